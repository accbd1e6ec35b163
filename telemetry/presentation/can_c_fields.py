"""Signals of the native profile as members of structs in C: type, bounds and place, all in whole steps.

A chip has no floats. A member is a whole number of the signal's steps, so that zero is zero; of a variance it is the
level, 0 for none; of an age the largest number stands for an infinite one.
"""

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from telemetry.presentation.can_coders import decoder_of
from telemetry.presentation.can_messages import UNSAID, NativeMessage
from telemetry.presentation.can_signals import Scale, Signal, signals_of
from telemetry.schema import SPEC_OF, MessageField

WORD_BITS = 32
WIDTHS = (8, 16, WORD_BITS, 64)


@dataclass(frozen=True, slots=True)
class CField:
    """One member of a struct.

    Attributes
    ----------
    name : of the signal
    bits : in the frame
    first : what the raw number 0 stands for, whole steps
    lowest, highest : values that the schema admits, whole steps
    meaning : with its unit
    is_age : the highest stands for an infinite one
    """

    name: str
    bits: int
    first: int
    lowest: int
    highest: int
    meaning: str
    is_age: bool

    @property
    def is_signed(self) -> bool:
        """Whether values are negative."""
        return self.first < 0

    @property
    def type_bits(self) -> int:
        """Bits of the type, which holds every raw number."""
        largest = self.first + (1 << self.bits) - 1
        return next(w for w in WIDTHS if (largest.bit_length() + 1 if self.is_signed else largest.bit_length()) <= w)

    @property
    def c_type(self) -> str:
        """Type in C."""
        return f"{'' if self.is_signed else 'u'}int{self.type_bits}_t"

    @property
    def refusals(self) -> list[str]:
        """Conditions under which a value is refused; none that the type excludes, of which compilers warn."""
        least, most = (-(1 << self.type_bits - 1), (1 << self.type_bits - 1) - 1)
        if not self.is_signed:
            least, most = 0, (1 << self.type_bits) - 1
        below = [f"values->{self.name} < {self.literal(self.lowest)}"] if self.lowest > least else []
        return below + ([f"values->{self.name} > {self.literal(self.highest)}"] if self.highest < most else [])

    def literal(self, value: int) -> str:
        """A constant that compares with the member without a conversion of its sign."""
        width = WORD_BITS if self.type_bits <= WORD_BITS else 64
        return f"{'' if self.is_signed else 'U'}INT{width}_C({value})"


def fields_in_c(native: NativeMessage) -> list[CField]:
    """Members of a message's struct, in the order of its signals."""
    return [field_in_c(field, signal) for field, signal in fields_and_signals(native)]


def fields_and_signals(native: NativeMessage) -> Iterator[tuple[MessageField, Signal]]:
    """Every signal with its line of the schema."""
    for field in SPEC_OF[native.message].fields:
        if field.name not in UNSAID:
            for signal in signals_of(field):
                yield field, signal


def field_in_c(field: MessageField, signal: Signal) -> CField:
    """Member of a struct for one signal."""
    lowest, highest = admitted_raws(field, signal)
    first = 0 if signal.scale is Scale.DECIBEL else signal.first
    meaning, is_age = meaning_in_c(field, signal), signal.scale is Scale.AGE
    return CField(signal.name, signal.bits, first, first + lowest, first + highest, meaning, is_age)


def admitted_raws(field: MessageField, signal: Signal) -> tuple[int, int]:
    """Smallest and largest raw number that the decoder of Python takes; all between are taken too."""
    if signal.scale in (Scale.DECIBEL, Scale.BYTES, Scale.SWITCH, Scale.CIRCLE):
        return 0, signal.largest
    decode = decoder_of(field, signal)
    inside = signal.raw_of(max(field.low, 0.0)) if signal.scale is not Scale.INTEGER else max(-signal.first, 0)
    lowest = bisect_left(range(inside), True, key=lambda raw: is_taken(decode, raw))
    highest = bisect_right(range(signal.largest + 1), False, lo=inside, key=lambda raw: not is_taken(decode, raw))
    return lowest, highest - 1


def is_taken(decode: Callable[[int], object], raw: int) -> bool:
    """Whether a raw number is decoded, not refused."""
    try:
        decode(raw)
    except ValueError:
        return False
    return True


def meaning_in_c(field: MessageField, signal: Signal) -> str:
    """What a member counts."""
    match signal.scale:
        case Scale.DECIBEL:
            unit = f"level: 0 for none, n for {signal.first} + n steps of {signal.step!r} {signal.unit}"
        case Scale.BYTES:
            unit = "four bytes, the first the highest"
        case Scale.SWITCH | Scale.INTEGER:
            unit = ""
        case Scale.AGE:
            unit = f"steps of {signal.step!r} {signal.unit}, the highest is infinite"
        case _:
            unit = f"steps of {signal.step!r} {signal.unit}"
    return "; ".join(filter(None, (unit, field.meaning.replace("*/", ""))))
