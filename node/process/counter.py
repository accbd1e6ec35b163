"""A boot counter on disk, replaced whole so that a cut leaves the old or the new number."""

from __future__ import annotations

import os
from pathlib import Path

from node.errors import SavedStateError
from node.process.journal import sync_folder


class BootCounter:
    """Counts the starts of a process in ``folder``; the number is on the disk before it is used.

    Raises
    ------
    SavedStateError
        When the file holds no number: a guess might be one that a neighbour has seen.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        path = folder / "boots"
        try:
            before = int(path.read_text()) if path.exists() else 0
        except ValueError as error:
            raise SavedStateError(f"{path}: expected the number of starts: {error}") from error
        self.boots = before + 1
        fresh = folder / "boots.new"
        with fresh.open("w") as file:
            file.write(f"{self.boots}\n")
            file.flush()
            os.fsync(file.fileno())
        fresh.replace(path)
        sync_folder(folder)
