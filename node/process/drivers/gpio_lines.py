"""Lines of a GPIO chip as the kernel's character device gives them: levels, and edges with the times of interrupts.

Source: Linux, include/uapi/linux/gpio.h, version 2 of the interface (``gpio_v2_line_request``, ``gpio_v2_line_event``,
``gpio_v2_line_values``).
"""

from __future__ import annotations

import fcntl
import os
import struct
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final, Protocol

from node.errors import SensorCause, SensorError
from node.process.drivers.waiting_bytes import read_waiting

REQUEST: Final = struct.Struct("=64I32sQI5I240sII5Ii")  # 592 bytes
VALUES: Final = struct.Struct("=QQ")
EVENT: Final = struct.Struct("=QIIII24x")  # ns, kind, line, number of all lines, number of its line
GET_LINES: Final = 3 << 30 | REQUEST.size << 16 | 0xB4 << 8 | 0x07
GET_VALUES: Final = 3 << 30 | VALUES.size << 16 | 0xB4 << 8 | 0x0E
INPUT_WITH_BOTH_EDGES: Final = 1 << 2 | 1 << 4 | 1 << 5
RISING: Final = 1  # kind of an event
BUFFER: Final = 4096  # events that the kernel keeps: two seconds of a head at 180 deg/s


@dataclass(frozen=True, slots=True)
class LineEdge:
    """One edge: its time (s, the machine's monotonic clock), line, new level and number among all edges."""

    at: float
    line: int
    level: int
    number: int


class GpioLines(Protocol):
    """Lines in use."""

    def edges(self) -> list[LineEdge]:
        """Edges that have come since the last call, in their order."""

    def levels(self) -> tuple[int, ...]:
        """Levels of the lines now, 0 or 1."""

    def close(self) -> None:
        """Give the lines back."""


class ChipLines:
    """Lines of one chip, such as ``/dev/gpiochip0``, requested as inputs with both edges."""

    def __init__(self, chip: Path, lines: Sequence[int]) -> None:
        self._chip, self._lines = chip, tuple(lines)
        try:
            device = os.open(chip, os.O_RDWR | os.O_CLOEXEC)
        except OSError as error:
            raise SensorError(f"gpio: {chip}: {error.strerror}") from error
        try:
            offsets = [*lines, *[0] * (64 - len(lines))]
            asked = (*offsets, b"borechain", INPUT_WITH_BOTH_EDGES, 0, *[0] * 5, b"", len(lines), BUFFER, *[0] * 5, -1)
            answer = fcntl.ioctl(device, GET_LINES, REQUEST.pack(*asked))
        except OSError as error:
            raise SensorError(f"gpio: {chip}: lines {', '.join(map(str, lines))}: {error.strerror}") from error
        finally:
            os.close(device)
        self._file = REQUEST.unpack(answer)[-1]
        os.set_blocking(self._file, False)

    def edges(self) -> list[LineEdge]:
        """Edges that have come since the last call, in their order."""
        try:
            return read_edges(self._file)
        except SensorError:  # bytes that are no events: the chip is there
            raise
        except OSError as error:
            raise SensorError(f"gpio: {self._chip}: {error.strerror}: the chip is gone") from error

    def levels(self) -> tuple[int, ...]:
        """Levels of the lines now, 0 or 1."""
        try:
            answer = fcntl.ioctl(self._file, GET_VALUES, VALUES.pack(0, (1 << len(self._lines)) - 1))
        except OSError as error:
            raise SensorError(f"gpio: {self._chip}: {error.strerror}", SensorCause.BUS) from error
        bits = VALUES.unpack(answer)[0]
        return tuple(bits >> k & 1 for k in range(len(self._lines)))

    def close(self) -> None:
        """Give the lines back."""
        os.close(self._file)


def read_edges(file: int) -> list[LineEdge]:
    """Edges that wait in an open file of lines; raises OSError where the device is gone."""
    data = read_waiting(file)
    if len(data) % EVENT.size:
        raise SensorError(
            f"gpio: {len(data) % EVENT.size} bytes beyond whole events of {EVENT.size}", SensorCause.LOST_BYTES
        )
    found = EVENT.iter_unpack(data)
    return [LineEdge(1e-9 * at, line, int(kind == RISING), number) for at, kind, line, number, _ in found]
