"""Bytes and text of a file of bounded size: one of two gigabytes is refused before it is read whole."""

from __future__ import annotations

import errno
from pathlib import Path
from typing import BinaryIO

LARGEST_FILE = 64 * 2**20  # bytes; a survey of a million stations has less
LARGEST_LOG = 2**30  # bytes of a logger's record; a day of a hundred readings a second has less


def bounded_bytes(source: Path | BinaryIO, largest: int = LARGEST_FILE) -> bytes:
    """Bytes of a file, or of an open stream, of at most ``largest`` bytes.

    Raises
    ------
    OSError
        When it cannot be read, or is larger; its ``strerror`` says which.
    """
    if isinstance(source, Path):
        with source.open("rb") as file:
            return bounded_bytes(file, largest)
    content = source.read(largest + 1)
    if len(content) > largest:
        raise OSError(errno.EFBIG, f"a file larger than {largest // 2**20} MiB")
    return content


def bounded_text(path: Path, encoding: str = "utf-8") -> str:
    """Text of a file of at most `LARGEST_FILE` bytes.

    Raises
    ------
    OSError
        When it cannot be read, or is larger.
    UnicodeDecodeError
        When it is no text.
    """
    return bounded_bytes(path).decode(encoding)
