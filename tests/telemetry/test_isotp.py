"""ISO-TP: every payload over both kinds of frame, beside an independent implementation, and whatever garbage comes."""

from __future__ import annotations

from collections import deque

import isotp
import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.media.can_timing import FD_LENGTHS
from telemetry.media.isotp import BLOCK, FlowStatus, Receiver, Sender, TransferError, flow_control, frame_lengths

LARGEST = [8, 64]
LIMIT = 16384


def carry(payload: bytes, largest: int) -> tuple[bytes | None, list[bytes]]:
    """What arrives of a payload, and the frames that its sender sent."""
    sender, receiver, frames, arrived = Sender(payload, largest), Receiver(LIMIT), [], None
    while not sender.is_done:
        assert not sender.awaits_flow
        frames.append(sender.next_frame())
        arrived = receiver.on_frame(frames[-1])
        if receiver.flow is not None:
            sender.on_flow(receiver.flow)
            receiver.flow = None
    return arrived, frames


@given(st.binary(max_size=5000), st.sampled_from(LARGEST))
def test_every_payload_arrives_in_frames_of_the_bus(payload: bytes, largest: int) -> None:
    arrived, frames = carry(payload, largest)
    assert arrived == payload
    assert all(len(frame) <= largest and len(frame) in FD_LENGTHS for frame in frames)


@pytest.mark.parametrize("largest", LARGEST)
@pytest.mark.parametrize("length", [0, 1, 7, 8, 62, 63, 4095, 4096, LIMIT])
def test_payloads_at_the_edges_of_the_lengths(length: int, largest: int) -> None:
    payload = bytes(k % 251 for k in range(length))
    assert carry(payload, largest)[0] == payload


@pytest.mark.parametrize(
    ("length", "classic", "fd"),
    # the table of the telemetry specification, section 4: payloads as they were measured there
    [(112, 17, 2), (43, 7, 1), (197, 29, 4), (211, 31, 4), (553, 80, 9), (1923, 275, 31), (25, 4, 1), (310, 45, 5)],
)
def test_a_payload_takes_as_many_frames_as_its_length_says(length: int, classic: int, fd: int) -> None:
    for largest, frames in ((8, classic), (64, fd)):
        sent = carry(bytes(length), largest)[1]
        assert len(sent) == frames
        answers = 0 if frames == 1 else 1 + (frames - 2) // BLOCK
        assert len(frame_lengths(length, largest)) == frames + answers


class Peer:
    """can-isotp's transport layer, its frames in plain queues."""

    def __init__(self, largest: int) -> None:
        self.out: deque[bytes] = deque()
        self.inward: deque[bytes] = deque()
        address = isotp.Address(isotp.AddressingMode.Normal_29bits, rxid=1, txid=2)
        options = {"tx_data_length": largest, "can_fd": largest > 8, "blocksize": 8, "stmin": 0}
        self.layer = isotp.TransportLayerLogic(self._receive, self._send, address, params=options)

    def _receive(self, _timeout: float) -> isotp.CanMessage | None:
        if not self.inward:
            return None
        return isotp.CanMessage(arbitration_id=1, data=bytearray(self.inward.popleft()), extended_id=True)

    def _send(self, message: isotp.CanMessage) -> None:
        self.out.append(bytes(message.data))


@pytest.mark.parametrize("largest", LARGEST)
@given(st.binary(min_size=1, max_size=600))
def test_an_independent_receiver_takes_what_we_send(largest: int, payload: bytes) -> None:
    peer, sender = Peer(largest), Sender(payload, largest)
    while not sender.is_done:
        if not sender.awaits_flow:
            peer.inward.append(sender.next_frame())
        peer.layer.process()
        while peer.out:
            sender.on_flow(peer.out.popleft())
    peer.layer.process()
    assert peer.layer.recv() == payload


