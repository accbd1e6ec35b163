"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

``telemetry.schema`` names every field, its short key and its range; encoding and decoding both check it. A relay reads
the envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import msgpack

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import BASE, SCHEMA_VERSION, Message
from telemetry.presentation.fields import MAX_BINARY, FieldCodec, codec_of
from telemetry.schema import SCHEMA, U53, Kind

MAX_PAYLOAD = 4096
NO_TARGET = 255


@dataclass(frozen=True, slots=True)
class Envelope:
    """What a relay needs to know of a payload."""

    kind: Kind
    origin: int
    target: int
    sequence: int


FIELDS: dict[type[Any], tuple[Kind, tuple[FieldCodec, ...]]] = {
    spec.message: (spec.kind, tuple(codec_of(field) for field in spec.fields)) for spec in SCHEMA
}
TYPE_OF: dict[Kind, tuple[type[Any], tuple[FieldCodec, ...]]] = {
    kind: (message, fields) for message, (kind, fields) in FIELDS.items()
}
NEWEST: dict[Kind, int] = {spec.kind: spec.newest for spec in SCHEMA}
DOWNWARD = (Kind.RECEIPT, Kind.COMMAND, Kind.BLOCK_SEGMENT)


def encode(message: Message) -> bytes:
    """Payload of a message, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    kind, fields = FIELDS[type(message)]
    body: dict[str, Any] = {}
    needed = (field.since for field in fields if field.since > 1 and getattr(message, field.name) != field.before)
    version = max(needed, default=1)
    try:
        for field in fields:
            if field.since <= version:
                body[field.key] = field.pack(field.check(getattr(message, field.name)))
    except ValueError as error:
        raise EncodeError(f"{type(message).__name__}: {error}") from error
    origin = getattr(message, "tube", NO_TARGET)
    target = origin if kind in DOWNWARD else BASE
    envelope = {"v": version, "k": int(kind), "o": origin, "t": target, "s": getattr(message, "sequence", 0)}
    return bytes(msgpack.packb(envelope | {"b": body}))


def decode(payload: bytes) -> Message:
    """Message of a payload.

    Raises
    ------
    DecodeError
        Whatever else the bytes are.
    """
    rows = _unpack(payload)
    kind = _envelope(rows).kind
    message, fields = TYPE_OF[kind]
    body = rows.get("b")
    if not isinstance(body, dict):
        raise DecodeError(f"{message.__name__}: expected a map of fields, got {body!r:.40}")
    try:
        values = {
            field.name: field.check(body.get(field.key)) if field.since <= rows["v"] else field.default()
            for field in fields
        }
    except ValueError as error:
        raise DecodeError(f"{message.__name__}: {error}") from error
    decoded: Message = message(**values)
    return decoded


def peek(payload: bytes) -> Envelope:
    """Envelope of a payload, its body unread.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    return _envelope(_unpack(payload))


def _unpack(payload: bytes) -> dict[str, Any]:
    if len(payload) > MAX_PAYLOAD:
        raise DecodeError(f"payload: expected at most {MAX_PAYLOAD} bytes, got {len(payload)}")
    try:
        rows = msgpack.unpackb(payload, max_str_len=MAX_PAYLOAD, max_bin_len=MAX_BINARY, max_ext_len=0)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise DecodeError(f"payload: not msgpack: {error}") from error
    if not isinstance(rows, dict):
        raise DecodeError(f"payload: expected a map, got {type(rows).__name__}")
    return rows


def _envelope(rows: dict[str, Any]) -> Envelope:
    version, kind = rows.get("v"), rows.get("k")
    if type(version) is not int or not 1 <= version <= SCHEMA_VERSION:
        raise DecodeError(f"payload: expected schema version 1 to {SCHEMA_VERSION}, got {version!r:.40}")
    if type(kind) is not int or kind not in TYPE_OF:
        raise DecodeError(f"payload: unknown kind {kind!r:.40}")
    if version > NEWEST[Kind(kind)]:
        raise DecodeError(f"payload: {Kind(kind).name.lower()}: expected version {NEWEST[Kind(kind)]}, got {version}")
    route = []
    for key, high in (("o", 255), ("t", 255), ("s", U53)):
        value = rows.get(key)
        if type(value) is not int or not 0 <= value <= high:
            raise DecodeError(f"payload: envelope field {key}: expected 0..{high}, got {value!r:.40}")
        route.append(value)
    return Envelope(Kind(kind), route[0], route[1], route[2])
