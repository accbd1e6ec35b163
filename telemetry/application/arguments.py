"""Arguments and replies of commands: checked in SI, read from an operator's text, shown with the unit in the name."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from typing import Any

from telemetry.application.commands import Argument, CommandSpec
from telemetry.errors import CommandError
from telemetry.messages import MAX_TUBE, Value
from telemetry.quantities import (
    Quantity,
    ValueKind,
    bound_text,
    check_boolean,
    check_integer,
    check_integers,
    check_number,
    check_numbers,
    check_text,
)

SUFFIXES = {"rad": "_deg", "s": "_s", "m": "_m"}  # how an operator reads a unit in a name
NAMED_BY_UNIT = ("seconds",)
ROUTE = ("tube", "action", "by")  # parameters of every command
SHORT = 40  # characters of a wrong value that an error repeats

CHECKS: dict[ValueKind, Callable[[Quantity, Any], Any]] = {
    ValueKind.NUMBER: check_number,
    ValueKind.INTEGER: check_integer,
    ValueKind.BOOLEAN: check_boolean,
    ValueKind.TEXT: check_text,
    ValueKind.NUMBERS: check_numbers,
    ValueKind.INTEGERS: check_integers,
}


def check_arguments(spec: CommandSpec, arguments: Mapping[str, Any]) -> dict[str, Any]:
    """Return the arguments in SI, with defaults for those left out.

    Raises
    ------
    CommandError
        When one is missing, unknown, of the wrong type or out of range.
    """
    _check_names(spec, arguments, lambda quantity: quantity.name)
    checked = {}
    for argument in spec.arguments:
        name = argument.quantity.name
        checked[name] = _check(argument, arguments[name]) if name in arguments else argument.default
    return checked


def parse_parameters(spec: CommandSpec, parameters: Mapping[str, str]) -> dict[str, Any]:
    """Return the arguments in SI from an operator's text; those left out stay out.

    Raises
    ------
    CommandError
        When one is missing, unknown, of the wrong type or out of range.
    """
    given = {name: text for name, text in parameters.items() if name not in ROUTE}
    _check_names(spec, given, shown_name)
    known = {shown_name(argument.quantity): argument.quantity for argument in spec.arguments}
    return {known[name].name: _parse(known[name], text) for name, text in given.items()}


def parse_tube(spec: CommandSpec, parameters: Mapping[str, str]) -> int:
    """The tube that an operator names.

    Raises
    ------
    CommandError
        When it is missing or not a tube's number.
    """
    text = parameters.get("tube", "")
    if not text.isdecimal() or len(text) > len(str(MAX_TUBE)) or not 1 <= int(text) <= MAX_TUBE:
        raise CommandError(f"expected cmd/{spec.name}?tube=N with N of 1..{MAX_TUBE}, got {text[:SHORT]!r}")
    return int(text)


def checked_values(spec: CommandSpec, values: Mapping[str, Value]) -> dict[str, Value]:
    """Values of a reply that the table lists; others are left out, since a node may be of another version."""
    checked: dict[str, Value] = {}
    for quantity in spec.reply:
        if quantity.name in values:
            try:
                checked[quantity.name] = CHECKS[quantity.kind](quantity, values[quantity.name])
            except ValueError:
                continue
    return checked


def shown_values(quantities: Iterable[Quantity], values: Mapping[str, Any]) -> dict[str, Any]:
    """Return values as an operator reads them: degrees for radians, the unit in the name."""
    return {shown_name(q): _shown(q, values[q.name]) for q in quantities if q.name in values}


def shown_name(quantity: Quantity) -> str:
    """Name as an operator writes and reads it."""
    return quantity.name if quantity.name in NAMED_BY_UNIT else quantity.name + SUFFIXES.get(quantity.unit, "")


def shown_range(quantity: Quantity) -> str:
    """Range as an operator reads it."""
    if quantity.unit == "rad" and math.isfinite(quantity.high):
        return f"{math.degrees(quantity.low):g}..{math.degrees(quantity.high):g}"
    return quantity.range_text


def _shown(quantity: Quantity, value: Any) -> Any:
    if isinstance(value, tuple):
        return [_shown(quantity, item) for item in value]
    return math.degrees(value) if quantity.unit == "rad" else value


def _check_names(spec: CommandSpec, given: Mapping[str, Any], name_of: Callable[[Quantity], str]) -> None:
    known = [name_of(argument.quantity) for argument in spec.arguments]
    needed = [name_of(argument.quantity) for argument in spec.arguments if argument.needed]
    if all(name in given for name in needed) and all(name in known for name in given):
        return
    begin = f"action={spec.action}" if spec.action else "tube=N"
    expected = "".join(f";{name}=.." for name in known)
    raise CommandError(f"expected cmd/{spec.name}?{begin}{expected}, got {', '.join(map(str, given)) or 'none':.80}")


def _check(argument: Argument, value: Any) -> Any:
    try:
        return CHECKS[argument.quantity.kind](argument.quantity, value)
    except ValueError as error:
        raise CommandError(str(error)) from error


def _parse(quantity: Quantity, text: str) -> Any:
    """Value of a text in an operator's units."""
    try:
        if quantity.kind is ValueKind.NUMBER:
            value: Any = math.radians(float(text)) if quantity.unit == "rad" else float(text)
        elif quantity.kind is ValueKind.INTEGER:
            value = int(text)
        elif quantity.kind is ValueKind.INTEGERS:
            value = tuple(int(part) for part in text.split(","))
        else:
            value = text
        return CHECKS[quantity.kind](quantity, value)
    except ValueError:
        raise CommandError(f"parameter {shown_name(quantity)}: {_expected(quantity)}, got {text[:SHORT]!r}") from None


def _expected(quantity: Quantity) -> str:
    what = shown_range(quantity)
    match quantity.kind:
        case ValueKind.NUMBER:
            return f"expected {what or 'a number'}"
        case ValueKind.INTEGER:
            return f"expected an integer of {bound_text(quantity.low)}..{bound_text(quantity.high)}"
        case ValueKind.INTEGERS:
            return f"expected integers of {what} as 1,2,3"
        case _:
            return f"expected {what or 'a short text'}"
