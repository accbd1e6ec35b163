"""A boot counter on disk, replaced whole so that a cut leaves the old or the new number.

A counter that is damaged or cannot be written does not end the process: the start gets a number by lot from a range
that counting never reaches, so that no neighbour takes it for a start that it has seen.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path

from node.process.journal import sync_folder

LOTS = 1 << 20  # numbers in LOTS..2 LOTS - 1 are by lot; an encoder's, shifted, still fit a sequence number


class BootCounter:
    """Counts the starts of a process in ``folder``; the number is on the disk before it is used.

    Parameters
    ----------
    folder : where it is kept
    lot : number below its argument by lot, for a start that cannot be counted

    Attributes
    ----------
    boots : number of this start
    fault : why it is by lot, or empty
    """

    def __init__(self, folder: Path, lot: Callable[[int], int] = secrets.randbelow) -> None:
        self.fault = ""
        try:
            self.boots = read_count(folder / "boots") + 1
        except (ValueError, OSError) as error:
            self.fault, self.boots = f"boots: {error}", LOTS + lot(LOTS)
        try:
            write_count(folder, self.boots)
        except OSError as error:
            self.fault, self.boots = f"boots: {error.strerror or error}", LOTS + lot(LOTS)


def read_count(path: Path) -> int:
    """Starts so far; 0 where none was counted.

    Raises
    ------
    ValueError, OSError
        When the file holds no such number or cannot be read.
    """
    try:
        count = int(path.read_text())
    except FileNotFoundError:
        return 0
    if not 0 <= count < 2 * LOTS - 1:
        raise ValueError(f"expected the number of starts, got {count}")
    return count


def write_count(folder: Path, count: int) -> None:
    """Replace the number in one step, forced to the disk with its name."""
    folder.mkdir(parents=True, exist_ok=True)
    fresh = folder / "boots.new"
    with fresh.open("w") as file:
        file.write(f"{count}\n")
        file.flush()
        os.fsync(file.fileno())
    fresh.replace(folder / "boots")
    sync_folder(folder)
