"""Frames that a link sends first, the least epochs that it believes, and tubes at the edge of a byte."""

from __future__ import annotations

import pytest
from sealed_string import state
from test_which_key import joint

from telemetry.presentation.msgpack_codec import encode_message, state_origin
from telemetry.transport.hop import HopLink, parse_frame

NOW = 100.0


@pytest.mark.parametrize("tube", [1, 127, 128, 251])
def test_a_relay_reads_the_tube_of_a_state_without_opening_it_at_every_edge_of_its_byte(tube: int) -> None:
    assert state_origin(encode_message(state(5, tube))) == tube


def test_the_first_frame_is_number_one_and_acknowledges_nothing() -> None:
    link = HopLink(7, 3)
    link.send_best_effort(b"state", "state")
    (first,) = link.take_frames(NOW)
    parsed = parse_frame(first.payload)
    assert parsed is not None
    assert parsed[0] == (7, 3 << 24 | 7, 1, 0, 0, 0)


def test_the_least_epoch_that_can_be_is_that_of_a_sender() -> None:
    """Address 1 that never started before, in its first session: what it numbers is delivered and acknowledged."""
    sender, receiver = HopLink(1, 0), HopLink(2, 0)
    assert sender.epoch == 1
    receiver.send_best_effort(b"beat", "beat")
    for frame in receiver.take_frames(NOW):
        sender.receive(frame.payload, NOW)
    sender.send_reliable(b"survey")
    delivered = [one for frame in sender.take_frames(NOW) for one in receiver.receive(frame.payload, NOW)]
    assert [bytes(one) for one in delivered] == [b"survey"]
    later = NOW + 0.05
    for frame in receiver.take_frames(later):
        sender.receive(frame.payload, later)
    assert sender.waiting == 0


def test_an_end_that_hears_no_other_calls_at_once_and_again_at_exactly_its_period() -> None:
    end = joint(1, 1)
    assert [len(end.own_frames(at)) for at in (NOW, NOW + 0.999, NOW + 1.0, NOW + 1.5, NOW + 2.0)] == [1, 0, 1, 0, 1]
