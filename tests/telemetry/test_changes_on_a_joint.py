"""What happens on a joint when its other end changes: each transition once more, and in the middle of something."""

from __future__ import annotations

from pathlib import Path

import pytest
from sealed_string import SealedString, make_folder, state
from test_can_exchange import STEP, joined
from test_endpoint import Chain, survey
from test_isotp import LIMIT
from test_which_key import Held, joint, lots, ring
from test_which_key import joined as prove

from telemetry.application.end_seal import UP, BaseEnd, Pair, SealFinding, SealingEnd, close_payload
from telemetry.application.endpoint import Endpoint
from telemetry.media.can_exchange import FLOW_LIMIT
from telemetry.media.can_identifier import FLOW_CONTROL, PRESENCE, packed_identifier
from telemetry.media.isotp import BLOCK, FlowStatus, Receiver, Sender, TransferError, flow_control
from telemetry.media.port import PortFrame, Priority
from telemetry.messages import BASE, ENCODER, Command, Hello, Message, NodeMode, Side, TimeReply, TimeRequest
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.transport.hop import Header, HopLink, pack_frame, parse_frame


class Wire:
    """One end of an endpoint, and a neighbour that is played by hand."""

    def __init__(self, endpoint: Endpoint, side: Side, address: int) -> None:
        self.endpoint, self.side, self.address = endpoint, side, address
        self.boots = self.number = 1

    def say(self, message: Message, now: float) -> None:
        self.number += 1
        header = Header(self.address, self.boots << 24 | self.address, self.number, 0, 0, 0)
        self.endpoint.receive(self.side, pack_frame(header, [(0, encode_message(message))]), now)

    def heard(self, now: float) -> list[Message]:
        """What the endpoint says at this end now."""
        self.endpoint.advance(now)
        frames = [frame for side, frame in self.endpoint.take_frames(now) if side is self.side]
        parsed = [parse_frame(frame.payload) for frame in frames]
        return [decode_message(bytes(payload)) for one in parsed if one is not None for _, payload in one[1]]


def tube(**settings: object) -> Endpoint:
    return Endpoint(2, frozenset(Side), boot_count=1, **settings)  # type: ignore[arg-type]


def tell_time(wire: Wire, now: float) -> None:
    """Have the neighbour above answer, whose clock is 50 s ahead and 30e-6 fast."""
    ahead = 50.0 + (1.0 + 30e-6) * now
    wire.say(TimeReply(now - 2e-3, ahead - 1e-3, ahead - 1e-3, ahead, 1.0, 0.0, 1), now)


@pytest.mark.parametrize("restarts", [1, 2])
def test_a_neighbour_that_starts_again_has_the_same_crystal_and_another_one_has_not(restarts: int) -> None:
    endpoint = tube()
    upper = Wire(endpoint, Side.UPPER, 3)
    now = 10.0
    upper.say(Hello(3, 1, 1, NodeMode.TRACKING, 1.0), now)
    for _ in range(20):
        now += 10.0
        tell_time(upper, now)
    for _ in range(restarts):
        upper.boots += 1
        upper.say(Hello(3, upper.boots, 1, NodeMode.TRACKING, 1.0), now)
        now += 10.0
        known = endpoint.clock.exchanges
        tell_time(upper, now)
        assert endpoint.clock.exchanges == known + 1  # it is compared on
        assert endpoint.clock.rig_rate == pytest.approx(1.0 + 30e-6, abs=2e-6)
    upper.address = 4
    upper.say(Hello(4, 1, 1, NodeMode.TRACKING, 1.0), now)
    tell_time(upper, now + 10.0)
    assert endpoint.clock.exchanges == 1


@pytest.mark.parametrize("times", [1, 2])
def test_a_new_neighbour_is_greeted_at_once_on_either_end(times: int) -> None:
    for side, address in ((Side.UPPER, 3), (Side.LOWER, 1)):
        endpoint = tube()
        wire, now = Wire(endpoint, side, address), 10.0
        wire.heard(now)
        for _ in range(times):
            now += 5.0
            wire.heard(now)  # one that was due
            now += 0.01
            assert not [m for m in wire.heard(now) if isinstance(m, Hello)]
            wire.boots += 1
            wire.say(Hello(address, wire.boots, 1, NodeMode.TRACKING, 1.0), now)
            assert [m.tube for m in wire.heard(now + 1e-3) if isinstance(m, Hello)] == [2]


