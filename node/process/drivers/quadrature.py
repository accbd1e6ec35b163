"""A quadrature counter of Linux' counter subsystem: ``counter:/dev/counter0``, or the file of a count.

The kernel keeps the count but not the time of its edges, so the encoder node takes the middle of the count at the
moment of the read, with the variance of a count, turning and at rest. Every read proves what it read, as far as the
device shows it: it is enabled, decodes four edges a line, has the ceiling of the start, and the levels of its two
signals follow the count modulo 4, so that a count that stands, or has lost edges, contradicts them.
Source: Linux, Documentation/ABI/testing/sysfs-bus-counter (``countY/count``, ``direction``, ``function``, ``enable``,
``ceiling``; ``signalY/signal``).
"""

from __future__ import annotations

import itertools
import re
from pathlib import Path
from typing import Final

from node.errors import SensorCause, SensorError
from node.firmware.encoder_node import EncoderSample

SYSFS: Final = Path("/sys/bus/counter/devices")
DEVICE: Final = re.compile(r"(?:/dev/)?(counter\d+)(?::(\d+))?")  # counter0, or its second count as counter0:1
LARGEST_JUMP: Final = 4096 * 4  # counts between two reads: four turns in a cycle are no drive head
WORDS: Final = {"forward": True, "backward": False}
FOUR_EDGES: Final = "quadrature x4"
LEVELS: Final = {("low", "low"): 0, ("low", "high"): 1, ("high", "high"): 2, ("high", "low"): 3}  # in turning order
RELATIONS: Final = frozenset(itertools.product((1, -1), range(4)))  # of the levels' place to the count, modulo 4


def counter_file(text: str, sysfs: Path = SYSFS) -> Path:
    """File of the count that an option names: a device of the kernel, or a file as it stands."""
    found = DEVICE.fullmatch(text)
    return sysfs / found[1] / f"count{found[2] or 0}" / "count" if found else Path(text)


class QuadratureFile:
    """Counter of a file that holds the count.

    Parameters
    ----------
    path : for example ``/sys/bus/counter/devices/counter0/count0/count``
    bits : width of the counter where it has no ``ceiling``; its wrap is undone
    """

    def __init__(self, path: Path, bits: int = 32) -> None:
        self._path = path
        self._usual_span = self._span = 1 << bits
        self._raw: int | None = None
        self._count = 0
        self._edge_at = 0.0
        self._rising = True
        self._relations = RELATIONS

    def start(self) -> None:
        """Set the counter up and check it; a jump while it could not be read is accepted."""
        if self._attribute("function") not in (None, FOUR_EDGES):
            self._write("function", FOUR_EDGES)
        if self._attribute("enable") == "0":
            self._write("enable", "1")
        ceiling = self._attribute("ceiling")
        self._span = self._usual_span if ceiling is None else _whole(self._path.parent / "ceiling", ceiling) + 1
        if self._span < 2:
            raise SensorError(f"{self._path.parent / 'ceiling'}: expected at least 1, got {ceiling}")
        self._prove_settings()
        self._relations = RELATIONS
        self._raw = self._read_file()

    def read(self, now: float) -> EncoderSample:
        """Count since the first start and the time of the read that found its last change (s, own clock)."""
        if self._raw is None:
            self._read_file()
            raise SensorError(f"{self._path}: not started")
        self._prove_settings()
        before = self._levels()
        raw = self._read_file()
        moved = (raw - self._raw + self._span // 2) % self._span - self._span // 2
        if abs(moved) > LARGEST_JUMP:
            raise SensorError(
                f"{self._path}: expected at most {LARGEST_JUMP} counts a cycle, got {moved}", SensorCause.COUNTER
            )
        self._raw = raw
        self._prove_count(before, raw)
        if moved:
            self._count += moved
            self._rising = self._direction(moved)
            self._edge_at = now
        return EncoderSample(self._count, self._edge_at, self._rising, timed=False)

    def close(self) -> None:
        """Nothing to release."""

    def _prove_settings(self) -> None:
        """Check that the device still decodes as it was set to."""
        function, enabled, ceiling = map(self._attribute, ("function", "enable", "ceiling"))
        if function not in (None, FOUR_EDGES):
            raise SensorError(
                f"{self._path.parent / 'function'}: expected {FOUR_EDGES}, got {function}: its counts are others",
                SensorCause.RESOLUTION,
            )
        if enabled == "0":
            raise SensorError(
                f"{self._path.parent / 'enable'}: expected 1, got 0: it does not count", SensorCause.COUNTER
            )
        if ceiling is not None and _whole(self._path.parent / "ceiling", ceiling) + 1 != self._span:
            raise SensorError(
                f"{self._path.parent / 'ceiling'}: expected {self._span - 1}, got {ceiling}", SensorCause.REGISTER
            )

    def _prove_count(self, before: int | None, raw: int) -> None:
        """Check a count against the levels of its signals, unless one changed while they were read."""
        if before is None or self._levels() != before or self._read_file() != raw:
            return
        self._relations = frozenset((s, c) for s, c in self._relations if (s * raw + c) % 4 == before)
        if not self._relations:
            raise SensorError(
                f"{self._path}: the levels of its signals contradict the count {raw}: it stands, or has lost edges",
                SensorCause.COUNTER,
            )

    def _levels(self) -> int | None:
        """Place of the levels of both signals in the order in which a head that turns runs through them."""
        folder = self._path.parent.parent
        try:
            one, other = (folder / f"signal{k}" / "signal" for k in range(2))
            return LEVELS.get((one.read_text().strip(), other.read_text().strip()))
        except (OSError, UnicodeDecodeError):
            return None

    def _attribute(self, name: str) -> str | None:
        """Text of a file beside the count; None where there is none."""
        try:
            return (self._path.parent / name).read_text().strip()
        except (OSError, UnicodeDecodeError):
            return None

    def _write(self, name: str, text: str) -> None:
        try:
            (self._path.parent / name).write_text(text)
        except OSError as error:
            raise SensorError(f"{self._path.parent / name}: {error.strerror}", SensorCause.REGISTER) from error

    def _direction(self, moved: int) -> bool:
        return WORDS.get(self._attribute("direction") or "", moved > 0)

    def _read_file(self) -> int:
        try:
            text = self._path.read_text().strip()
        except (OSError, UnicodeDecodeError) as error:
            raise SensorError(f"{self._path}: {error}") from error
        return _whole(self._path, text)


def _whole(path: Path, text: str) -> int:
    """Whole number of a text."""
    if not text.removeprefix("-").isdecimal() or len(text) > 24:
        raise SensorError(f"{path}: expected a count, got {text[:40]!r}")
    return int(text)
