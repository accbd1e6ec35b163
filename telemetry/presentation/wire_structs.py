"""Types of the messages on the wire, made from the schema: by them msgspec reads and checks a payload in one pass.

A struct has the fields of one schema version under their short keys. Its types say what the schema asks of a value:
kind, range, length. NaN is in no range, so every number has one. What comes under other keys is skipped.
"""

from __future__ import annotations

import enum
import math
import sys
from collections.abc import Callable
from itertools import pairwise
from typing import Annotated, Any

from msgspec import Meta, Struct, defstruct

from telemetry.quantities import MAX_ARGUMENTS, MAX_IMUS, MAX_LIST, MAX_STANDS, MAX_TEXT, ValueKind
from telemetry.schema import LARGEST_TIME, MAX_EPOCH, MessageField, MessageSpec

LARGEST_COVARIANCE, LARGEST_FORCE = 1e6, 1e3  # (m/s^2)^2 and the like, m/s^2
LARGEST = sys.float_info.max
TUPLE: Any = tuple  # to be given types that are made here
DICT: Any = dict
ANNOTATED: Any = Annotated


def struct_of(spec: MessageSpec, version: int, *, as_list: bool = False) -> type[Struct]:
    """Struct of the fields that a schema version of a message has, in the order of the schema; a map or a list."""
    fields = [field for field in spec.fields if field.since <= version]
    has_stands = any(field.kind is ValueKind.STANDS for field in fields)
    return defstruct(
        f"{spec.message.__name__}{version}",
        [(field.name, type_of(field)) for field in fields],
        rename={field.name: field.key for field in fields},
        array_like=as_list,
        namespace={"__post_init__": _check_order} if has_stands else {},
    )


def type_of(field: MessageField) -> Any:
    """Type of one field: what msgspec is to find in its place."""
    return TYPES[field.kind](field)


def number_type(low: float = -LARGEST, high: float = LARGEST) -> Any:
    """A number in a range; finite unless that reaches to infinity.

    Raises
    ------
    ValueError
        When the range has no end, for it would let NaN in.
    """
    ends = [float(end) if math.isfinite(end) else None for end in (low, high)]
    if ends == [None, None]:
        raise ValueError("expected a range with one end at least: NaN is in every other")
    return Annotated[float, Meta(ge=ends[0], le=ends[1])]


def integer_type(field: MessageField) -> Any:
    """An integer in the range of a field, or a member of its enumeration; flags come as their number."""
    if field.enumeration is not None and not issubclass(field.enumeration, enum.Flag):
        return field.enumeration
    return Annotated[int, Meta(ge=int(field.low), le=int(field.high))]


def binary_type(field: MessageField) -> Any:
    """Bytes, as many as the range of a field says."""
    return Annotated[bytes, Meta(min_length=int(field.low), max_length=int(field.high))]


def vector_type(limit: float) -> Any:
    """Three numbers of magnitude up to the limit."""
    return tuple_type(*[number_type(-limit, limit)] * 3)


def covariance_type(limit: float) -> Any:
    """Three rows of three numbers of magnitude up to the limit, variances of zero or more on the diagonal."""
    var, cov = number_type(0.0, limit), number_type(-limit, limit)
    return tuple_type(tuple_type(var, cov, cov), tuple_type(cov, var, cov), tuple_type(cov, cov, var))


def names_type(values: Any) -> Any:
    """A few short names, each with a value."""
    return limited_type(DICT[TEXT, values], MAX_ARGUMENTS)


def stands_type(field: MessageField) -> Any:
    """Stands of the bit: epoch, begin, end and depth, the end not before the begin."""
    stand = defstruct(
        "StandOnWire",
        [
            ("epoch", Annotated[int, Meta(ge=0, le=MAX_EPOCH)]),
            ("begun_at", number_type(-LARGEST_TIME, LARGEST_TIME)),
            ("ended_at", number_type(-LARGEST_TIME, LARGEST_TIME)),
            ("md", number_type(field.low, field.high)),
        ],
        array_like=True,
        forbid_unknown_fields=True,
        namespace={"__post_init__": _check_stand},
    )
    return limited_type(tuple_type(stand, ...), MAX_STANDS)


def tuple_type(*kinds: Any) -> Any:
    """Type of a tuple of values of these types."""
    return TUPLE[kinds]


def limited_type(kind: Any, most: int, least: int = 0) -> Any:
    """Type of a collection of so many items."""
    return ANNOTATED[kind, Meta(min_length=least, max_length=most)]


def _check_stand(stand: Any) -> None:
    if stand.ended_at < stand.begun_at:
        raise ValueError(f"stands: expected an end after the begin {stand.begun_at}, got {stand.ended_at}")


def _check_order(reading: Any) -> None:
    """Stands come in the order of time, those of one epoch one after the other."""
    for before, after in pairwise(reading.stands):
        if before.epoch == after.epoch and after.begun_at < before.ended_at:
            raise ValueError(f"stands: expected one after the other, got {after.begun_at} in another")


TEXT = Annotated[str, Meta(max_length=MAX_TEXT)]
SCALAR: Any = None | bool | Annotated[int, Meta(ge=-(2**63), le=2**63 - 1)] | number_type() | TEXT
NUMBERS = limited_type(tuple_type(number_type(), ...), MAX_LIST)
IMU = defstruct(
    "ImuOnWire",
    [("force", vector_type(LARGEST_FORCE)), ("force_cov", covariance_type(LARGEST_COVARIANCE))],
    array_like=True,
    forbid_unknown_fields=True,
)
TYPES: dict[ValueKind, Callable[[MessageField], Any]] = {
    ValueKind.NUMBER: lambda field: number_type(field.low, field.high),
    ValueKind.INTEGER: integer_type,
    ValueKind.BOOLEAN: lambda _: bool,
    ValueKind.TEXT: lambda _: TEXT,
    ValueKind.BINARY: binary_type,
    ValueKind.VECTOR: lambda field: vector_type(field.high),
    ValueKind.COVARIANCE: lambda field: covariance_type(field.high),
    ValueKind.IMUS: lambda _: limited_type(tuple_type(IMU, ...), MAX_IMUS, least=1),
    ValueKind.SCALARS: lambda _: names_type(SCALAR),
    ValueKind.VALUES: lambda _: names_type(SCALAR | NUMBERS),
    ValueKind.STANDS: stands_type,
}
