"""One function a message that checks its fields and builds it, compiled from the schema.

Every process decodes each message it believes. What a loop over the fields would look up each time is written out here:
a value that is as the schema says takes a comparison, and anything else goes to its field's check, which converts it or
refuses it by name. Fields are checked in the order of the schema, so the first wrong one is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

from telemetry.presentation.fields import FieldCodec
from telemetry.quantities import ValueKind
from telemetry.schema import Field, MessageSpec

Reader = Callable[[dict[str, Any]], Any]  # message of its fields by their keys; raises ValueError
RIGHT = {
    ValueKind.NUMBER: "type({v}) is float and {low!r} <= {v} <= {high!r}",
    ValueKind.INTEGER: "type({v}) is int and {low!r} <= {v} <= {high!r}",
    ValueKind.BOOLEAN: "{v} is True or {v} is False",
    ValueKind.BINARY: "type({v}) is bytes and {low!r} <= len({v}) <= {high!r}",
}  # what needs no check


def reader_of(spec: MessageSpec, codecs: Sequence[FieldCodec], version: int) -> Reader:
    """Function from the fields of a payload of a schema version to its message; ``codecs`` are those of all fields.

    The first field that is missing or not as the schema says raises ValueError.
    """
    said = [k for k, codec in enumerate(codecs) if codec.since <= version]
    space: dict[str, Any] = {"inf": math.inf, "Message": spec.message, "Writable": writable(spec.message)}
    space |= {f"check{k}": codecs[k].check for k in said}
    space["keys"] = [codecs[k].key for k in said]
    lines = ["try:", *(f"    v{k} = body[{codecs[k].key!r}]" for k in said)]
    # what is missing is None, which no check lets pass
    lines += ["except KeyError:", f"    {' '.join(f'v{k},' for k in said)} = [body.get(key) for key in keys]"]
    lines += [line for k in said for line in checking(spec.fields[k], k)]
    for k in sorted(set(range(len(codecs))).difference(said)):
        before = codecs[k].before
        is_shared = codecs[k].default() is before  # a mutable one is copied for each message
        space[f"before{k}"] = before if is_shared else codecs[k].default
        lines.append(f"v{k} = before{k}{'' if is_shared else '()'}")
    lines += ["message = Writable()", *(f"message.{codec.name} = v{k}" for k, codec in enumerate(codecs))]
    lines += ["message.__class__ = Message", "return message"]
    source = "def read(body):\n" + "\n".join(f"    {line}" for line in lines)
    exec(compile(source, f"<reader of {spec.message.__name__}>", "exec"), space)
    reader: Reader = space["read"]
    return reader


def checking(field: Field, place: int) -> list[str]:
    """Lines that check the value of a field."""
    v = f"v{place}"
    check = f"{v} = check{place}({v})"
    if field.kind is ValueKind.VECTOR:
        within = " and ".join(f"{-field.high!r} <= {axis} <= {field.high!r}" for axis in "xyz")
        return [
            f"x, y, z = {v} if type({v}) is list and len({v}) == 3 else (None, None, None)",
            f"if type(x) is type(y) is type(z) is float and {within}:",
            f"    {v} = x, y, z",
            "else:",
            f"    {check}",
        ]
    right = None if field.enumeration else RIGHT.get(field.kind)
    if right is None:
        return [check]
    return [f"if not ({right.format(v=v, low=field.low, high=field.high)}):", f"    {check}"]


def writable(message: type[Any]) -> type[Any]:
    """Twin of a frozen message whose fields can be assigned.

    An instance becomes the message by ``__class__``, which Python allows between classes of the same slots. A frozen
    dataclass assigns each field by a call: for a state that takes six times as long.
    """
    return type(f"Writable{message.__name__}", (), {"__slots__": message.__slots__})
