"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

``telemetry.schema`` names every field, its short key and its range; encoding and decoding both check it. A relay reads
the envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

from collections.abc import Callable
from operator import attrgetter
from typing import Any, NamedTuple

import msgpack

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import BASE, SCHEMA_VERSION, Message
from telemetry.presentation.fields import MAX_BINARY, codec_of
from telemetry.schema import SCHEMA, U53, Kind, MessageSpec

MAX_PAYLOAD = 4096
NO_TARGET = 255
HIGHEST_ADDRESS = 255
DOWNWARD = (Kind.RECEIPT, Kind.COMMAND, Kind.BLOCK_SEGMENT, Kind.SESSION_OFFER)


class Envelope(NamedTuple):
    """What a relay needs to know of a payload."""

    kind: Kind
    origin: int
    target: int
    sequence: int


class Opened(NamedTuple):
    """A payload whose envelope has been read, its fields not yet."""

    envelope: Envelope
    rows: dict[str, Any]


class MessageCodec:
    """One message on the wire, made from its line of the schema; what every message needs is looked up here once."""

    def __init__(self, spec: MessageSpec) -> None:
        self.kind = spec.kind
        self.message = spec.message
        self.newest = spec.newest
        self.fields = tuple(codec_of(field) for field in spec.fields)
        self.later = tuple(field for field in self.fields if field.since > 1)
        self.goes_down = spec.kind in DOWNWARD
        names = [field.name for field in self.fields]
        self.values: Callable[[Any], Any] = attrgetter(*names) if len(names) > 1 else lambda m: (getattr(m, names[0]),)
        self.origin = attrgetter("tube") if "tube" in names else lambda _message: NO_TARGET
        self.sequence = attrgetter("sequence") if "sequence" in names else lambda _message: 0

    def version_of(self, message: Message) -> int:
        """Earliest schema version that can express it."""
        version = 1
        for field in self.later:
            if field.since > version and getattr(message, field.name) != field.before:
                version = field.since
        return version


CODECS: dict[type[Any], MessageCodec] = {spec.message: MessageCodec(spec) for spec in SCHEMA}
CODEC_OF: dict[int, MessageCodec] = {int(codec.kind): codec for codec in CODECS.values()}


def encode(message: Message) -> bytes:
    """Payload of a message, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    codec = CODECS[type(message)]
    version = codec.version_of(message)
    try:
        body = {
            field.key: field.pack(field.check(value)) if field.pack is not None else field.check(value)
            for field, value in zip(codec.fields, codec.values(message), strict=True)
            if field.since <= version
        }
    except ValueError as error:
        raise EncodeError(f"{type(message).__name__}: {error}") from error
    origin = codec.origin(message)
    target = origin if codec.goes_down else BASE
    rows = {"v": version, "k": int(codec.kind), "o": origin, "t": target, "s": codec.sequence(message), "b": body}
    return bytes(msgpack.packb(rows))


def decode(payload: bytes) -> Message:
    """Message of a payload.

    Raises
    ------
    DecodeError
        Whatever else the bytes are.
    """
    return decode_opened(open_payload(payload))


def open_payload(payload: bytes) -> Opened:
    """Payload with its envelope read and checked.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    rows = _unpack(payload)
    return Opened(_envelope(rows), rows)


def decode_opened(opened: Opened) -> Message:
    """Message of an opened payload.

    Raises
    ------
    DecodeError
        When a field is missing or outside its range.
    """
    codec = CODEC_OF[opened.envelope.kind]
    body, version = opened.rows.get("b"), opened.rows["v"]
    if not isinstance(body, dict):
        raise DecodeError(f"{codec.message.__name__}: expected a map of fields, got {body!r:.40}")
    get = body.get
    try:
        values = [field.check(get(field.key)) if field.since <= version else field.default() for field in codec.fields]
    except ValueError as error:
        raise DecodeError(f"{codec.message.__name__}: {error}") from error
    decoded: Message = codec.message(*values)
    return decoded


def peek(payload: bytes) -> Envelope:
    """Envelope of a payload, its body unread.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    return open_payload(payload).envelope


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
    get = rows.get
    version, kind = get("v"), get("k")
    if type(version) is not int or not 1 <= version <= SCHEMA_VERSION:
        raise DecodeError(f"payload: expected schema version 1 to {SCHEMA_VERSION}, got {version!r:.40}")
    codec = CODEC_OF.get(kind) if type(kind) is int else None
    if codec is None:
        raise DecodeError(f"payload: unknown kind {kind!r:.40}")
    if version > codec.newest:
        raise DecodeError(f"payload: {codec.kind.name.lower()}: expected version {codec.newest}, got {version}")
    origin = _route(rows, "o", HIGHEST_ADDRESS)
    return Envelope(codec.kind, origin, _route(rows, "t", HIGHEST_ADDRESS), _route(rows, "s", U53))


def _route(rows: dict[str, Any], key: str, high: int) -> int:
    value = rows.get(key)
    if type(value) is not int or not 0 <= value <= high:
        raise DecodeError(f"payload: envelope field {key}: expected 0..{high}, got {value!r:.40}")
    return value
