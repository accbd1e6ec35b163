"""Saved state on disk: a ring of slots written in turn, each with its checksum and its number in the sequence.

A save goes to the slot after the newest good one, so a cut at any instant spares all others, and every slot is written
as often as any other, over all lives of the node. A slot is written in place, its own sectors and no others, and read
back; one that does not take what is written is passed over.

Why 32: a save takes three sectors of 4 KiB, and flash endures 1e4 to 1e5 erasures of a sector. Some 300 saves a day at
rest are 9 a slot: 3 to 30 years; 1800 on a day of drilling are 56: half a year to 5 years. Two slots and a save every
10 s were 4320 a slot: 2 to 23 days. A ring takes 384 KiB.
"""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator
from pathlib import Path
from typing import Final

from node.errors import SavedStateError
from node.firmware.saved_layouts import CarriedState
from node.firmware.saved_state import Saved, pack_state_slot, unpack_state_slot
from node.kernels.arithmetic.formats import Array
from telemetry.runtime.disk import MACHINE, Disk

SLOTS: Final = 32


class Journal:
    """Ring of ``slots`` files in ``folder``; the newest slot with a good checksum wins.

    Attributes
    ----------
    worn : places of the slots that did not take what was written, since this start; they are passed over
    carried : how much of what was loaded was carried over from another layout; None where it is of the present one
    """

    def __init__(self, folder: Path, slots: int = SLOTS, disk: Disk = MACHINE) -> None:
        self._disk = disk
        self._slots = [folder / f"slot-{place}" for place in range(slots)]
        self._newest: int | None = None  # place of the newest good slot
        self._generation = 0
        self._there: set[int] = set()  # places whose file has its name on the disk
        self._has_looked = False
        self.worn: set[int] = set()
        self.carried: CarriedState | None = None
        with contextlib.suppress(OSError):  # the first save says what is wrong with it
            disk.make_folder(folder)

    def load(self) -> tuple[Array, bytes] | None:
        """State and telemetry blob of the newest good slot, or None on a first start.

        Raises
        ------
        SavedStateError
            When slots exist and none is good; the message says why and names them.
        """
        best: Saved | None = None
        faults: dict[str, list[str]] = {}
        self._newest, self._has_looked = None, True
        for place, slot in enumerate(self._slots):
            try:
                found = unpack_state_slot(self._disk.read(slot))
            except FileNotFoundError:
                continue
            except (SavedStateError, OSError) as error:
                faults.setdefault(str(error), []).append(slot.name)
            else:
                if best is None or found.generation > best.generation:
                    best, self._newest = found, place
            self._there.add(place)
        if best is not None:
            self._generation = max(self._generation, best.generation)
            self.carried = best.carried
            return best.nodes, best.blob
        if faults:
            raise SavedStateError("; ".join(f"{fault} ({', '.join(names)})" for fault, names in faults.items()))
        return None

    def save(self, state: Array, blob: bytes) -> None:
        """Write the slot after the newest good one, force it to the disk and read it back before returning.

        Raises
        ------
        OSError
            When no slot takes it; the newest good one is as it was, if there is another that could be tried.
        """
        if not self._has_looked:
            self._look()
        self._generation += 1  # also of a save that fails: what it may have left must not pass for a later one
        data = pack_state_slot(state, blob, self._generation)
        fault = OSError(errno.EIO, "saved state: expected a slot that can be written, got none", str(self._slots[0]))
        for place in self._places():
            try:
                self._write(place, data)
            except OSError as error:
                self.worn.add(place)
                fault = error
            else:
                self._newest = place
                return
        self.worn.clear()  # a disk that refuses all is perhaps full: the next save tries every slot again
        raise fault

    def _look(self) -> None:
        """Find the newest good slot before the first save, where its contents were not loaded."""
        try:
            self.load()
        except SavedStateError:
            return  # nothing there is worth sparing

    def _places(self) -> Iterator[int]:
        """Places to try, in order; the newest good slot is the last resort."""
        count = len(self._slots)
        newest = count - 1 if self._newest is None else self._newest
        for step in range(1, count + 1):
            place = (newest + step) % count
            if place not in self.worn:
                yield place

    def _write(self, place: int, data: bytes) -> None:
        slot, disk = self._slots[place], self._disk
        disk.reserve(slot, len(data))  # a full disk is known before anything is written over
        disk.write(slot, data)
        disk.force(slot)
        if disk.read(slot, 0, len(data)) != data:
            raise OSError(errno.EIO, "saved state: expected to read what was written, got other bytes", str(slot))
        if place not in self._there:
            disk.force_names(slot.parent)
            self._there.add(place)
