"""Fields of cyclic messages as signals of a few bits, made from the schema.

A signal is a whole number of steps (``Quantity.step``); a variance is in steps of 0.5 dB. Values are rounded once, at
the source: one that stands on a step already stays as it is, so that a relay changes nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import Enum
from typing import Any

from telemetry.errors import EncodeError
from telemetry.quantities import ValueKind
from telemetry.schema import TIME_STEP, TURN, MessageField

COUNT_BITS = 8
VARIANCE_BITS, WIDE_VARIANCE_BITS = 8, 9  # of rad^2, and of s^2 with its many powers of ten
LAST_TIME = (2**47 - 1) * TIME_STEP  # s either side of zero, 44 years in 48 bits
AGE_BITS = 24
ON_STEP = 0.05  # of a step, by which a value that was rounded before may miss it; times have 14 digits before theirs
NARROWER = {
    "cycles": 2**22 - 1,  # 25 days
    "overruns": 2**8 - 1,
    "gyro_bias": 0.125,
    "innovation": 0.75,
    "parameters_version": 2**12 - 1,
    "epoch": 2**16 - 1,
    "numbered": 2**28 - 1,
}  # upper ends; beyond them the tunnel carries it


class Scale(Enum):
    """How a raw number stands for a value."""

    LINEAR = "linear"
    CIRCLE = "circle"  # the full scale is zero again
    DECIBEL = "decibel"  # of a variance; raw 0 is a variance of zero
    AGE = "age"  # linear; all ones: infinite
    INTEGER = "integer"
    SWITCH = "switch"
    BYTES = "bytes"


@dataclass(frozen=True, slots=True)
class Signal:
    """One number in a frame: ``value = (first + raw) step``, of a variance in dB; ``first`` is a whole number of steps.

    ``first`` times ``step`` is the lower end of the range, and zero stands on a step.
    """

    name: str
    unit: str
    bits: int
    scale: Scale
    first: int = 0
    step: float = 1.0

    @property
    def largest(self) -> int:
        """Largest raw number."""
        return (1 << self.bits) - 1

    @property
    def lowest_value(self) -> float:
        """Value of raw number 0, of a variance in dB."""
        return self.first * self.step

    @property
    def highest_value(self) -> float:
        """Value of the largest raw number, of a variance in dB."""
        return (self.first + self.largest) * self.step

    def raw_of(self, value: Any) -> int:
        """Raw number of a value.

        Raises
        ------
        EncodeError
            When the value is not finite or outside the signal's range.
        """
        if self.scale is Scale.BYTES:
            return int.from_bytes(value)
        if not -math.inf < value < math.inf and not (self.scale is Scale.AGE and value > 0):
            raise EncodeError(f"{self.name}: expected a finite number, got {value}")
        raw = self._rounded(value)
        if not 0 <= raw <= self.largest:
            low, high = self.lowest_value, self.highest_value
            raise EncodeError(f"{self.name}: expected {low:g}..{high:g} {self.unit}, got {value:g}")
        return raw

    def _rounded(self, value: Any) -> int:
        steps: int
        if self.scale is Scale.LINEAR:
            steps = round(value / self.step)
            return steps - self.first
        if self.scale in (Scale.INTEGER, Scale.SWITCH):
            return int(value) - self.first
        if self.scale is Scale.DECIBEL:
            return 0 if value <= 0.0 else max(round(10.0 * math.log10(value) / self.step) - self.first, 1)
        if self.scale is Scale.AGE:
            if value == math.inf:
                return self.largest
            steps = round(min(value / self.step, self.largest))
            return min(steps - self.first, self.largest - 1)
        raw: int = round(value / self.step)
        return 0 if raw == self.largest + 1 else raw


COUNT = Signal("count", "1", COUNT_BITS, Scale.INTEGER)


def signals_of(field: MessageField) -> list[Signal]:
    """Signals of one field of the schema: three of a vector, two of eight bytes.

    Raises
    ------
    ValueError
        When the field is of a kind that only the tunnel carries.
    """
    high = NARROWER.get(field.name, field.high)
    match field.kind:
        case ValueKind.BOOLEAN:
            return [Signal(field.name, "1", 1, Scale.SWITCH)]
        case ValueKind.INTEGER:
            return [_integer(field, int(high))]
        case ValueKind.VECTOR:
            return [_linear(f"{field.name}_{axis}", field.unit, high, field.step) for axis in "xyz"]
        case ValueKind.BINARY:
            return [Signal(f"{field.name}_{k}", "1", 4 * int(field.high), Scale.BYTES) for k in (1, 2)]
        case ValueKind.NUMBER:
            return [_number(field)]
    raise ValueError(f"{field.name}: expected a field of a cyclic message, got {field.kind.value}")


def _number(field: MessageField) -> Signal:
    if field.step_db:
        bits = VARIANCE_BITS if field.high <= 1e3 else WIDE_VARIANCE_BITS
        first = round(10.0 * math.log10(field.high) / field.step_db) - (1 << bits) + 1
        return Signal(field.name, f"dB({field.unit})", bits, Scale.DECIBEL, first, field.step_db)
    if math.isinf(field.high):
        return Signal(field.name, field.unit, AGE_BITS, Scale.AGE, round(field.low / field.step), field.step)
    if (field.low, field.high) == (0.0, TURN):
        return Signal(field.name, field.unit, round(math.log2(TURN / field.step)), Scale.CIRCLE, 0, field.step)
    if field.low < 0.0:
        return _linear(field.name, field.unit, min(field.high, LAST_TIME), field.step)
    first = round(field.low / field.step)
    bits = (math.ceil(field.high / field.step) - first).bit_length()
    return Signal(field.name, field.unit, bits, Scale.LINEAR, first, field.step)


def _linear(name: str, unit: str, limit: float, step: float) -> Signal:
    """Signal of a range from ``-limit`` to ``limit``, zero in its middle."""
    bits = math.ceil(limit / step).bit_length() + 1
    return Signal(name, unit, bits, Scale.LINEAR, -(1 << bits - 1), step)


def _integer(field: MessageField, high: int) -> Signal:
    return Signal(field.name, "1", (high - int(field.low)).bit_length(), Scale.INTEGER, int(field.low))
