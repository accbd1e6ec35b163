"""Check of a value of a cyclic message outside the usual case: it is converted, or refused by name."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from telemetry.quantities import Quantity, ValueKind, check_binary, check_boolean, check_integer, check_number
from telemetry.schema import MessageField

Check = Callable[[Any], Any]  # raises ValueError
QUICK: dict[ValueKind, type[Any]] = {ValueKind.NUMBER: float, ValueKind.INTEGER: int}


def check_of(field: MessageField) -> Check:
    """Check of one line of the schema."""
    check: Check = partial(CHECKS[field.kind], field)
    if field.enumeration is not None:
        return member_check(field, field.enumeration)
    return quick_check(field, QUICK[field.kind], check) if field.kind in QUICK else check


def quick_check(q: Quantity, kind: type[Any], check: Check) -> Check:
    """Check of a number that calls ``check`` only for one of another type or out of its range."""
    low, high = q.low, q.high

    def checked(value: Any) -> Any:
        return value if type(value) is kind and low <= value <= high else check(value)

    return checked


def member_check(q: Quantity, enumeration: Callable[[int], Any]) -> Check:
    """Check of an integer that stands for a member or for flags."""
    members: dict[int, Any] = {}

    def checked(value: Any) -> Any:
        is_plain = type(value) is int or type(value) is enumeration
        if not is_plain or (member := members.get(value)) is None:
            member = members[int(value)] = enumeration(check_integer(q, value))
        return member

    return checked


def check_vector(q: Quantity, value: Any) -> tuple[float, float, float]:
    """Three finite numbers of magnitude up to the limit."""
    limit = q.high
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"{q.name}: expected three numbers, got {value!r:.40}")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not -limit <= item <= limit:
            raise ValueError(f"{q.name}: expected numbers within +-{limit:g}, got {item!r:.40}")
    return float(value[0]), float(value[1]), float(value[2])


CHECKS: dict[ValueKind, Callable[[Quantity, Any], Any]] = {
    ValueKind.NUMBER: check_number,
    ValueKind.INTEGER: check_integer,
    ValueKind.BOOLEAN: check_boolean,
    ValueKind.BINARY: check_binary,
    ValueKind.VECTOR: check_vector,
}
