"""Cyclic messages as signals of a few bits: the native profile of CAN, made from the schema.

A signal is a whole number of steps (``Quantity.step``); a variance is in steps of 0.5 dB. Values are rounded once, at
the source: one that stands on a step already stays as it is, so that a relay changes nothing, and what rounding may
have done is in the variance that goes with it. On CAN FD a message is one frame, on classic CAN several of 8 bytes;
each holds a count by which the parts of one message are told from those of the next.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from operator import attrgetter, itemgetter
from typing import Any

from telemetry.errors import DecodeError, EncodeError
from telemetry.media.can_timing import CLASSIC_LARGEST, FD_LARGEST, fd_length
from telemetry.messages import Aiding, Message
from telemetry.presentation.fields import codec_of
from telemetry.quantities import ValueKind
from telemetry.schema import SCHEMA, TIME_STEP, TURN, Field, Kind, MessageSpec

COUNT_BITS = 8
VARIANCE_BITS, WIDE_VARIANCE_BITS = 8, 9  # of rad^2, and of s^2 with its many powers of ten
LAST_TIME = (2**47 - 1) * TIME_STEP  # s either side of zero, 44 years in 48 bits
AGE_BITS = 24
ON_STEP = 0.05  # of a step, by which a value that was rounded before may miss it; times have 14 digits before theirs
FD_PART = 31  # part of a message that is whole in one frame
NARROWER = {
    "cycles": 2**22 - 1,  # 25 days
    "overruns": 2**8 - 1,
    "gyro_bias": 0.125,
    "innovation": 0.75,
    "parameters_version": 2**12 - 1,
    "epoch": 2**16 - 1,
    "numbered": 2**28 - 1,
}  # upper ends; beyond them the tunnel carries it
# no signals: a wired joint has no radio, and what is sealed goes as it is, by ISO-TP
UNSAID = {"upper_margin": "where there is no radio", "lower_margin": "where there is no radio", "seal": "as signals"}
CYCLIC = (Kind.AIDING, Kind.HELLO, Kind.TIME_REQUEST, Kind.TIME_REPLY, Kind.NODE_STATE)
# of an aiding, the encoder's measurement goes on unchanged and each relay writes the path anew
PATH = ("systematic_var", "offset", "hops", "torsion_var")
ROUNDED_INTO = {
    Kind.AIDING: (("yaw", "yaw_var"), ("offset", "systematic_var")),
    Kind.TIME_REPLY: (("rig_at", "clock_var"),),
    Kind.NODE_STATE: (("yaw", "yaw_var"), ("innovation", "innovation_var")),
}  # whose rounding is in which variance


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

    def raw_of(self, value: Any) -> int:
        """Raw number of a value.

        Raises
        ------
        EncodeError
            When the value is not finite or outside the signal's range.
        """
        if self.scale is Scale.BYTES:
            return int.from_bytes(value)
        if self.scale is Scale.INTEGER and 0 <= (raw := int(value) - self.first) < 1 << self.bits:
            return raw
        if not -math.inf < value < math.inf and not (self.scale is Scale.AGE and value > 0):
            raise EncodeError(f"{self.name}: expected a finite number, got {value}")
        raw = self._rounded(value)
        if not 0 <= raw <= self.largest:
            low, high = self.first * self.step, (self.first + self.largest) * self.step
            raise EncodeError(f"{self.name}: expected {low:g}..{high:g} {self.unit}, got {value:g}")
        return raw

    def decoder(self) -> Callable[[int], Any]:
        """Function from a raw number to its value."""
        first, step, largest = self.first, self.step, self.largest
        if self.scale is Scale.DECIBEL:
            levels = [10.0 ** ((first + raw) * step / 10.0) for raw in range(largest + 1)]
            return [0.0, *levels[1:]].__getitem__
        if self.scale is Scale.BYTES:
            return partial(int.to_bytes, length=self.bits // 8)
        if self.scale is Scale.INTEGER:
            return lambda raw: first + raw
        if self.scale is Scale.SWITCH:
            return lambda raw: raw == 1
        parts = round(1.0 / step)  # a decimal step divides one: dividing gives the nearest number, multiplying may not
        is_decimal = abs(parts * step - 1.0) < 1e-12
        if self.scale is Scale.AGE:
            return lambda raw: math.inf if raw == largest else (first + raw) / parts
        return (lambda raw: (first + raw) / parts) if is_decimal else (lambda raw: (first + raw) * step)

    def is_rounded(self, value: float) -> bool:
        """Whether the signal cannot express ``value`` exactly."""
        steps = value / self.step
        return abs(steps - round(steps)) > ON_STEP

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


ALWAYS_IN_RANGE = (Scale.CIRCLE, Scale.DECIBEL, Scale.SWITCH, Scale.BYTES)
COUNT = Signal("count", "1", COUNT_BITS, Scale.INTEGER)


@dataclass(frozen=True, slots=True)
class Layout:
    """One frame of a message: its signals and the first bit of each, counted from the lowest of the first byte."""

    name: str
    part: int
    length: int  # bytes
    places: tuple[tuple[Signal, int], ...]


class Form:
    """A message in frames of one kind of CAN: packs and unpacks all its signals at once."""

    def __init__(self, layouts: tuple[Layout, ...], signals: Iterable[Signal]) -> None:
        self.layouts = layouts
        self._lengths = [layout.length for layout in layouts]
        found = {
            signal.name: (frame, start)
            for frame, layout in enumerate(layouts)
            for signal, start in layout.places
            if signal is not COUNT
        }
        self._places = [found[signal.name] for signal in signals]
        self._plan = [(*found[signal.name], signal.largest, signal.decoder()) for signal in signals]

    def pack(self, raws: Iterable[int], count: int) -> list[bytes]:
        """Data of each frame; ``raws`` in the order of the signals."""
        bits = [count & COUNT.largest] * len(self._lengths)
        for (frame, start), raw in zip(self._places, raws, strict=True):
            bits[frame] |= raw << start
        return [number.to_bytes(length, "little") for number, length in zip(bits, self._lengths, strict=True)]

    def unpack(self, frames: Sequence[bytes]) -> list[Any]:
        """Values in the order of the signals.

        Raises
        ------
        DecodeError
            When a frame has another length.
        """
        for layout, data in zip(self.layouts, frames, strict=True):
            if len(data) != layout.length:
                raise DecodeError(f"{layout.name}: expected {layout.length} bytes, got {len(data)}")
        bits = [int.from_bytes(data, "little") for data in frames]
        return [decode(bits[frame] >> start & largest) for frame, start, largest, decode in self._plan]


Step = tuple[Callable[[Sequence[Any]], Any], Callable[[Any], Any] | None]  # gathers a field's value, checks it


class NativeMessage:
    """One message of the schema as signals."""

    def __init__(self, spec: MessageSpec) -> None:
        self.kind = spec.kind
        self.message = spec.message
        self.name = spec.message.__name__
        fields = [field for field in spec.fields if field.name not in UNSAID]
        self._fields = [(codec_of(field), signals_of(field)) for field in fields]
        self._unsaid = [(field.name, field.before) for field in spec.fields if field.name in UNSAID]
        self._values = attrgetter(*(field.name for field in fields))
        self._is_single = len(fields) == 1
        self._plan = self._make_plan()
        self.signals = {signal.name: signal for _, signals in self._fields for signal in signals}
        self.fd = Form((laid_out(self.name, FD_PART, list(self.signals.values()), FD_LARGEST),), self.signals.values())
        self.classic = Form(self._classic_layouts(), self.signals.values())

    def raws_of(self, message: Message) -> list[int]:
        """Raw numbers of a message in the order of the signals, its rounding in its variances.

        Raises
        ------
        EncodeError
            When a value is outside the range of the schema or of its signal; named.
        """
        values = self._values(message)
        raws: list[int] = []
        for name, before in self._unsaid:
            if getattr(message, name) != before:
                raise EncodeError(f"{self.name}: {name}: expected none {UNSAID[name]}")
        try:
            given = (values,) if self._is_single else values
            checks = [codec.check(value) for (codec, _), value in zip(self._fields, given, strict=True)]
            rounding = self._rounding(message)
            for (codec, signals), checked in zip(self._fields, checks, strict=True):
                if codec.name in rounding:
                    checked += rounding[codec.name]  # noqa: PLW2901
                if len(signals) == 1:
                    raws.append(signals[0].raw_of(checked))
                else:
                    raws += [s.raw_of(part) for s, part in zip(signals, parts_of(checked, len(signals)), strict=True)]
        except ValueError as error:
            raise EncodeError(f"{self.name}: {error}") from error
        return raws

    def message_of(self, values: Sequence[Any]) -> Message:
        """Message of the values of its signals.

        Raises
        ------
        DecodeError
            When a value is outside the range of the schema; named.
        """
        try:
            fields = [check(gather(values)) if check else gather(values) for gather, check in self._plan]
            decoded: Message = self.message(*fields)
        except ValueError as error:
            raise DecodeError(f"{self.name}: {error}") from error
        return decoded

    def _make_plan(self) -> list[Step]:
        """For each field how its value is gathered, and its check; none where no raw number is outside the range."""
        plan: list[Step] = []
        begin = 0
        for codec, signals in self._fields:
            end = begin + len(signals)
            gather: Callable[[Sequence[Any]], Any] = (
                itemgetter(begin) if len(signals) == 1 else partial(joined, begin, end)
            )
            plan.append((gather, None if signals[0].scale in ALWAYS_IN_RANGE else codec.check))
            begin = end
        return plan

    def _classic_layouts(self) -> tuple[Layout, ...]:
        """Frames of 8 bytes; of an aiding the measurement's before the path's."""
        path = [s for s in self.signals.values() if self.kind is Kind.AIDING and s.name in PATH]
        first = [s for s in self.signals.values() if s not in path]
        halves = [("Measurement", first), ("Path", path)] if path else [("", first)]
        layouts: list[Layout] = []
        for half, signals in halves:
            for number, group in enumerate(groups(signals, 8 * CLASSIC_LARGEST - COUNT_BITS), 1):
                layouts.append(laid_out(f"{self.name}{half}{number}", len(layouts), group, CLASSIC_LARGEST))
        return tuple(layouts)

    def _rounding(self, message: Message) -> dict[str, float]:
        """What the rounding of each value adds to its variance: a twelfth of a step squared."""
        added: dict[str, float] = {}
        for name, variance in ROUNDED_INTO.get(self.kind, ()):
            signal = self.signals[name]
            if signal.is_rounded(getattr(message, name)):
                added[variance] = added.get(variance, 0.0) + signal.step**2 / 12.0
        if isinstance(message, Aiding) and self.signals["valid_at"].is_rounded(message.valid_at):
            turned = message.rate * self.signals["valid_at"].step
            added["yaw_var"] = added.get("yaw_var", 0.0) + turned * turned / 12.0
        return added


def signals_of(field: Field) -> list[Signal]:
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


def _number(field: Field) -> Signal:
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


def _integer(field: Field, high: int) -> Signal:
    return Signal(field.name, "1", (high - int(field.low)).bit_length(), Scale.INTEGER, int(field.low))


def parts_of(value: Any, count: int) -> Iterable[Any]:
    """What the signals of a value hold."""
    if count == 1:
        return (value,)
    return value if count == 3 else (value[: len(value) // 2], value[len(value) // 2 :])


def joined(begin: int, end: int, values: Sequence[Any]) -> Any:
    """The value that several signals hold together."""
    if end - begin == 3:
        return values[begin], values[begin + 1], values[begin + 2]
    return values[begin] + values[begin + 1]


def groups(signals: list[Signal], bits: int) -> list[list[Signal]]:
    """Signals put into frames with room for ``bits``: each into the first that has room."""
    filled: list[list[Signal]] = []
    for signal in signals:
        for group in filled:
            if sum(s.bits for s in group) + signal.bits <= bits:
                group.append(signal)
                break
        else:
            filled.append([signal])
    return filled


def laid_out(name: str, part: int, signals: list[Signal], largest: int) -> Layout:
    """The count and the signals one after the other, from the lowest bit."""
    places, start = [], 0
    for signal in [COUNT, *signals]:
        places.append((signal, start))
        start += signal.bits
    length = (start + 7) // 8
    return Layout(name, part, fd_length(length) if largest == FD_LARGEST else length, tuple(places))


NATIVE: dict[Kind, NativeMessage] = {spec.kind: NativeMessage(spec) for spec in SCHEMA if spec.kind in CYCLIC}