def test_time_is_told_downward_alone() -> None:
    """What a tube knows of rig time comes from above: to tell it there would close a circle."""
    endpoint = tube()
    upper, lower = Wire(endpoint, Side.UPPER, 3), Wire(endpoint, Side.LOWER, 1)
    for wire in (upper, lower):
        wire.say(Hello(wire.address, 1, 1, NodeMode.TRACKING, 1.0), 10.0)
    tell_time(upper, 20.0)
    for wire, answers in ((upper, 0), (lower, 1), (upper, 0), (lower, 1)):
        wire.say(TimeRequest(20.5), 21.0)
        assert len([m for m in wire.heard(21.0) if isinstance(m, TimeReply)]) == answers


@pytest.mark.parametrize("hops", [1, 7, 60, 99])
def test_a_tube_with_fewer_hops_waits_longer_for_the_states_from_below(hops: int) -> None:
    """By a frame's way for each hop; after a loss the lowest goes first again. From 100 hops on none waits longer."""

    def wait(of: int) -> float:
        endpoint = tube()
        endpoint.place.hops = of
        lower = Wire(endpoint, Side.LOWER, 1)
        lower.say(Hello(1, 1, of + 1, NodeMode.TRACKING, 1.0), 10.0)
        lower.heard(10.0)
        endpoint.send_state(state(5), 10.1)
        return endpoint._links[Side.UPPER].next_wake(10.1) - 10.1

    assert wait(hops) - wait(hops + 1) == pytest.approx(0.005, abs=1e-9)
    assert wait(100) == pytest.approx(wait(200), abs=1e-9) == pytest.approx(1.15, abs=1e-9)


@pytest.mark.parametrize("starts", [1, 2])
def test_an_order_that_waited_for_a_session_goes_as_soon_as_there_is_one(tmp_path: Path, starts: int) -> None:
    string = SealedString(make_folder(tmp_path / "stick"))
    string.settle()
    for number in range(1, 1 + starts):
        string.start(BASE)
        string.endpoints[BASE].mail.command(Command(1, number, "take_survey"), string.now)
        string.run(4.0)
        string.talking = True  # what a tube says begins the session
        string.run(3.5, until=lambda n=number: obeyed(string) == n)  # less than the order's own repetition, 10 s
        string.talking = False
        assert obeyed(string) == number


def obeyed(string: SealedString) -> int:
    """Orders that tube 1 has been given."""
    return len([m for m in string.heard[1] if isinstance(m, Command)])


def test_what_names_an_offered_session_under_the_number_of_before_proves_nothing() -> None:
    """Who takes an offer draws a new number: the old one beside it was put together by another one."""
    base, tube_end = BaseEnd(Held(BASE, 1), lots()), SealingEnd(1, Held(1, 1), lots())
    before = tube_end._pair
    base.open(tube_end.close(b"hello"), 1, 0.0)
    ((_, offer),) = base.due_offers(lambda tube: b"offer")
    assert tube_end.open(offer, 0.1, is_offer=True)
    offered = tube_end._pair.base
    key = ring(1, 1).seal_key(1, "end", 1)
    assert key is not None
    for of_tube, finding in ((before.tube, SealFinding.NOTHING), (before.tube + 77, SealFinding.BEGINS)):
        payload = close_payload(key, UP, b"first", Pair(of_tube, offered), 1, 1, 1)
        assert base.open(payload, 1, 0.2) is finding


def test_the_own_call_that_a_joint_sends_back_has_no_effect() -> None:
    end = joint(2, 1)
    for step in range(3):
        (call,) = end.own_frames(2.0 * step)
        assert end.open(call, 2.0 * step + 0.1) is None
        assert end.own_frames(2.0 * step + 0.5) == []
    assert end.counters["seal_wrong_tag"] == 3


def test_who_is_revoked_is_neither_partner_nor_answered() -> None:
    end, other = joint(2, 1), joint(1, 1)
    keys = end._ring
    (call,) = other.own_frames(0.0)
    end.open(call, 0.1)
    assert end.next_wake() < 1.0  # an answer is due
    keys._ring = ring(2, 1, revoked=(1,))  # type: ignore[attr-defined]
    end.forget_revoked()
    assert [frame for frame in end.own_frames(0.2) if frame[4] == 1] == []
    prove(one := joint(3, 1), two := joint(4, 1))
    one._ring._ring = ring(3, 1, revoked=(4,))  # type: ignore[attr-defined]
    one.forget_revoked()
    assert one.partner is None
    assert one.close(b"beat") is None
    assert two.partner is not None


