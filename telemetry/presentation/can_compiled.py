"""A cyclic message between its fields and the data of its frames at one go, compiled from its signals.

``can_coders`` says what each field becomes, one after the other; here that is written out for a whole message whose
values are as the schema says. For any other one these functions return None, and the way field by field converts its
values or refuses them by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

from telemetry.presentation.can_checks import check_of
from telemetry.presentation.can_coders import levels_of, parts_of_one
from telemetry.presentation.can_forms import Form
from telemetry.presentation.can_signals import COUNT, ON_STEP, Scale, Signal
from telemetry.quantities import ValueKind
from telemetry.schema import MessageField

Packer = Callable[[Sequence[Any], int], list[bytes] | None]  # data of each frame of the values of all fields, a count
Unpacker = Callable[[Sequence[bytes]], list[Any] | None]  # values of all fields; raises ValueError
OTHERWISE = "    return None"
RIGHT = {
    ValueKind.NUMBER: "type({v}) is float and {low!r} <= {v} <= {high!r}",
    ValueKind.INTEGER: "type({v}) is int and {low!r} <= {v} <= {high!r}",
    ValueKind.BOOLEAN: "{v} is True or {v} is False",
    ValueKind.BINARY: "type({v}) is bytes and {low!r} <= len({v}) <= {high!r}",
}  # what needs no check


class Rounded(NamedTuple):
    """A field whose rounding is in the variance of another one, times a rate where it is a time: their places."""

    value: int
    rate: int | None
    variance: int


def packer_of(
    fields: Sequence[tuple[MessageField, Sequence[Signal]]], rounded: Sequence[Rounded], form: Form
) -> Packer:
    """Function from the values of all fields to the data of the frames of ``form``.

    ``fields`` have their signals; those that no signal says come last.
    """
    lines = [f"{' '.join(f'v{k},' for k in range(len(fields)))} = values"]
    for k, (field, signals) in enumerate(fields):
        lines += guard_lines(f"v{k}", field, signals)
    lines += [line for one in rounded for line in rounding_lines(one, fields[one.value][1][0])]
    bits = [[f"count & {COUNT.largest}"] for _ in form.layouts]
    places = iter(form.places)
    for k, (_, signals) in enumerate(fields):
        added = [f"a{one.value}" for one in rounded if one.variance == k]
        for n, signal in enumerate(signals):
            frame, start, _ = next(places)
            name = f"r{k}_{n}"
            steps = f"n{k}" if any(one.value == k for one in rounded) else None
            lines += raw_lines(name, f"v{k}" if len(signals) == 1 else f"v{k}_{n}", signal, added, steps)
            bits[frame].append(f"{name} << {start}")
    data = [
        f"({' | '.join(of)}).to_bytes({layout.length}, 'little')" for of, layout in zip(bits, form.layouts, strict=True)
    ]
    space = {f"kind_of_v{k}": field.enumeration for k, (field, _) in enumerate(fields)} | {"log10": math.log10}
    packer: Packer = compile_function([*lines, f"return [{', '.join(data)}]"], space, "values, count")
    return packer


def unpacker_of(fields: Sequence[tuple[MessageField, Sequence[Signal]]], form: Form) -> Unpacker:
    """Function from the data of the frames of ``form`` to the values of all fields, see ``packer_of``."""
    lines = [f"{' '.join(f'd{frame},' for frame in range(len(form.layouts)))} = frames"]
    for frame, layout in enumerate(form.layouts):
        lines += [f"if len(d{frame}) != {layout.length}:", OTHERWISE]
        lines.append(f"b{frame} = int.from_bytes(d{frame}, 'little')")
    space: dict[str, Any] = {}
    found: list[str] = []
    places = iter(form.places)
    for k, (field, signals) in enumerate(fields):
        names = [f"v{k}_{n}" for n in range(len(signals))]
        for name, signal in zip(names, signals, strict=True):
            frame, start, largest = next(places)
            lines += [f"raw = b{frame} >> {start} & {largest}", *value_lines(name, k, field, signal, space)]
        if not signals:
            space[f"before{k}"] = field.before
            found.append(f"before{k}")
        elif field.kind is ValueKind.VECTOR:
            found.append(f"({', '.join(names)})")
        else:
            found.append(" + ".join(names))
    space |= {f"check{k}": check_of(field) for k, (field, _) in enumerate(fields) if field.enumeration is not None}
    unpacker: Unpacker = compile_function([*lines, f"return [{', '.join(found)}]"], space, "frames")
    return unpacker


def guard_lines(v: str, field: MessageField, signals: Sequence[Signal]) -> list[str]:
    """Lines that give up where a value needs a check, or is beyond its signal."""
    if not signals:
        return [f"if {v} != {field.before!r}:", OTHERWISE]
    low, high = field.low, field.high
    if field.kind is ValueKind.VECTOR:
        high = min(high, *(signal.highest_value for signal in signals))
        low = max(-field.high, *(signal.lowest_value for signal in signals))
        axes = [f"{v}_{n}" for n in range(3)]
        within = " and ".join(f"{low!r} <= {axis} <= {high!r}" for axis in axes)
        return [
            f"if type({v}) not in (list, tuple) or len({v}) != 3:",
            OTHERWISE,
            f"{', '.join(axes)} = {v}",
            f"if not (type({axes[0]}) is type({axes[1]}) is type({axes[2]}) is float and {within}):",
            OTHERWISE,
        ]
    if signals[0].scale in (Scale.LINEAR, Scale.INTEGER):
        low, high = max(low, signals[0].lowest_value), min(high, signals[0].highest_value)
    right = RIGHT[field.kind].format(v=v, low=low, high=high)
    if field.enumeration is not None:  # a member as well as its number
        right = f"(type({v}) is int or type({v}) is kind_of_{v}) and {low!r} <= {v} <= {high!r}"
    halves = (
        [f"{v}_0, {v}_1 = {v}[:{int(high) // 2}], {v}[{int(high) // 2}:]"] if field.kind is ValueKind.BINARY else []
    )
    return [f"if not ({right}):", OTHERWISE, *halves]


def rounding_lines(one: Rounded, signal: Signal) -> list[str]:
    """Lines for what a rounding adds to a variance, see ``can_messages.Rounding.added``."""
    step = f"{signal.step!r}" if one.rate is None else f"(v{one.rate} * {signal.step!r})"
    return [
        f"s{one.value} = v{one.value} / {signal.step!r}",
        f"n{one.value} = round(s{one.value})",
        f"a{one.value} = 0.0 if abs(s{one.value} - n{one.value}) <= {ON_STEP!r} else {step} * {step} / 12.0",
    ]


def raw_lines(raw: str, v: str, signal: Signal, added: Sequence[str], steps: str | None) -> list[str]:
    """Lines that make the raw number of a value; ``steps`` are how many it is where that is known already."""
    steps = steps or f"round({v} / {signal.step!r})"
    match signal.scale:
        case Scale.LINEAR:
            return [f"{raw} = {steps} - {signal.first}"]
        case Scale.CIRCLE:
            return [f"{raw} = {steps} & {signal.largest}"]
        case Scale.INTEGER | Scale.SWITCH:
            return [f"{raw} = {v} - {signal.first}"]
        case Scale.BYTES:
            return [f"{raw} = int.from_bytes({v})"]
        case Scale.AGE:
            age = f"round(min({v} / {signal.step!r}, {signal.largest})) - {signal.first}"
            return [f"{raw} = {signal.largest} if {v} == inf else min({age}, {signal.largest - 1})"]
    whole = f"x = {v} + ({' + '.join(added)})" if added else f"x = {v}"
    return [
        whole,
        f"{raw} = round(10.0 * log10(x) / {signal.step!r}) - {signal.first} if x > 0.0 else 0",
        f"if {raw} > {signal.largest}:",
        OTHERWISE,
        f"if {raw} < 1 and x > 0.0:",
        f"    {raw} = 1",
    ]


def value_lines(name: str, place: int, field: MessageField, signal: Signal, space: dict[str, Any]) -> list[str]:
    """Lines that make a value, or the part of one, of ``raw``."""
    match signal.scale:
        case Scale.DECIBEL:
            space[f"levels{place}"] = levels_of(signal)
            return [f"{name} = levels{place}[raw]"]
        case Scale.BYTES:
            return [f"{name} = raw.to_bytes({signal.bits // 8})"]
        case Scale.SWITCH:
            return [f"{name} = raw == 1"]
        case Scale.INTEGER if field.enumeration is not None:
            return [f"{name} = check{place}(raw + {signal.first})"]
        case Scale.INTEGER:
            return [f"{name} = raw + {signal.first}", *within_lines(name, field)]
    parts = parts_of_one(signal)
    scaled = f"(raw + {signal.first}) {f'/ {parts}' if parts else f'* {signal.step!r}'}"
    unless = f"inf if raw == {signal.largest} else " if signal.scale is Scale.AGE else ""
    return [f"{name} = {unless}{scaled}", *within_lines(name, field)]


def within_lines(name: str, field: MessageField) -> list[str]:
    """Lines that give up where a value is outside the range of the schema."""
    low = -field.high if field.kind is ValueKind.VECTOR else field.low
    return [f"if not {low!r} <= {name} <= {field.high!r}:", OTHERWISE]


def compile_function(lines: list[str], space: dict[str, Any], arguments: str) -> Callable[..., Any]:
    """Function of its lines, which may name ``arguments``, what is in ``space`` and infinity.

    Read signal by signal a message takes three times as long and more, which ``benchmarks/codec.py`` holds.
    """
    space["inf"] = math.inf
    source = f"def function({arguments}):\n" + "\n".join(f"    {line}" for line in lines)
    exec(compile(source, "<compiled from the schema>", "exec"), space)
    function: Callable[..., Any] = space["function"]
    return function
