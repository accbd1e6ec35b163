"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

``telemetry.schema`` names every field, its short key and its range; encoding and decoding both check it. A relay reads
the envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

from typing import Annotated, Generic, TypeAlias, TypeVar

from msgspec import Meta, Raw, Struct
from msgspec.msgpack import Decoder, Encoder

from telemetry.errors import DecodeError
from telemetry.messages import BASE, SCHEMA_VERSION, Message
from telemetry.presentation.message_codec import CODEC_OF, CODECS, REFUSED, MessageCodec, Values, name_refusal
from telemetry.schema import U53, MessageKind
from telemetry.unwritten import Content, Unwritten

MAX_PAYLOAD = 4096
HIGHEST_ADDRESS = 255
NO_TARGET = 255
DOWNWARD = (MessageKind.RECEIPT, MessageKind.COMMAND, MessageKind.BLOCK_SEGMENT, MessageKind.SESSION_OFFER)
KEYS = {"version": "v", "kind": "k", "origin": "o", "target": "t", "sequence": "s", "body": "b"}
NAMES = {key: name for name, key in KEYS.items()}
Address: TypeAlias = Annotated[int, Meta(ge=0, le=HIGHEST_ADDRESS)]
Body = TypeVar("Body")


class Envelope(Struct, Generic[Body], rename=KEYS):
    """Envelope of a payload, which is all that a relay needs.

    Its body is not read yet; that of a payload which was never written is the values of all fields, checked.
    """

    version: Annotated[int, Meta(ge=1, le=SCHEMA_VERSION)]
    kind: MessageKind
    origin: Address
    target: Address
    sequence: Annotated[int, Meta(ge=0, le=U53)]
    body: Body


Opened: TypeAlias = Envelope[Raw] | Envelope[Values]
ENVELOPES, ENCODER = Decoder(Envelope[Raw]), Encoder()


class UnwrittenMessage(Unwritten):
    """A message as the values of all its fields, checked; its payload is made when its bytes are needed."""

    __slots__ = ("_opened", "codec", "values")

    def __init__(self, codec: MessageCodec, values: Values) -> None:
        self._written = None
        self._opened: Envelope[Values] | None = None
        self.codec, self.values = codec, values

    @property
    def most(self) -> int:
        """Bytes that it takes at most."""
        return MAX_PAYLOAD

    @property
    def kind(self) -> MessageKind:
        """Kind of the message."""
        return self.codec.kind

    def opened(self) -> Envelope[Values]:
        """What ``open_payload`` finds in its payload; worked out once for all the hops it goes over."""
        if self._opened is None:
            self._opened = envelope_of(self.codec, self.codec.newest, self.values, self.values)
        return self._opened

    def _write(self) -> bytes:
        return write_payload(self.codec, self.values)


def encode_message(message: Message) -> bytes:
    """Payload of a message, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    codec = CODECS[type(message)]
    return write_payload(codec, codec.values_of(message))


def unwritten_message(message: Message) -> UnwrittenMessage:
    """Message as it will be written, in the earliest schema version that can express it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    codec = CODECS[type(message)]
    return UnwrittenMessage(codec, codec.values_of(message))


def envelope_of(codec: MessageCodec, version: int, values: Values, body: Body) -> Envelope[Body]:
    """Body in its envelope; the tube and the number of the message are among its ``values``."""
    origin = NO_TARGET if codec.tube_at is None else values[codec.tube_at]
    sequence = 0 if codec.sequence_at is None else values[codec.sequence_at]
    target = origin if codec.kind in DOWNWARD else BASE
    return Envelope(version, codec.kind, origin, target, sequence, body)


def write_payload(codec: MessageCodec, values: Values) -> bytes:
    """Payload of the values of all fields of a message, which are checked, in the earliest schema version."""
    version, body = codec.body_of(values)
    return ENCODER.encode(envelope_of(codec, version, values, body))


def decode_message(payload: Content) -> Message:
    """Message of a payload.

    Raises
    ------
    DecodeError
        Whatever else the bytes are.
    """
    return decode_opened(open_payload(payload))


def open_payload(payload: Content) -> Opened:
    """Payload with its envelope read and checked; of its body, that it is msgpack and ends where the payload does.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    if type(payload) is UnwrittenMessage:
        return payload.opened()
    if len(payload) > MAX_PAYLOAD:
        raise DecodeError(f"payload: expected at most {MAX_PAYLOAD} bytes, got {len(payload)}")
    try:
        opened = ENVELOPES.decode(bytes(payload))
    except REFUSED as error:
        raise DecodeError(f"payload: {name_refusal(error, NAMES)}") from error
    newest = CODEC_OF[opened.kind].newest
    if opened.version > newest:
        raise DecodeError(f"payload: {opened.kind.name.lower()}: expected version {newest}, got {opened.version}")
    return opened


def decode_opened(opened: Opened) -> Message:
    """Message of an opened payload.

    Raises
    ------
    DecodeError
        When a field is missing or outside its range.
    """
    return CODEC_OF[opened.kind].message_of(values_of_opened(opened))


def values_of_opened(opened: Opened) -> Values:
    """Values of all fields of an opened payload.

    Raises
    ------
    DecodeError
        When a field is missing or outside its range.
    """
    body = opened.body
    return CODEC_OF[opened.kind].read(opened.version, body) if isinstance(body, Raw) else body


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
    return opened.origin if opened is not None and opened.kind is MessageKind.NODE_STATE else None


def _state_head(version: int) -> bytes:
    """First bytes of a node state, up to the key of its tube."""
    key = ENCODER.encode(KEYS["origin"])
    head, _, _ = ENCODER.encode(Envelope(version, MessageKind.NODE_STATE, 0, 0, 0, {})).partition(key)
    return head + key


STATE_HEADS = frozenset(map(_state_head, range(1, CODEC_OF[MessageKind.NODE_STATE].newest + 1)))
(STATE_HEAD,) = set(map(len, STATE_HEADS))
UINT8, HIGHEST_FIXINT = 0xCC, 0x7F  # of msgpack
