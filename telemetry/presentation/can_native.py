"""The native profile of CAN: cyclic messages leave the link's frame and travel as signals.

What the link's header says beside them is known at the other end or told by the frames that carry something which must
not be lost: these go by ISO-TP, and so does the header alone where it acknowledges something new. A message that no
signal can express goes by ISO-TP as well, so nothing is lost by the profile but what rounding takes.
"""

from __future__ import annotations

import math

from telemetry.errors import DecodeError, EncodeError
from telemetry.media.can_identifier import packed_identifier
from telemetry.media.can_profile import NativePart, Split
from telemetry.media.port import Priority
from telemetry.messages import Message
from telemetry.presentation.can_forms import FD_PART
from telemetry.presentation.can_messages import NATIVE
from telemetry.presentation.can_signals import COUNT
from telemetry.presentation.message_codec import CODEC_OF
from telemetry.presentation.msgpack_codec import (
    HIGHEST_ADDRESS,
    UnwrittenMessage,
    open_payload,
    values_of_opened,
    write_payload,
)
from telemetry.schema import SPEC_OF, MessageKind
from telemetry.transport.hop import NOT_TOLD, Header, LinkFrame, pack_frame, parse_frame
from telemetry.unwritten import Content

PRIORITIES = {
    MessageKind.TIME_REQUEST: Priority.TIME,
    MessageKind.TIME_REPLY: Priority.TIME,
    MessageKind.AIDING: Priority.AIDING,
    MessageKind.HELLO: Priority.HELLO,
    MessageKind.NODE_STATE: Priority.STATE,
}
HEADER_EVERY = 2.0  # s, after which an end that has lost it, or started anew, is told again
BY_TYPE = {int(kind): native for kind, native in NATIVE.items()}
HEADS = {
    kind: tuple(
        [packed_identifier(PRIORITIES[kind], int(kind), 0, layout.part) for layout in native.form(fd=fd).layouts]
        for fd in (False, True)
    )
    for kind, native in NATIVE.items()
}  # identifiers of the frames but for who sends them, on classic CAN and on CAN FD
HALF = (COUNT.largest + 1) // 2


class NativeProfile:
    """Both directions of one end, see ``telemetry.media.can_profile.Profile``."""

    def __init__(self) -> None:
        self._told: Header | None = None  # the newest header that went by ISO-TP
        self._told_at = -math.inf  # s
        self._epoch: dict[int, int] = {}  # of each sender
        self._count: dict[int, int] = {}  # of its frames so far
        self._parts: dict[int, dict[int, bytes]] = {}  # by type: parts of the message that is coming in

    def split(self, content: Content, now: float, *, fd: bool) -> Split:
        """Parts of a frame of the link that is to be sent at ``now`` (s)."""
        parsed = parse_frame(content)
        if parsed is None:
            return Split([], bytes(content))
        header, entries = parsed
        parts: list[NativePart] = []
        rest: list[tuple[int, bytes]] = []
        for number, payload in entries:
            frames = native_parts(payload, header.number, fd=fd) if number == 0 else None
            if frames is None:
                rest.append((number, bytes(payload)))
            else:
                parts += frames
        # an acknowledgement alone is said again because the one before was not heard
        if parts and not rest and not self._is_news(header, now):
            return Split(parts, None)
        self._told, self._told_at = header, now
        return Split(parts, pack_frame(header, rest))

    def join(self, source: int, type_: int, part: int, data: bytes) -> Content | None:
        """Frame of the link that a part which arrived completes, or None while others are missing.

        Raises
        ------
        DecodeError
            When it is none of a known form, or its values are outside their ranges.
        """
        message = BY_TYPE.get(type_)
        if message is None:
            raise DecodeError("unknown_identifier")
        if not data:
            raise DecodeError("bad_length")
        is_fd = part == FD_PART
        frames = [data] if is_fd else self._collect(type_, part, data, len(message.classic.layouts))
        if frames is None:
            return None
        values = message.unpack(frames, fd=is_fd)
        epoch = self._epoch.get(source, NOT_TOLD)  # signals are heard before the first header
        newest = self._count.get(source, 0)
        number = newest + (data[0] - newest + HALF & COUNT.largest) - HALF  # urgent frames come before older ones
        self._count[source] = max(newest, number)
        header = Header(source, epoch, max(number, 1), 0, 0, 0)
        return LinkFrame(header, [(0, UnwrittenMessage(CODEC_OF[type_], values))])

    def observe(self, payload: bytes) -> None:
        """See a frame of the link that came by ISO-TP: who sends in which boot and session, and how many so far.

        A sender that no identifier can name sends no signals, and is not remembered.
        """
        parsed = parse_frame(payload)
        if parsed is not None and parsed[0].sender <= HIGHEST_ADDRESS:
            header = parsed[0]
            if self._epoch.get(header.sender) != header.epoch:
                self._epoch[header.sender], self._count[header.sender] = header.epoch, 0
            self._count[header.sender] = max(self._count[header.sender], header.number)

    def _is_news(self, header: Header, now: float) -> bool:
        """Whether the other end has to see the header; now and then it has to anyway, since one may be lost."""
        told = self._told
        if told is None or now - self._told_at >= HEADER_EVERY:
            return True
        return header[3:] != told[3:] or header[:2] != told[:2]

    def _collect(self, type_: int, part: int, data: bytes, needed: int) -> list[bytes] | None:
        """All parts of a message in order once they are there; those of another count are forgotten."""
        if part >= needed:
            raise DecodeError("unknown_identifier")
        parts = self._parts.setdefault(type_, {})
        if any(other[0] != data[0] for other in parts.values()):
            parts.clear()
        parts[part] = data
        if len(parts) < needed:
            return None
        del self._parts[type_]
        return [parts[k] for k in range(needed)]


def native_parts(payload: Content, count: int, *, fd: bool) -> list[NativePart] | None:
    """Frames of a cyclic message; None for one that only the tunnel carries."""
    try:
        said = payload if isinstance(payload, UnwrittenMessage) else open_payload(payload)
        native = NATIVE.get(said.kind)
        if native is None:
            return None
        values = said.values if isinstance(said, UnwrittenMessage) else values_of_opened(said)
        frames = native.pack(values, count, fd=fd)
    except (DecodeError, EncodeError):
        return None
    return list(map(NativePart, HEADS[native.kind][fd], frames))


def rounded_message(message: Message) -> Message:
    """What arrives of a message: itself, its values on the steps of their signals."""
    native = NATIVE.get(SPEC_OF[type(message)].kind)
    if native is None:
        return message
    return native.message_of(native.raws_of(message))


def rounded_frame(frame: Content) -> bytes:
    """A frame of the link whose cyclic messages are as they would arrive."""
    parsed = parse_frame(frame)
    if parsed is None:
        return bytes(frame)
    header, entries = parsed
    return pack_frame(header, [(number, _rounded_payload(bytes(content))) for number, content in entries])


def _rounded_payload(payload: bytes) -> bytes:
    try:
        opened = open_payload(payload)
        native = NATIVE.get(opened.kind)
        if native is None:
            return payload
        values = native.values_of(native.raws_of_values(values_of_opened(opened)))
        return write_payload(CODEC_OF[native.kind], values)
    except (DecodeError, EncodeError):
        return payload


def open_profile() -> NativeProfile:
    """Profile of one end."""
    return NativeProfile()
