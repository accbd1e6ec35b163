"""VectorNav VN-100 on a serial line: its own compensated rates and forces, averaged over the cycle.

It is asked for ``$VNIMU`` at a rate; a line is ``$VNIMU,mx,my,mz,ax,ay,az,gx,gy,gz,temperature,pressure*checksum`` in
gauss, m/s^2, rad/s, C and kPa. A line that is cut or whose checksum is wrong is dropped and counted: too many, and the
cycle is lost. Source: VectorNav, VN-100 user manual, asynchronous output IMU measurements and register 6 and 7.
"""

from __future__ import annotations

import contextlib
import os
import termios
from dataclasses import replace
from pathlib import Path
from typing import Final

import numpy as np

from node.errors import SensorError
from node.process.drivers.fifo_window import parts_of
from node.process.drivers.source import ImuSample
from node.process.drivers.waiting_bytes import FOLLOWS_S, read_waiting

RATE: Final = 100  # Hz, of its lines
IMU_LINES: Final = 19  # of register 6
SPEED: Final = termios.B115200
FIELDS: Final = 11  # numbers of a line
SHORTEST: Final = 0.5  # of the lines of a cycle
LARGEST_RATE, LARGEST_FORCE = 34.9, 157.0  # rad/s and m/s^2, of 2000 deg/s and 16 g


class Vn100:
    """One sensor on a serial device, such as ``/dev/ttyUSB0``."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._file = -1
        self._rest = b""
        self._fresh = True
        self.dropped = 0  # lines that were cut or damaged

    @property
    def description(self) -> str:
        """What it is."""
        return f"vn100 at {self._path}, {RATE} Hz"

    def start(self) -> None:
        """Open the line and ask for its measurements."""
        self.close()
        try:
            self._file = os.open(self._path, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
            settings = termios.tcgetattr(self._file)
            settings[0] = settings[1] = settings[3] = 0  # raw, both ways
            settings[2] = termios.CS8 | termios.CREAD | termios.CLOCAL
            settings[4] = settings[5] = SPEED
            termios.tcsetattr(self._file, termios.TCSANOW, settings)
            read_waiting(self._file, FOLLOWS_S)  # of before it was opened; TCSAFLUSH leaves what is beyond 4095 bytes
        except (OSError, termios.error) as error:
            self.close()
            raise SensorError(f"vn100: {self._path}: {error}") from error
        for order in (f"VNWRG,06,{IMU_LINES}", f"VNWRG,07,{RATE}"):
            self._send(order)
        self._rest, self._fresh = b"", True

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean of the lines since the last read, which must be about those of a cycle from ``begin`` to ``end``."""
        rows, families = self._rows()
        expected, fresh = (end - begin) * RATE, self._fresh
        self._fresh = False
        if not rows and families:
            raise SensorError(f"vn100: {self._path}: expected lines $VNIMU, got {sorted(families)[0]}")
        if not rows or (not fresh and len(rows) < SHORTEST * expected):
            raise SensorError(f"vn100: {self._path}: expected about {expected:.0f} lines, got {len(rows)}")
        values = np.array(rows)
        fx, fy, fz, wx, wy, wz, warmth = values[:, 3:10].mean(axis=0).tolist()
        saturated = int(np.any(np.abs(values[:, 6:9]) >= LARGEST_RATE))
        saturated |= 2 * int(np.any(np.abs(values[:, 3:6]) >= LARGEST_FORCE))
        sample = ImuSample((wx, wy, wz), (fx, fy, fz), warmth, saturated)
        return sample if fresh else replace(sample, parts=parts_of(values[:, 8], (begin, end), begin, end))

    def close(self) -> None:
        """Release the line."""
        if self._file >= 0:
            with contextlib.suppress(OSError):
                os.close(self._file)
            self._file = -1

    def _rows(self) -> tuple[list[list[float]], set[str]]:
        """Numbers of the lines that have come, and what other lines there were."""
        if self._file < 0:
            raise SensorError(f"vn100: {self._path}: not started")
        try:
            data = self._rest + read_waiting(self._file, FOLLOWS_S)
        except OSError as error:
            raise SensorError(f"vn100: {self._path}: {error.strerror}: the line is gone") from error
        *lines, self._rest = data.split(b"\n")
        rows, others = [], set()
        for line in lines:
            words = checked_words(line)
            if words is None:
                self.dropped += 1
            elif words[0] == "VNIMU" and len(words) == FIELDS + 1 and (row := _numbers(words[1:])):
                rows.append(row)
            elif words[0] not in ("VNWRG", "VNIMU"):
                others.add(f"${words[0]}")
        return rows, others

    def _send(self, order: str) -> None:
        try:
            os.write(self._file, f"${order}*{line_checksum(order.encode()):02X}\r\n".encode())
        except OSError as error:
            raise SensorError(f"vn100: {self._path}: {error.strerror}") from error


def line_checksum(text: bytes) -> int:
    """Exclusive or of the bytes between ``$`` and ``*``."""
    found = 0
    for byte in text:
        found ^= byte
    return found


def checked_words(line: bytes) -> list[str] | None:
    """Words of a line ``$WORD,..*XX``; None where it is cut or its checksum is another."""
    body, star, given = line.strip().rpartition(b"*")
    dollar = body.rfind(b"$")
    if not star or dollar < 0:
        return None
    try:
        right = int(given, 16) == line_checksum(body[dollar + 1 :])
        return body[dollar + 1 :].decode("ascii").split(",") if right and len(given) == 2 else None
    except ValueError:
        return None


def _numbers(words: list[str]) -> list[float]:
    """Numbers of words; nothing where one is not finite."""
    try:
        values = [float(word) for word in words]
    except ValueError:
        return []
    return values if np.all(np.isfinite(values)) else []
