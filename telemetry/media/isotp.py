"""ISO-TP (ISO 15765-2) as pure state machines: payloads in frames of 8 or 64 bytes, over classic CAN and CAN FD.

A sender hands out one frame at a time, so that its caller can let an urgent frame go between two of a long
payload. Normal addressing: the identifier says whose transfer it is. One departure: a single frame may be empty.
"""

from __future__ import annotations

from enum import IntEnum

from telemetry.errors import MediumError
from telemetry.media.can_timing import CLASSIC_LARGEST, fd_length

SINGLE, FIRST, CONSECUTIVE, FLOW = 0, 1, 2, 3  # type of a frame, high half of its first byte
SHORT_LIMIT = 4095  # bytes, longest payload whose length fits the short first frame
BLOCK = 32  # frames that a receiver takes before it is asked again; bounds what waits in its controller
PADDING = 0xCC


class FlowStatus(IntEnum):
    """Answer of a receiver."""

    CONTINUE = 0
    WAIT = 1
    OVERFLOW = 2


class TransferError(MediumError):
    """A transfer failed; the message is the name under which it is counted."""


class Sender:
    """One payload on its way out.

    Parameters
    ----------
    payload : bytes, may be empty
    largest : bytes of data in a frame, 8 or 64
    """

    def __init__(self, payload: bytes, largest: int) -> None:
        self._payload, self._largest = payload, largest
        self._sent = 0
        self._sequence = 0
        self._allowed: int | None = 1  # frames until the receiver is waited for, None: all
        self.is_done = False

    @property
    def awaits_flow(self) -> bool:
        """Whether the receiver must answer first."""
        return self._allowed == 0

    def next_frame(self) -> bytes:
        """Return data of the next frame; not while it awaits flow control, nor when it is done."""
        if self._sent:
            frame = self._consecutive()
        elif (single := self._single()) is not None:
            frame, self._sent = single, len(self._payload)
        else:
            frame = self._first()
        if self._allowed is not None:
            self._allowed -= 1
        self.is_done = self._sent >= len(self._payload)
        return padded_frame(frame, self._largest)

    def on_flow(self, data: bytes) -> None:
        """Take the receiver's flow control.

        Raises
        ------
        TransferError
            When it refuses, or the answer is none.
        """
        status = data[0] & 0x0F
        if len(data) < 3 or status > FlowStatus.OVERFLOW:
            raise TransferError("bad_flow_control")
        if status == FlowStatus.OVERFLOW:
            raise TransferError("refused")
        if status == FlowStatus.CONTINUE and self.awaits_flow:
            self._allowed = data[1] or None

    def _single(self) -> bytes | None:
        length = len(self._payload)
        if length < CLASSIC_LARGEST:
            return bytes([SINGLE << 4 | length]) + self._payload
        if self._largest > CLASSIC_LARGEST and length <= self._largest - 2:
            return bytes([SINGLE << 4, length]) + self._payload
        return None

    def _first(self) -> bytes:
        length = len(self._payload)
        if length <= SHORT_LIMIT:
            head = (FIRST << 12 | length).to_bytes(2)
        else:
            head = (FIRST << 12).to_bytes(2) + length.to_bytes(4)
        self._sent = self._largest - len(head)
        return head + self._payload[: self._sent]

    def _consecutive(self) -> bytes:
        self._sequence = (self._sequence + 1) & 0x0F
        part = self._payload[self._sent : self._sent + self._largest - 1]
        self._sent += len(part)
        return bytes([CONSECUTIVE << 4 | self._sequence]) + part


class Receiver:
    """One payload on its way in, of one sender.

    Parameters
    ----------
    limit : bytes of the largest payload that is taken
    """

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._length = 0  # 0: no transfer is open
        self._parts = bytearray()
        self._sequence = 0
        self._until_flow = 0
        self.flow: bytes | None = None  # answer to send, for the caller to take away

    @property
    def is_open(self) -> bool:
        """Whether a payload has begun."""
        return self._length > 0

    def abandon(self) -> None:
        """Forget the payload that has begun."""
        self._length = 0
        self._parts.clear()

    def on_frame(self, data: bytes) -> bytes | None:
        """Take a frame; returns the payload it completes.

        Raises
        ------
        TransferError
            When the frame is malformed, or belongs to no payload that has begun.
        """
        if not data:
            raise TransferError("bad_length")
        kind = data[0] >> 4
        if kind == SINGLE:
            return self._on_single(data)
        if kind == CONSECUTIVE:
            return self._on_consecutive(data)
        if kind != FIRST:
            raise TransferError("bad_type")
        self._on_first(data)
        return None

    def _on_single(self, data: bytes) -> bytes:
        self.abandon()
        length, begin = data[0] & 0x0F, 1
        if length == 0 and len(data) > 1:
            length, begin = data[1], 2
        if length > len(data) - begin:
            raise TransferError("bad_length")
        return data[begin : begin + length]

    def _on_first(self, data: bytes) -> None:
        interrupted = self.is_open
        self.abandon()
        if len(data) < CLASSIC_LARGEST:
            raise TransferError("bad_length")
        length, begin = int.from_bytes(data[:2]) & 0x0FFF, 2
        if length == 0:
            length, begin = int.from_bytes(data[2:6]), 6
        if length <= len(data) - begin:
            raise TransferError("bad_length")
        if length > self._limit:
            self.flow = flow_control(FlowStatus.OVERFLOW)
            raise TransferError("too_long")
        self._length, self._sequence = length, 0
        self._parts += data[begin:]
        self._ask()
        if interrupted:
            raise TransferError("interrupted")

    def _on_consecutive(self, data: bytes) -> bytes | None:
        if not self.is_open:
            raise TransferError("unexpected")
        self._sequence = (self._sequence + 1) & 0x0F
        if data[0] & 0x0F != self._sequence:
            self.abandon()
            raise TransferError("out_of_order")
        missing = self._length - len(self._parts)
        if len(data) < 2:
            self.abandon()
            raise TransferError("bad_length")
        self._parts += data[1 : 1 + missing]
        if len(self._parts) == self._length:
            payload = bytes(self._parts)
            self.abandon()
            return payload
        self._until_flow -= 1
        if self._until_flow == 0:
            self._ask()
        return None

    def _ask(self) -> None:
        self._until_flow = BLOCK
        self.flow = flow_control(FlowStatus.CONTINUE, BLOCK)


def flow_control(status: FlowStatus, block: int = 0) -> bytes:
    """Answer of a receiver: ``block`` frames may follow, 0 for all, without a pause between them."""
    return bytes([FLOW << 4 | status, block, 0])


def padded_frame(frame: bytes, largest: int) -> bytes:
    """Frame filled up to a length that CAN FD has; classic frames have every length."""
    if largest <= CLASSIC_LARGEST or len(frame) <= CLASSIC_LARGEST:
        return frame
    return frame.ljust(fd_length(len(frame)), bytes([PADDING]))


def frame_lengths(length: int, largest: int) -> list[int]:
    """Bytes of data in each frame of a payload, the receiver's answers included at their place."""
    sender, receiver, lengths = Sender(bytes(length), largest), Receiver(max(length, 1)), []
    while not sender.is_done:
        frame = sender.next_frame()
        lengths.append(len(frame))
        receiver.on_frame(frame)
        if receiver.flow is not None:
            lengths.append(len(receiver.flow))
            if sender.awaits_flow:
                sender.on_flow(receiver.flow)
            receiver.flow = None
    return lengths