@pytest.mark.parametrize("largest", LARGEST)
@given(st.binary(min_size=1, max_size=600))
def test_we_take_what_an_independent_sender_sends(largest: int, payload: bytes) -> None:
    peer, receiver, arrived = Peer(largest), Receiver(LIMIT), None
    peer.layer.send(payload)
    for _ in range(1000):
        peer.layer.process()
        while peer.out:
            arrived = receiver.on_frame(peer.out.popleft())
            if receiver.flow is not None:
                peer.inward.append(receiver.flow)
                receiver.flow = None
        if arrived is not None:
            break
    assert arrived == payload


def test_a_receiver_asks_after_every_block() -> None:
    sent = carry(bytes(7 * 100), 8)[1]
    assert len(frame_lengths(700, 8)) == len(sent) + 1 + (len(sent) - 2) // BLOCK


@pytest.mark.parametrize(
    ("data", "name"),
    [
        (b"", "bad_length"),
        (b"\x07abc", "bad_length"),
        (b"\x00\x3f" + bytes(20), "bad_length"),
        (b"\x10\x64", "bad_length"),
        (b"\x10\x03" + bytes(6), "bad_length"),
        (b"\x10\x00\xff\xff\xff\xff\x00\x00", "too_long"),
        (b"\x21abc", "unexpected"),
        (b"\x40", "bad_type"),
        (b"\x30\x00\x00", "bad_type"),
    ],
)
def test_garbage_is_refused_by_name(data: bytes, name: str) -> None:
    with pytest.raises(TransferError, match=f"^{name}$"):
        Receiver(LIMIT).on_frame(data)


def test_a_lost_frame_ends_the_payload_and_the_next_one_arrives() -> None:
    sender, receiver = Sender(bytes(100), 8), Receiver(LIMIT)
    receiver.on_frame(sender.next_frame())
    sender.on_flow(receiver.flow or b"")
    sender.next_frame()
    with pytest.raises(TransferError, match="out_of_order"):
        receiver.on_frame(sender.next_frame())
    with pytest.raises(TransferError, match="unexpected"):
        receiver.on_frame(sender.next_frame())
    assert receiver.on_frame(b"\x02ok") == b"ok"


def test_a_payload_that_begins_anew_interrupts_the_one_before() -> None:
    receiver = Receiver(LIMIT)
    receiver.on_frame(Sender(bytes(100), 8).next_frame())
    with pytest.raises(TransferError, match="interrupted"):
        receiver.on_frame(Sender(bytes(50), 8).next_frame())
    assert receiver.is_open


def test_a_payload_too_long_is_refused_to_its_sender() -> None:
    sender, receiver = Sender(bytes(200), 8), Receiver(100)
    with pytest.raises(TransferError, match="too_long"):
        receiver.on_frame(sender.next_frame())
    assert receiver.flow == flow_control(FlowStatus.OVERFLOW)
    with pytest.raises(TransferError, match="refused"):
        sender.on_flow(receiver.flow)


def test_a_receiver_that_asks_to_wait_is_waited_for() -> None:
    sender = Sender(bytes(100), 8)
    sender.next_frame()
    sender.on_flow(flow_control(FlowStatus.WAIT))
    assert sender.awaits_flow
    sender.on_flow(flow_control(FlowStatus.CONTINUE))
    assert not sender.awaits_flow


@pytest.mark.parametrize("data", [b"\x30", b"\x33\x00\x00", b"\x3f\x01\x00"])
def test_an_answer_that_is_none_ends_the_transfer(data: bytes) -> None:
    sender = Sender(bytes(100), 8)
    sender.next_frame()
    with pytest.raises(TransferError, match="bad_flow_control"):
        sender.on_flow(data)


@given(st.lists(st.binary(max_size=64), max_size=50))
def test_whatever_comes_a_receiver_names_it_and_holds_no_more_than_its_limit(frames: list[bytes]) -> None:
    receiver = Receiver(500)
    for frame in frames:
        try:
            payload = receiver.on_frame(frame)
        except TransferError:
            continue
        assert payload is None or len(payload) <= 500
    assert len(receiver._parts) <= 500
