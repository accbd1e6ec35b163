"""Bytes that wait in a device that never blocks."""

from __future__ import annotations

import os

CHUNK = 1 << 16  # bytes of one read


def read_waiting(file: int) -> bytes:
    """Everything that waits in an open file; raises OSError where its device is gone."""
    data = bytearray()
    while True:
        try:
            got = os.read(file, CHUNK)
        except BlockingIOError:
            break
        if not got:
            break
        data += got
    return bytes(data)
