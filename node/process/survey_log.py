"""Surveys and static records that were receipted: kept until overwritten by age.

A ground station that lost its database, or had it restored from an old copy, asks for what it misses, and gets the very
payloads. The log is one file of places; a payload is written in place once, forced to the disk, and overwritten when
all later places have been. Losing the log loses nothing but this second chance.
"""

from __future__ import annotations

import contextlib
import struct
import zlib
from pathlib import Path
from typing import Final

from telemetry.runtime.disk import MACHINE, Disk

PLACES: Final = 256
PLACE_SIZE: Final = 4608  # bytes: the largest payload and its header
HEADER: Final = struct.Struct("<4sIQH")  # magic, CRC-32 of what follows, sequence number, bytes of the payload
MAGIC: Final = b"BCSL"
AFTER_CRC: Final = 8  # bytes of the header that the checksum does not cover


class SurveyLog:
    """Log in ``folder``; a disk that refuses is counted in ``refused`` and ends nothing."""

    def __init__(self, folder: Path, disk: Disk = MACHINE) -> None:
        self._disk = disk
        self._path = folder / "surveys"
        self._held: dict[int, int] = {}  # place by sequence number, the oldest first
        self._payloads_lost = False
        self.refused = 0
        with contextlib.suppress(OSError):
            self._look()

    def append_payload(self, sequence: int, payload: bytes) -> None:
        """Keep a payload in the place of the oldest."""
        place = self._next_place()
        body = struct.pack("<QH", sequence, len(payload)) + payload
        record = MAGIC + zlib.crc32(body).to_bytes(4, "little") + body
        try:
            self._disk.write(self._path, record.ljust(PLACE_SIZE, b"\0"), place * PLACE_SIZE)
            self._disk.force(self._path)
        except OSError:
            self.refused += 1
            return
        for known in [number for number, held in self._held.items() if held == place]:
            del self._held[known]
            self._payloads_lost = True
        self._held[sequence] = place

    def payloads(self, first: int, last: int) -> list[tuple[int, bytes]]:
        """Numbers from ``first`` to ``last`` that are kept, each with its payload."""
        found = []
        for sequence in sorted(number for number in self._held if first <= number <= last):
            with contextlib.suppress(OSError):
                if (read := read_place(self._disk, self._path, self._held[sequence])) is not None and read[
                    0
                ] == sequence:
                    found.append(read)
        return found

    @property
    def complete_from(self) -> int:
        """Number from which on every survey is kept."""
        if not self._payloads_lost and not self.refused:
            return 0
        return min(self._held, default=0)

    def _next_place(self) -> int:
        if len(self._held) < PLACES:
            return next(place for place in range(PLACES) if place not in self._held.values())
        return self._held[next(iter(self._held))]

    def _look(self) -> None:
        """Find what the places hold, damaged ones being free; number order is the order of age."""
        found = {}
        size = len(self._disk.read(self._path))
        for place in range(min(PLACES, -(-size // PLACE_SIZE))):
            if (read := read_place(self._disk, self._path, place)) is not None:
                found[read[0]] = place
            else:
                self._payloads_lost = True
        self._held = dict(sorted(found.items()))
        self._payloads_lost = self._payloads_lost or len(self._held) == PLACES


def read_place(disk: Disk, path: Path, place: int) -> tuple[int, bytes] | None:
    """Number and payload in a place, None where it is empty, torn or damaged."""
    record = disk.read(path, place * PLACE_SIZE, PLACE_SIZE)
    if len(record) < HEADER.size:
        return None
    magic, crc, sequence, size = HEADER.unpack_from(record)
    payload = record[HEADER.size : HEADER.size + size]
    if magic != MAGIC or len(payload) != size or zlib.crc32(record[AFTER_CRC : HEADER.size + size]) != crc:
        return None
    return sequence, payload
