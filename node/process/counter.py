"""A boot counter on disk, replaced whole so that a cut leaves the old or the new number.

A counter that is damaged or cannot be written does not end the process: the start gets a random number from a range
that counting never reaches, so that no neighbour takes it for a start that it has seen.
"""

from __future__ import annotations

import secrets
from collections.abc import Callable
from pathlib import Path

from telemetry.runtime.disk import MACHINE, Disk, replace_file

LOTS = 1 << 20  # numbers in LOTS..2 LOTS - 1 are random; an encoder's, shifted, still fit a sequence number


class BootCounter:
    """Counts the starts of a process in ``folder``; the number is on the disk before it is used.

    Parameters
    ----------
    folder : where it is kept
    lot : random number below its argument, for a start that cannot be counted
    disk : that holds the folder
    is_new : a folder without a count is a new one, whose starts count from 1; otherwise the count may have been lost
    is_own : the folder is that of the process; of another's starts its own cannot be counted on

    Attributes
    ----------
    boots : number of this start
    fault : why it is random, or empty
    """

    def __init__(
        self,
        folder: Path,
        lot: Callable[[int], int] = secrets.randbelow,
        disk: Disk = MACHINE,
        *,
        is_new: bool = True,
        is_own: bool = True,
    ) -> None:
        self.fault = ""
        try:
            self.boots = read_count(disk, folder / "boots") + 1
            if not is_own or (self.boots == 1 and not is_new):
                self.boots = LOTS + lot(LOTS)
        except (ValueError, OSError) as error:
            self.fault, self.boots = f"boots: {error}", LOTS + lot(LOTS)
        try:
            write_count(disk, folder, self.boots)
        except OSError as error:
            self.fault, self.boots = f"boots: {error.strerror or error}", LOTS + lot(LOTS)


def read_count(disk: Disk, path: Path) -> int:
    """Starts so far; 0 where none was counted.

    Raises
    ------
    ValueError, OSError
        When the file holds no such number or cannot be read.
    """
    try:
        count = int(disk.read(path))
    except FileNotFoundError:
        return 0
    if not 0 <= count < 2 * LOTS - 1:
        raise ValueError(f"expected the number of starts, got {count}")
    return count


def write_count(disk: Disk, folder: Path, count: int) -> None:
    """Replace the number in one step, forced to the disk with its name."""
    disk.make_folder(folder)
    replace_file(disk, folder / "boots", f"{count}\n".encode())
