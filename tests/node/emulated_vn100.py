"""A VN-100 on a pseudo-terminal: its lines as the manual prints them, and both ends of the line."""

from __future__ import annotations

import contextlib
import functools
import os
import pty
from pathlib import Path

import numpy as np


def line_of(rate: np.ndarray, force: np.ndarray, word: str = "VNIMU") -> bytes:
    """A line as the manual prints it: signed numbers, exclusive or of the bytes as two hex digits."""
    numbers = [0.21, -0.1, 0.45, *force, *rate, 31.5, 101.325]
    body = f"{word}," + ",".join(f"{v:+010.6f}" for v in numbers)
    return f"${body}*{functools.reduce(lambda a, b: a ^ b, body.encode()):02X}\r\n".encode()


class Line:
    """Both ends of a serial line, which holds 8 kB and never waits for who should read them."""

    def __init__(self) -> None:
        self.end, other = pty.openpty()
        self.path = Path(os.ttyname(other))
        self._other = other

    def send(self, data: bytes) -> None:
        """Write what fits; the rest is lost, as at a port without a reader. It never waits."""
        os.set_blocking(self.end, False)
        with contextlib.suppress(BlockingIOError):
            while data:
                data = data[os.write(self.end, data) :]
        os.set_blocking(self.end, True)

    def cut(self) -> None:
        os.close(self._other)
        os.close(self.end)
