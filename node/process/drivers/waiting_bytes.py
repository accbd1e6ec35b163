"""Bytes that wait in a device that never blocks."""

from __future__ import annotations

import os
import select
from typing import Final

CHUNK: Final = 1 << 16  # bytes of one read
# a serial line hands on at most 4095 bytes at a time, and what it holds beyond them once these are read
PORTION: Final = 1024  # bytes, from which on more may follow
FOLLOWS_S: Final = 2e-3  # by when it has, on a processor that is busy too


def read_waiting(file: int, follows_s: float = 0.0) -> bytes:
    """Everything that waits in an open file; raises OSError where its device is gone.

    Parameters
    ----------
    follows_s : how long to wait for what follows a portion of the device's, s
    """
    data = bytearray()
    portion = 0
    while True:
        try:
            got = os.read(file, CHUNK)
        except BlockingIOError:
            if portion < PORTION or not select.select([file], [], [], follows_s)[0]:
                break
            portion = 0
            continue
        if not got:
            break
        data += got
        portion += len(got)
    return bytes(data)
