"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

``telemetry.schema`` names every field, its short key and its range; encoding and decoding both check it. A relay reads
the envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any, NamedTuple

import msgpack

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import BASE, SCHEMA_VERSION, Message
from telemetry.presentation.compiled import (
    NO_TARGET,
    Lister,
    Picker,
    Reader,
    Writer,
    lister_of,
    picker_of,
    reader_of,
    writer_of,
)
from telemetry.presentation.fields import MAX_BINARY, codec_of
from telemetry.schema import SCHEMA, U53, Kind, MessageSpec
from telemetry.unwritten import Content, Unwritten

MAX_PAYLOAD = 4096
HIGHEST_ADDRESS = 255
DOWNWARD = (Kind.RECEIPT, Kind.COMMAND, Kind.BLOCK_SEGMENT, Kind.SESSION_OFFER)


class Opened(NamedTuple):
    """A payload whose envelope has been read, which is all that a relay needs; its fields have not been read yet.

    Of one that was never written there are the ``values`` of its fields, checked, and no ``rows``.
    """

    kind: Kind
    origin: int
    target: int
    sequence: int
    rows: dict[str, Any]
    values: list[Any] | None = None


class MessageCodec:
    """One message on the wire, made from its line of the schema; what every message needs is looked up here once."""

    def __init__(self, spec: MessageSpec) -> None:
        self._spec = spec
        self.readers: dict[int, Reader] = {}  # by schema version, compiled when a payload of it comes
        self._pickers: dict[int, Picker] = {}
        self.kind = spec.kind
        self.message = spec.message
        self.newest = spec.newest
        self.fields = tuple(codec_of(field) for field in spec.fields)
        sinces = [field.since for field in self.fields]
        names = [field.name for field in self.fields]
        self.tube_at = names.index("tube") if "tube" in names else None
        self.sequence_at = names.index("sequence") if "sequence" in names else None
        if sinces != sorted(sinces):
            raise ValueError(f"{spec.message.__name__}: expected fields of later schema versions after all others")

    @cached_property
    def values(self) -> Lister:
        """Function from a message to the values of its fields, checked."""
        return lister_of(self._spec, self.fields)

    def reader(self, version: int) -> Reader:
        """Make the function from the fields of a payload of a schema version to its message."""
        reader = self.readers[version] = reader_of(self._spec, self.fields, version)
        return reader

    def picker(self, version: int) -> Picker:
        """Function from the fields of a payload of a schema version to the values of all fields, unchecked."""
        picker = self._pickers.get(version)
        if picker is None:
            picker = self._pickers[version] = picker_of(self.fields, version)
        return picker

    @cached_property
    def pack(self) -> Writer:
        """Function from the values of all fields, which are checked, to the payload."""
        return writer_of(self._spec, self.fields, None if self.kind in DOWNWARD else BASE)


class UnwrittenMessage(Unwritten):
    """A message as the values of all its fields, checked; its payload is made when its bytes are needed."""

    __slots__ = ("_opened", "codec", "values")

    def __init__(self, codec: MessageCodec, values: list[Any]) -> None:
        self._written = None
        self._opened: Opened | None = None
        self.codec, self.values = codec, values

    @property
    def most(self) -> int:
        """Bytes that it takes at most."""
        return MAX_PAYLOAD

    @property
    def kind(self) -> Kind:
        """Kind of the message."""
        return self.codec.kind

    def opened(self) -> Opened:
        """What ``open_payload`` finds in its payload; worked out once for all the hops it goes over."""
        if self._opened is None:
            codec, values = self.codec, self.values
            origin = NO_TARGET if codec.tube_at is None else values[codec.tube_at]
            sequence = 0 if codec.sequence_at is None else values[codec.sequence_at]
            target = origin if codec.kind in DOWNWARD else BASE
            self._opened = Opened(codec.kind, origin, target, sequence, {}, values)
        return self._opened

    def _write(self) -> bytes:
        return self.codec.pack(self.values)


CODECS: dict[type[Any], MessageCodec] = {spec.message: MessageCodec(spec) for spec in SCHEMA}
CODEC_OF: dict[int, MessageCodec] = {int(codec.kind): codec for codec in CODECS.values()}


def _state_head(version: int) -> bytes:
    """First bytes of a node state, up to the key of its tube."""
    key = msgpack.packb("o")
    head, _, _ = msgpack.packb({"v": version, "k": int(Kind.NODE_STATE), "o": 0, "t": 0, "s": 0, "b": 0}).partition(key)
    return bytes(head + key)


STATE_HEADS = frozenset(map(_state_head, range(1, CODEC_OF[Kind.NODE_STATE].newest + 1)))
(STATE_HEAD,) = set(map(len, STATE_HEADS))
UINT8, HIGHEST_FIXINT = 0xCC, 0x7F  # of msgpack


def encode(message: Message) -> bytes:
    """Payload of a message, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    codec = CODECS[type(message)]
    return codec.pack(checked_values(codec, message))


def unwritten(message: Message) -> UnwrittenMessage:
    """Message as it will be written, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    codec = CODECS[type(message)]
    return UnwrittenMessage(codec, checked_values(codec, message))


