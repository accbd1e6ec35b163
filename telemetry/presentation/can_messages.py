"""Cyclic messages as signals: the native profile of CAN, made from the schema.

What the rounding of a value may have done is in the variance that goes with it. On CAN FD a message is one frame, on
classic CAN several. A message is packed and unpacked as its fields in the order of the schema, so that what comes as
msgpack and goes as signals, or the other way round, need not become an object between the two.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property, partial
from operator import add, attrgetter, itemgetter
from typing import Any, NamedTuple

from telemetry.errors import DecodeError, EncodeError
from telemetry.media.can_timing import CLASSIC_LARGEST, FD_LARGEST
from telemetry.messages import Message
from telemetry.presentation.can_coders import decoder_of, encoder_of, number_encoder
from telemetry.presentation.can_compiled import Packer, Rounded, Unpacker, packer_of, unpacker_of
from telemetry.presentation.can_forms import FD_PART, Form, Layout, frame_groups, laid_out
from telemetry.presentation.can_signals import COUNT_BITS, ON_STEP, Signal, signals_of
from telemetry.schema import SCHEMA, MessageField, MessageKind, MessageSpec

# no signals: a wired joint has no radio, and what is sealed goes as it is, by ISO-TP
UNSAID = {"upper_margin": "where there is no radio", "lower_margin": "where there is no radio", "seal": "as signals"}
CYCLIC = (
    MessageKind.AIDING,
    MessageKind.HELLO,
    MessageKind.TIME_REQUEST,
    MessageKind.TIME_REPLY,
    MessageKind.NODE_STATE,
)
# of an aiding, the encoder's measurement goes on unchanged and each relay writes the path anew
PATH = ("systematic_var", "offset", "hops", "torsion_var")
ROUNDED_INTO = {
    MessageKind.AIDING: (("yaw", "", "yaw_var"), ("offset", "", "systematic_var"), ("valid_at", "rate", "yaw_var")),
    MessageKind.TIME_REPLY: (("rig_at", "", "clock_var"),),
    MessageKind.NODE_STATE: (("yaw", "", "yaw_var"), ("innovation", "", "innovation_var")),
}  # whose rounding, times which rate, is in which variance
Gather = Callable[[Sequence[Any]], Any]


class Rounding(NamedTuple):
    """A value whose rounding is in a variance: their places among the fields, and the variance's among the signals."""

    value: int
    rate: int | None
    variance: int
    raw: int
    step: float
    raw_of: Callable[[Any], int]  # of the variance

    def added(self, values: Sequence[Any]) -> float:
        """What it adds: a twelfth of the squared step, of a time that of what turns in a step; 0: it is not rounded."""
        steps = values[self.value] / self.step
        if abs(steps - round(steps)) <= ON_STEP:
            return 0.0
        step: float = self.step if self.rate is None else values[self.rate] * self.step
        return step * step / 12.0