@pytest.mark.parametrize("frames", [1, 3])
def test_a_whole_payload_ends_the_one_that_was_open(frames: int) -> None:
    """The rest of what was interrupted is not taken for a part of anything."""
    sender, receiver = Sender(bytes(range(100)), 8), Receiver(LIMIT)
    for _ in range(frames):
        receiver.on_frame(sender.next_frame())
        if receiver.flow is not None:
            sender.on_flow(receiver.flow)
            receiver.flow = None
    for _ in range(2):
        assert receiver.on_frame(b"\x02ok") == b"ok"
        assert not receiver.is_open
        with pytest.raises(TransferError, match="unexpected"):
            receiver.on_frame(sender.next_frame())


def test_a_transfer_whose_frames_still_move_is_not_given_up_however_long_it_takes() -> None:
    """Its receiver has a second to answer from the last frame on, and not from its answer before."""
    upper, _, wire = joined()
    upper.queue.offer(PortFrame(bytes(300), Priority.SURVEY))
    now, flow = wire.now, packed_identifier(Priority.SURVEY, FLOW_CONTROL, 1)
    for _ in range(1 + BLOCK):
        now += 0.2 * FLOW_LIMIT
        upper.advance(now)
        while (frame := upper.next_frame(now)) is not None and frame.identifier >> 21 & 0x1F == PRESENCE:
            upper.on_acknowledged(now)
        upper.on_acknowledged(now)
        if frame is not None and frame.data[0] >> 4 == 1:
            upper.on_frame(flow, flow_control(FlowStatus.CONTINUE, BLOCK), now)
    (outgoing,) = upper._outgoing.values()
    assert outgoing.awaits_flow
    upper.advance(now + FLOW_LIMIT)
    assert upper.counters["no_flow_control"] == 0
    upper.advance(now + 1.01 * FLOW_LIMIT)
    assert upper.counters["no_flow_control"] == 1


def test_what_may_be_lost_is_dropped_by_an_end_that_goes_down_and_what_must_not_goes_on() -> None:
    for topic, is_kept in ((None, True), ("state", False)):
        upper, _, wire = joined()
        upper.queue.offer(PortFrame(bytes(range(200)), Priority.SURVEY, topic))
        wire.run(10 * STEP)
        upper._go_down()
        assert bool(upper._outgoing) == is_kept
        assert upper.counters["interrupted"] == (0 if is_kept else 1)


def test_a_link_that_begins_anew_sends_first_what_was_on_its_way_first() -> None:
    for restarts in (1, 2):
        link = HopLink(2, 1)
        hear(link, 1, 1)
        payloads = [b"%d" % k for k in range(6)]
        for payload in payloads[:3]:
            link.send_reliable(payload)
        link.take_frames(1.0)
        for payload in payloads[3:]:
            link.send_reliable(payload)
        for boot in range(2, 2 + restarts):
            hear(link, boot, 1)
        sent = [parse_frame(frame.payload) for frame in link.take_frames(1.1)]
        told = [bytes(payload) for one in sent if one is not None for number, payload in one[1] if number]
        assert told == payloads


def hear(link: HopLink, boot: int, number: int) -> None:
    """A frame of a neighbour's start."""
    link.receive(pack_frame(Header(1, boot << 24 | 1, number, 0, 0, 0), []), 1.0)


@pytest.mark.parametrize("untils", [(5.0, 3.0), (3.0, 5.0), (3.0, 5.0, 4.0)])
def test_what_is_told_again_while_it_waits_goes_no_later_than_it_was_to(untils: tuple[float, ...]) -> None:
    link = HopLink(2, 1)
    for k, until in enumerate(untils):
        link.send_with_others(b"%d" % k, "hello", Priority.HELLO, until)
    assert link.next_wake(0.0) == 3.0
    assert link.take_frames(2.999) == []
    (frame,) = link.take_frames(3.0)
    parsed = parse_frame(frame.payload)
    assert parsed is not None
    assert [bytes(payload) for _, payload in parsed[1]] == [b"%d" % (len(untils) - 1)]


def test_states_of_a_relay_that_is_above_no_other_go_at_once() -> None:
    chain = Chain([1])
    chain.run(4.0)
    chain.stations[1].send_state(state(5), chain.local(1))
    chain.run(0.1)
    assert [m.cycles for m in chain.got[BASE] if hasattr(m, "cycles")] == [5]
    assert survey(1, 1).tube == 1
    assert chain.addresses[1] == ENCODER
