"""Functions for the fields of one kind of message, compiled from the schema: for reading and for writing it.

Every process checks what it says and what it believes. What a loop over the fields would look up each time is written
out here: a value that is as the schema says takes a comparison, and anything else goes to its field's check, which
converts it or refuses it by name. Fields are checked in the order of the schema, so the first wrong one is named.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import msgpack

from telemetry.frozen import writable
from telemetry.presentation.fields import FieldCodec
from telemetry.quantities import ValueKind
from telemetry.schema import Field, MessageSpec

NO_TARGET = 255
Reader = Callable[[dict[str, Any]], Any]  # message of its fields by their keys; raises ValueError
Lister = Callable[[Any], list[Any]]  # values of the fields of a message; raises ValueError
Picker = Callable[[dict[str, Any]], list[Any]]  # values of all fields of a body, unchecked; raises KeyError
Writer = Callable[[Sequence[Any]], bytes]  # payload of the values of all fields, which are checked
RIGHT = {
    ValueKind.NUMBER: "type({v}) is float and {low!r} <= {v} <= {high!r}",
    ValueKind.INTEGER: "type({v}) is int and {low!r} <= {v} <= {high!r}",
    ValueKind.BOOLEAN: "{v} is True or {v} is False",
    ValueKind.BINARY: "type({v}) is bytes and {low!r} <= len({v}) <= {high!r}",
}  # what needs no check


def reader_of(spec: MessageSpec, codecs: Sequence[FieldCodec], version: int) -> Reader:
    """Function from the body of a payload of a schema version to its message; ``codecs`` are those of all fields.

    The first field that is missing or not as the schema says raises ValueError.
    """
    said = [k for k, codec in enumerate(codecs) if codec.since <= version]
    space: dict[str, Any] = {"Message": spec.message, "Writable": writable(spec.message)}
    space["keys"] = [codecs[k].key for k in said]
    lines = ["try:", *(f"    v{k} = given[{codecs[k].key!r}]" for k in said)]
    # what is missing is None, which no check lets pass
    lines += ["except KeyError:", f"    {' '.join(f'v{k},' for k in said)} = [given.get(key) for key in keys]"]
    lines += [line for k in said for line in checking(spec.fields[k], k, "list")]
    for k in sorted(set(range(len(codecs))).difference(said)):
        before = codecs[k].before
        is_shared = codecs[k].default() is before  # a mutable one is copied for each message
        space[f"before{k}"] = before if is_shared else codecs[k].default
        lines.append(f"v{k} = before{k}{'' if is_shared else '()'}")
    lines += ["message = Writable()", *(f"message.{codec.name} = v{k}" for k, codec in enumerate(codecs))]
    lines += ["message.__class__ = Message", "return message"]
    reader: Reader = compiled(lines, space, codecs)
    return reader


def lister_of(spec: MessageSpec, codecs: Sequence[FieldCodec]) -> Lister:
    """Function from a message to the values of its fields; the first one not as the schema says raises ValueError."""
    lines = []
    for k, field in enumerate(spec.fields):
        lines += [f"v{k} = given.{field.name}", *checking(field, k, "tuple")]
    lister: Lister = compiled([*lines, f"return [{', '.join(f'v{k}' for k in range(len(codecs)))}]"], {}, codecs)
    return lister


def picker_of(codecs: Sequence[FieldCodec], version: int) -> Picker:
    """Function from the body of a payload of a schema version to the values of all fields, unchecked."""
    space = {f"default{k}": codec.default for k, codec in enumerate(codecs) if codec.since > version}
    picked = [f"default{k}()" if codec.since > version else f"given[{codec.key!r}]" for k, codec in enumerate(codecs)]
    picker: Picker = compiled([f"return [{', '.join(picked)}]"], space, codecs)
    return picker


def writer_of(spec: MessageSpec, codecs: Sequence[FieldCodec], target: int | None) -> Writer:
    """Function from the values of all fields to the payload, in the earliest schema version that has them.

    The envelope names the tube and the number among them; ``target`` is who is addressed, or None for that tube.
    """
    space: dict[str, Any] = {"packb": msgpack.packb}
    places = range(len(codecs))
    lines = [f"{' '.join(f'v{k},' for k in places)} = given", "version = 1"]
    for k in places:
        if codecs[k].since > 1:
            space[f"before{k}"] = codecs[k].before
            lines += [f"if v{k} != before{k}:", f"    version = {codecs[k].since}"]
    for k in places:
        if codecs[k].pack is not None:
            space[f"pack{k}"] = codecs[k].pack
            lines.append(f"v{k} = pack{k}(v{k})")
    for version in range(1, spec.newest + 1):
        body = ", ".join(f"{codecs[k].key!r}: v{k}" for k in places if codecs[k].since <= version)
        lines += [f"if version == {version}:", f"    body = {{{body}}}"]
    place = {codec.name: f"v{k}" for k, codec in enumerate(codecs)}
    origin, sequence = place.get("tube", str(NO_TARGET)), place.get("sequence", "0")
    to = origin if target is None else str(target)
    rows = f"'v': version, 'k': {int(spec.kind)}, 'o': {origin}, 't': {to}, 's': {sequence}, 'b': body"
    writer: Writer = compiled([*lines, f"return packb({{{rows}}})"], space, codecs)
    return writer


def checking(field: Field, place: int, sequence: str) -> list[str]:
    """Lines that check the value of a field; ``sequence`` is the type that vectors come in."""
    v = f"v{place}"
    check = f"{v} = check{place}({v})"
    if field.kind is ValueKind.VECTOR:
        within = " and ".join(f"{-field.high!r} <= {axis} <= {field.high!r}" for axis in "xyz")
        return [
            f"x, y, z = {v} if type({v}) is {sequence} and len({v}) == 3 else (None, None, None)",
            f"if type(x) is type(y) is type(z) is float and {within}:",
            f"    {v} = x, y, z",
            "else:",
            f"    {check}",
        ]
    right = None if field.enumeration else RIGHT.get(field.kind)
    if right is None:
        return [check]
    return [f"if not ({right.format(v=v, low=field.low, high=field.high)}):", f"    {check}"]


def compiled(
    lines: list[str], space: dict[str, Any], codecs: Sequence[FieldCodec], arguments: str = "given"
) -> Callable[..., Any]:
    """Function of its lines, which may name ``arguments``, what is in ``space`` and the checks of all fields."""
    space |= {"inf": math.inf} | {f"check{k}": codec.check for k, codec in enumerate(codecs)}
    source = f"def function({arguments}):\n" + "\n".join(f"    {line}" for line in lines)
    exec(compile(source, "<compiled from the schema>", "exec"), space)
    function: Callable[..., Any] = space["function"]
    return function
