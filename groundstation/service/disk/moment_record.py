"""A moment of the history as the database keeps it: numbers in a row, checked when they are read."""

from __future__ import annotations

import struct
from itertools import pairwise

import numpy as np

from groundstation.errors import GroundError
from groundstation.service.hole.history import Moment
from groundstation.service.hole.packed_end import PackedEnd

HEAD = struct.Struct("<dIi")  # rig time (s), stations, and parts of the end's mixture; -1 where no end was known
OF_STATION, OF_WHERE, OF_END, OF_PART = 6, 2, 13, 6


class DamagedMomentError(GroundError, ValueError):
    """The bytes are no moment."""


def moment_to_bytes(moment: Moment) -> bytes:
    """Head, depths and limits, deviations, end."""
    end, parts = moment.end, -1
    packed = [moment.where.astype("<f8").tobytes(), moment.found.astype("<f4").tobytes()]
    if end is not None:
        parts = len(end.parts)
        packed += [end.numbers.astype("<f8").tobytes(), end.parts.astype("<f4").tobytes()]
    return HEAD.pack(moment.at, len(moment.where), parts) + b"".join(packed)


def moment_of_bytes(number: int, content: bytes) -> Moment:
    """The moment of a number.

    Raises
    ------
    DamagedMomentError
        When it is none.
    """
    try:
        at, stations, parts = HEAD.unpack_from(content)
        sizes = [8 * OF_WHERE * stations, 4 * OF_STATION * stations]
        sizes += [] if parts < 0 else [8 * OF_END, 4 * OF_PART * parts]
        ends = np.cumsum([HEAD.size, *sizes]).tolist()
        if ends[-1] != len(content) or not stations:
            raise DamagedMomentError(f"moment {number}: expected {ends[-1]} bytes, got {len(content)}")
    except struct.error as error:
        raise DamagedMomentError(f"moment {number}: expected a head of {HEAD.size} bytes: {error}") from error
    pieces = [content[begin:end] for begin, end in pairwise(ends)]
    where = np.frombuffer(pieces[0], "<f8").reshape(-1, OF_WHERE)
    found = np.frombuffer(pieces[1], "<f4").reshape(-1, OF_STATION)
    end = None
    if parts >= 0:
        mixture = np.frombuffer(pieces[3], "<f4").reshape(-1, OF_PART)
        end = PackedEnd(np.frombuffer(pieces[2], "<f8"), mixture)
    if not all(np.isfinite(part).all() for part in (where, found, *(() if end is None else (end.numbers, end.parts)))):
        raise DamagedMomentError(f"moment {number}: expected numbers, got some that are none")
    return Moment(number, at, where, found, end)