class NativeMessage:
    """One message of the schema as signals."""

    def __init__(self, spec: MessageSpec) -> None:
        self.kind = spec.kind
        self.message = spec.message
        self.name = spec.message.__name__
        fields = [field for field in spec.fields if field.name not in UNSAID]
        by_field = [(field, signals_of(field)) for field in fields]
        self.signals = {signal.name: signal for _, signals in by_field for signal in signals}
        self._encoders = [encoder_of(field, signals) for field, signals in by_field]
        self._decoders = [decoder_of(field, signal) for field, signals in by_field for signal in signals]
        self._gathers = gathers_of([len(signals) for _, signals in by_field])
        self._unsaid = [(k, f.name, f.before) for k, f in enumerate(spec.fields) if f.name in UNSAID]
        self._before = [before for _, _, before in self._unsaid]
        if [k for k, _, _ in self._unsaid] != list(range(len(fields), len(spec.fields))):
            raise ValueError(f"{self.name}: expected fields without signals after all others")
        names, places = [field.name for field in fields], list(self.signals)
        get = attrgetter(*(field.name for field in spec.fields))
        self._values: Callable[[Any], Sequence[Any]] = get if len(spec.fields) > 1 else lambda message: (get(message),)
        self._roundings = [
            Rounding(
                names.index(value),
                names.index(rate) if rate else None,
                names.index(variance),
                places.index(variance),
                self.signals[value].step,
                number_encoder(self.signals[variance], float, 0.0, spec.fields[names.index(variance)].high),
            )
            for value, rate, variance in ROUNDED_INTO.get(self.kind, ())
        ]
        everything = list(self.signals.values())
        self.fd = Form((laid_out(self.name, FD_PART, everything, FD_LARGEST),), everything)
        self.classic = Form(self._classic_layouts(), everything)
        self._by_field: list[tuple[MessageField, list[Signal]]] = [
            *by_field,
            *((spec.fields[k], []) for k, _, _ in self._unsaid),
        ]

    def pack(self, values: Sequence[Any], count: int, *, fd: bool) -> list[bytes]:
        """Data of each frame; ``values`` are those of all fields of the schema, unchecked, see ``raws_of_values``."""
        data = self.packers[fd](values, count)
        return data if data is not None else self.form(fd=fd).pack(self.raws_of_values(values), count)

    def unpack(self, frames: Sequence[bytes], *, fd: bool) -> list[Any]:
        """Values of all fields of the schema, of the data of each frame.

        Raises
        ------
        DecodeError
            When a frame has another length, or a value is outside the range of the schema; named.
        """
        try:
            values = self.unpackers[fd](frames)
        except ValueError:  # of a member that an enumeration has not
            values = None
        if values is not None:
            return values
        return self.values_of(self.form(fd=fd).unpack(frames))

    def form(self, *, fd: bool) -> Form:
        """Its frames on CAN FD or on classic CAN."""
        return self.fd if fd else self.classic

    @cached_property
    def packers(self) -> tuple[Packer, Packer]:
        """Compiled for classic CAN and for CAN FD."""
        rounded = [Rounded(one.value, one.rate, one.variance) for one in self._roundings]
        return packer_of(self._by_field, rounded, self.classic), packer_of(self._by_field, rounded, self.fd)

    @cached_property
    def unpackers(self) -> tuple[Unpacker, Unpacker]:
        """Compiled for classic CAN and for CAN FD."""
        return unpacker_of(self._by_field, self.classic), unpacker_of(self._by_field, self.fd)

    def raws_of(self, message: Message) -> list[int]:
        """Raw numbers of a message, see ``raws_of_values``."""
        return self.raws_of_values(self._values(message))

    def raws_of_values(self, values: Sequence[Any]) -> list[int]:
        """Raw numbers in the order of the signals; ``values`` are those of all fields of the schema, unchecked.

        The rounding of a value is in its variance.

        Raises
        ------
        EncodeError
            When a value is outside the range of the schema or of its signal; named.
        """
        for place, name, before in self._unsaid:
            if values[place] != before:
                raise EncodeError(f"{self.name}: {name}: expected none {UNSAID[name]}")
        raws: list[int] = []
        try:
            for encode, value in zip(self._encoders, values, strict=False):  # what is not said comes last
                raws += encode(value)
            self._add_rounding(values, raws)
        except ValueError as error:
            raise EncodeError(f"{self.name}: {error}") from error
        return raws

    def values_of(self, raws: Sequence[int]) -> list[Any]:
        """Values of all fields of the schema, of the raw numbers of its signals.

        Raises
        ------
        DecodeError
            When a value is outside the range of the schema; named.
        """
        try:
            found = [decode(raw) for decode, raw in zip(self._decoders, raws, strict=True)]
        except ValueError as error:
            raise DecodeError(f"{self.name}: {error}") from error
        return [gather(found) for gather in self._gathers] + self._before

    def message_of(self, raws: Sequence[int]) -> Message:
        """Message of the raw numbers of its signals, see ``values_of``."""
        decoded: Message = self.message(*self.values_of(raws))
        return decoded

    def _add_rounding(self, values: Sequence[Any], raws: list[int]) -> None:
        total: dict[int, float] = {}
        for rounding in self._roundings:
            if added := rounding.added(values):
                total[rounding.raw] = added = total.get(rounding.raw, 0.0) + added
                raws[rounding.raw] = rounding.raw_of(values[rounding.variance] + added)

    def _classic_layouts(self) -> tuple[Layout, ...]:
        """Frames of 8 bytes; of an aiding the measurement's before the path's."""
        path = [s for s in self.signals.values() if self.kind is MessageKind.AIDING and s.name in PATH]
        first = [s for s in self.signals.values() if s not in path]
        halves = [("Measurement", first), ("Path", path)] if path else [("", first)]
        layouts: list[Layout] = []
        for half, signals in halves:
            for number, group in enumerate(frame_groups(signals, 8 * CLASSIC_LARGEST - COUNT_BITS), 1):
                layouts.append(laid_out(f"{self.name}{half}{number}", len(layouts), group, CLASSIC_LARGEST))
        return tuple(layouts)


def gathers_of(counts: list[int]) -> list[Gather]:
    """For each field of so many signals, how its value is put together of all values."""
    gathers: list[Gather] = []
    begin = 0
    for count in counts:
        places = range(begin, begin + count)
        gathers.append(partial(join_halves, itemgetter(*places)) if count == 2 else itemgetter(*places))
        begin += count
    return gathers


def join_halves(halves: Gather, values: Sequence[Any]) -> Any:
    """Bytes of the two signals that hold them."""
    return add(*halves(values))


NATIVE: dict[MessageKind, NativeMessage] = {spec.kind: NativeMessage(spec) for spec in SCHEMA if spec.kind in CYCLIC}
