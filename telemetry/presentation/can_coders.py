"""A field of a cyclic message to the raw numbers of its signals and back, checked on the way.

What is as the schema says takes a comparison; anything else goes to the schema's check, which converts it (a whole
number where any number will do) or refuses it by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from typing import Any

from telemetry.presentation.can_checks import Check, check_of
from telemetry.presentation.can_signals import Scale, Signal
from telemetry.schema import MessageField

Encoder = Callable[[Any], tuple[int, ...]]  # of a field's value; raises ValueError
Decoder = Callable[[int], Any]  # of one signal's raw number; raises ValueError


def encoder_of(field: MessageField, signals: list[Signal]) -> Encoder:
    """Function from a field's value to the raw numbers of its signals."""
    check, first = check_of(field), signals[0]
    if len(signals) == 3:
        return vector_encoder(check, [number_encoder(s, float, -field.high, field.high) for s in signals])
    if first.scale is Scale.BYTES:
        return bytes_encoder(check)
    if first.scale in (Scale.INTEGER, Scale.SWITCH):
        return integer_encoder(first, check, field.low, field.high)
    raw_of = number_encoder(first, check, field.low, field.high)
    return lambda value: (raw_of(value),)


def number_encoder(signal: Signal, check: Check, low: float, high: float) -> Callable[[Any], int]:
    """Function from a number to its raw number; ``low`` and ``high`` bound what needs no check."""
    first, step, largest = signal.first, signal.step, signal.largest

    def checked(value: Any) -> int:
        return signal.raw_of(check(value))

    def linear(value: Any) -> int:
        return round(value / step) - first if type(value) is float and low <= value <= high else checked(value)

    def circle(value: Any) -> int:
        return round(value / step) & largest if type(value) is float and low <= value <= high else checked(value)

    def decibel(value: Any) -> int:
        if not (type(value) is float and 0.0 < value <= high):
            return checked(value)
        raw = round(10.0 * math.log10(value) / step) - first
        return raw if raw > 0 else 1

    if signal.scale is Scale.LINEAR:
        low, high = max(low, signal.lowest_value), min(high, signal.highest_value)
        return linear
    return {Scale.CIRCLE: circle, Scale.DECIBEL: decibel}.get(signal.scale, checked)


def integer_encoder(signal: Signal, check: Check, low: float, high: float) -> Encoder:
    """Function from an integer, a flag or a member of an enumeration that has all numbers from ``low`` to ``high``."""
    first = signal.first
    low, high = max(low, signal.lowest_value), min(high, signal.highest_value)

    def raws_of(value: Any) -> tuple[int, ...]:
        if type(value) is int and low <= value <= high:
            return (value - first,)
        return (signal.raw_of(check(value)),)

    return raws_of


def vector_encoder(check: Check, encoders: list[Callable[[Any], int]]) -> Encoder:
    """Function from a vector."""
    x_of, y_of, z_of = encoders

    def raws_of(value: Any) -> tuple[int, ...]:
        x, y, z = check(value)
        return x_of(x), y_of(y), z_of(z)

    return raws_of


def bytes_encoder(check: Check) -> Encoder:
    """Function from bytes, of which each of two signals holds a half."""

    def raws_of(value: Any) -> tuple[int, ...]:
        content = check(value)
        half = len(content) // 2
        return int.from_bytes(content[:half]), int.from_bytes(content[half:])

    return raws_of


def decoder_of(field: MessageField, signal: Signal) -> Decoder:
    """Function from a raw number to the value it stands for, or to the component of the vector."""
    first = signal.first
    check = check_of(field) if signal.name == field.name else component_check(check_of(field))
    match signal.scale:
        case Scale.DECIBEL:
            return levels_of(signal).__getitem__
        case Scale.BYTES:
            return partial(int.to_bytes, length=signal.bits // 8)
        case Scale.SWITCH:
            return (False, True).__getitem__
        case Scale.INTEGER:
            return lambda raw: check(first + raw)
    return number_decoder(signal, check, field.low, field.high)


def number_decoder(signal: Signal, check: Check, low: float, high: float) -> Decoder:
    """Function from a raw number to a number; ``low`` and ``high`` bound what needs no check."""
    first, step, largest = signal.first, signal.step, signal.largest
    parts = parts_of_one(signal)

    def value_of(raw: int) -> Any:
        value = (first + raw) / parts if parts else (first + raw) * step
        return value if low <= value <= high else check(value)

    if signal.scale is Scale.AGE:
        return lambda raw: math.inf if raw == largest else value_of(raw)
    return value_of


def parts_of_one(signal: Signal) -> int:
    """How often a decimal step divides one, 0 where it does not.

    Dividing by it gives the nearest number, multiplying by the step may not.
    """
    parts = round(1.0 / signal.step)
    return parts if abs(parts * signal.step - 1.0) < 1e-12 else 0


def levels_of(signal: Signal) -> list[float]:
    """Variance of each raw number."""
    levels = [10.0 ** ((signal.first + raw) * signal.step / 10.0) for raw in range(signal.largest + 1)]
    return [0.0, *levels[1:]]


def component_check(check: Check) -> Check:
    """Check of one number by that of a vector of three of them."""
    return lambda value: check((value, value, value))[0]
