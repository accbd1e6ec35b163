"""A serial line or a pseudo terminal, raw both ways, whose loss is told by name."""

from __future__ import annotations

import contextlib
import os
import select
import stat
import termios
from pathlib import Path

from telemetry.errors import MediumError

SPEEDS = {
    speed: getattr(termios, f"B{speed}")
    for speed in (9600, 115200, 230400, 460800, 921600, 1000000, 2000000, 3000000)
    if hasattr(termios, f"B{speed}")
}  # baud
WRITE_LIMIT = 1.0  # s, that the other end may take to read


class SerialLine:
    """One line.

    Parameters
    ----------
    path : of the device
    speed : baud, one of ``SPEEDS``; without meaning for a pseudo terminal

    Raises
    ------
    MediumError
        When there is none, or it is no serial line.
    """

    def __init__(self, path: Path, speed: int) -> None:
        self._path = path
        try:
            self._file = os.open(path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        except OSError as error:
            raise MediumError(f"{path}: expected a serial line, got none: {error.strerror}") from error
        try:
            if not stat.S_ISCHR(os.fstat(self._file).st_mode) or not os.isatty(self._file):
                raise MediumError(f"{path}: expected a serial line, got something else")
            self._set_raw(SPEEDS[speed])
        except MediumError:
            self.close()
            raise
        except termios.error as error:
            self.close()
            raise MediumError(f"{path}: expected a serial line of {speed} baud: {error}") from error

    def receive(self, patience: float) -> bytes:
        """What came, nothing after ``patience`` s.

        Raises
        ------
        MediumError
            When the other end is gone.
        """
        try:
            if not select.select([self._file], [], [], patience)[0]:
                return b""
            received = os.read(self._file, 4096)
        except BlockingIOError:
            return b""
        except (OSError, ValueError) as error:
            raise self._gone() from error
        if not received:
            raise self._gone()
        return received

    def send(self, content: bytes) -> bool:
        """Send all of it; False where the other end does not read.

        Raises
        ------
        MediumError
            When the other end is gone.
        """
        while content:
            try:
                if not select.select([], [self._file], [], WRITE_LIMIT)[1]:
                    return False
                content = content[os.write(self._file, content) :]
            except BlockingIOError:
                continue
            except (OSError, ValueError) as error:
                raise self._gone() from error
        return True

    def close(self) -> None:
        """Release the line."""
        if self._file >= 0:
            with contextlib.suppress(OSError):
                os.close(self._file)
            self._file = -1

    def _set_raw(self, speed: int) -> None:
        settings = termios.tcgetattr(self._file)
        settings[0] = settings[1] = settings[3] = 0
        settings[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
        settings[4] = settings[5] = speed
        termios.tcsetattr(self._file, termios.TCSANOW, settings)

    def _gone(self) -> MediumError:
        return MediumError(f"{self._path}: expected a device at the line, it is gone")