def checked_values(codec: MessageCodec, message: Message) -> list[Any]:
    """Values of the fields of a message.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    try:
        return codec.values(message)
    except ValueError as error:
        raise EncodeError(f"{type(message).__name__}: {error}") from error


def decode(payload: Content) -> Message:
    """Message of a payload.

    Raises
    ------
    DecodeError
        Whatever else the bytes are.
    """
    return decode_opened(open_payload(payload))


def open_payload(payload: Content) -> Opened:
    """Payload with its envelope read and checked.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    if isinstance(payload, UnwrittenMessage):
        return payload.opened()
    rows = _unpack(payload)
    get = rows.get
    version, kind, origin, target, sequence = get("v"), get("k"), get("o"), get("t"), get("s")
    codec = CODEC_OF.get(kind) if type(kind) is int else None
    if (
        codec is not None
        and type(version) is type(origin) is type(target) is type(sequence) is int
        and 1 <= version <= codec.newest
        and 0 <= origin <= HIGHEST_ADDRESS
        and 0 <= target <= HIGHEST_ADDRESS
        and 0 <= sequence <= U53
    ):
        return Opened(codec.kind, origin, target, sequence, rows)
    raise _refusal(version, kind, origin, target, sequence)


def state_origin(payload: Content) -> int | None:
    """Tube of a node state, by the first bytes as we write them; None for anything else, which is to be opened.

    Nearly all that a relay sees are states, and those of a long string took it more time to read than all the rest.
    Whether what follows is as it must be is judged where it is read.
    """
    if type(payload) is bytes:
        if payload[:STATE_HEAD] not in STATE_HEADS or len(payload) < STATE_HEAD + 2:
            return None
        origin = payload[STATE_HEAD]
        if origin == UINT8:
            return payload[STATE_HEAD + 1]
        return origin if origin <= HIGHEST_FIXINT else None
    opened = payload.opened() if isinstance(payload, UnwrittenMessage) else None
    return opened.origin if opened is not None and opened.kind is Kind.NODE_STATE else None


def _refusal(version: Any, kind: Any, origin: Any, target: Any, sequence: Any) -> DecodeError:
    """What is wrong with an envelope: the first of its fields that is not as it must be."""
    if type(version) is not int or not 1 <= version <= SCHEMA_VERSION:
        return DecodeError(f"payload: expected schema version 1 to {SCHEMA_VERSION}, got {version!r:.40}")
    codec = CODEC_OF.get(kind) if type(kind) is int else None
    if codec is None:
        return DecodeError(f"payload: unknown kind {kind!r:.40}")
    if version > codec.newest:
        return DecodeError(f"payload: {codec.kind.name.lower()}: expected version {codec.newest}, got {version}")
    if type(origin) is not int or not 0 <= origin <= HIGHEST_ADDRESS:
        return _wrong_route("o", HIGHEST_ADDRESS, origin)
    if type(target) is not int or not 0 <= target <= HIGHEST_ADDRESS:
        return _wrong_route("t", HIGHEST_ADDRESS, target)
    return _wrong_route("s", U53, sequence)


def decode_opened(opened: Opened) -> Message:
    """Message of an opened payload.

    Raises
    ------
    DecodeError
        When a field is missing or outside its range.
    """
    codec = CODEC_OF[opened.kind]
    if opened.values is not None:
        said: Message = codec.message(*opened.values)
        return said
    rows = opened.rows
    body = rows.get("b")
    if type(body) is not dict:
        body = body_of(opened)
    try:
        version = rows["v"]
        read = codec.readers.get(version) or codec.reader(version)
        decoded: Message = read(body)
    except ValueError as error:
        raise DecodeError(f"{codec.message.__name__}: {error}") from error
    return decoded


def values_of_opened(opened: Opened) -> list[Any]:
    """Values of all fields of an opened payload, unchecked: None where one is missing.

    Raises
    ------
    DecodeError
        When there are no fields at all.
    """
    if opened.values is not None:
        return opened.values
    version, body, codec = opened.rows["v"], body_of(opened), CODEC_OF[opened.kind]
    try:
        return codec.picker(version)(body)
    except KeyError:
        return [body.get(f.key) if f.since <= version else f.default() for f in codec.fields]


def body_of(opened: Opened) -> dict[str, Any]:
    """Fields of an opened payload by their keys, unchecked.

    Raises
    ------
    DecodeError
        When there are no fields at all.
    """
    body = opened.rows.get("b")
    if not isinstance(body, dict):
        name = CODEC_OF[opened.kind].message.__name__
        raise DecodeError(f"{name}: expected a map of fields, got {body!r:.40}")
    return body


def _unpack(payload: Content) -> dict[str, Any]:
    if len(payload) > MAX_PAYLOAD:
        raise DecodeError(f"payload: expected at most {MAX_PAYLOAD} bytes, got {len(payload)}")
    try:
        rows = msgpack.unpackb(payload, max_str_len=MAX_PAYLOAD, max_bin_len=MAX_BINARY, max_ext_len=0)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise DecodeError(f"payload: not msgpack: {error}") from error
    if not isinstance(rows, dict):
        raise DecodeError(f"payload: expected a map, got {type(rows).__name__}")
    return rows


def _wrong_route(key: str, high: int, value: object) -> DecodeError:
    return DecodeError(f"payload: envelope field {key}: expected 0..{high}, got {value!r:.40}")
