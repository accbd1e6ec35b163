"""Content of a file or of standard input: bounded, and as text in the encodings that programs write."""

from __future__ import annotations

import sys
from pathlib import Path

from groundstation.errors import SurveyError
from telemetry.bounded_bytes import bounded_bytes

MARKS = {b"\xff\xfe": "utf-16", b"\xfe\xff": "utf-16", b"\xef\xbb\xbf": "utf-8-sig"}


def read_file(path: Path) -> bytes:
    """Bytes of a file, or of standard input where it is ``-``.

    Raises
    ------
    SurveyError
        When it cannot be read, or is larger than any survey.
    """
    try:
        return bounded_bytes(sys.stdin.buffer if path == Path("-") else path)
    except OSError as error:
        raise SurveyError(f"{path}: {error.strerror}; expected a file of stations") from error


def decode_text(path: Path, content: bytes) -> str:
    """Text of UTF-8, of UTF-16 that says so, or of the old code page of western Windows.

    Raises
    ------
    SurveyError
        When it is no text.
    """
    marked = next((name for mark, name in MARKS.items() if content.startswith(mark)), None)
    for encoding in (marked,) if marked else ("utf-8", "cp1252"):
        try:
            text = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\x00" not in text:
            return text
    raise SurveyError(f"{path}: not a text file; expected a file of stations")
