"""Text of a file of bounded size: one of two gigabytes is refused before it is read whole."""

from __future__ import annotations

import errno
from pathlib import Path

LARGEST_FILE = 64 * 2**20  # bytes; a survey of a million stations has less


def bounded_text(path: Path, encoding: str = "utf-8") -> str:
    """Text of a file of settings.

    Raises
    ------
    OSError
        When it cannot be read, or is larger than any.
    UnicodeDecodeError
        When it is no text.
    """
    with path.open("rb") as file:
        content = file.read(LARGEST_FILE + 1)
    if len(content) > LARGEST_FILE:
        raise OSError(errno.EFBIG, f"larger than {LARGEST_FILE // 2**20} MiB")
    return content.decode(encoding)
