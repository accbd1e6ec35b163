"""A boot counter on disk, replaced whole so that a cut leaves the old or the new number."""

from __future__ import annotations

import os
from pathlib import Path


class BootCounter:
    """Counts the starts of a process in ``folder``; the number is on the disk before it is used."""

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "boots"
        before = int(path.read_text()) if path.exists() else 0
        self.boots = before + 1
        fresh = folder / "boots.new"
        with fresh.open("w") as file:
            file.write(f"{self.boots}\n")
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
