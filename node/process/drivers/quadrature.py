"""A quadrature counter as a file: Linux's counter subsystem, one number a line, ``count`` and perhaps ``direction``.

The kernel keeps the count but not the time of its edges, so the encoder node takes the middle of the count at the
moment of the read, with the variance of a count, turning and at rest.
Source: Linux, Documentation/ABI/testing/sysfs-bus-counter (``countY/count``, ``countY/direction``).
"""

from __future__ import annotations

from pathlib import Path

from node.errors import SensorError
from node.firmware.encoder_node import EncoderSample

LARGEST_JUMP = 4096 * 4  # counts between two reads: four turns in a cycle are no drive head
WORDS = {"forward": True, "backward": False}


class QuadratureFile:
    """Counter of a file that holds the count.

    Parameters
    ----------
    path : for example ``/sys/bus/counter/devices/counter0/count0/count``
    bits : width of the counter; its wrap is undone
    """

    def __init__(self, path: Path, bits: int = 32) -> None:
        self._path = path
        self._span = 1 << bits
        self._raw: int | None = None
        self._count = 0
        self._edge_at = 0.0
        self._rising = True

    def start(self) -> None:
        """Check that the counter can be read; a jump while it could not be read is accepted."""
        self._raw = self._read_file()

    def read(self, now: float) -> EncoderSample:
        """Count since the first start and the time of the read that found its last change (s, own clock)."""
        raw = self._read_file()
        if self._raw is None:
            raise SensorError(f"{self._path}: not started")
        moved = (raw - self._raw + self._span // 2) % self._span - self._span // 2
        if abs(moved) > LARGEST_JUMP:
            raise SensorError(f"{self._path}: expected at most {LARGEST_JUMP} counts a cycle, got {moved}")
        self._raw = raw
        if moved:
            self._count += moved
            self._rising = self._direction(moved)
            self._edge_at = now
        return EncoderSample(self._count, self._edge_at, self._rising, timed=False)

    def close(self) -> None:
        """Nothing to release."""

    def _direction(self, moved: int) -> bool:
        try:
            return WORDS.get((self._path.parent / "direction").read_text().strip(), moved > 0)
        except OSError:
            return moved > 0

    def _read_file(self) -> int:
        try:
            text = self._path.read_text().strip()
        except (OSError, UnicodeDecodeError) as error:
            raise SensorError(f"{self._path}: {error}") from error
        if not text.removeprefix("-").isdecimal() or len(text) > 24:
            raise SensorError(f"{self._path}: expected a count, got {text[:40]!r}")
        return int(text)
