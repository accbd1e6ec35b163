"""What a link, a clock and a session keep over each transition, made twice, and bounds at exactly their value."""

from __future__ import annotations

import contextlib
import math
from pathlib import Path
from typing import Any

import pytest
from sealed_string import SealedString, make_folder
from test_clock_variance import ABOVE, JITTER, RIG_RATE, WAY, exchange
from test_isotp import LIMIT, carry
from test_upload import segments, status
from test_which_key import Ends, Held, joined, joint, lots, ring

from telemetry.application.arguments import checked_values, parse_tube, shown_values
from telemetry.application.can_load import CYCLE, STATE, presence_rate, steady_traffic
from telemetry.application.clock import PLAUSIBLE_ROUND_TRIP, ClockFilter
from telemetry.application.commands import find_command
from telemetry.application.end_seal import LATE_WITHIN, OFFER_EVERY, BaseEnd, SealingEnd
from telemetry.application.measurement_seal import OLDEST, MeasurementSeal
from telemetry.application.outbox import FIRST_RETRY, Outbox
from telemetry.errors import CommandError
from telemetry.frozen import replace
from telemetry.media.can_timing import FD_HEAD, TAIL, fd_bits
from telemetry.media.isotp import Receiver, Sender, TransferError
from telemetry.media.port import Priority
from telemetry.messages import (
    BASE,
    ENCODER,
    MAX_TUBE,
    Aiding,
    Event,
    Hello,
    NodeMode,
    NodeState,
    Severity,
    TimeReply,
    TimeRequest,
    UploadPhase,
)
from telemetry.quantities import Quantity, ValueKind
from telemetry.transport.hop import QUALITY_WEIGHT, Header, HopLink, pack_frame, parse_frame
from telemetry.transport.joint_seal import DUPLICATE_WITHIN
from telemetry.transport.upload import Assembly, Upload

# the clock


@pytest.mark.parametrize("wait", [0.0, 1e-3, 4e-3, 10e-3])
def test_what_a_reply_took_beyond_the_shortest_is_a_wait_of_half_of_it(wait: float) -> None:
    clock = ClockFilter()
    exchange(clock, 100.0)
    clock.change_neighbour()  # begins anew with the variance of its exchange alone
    exchange(clock, 110.0, waits=wait)
    middle = 110.0 + WAY + 0.5 * wait
    assert clock.variance(middle) == pytest.approx(JITTER**2 + (0.5 * wait) ** 2 + ABOVE, rel=1e-9)


def test_round_trips_that_are_all_long_are_doubted_by_what_the_three_shortest_differ_in() -> None:
    """Until there are three by half of what they are beyond a plausible one; a wait on the way back moves by half."""
    waits = (0.05, 0.054, 0.058)
    shortest = 2.0 * WAY + waits[0]
    beyond = 0.5 * (shortest - PLAUSIBLE_ROUND_TRIP)
    doubts = (beyond, beyond, (waits[2] - waits[0]) - 20e-6 * 20.0)  # the two crystals part meanwhile
    clock = ClockFilter()
    for k, (wait, doubt) in enumerate(zip(waits, doubts, strict=True)):
        asked = 100.0 + 10.0 * k
        exchange(clock, asked, waits=wait)
        error = 0.5 * (wait - waits[0]) + doubt
        assert clock.variance(asked + WAY + 0.5 * wait) == pytest.approx(JITTER**2 + error**2 + ABOVE, rel=1e-9)
        clock.change_neighbour()


def test_another_crystal_is_compared_without_the_rate_of_the_one_before() -> None:
    clock = ClockFilter()
    for times in range(2):
        for k in range(40):
            exchange(clock, 100.0 + 1000.0 * times + 10.0 * k)
        assert abs(clock.rig_rate / RIG_RATE - 1.0) == pytest.approx(20e-6, rel=0.05)
        clock.change_neighbour()
        exchange(clock, 600.0 + 1000.0 * times)
        assert clock.rig_rate == pytest.approx(RIG_RATE, abs=1e-12)


def test_steps_of_a_clock_add_up_until_they_are_taken() -> None:
    clock = ClockFilter()
    for k in range(5):
        exchange(clock, 100.0 + 10.0 * k)
    clock.take_step()
    for times in range(2):
        total = 0.0
        for k, off in enumerate((2e-4, 3e-4, -1e-4)):
            asked = 200.0 + 100.0 * times + 10.0 * k
            back = asked + 2.0 * WAY
            before = clock.rig_from_local(back)
            exchange(clock, asked, off=off)
            total += (before - clock.rig_from_local(back)) / clock.rig_rate
        assert clock.take_step() == pytest.approx(total, rel=1e-9)
        assert total != 0.0
        assert clock.take_step() == 0.0


# the link


def frame(number: int, sender: int = 9) -> bytes:
    return pack_frame(Header(sender, 1 << 24 | sender, number, 0, 0, 0), [(0, b"x")])


def test_a_late_frame_is_no_gap_in_the_quality_of_a_link_and_no_begin_of_one() -> None:
    link, quality = HopLink(1, 1), 1.0
    for number, missed in ((1, 0), (4, 2), (2, 0), (3, 0), (5, 0), (7, 1), (6, 0), (8, 0)):
        link.receive(frame(number), 100.0)
        quality = quality * (1.0 - QUALITY_WEIGHT) ** (missed + 1) + QUALITY_WEIGHT
        assert link.quality == pytest.approx(quality, rel=1e-12)


def test_of_what_waits_each_goes_at_its_own_time() -> None:
    link = HopLink(1, 1)
    for times in range(2):
        begin = 100.0 * (1 + times)
        for topic, wait in (("a", 5.0), ("b", 3.0), ("c", 4.0)):
            link.send_with_others(topic.encode(), topic, Priority.STATE, begin + wait)
        for wait, topic in ((3.0, b"b"), (4.0, b"c"), (5.0, b"a")):
            assert link.next_wake(begin) == begin + wait
            assert link.take_frames(begin + wait - 0.1) == []
            (made,) = link.take_frames(begin + wait)
            parsed = parse_frame(made.payload)
            assert parsed is not None
            assert [bytes(payload) for _, payload in parsed[1]] == [topic]
        assert link.next_wake(begin) == math.inf


def test_what_was_on_its_way_to_a_neighbour_goes_to_the_next_before_what_waited_behind_it() -> None:
    link = HopLink(1, 1)
    link.receive(frame(1), 100.0)
    for number in range(3):
        link.send_reliable(b"way %d" % number)
    link.take_frames(100.0)
    link.send_reliable(b"behind")
    for sender in (8, 7):  # twice
        link.receive(frame(1, sender), 101.0)
        (made,) = link.take_frames(101.0)
        parsed = parse_frame(made.payload)
        assert parsed is not None
        assert [(n, bytes(p)) for n, p in parsed[1]] == [(1, b"way 0"), (2, b"way 1"), (3, b"way 2"), (4, b"behind")]


@pytest.mark.parametrize(
    ("later", "reason"),
    [(0.0, "duplicate"), (DUPLICATE_WITHIN, "duplicate"), (DUPLICATE_WITHIN + 1e-6, "repeated")],
)
def test_a_second_frame_is_the_mediums_doing_within_exactly_its_time(later: float, reason: str) -> None:
    upper, lower, now = joint(2, 1), joint(1, 1), 3.0
    joined(upper, lower)
    sealed = upper.close(b"once")
    assert sealed is not None
    assert lower.open(sealed, now) == b"once"
    before = dict(lower.counters)
    assert lower.open(sealed, now + later) is None
    told = {name: count - before.get(name, 0) for name, count in lower.counters.items()}
    assert {name for name, count in told.items() if count} == {f"seal_{reason}"}


# messages that wait


def test_what_was_sent_once_is_not_hastened_by_others_that_leave() -> None:
    box = Outbox()
    box.keep_waiting(1, b"a", 10.0)
    assert list(box.due_payloads(10.0)) == [b"a"]
    assert not box.release(10.5)
    assert list(box.due_payloads(11.0)) == []
    assert box.next_due() == 10.0 + FIRST_RETRY
    box.keep_waiting(2, b"b", 30.0)
    assert box.release(12.0)
    assert list(box.due_payloads(12.0)) == [b"b"]


@pytest.mark.parametrize("starts", [0, 1, 2])
def test_what_was_said_before_a_session_is_said_again_as_soon_as_there_is_one(tmp_path: Path, starts: int) -> None:
    """Sooner than a repetition would bring it."""
    string = SealedString(make_folder(tmp_path))
    string.settle()
    for start in range(starts + 1):
        if start:
            string.start(BASE)
        number = 50 + start
        mail = string.endpoints[1].mail
        mail.submit(Event(1, number, string.now, Severity.WARNING, "happened", {}, 1), string.now)
        begun = string.now

        def has_come(number: int = number) -> bool:
            return any(isinstance(m, Event) and (m.tube, m.sequence) == (1, number) for m in string.heard[BASE])

        string.run(0.9 * FIRST_RETRY, has_come)
        assert has_come()
        assert string.now - begun < 0.8 * FIRST_RETRY


# seals


def aiding(sequence: int, epoch: int, at: float) -> Aiding:
    return Aiding(1.0, 1e-6, 1e-6, 0.1, 0.2, at, sequence, 2, 30.0, 1e-6, True, epoch)


def test_a_measurement_counts_anew_in_another_epoch_and_never_backwards_in_one() -> None:
    encoder, tube = MeasurementSeal(Held(ENCODER, 1, 2)), MeasurementSeal(Held(1, 1, 2))
    for epoch, numbers in ((1, (100, 101, 101)), (2, (5, 6)), (3, (1, 2))):
        for sequence in numbers:
            assert tube.admits(encoder.close(aiding(sequence, epoch, 50.0)), epoch, 50.0)
        assert not tube.admits(encoder.close(aiding(numbers[-1] - 1, epoch, 50.0)), epoch, 50.0)


@pytest.mark.parametrize(("age", "is_believed"), [(0.0, True), (OLDEST, True), (OLDEST + 1e-6, False)])
def test_a_measurement_is_a_recording_from_exactly_its_age_on(age: float, is_believed: bool) -> None:
    encoder, tube = MeasurementSeal(Held(ENCODER, 1)), MeasurementSeal(Held(1, 1))
    assert tube.admits(encoder.close(aiding(7, 1, 50.0)), 1, 50.0 + age) == is_believed


@pytest.mark.parametrize("of_tube", [(1, 2), (2, 3), (2,)])
def test_the_tag_of_a_measurement_is_of_the_generation_that_it_names(of_tube: tuple[int, ...]) -> None:
    encoder, tube = MeasurementSeal(Held(ENCODER, 2)), MeasurementSeal(Held(1, *of_tube))
    made = encoder.close(aiding(7, 1, 50.0))
    assert made.seal[0] == 2
    assert tube.admits(made, 1, 50.0)


@pytest.mark.parametrize(
    ("later", "offers"), [(0.0, 0), (OFFER_EVERY - 1e-6, 0), (OFFER_EVERY, 1), (OFFER_EVERY + 1.0, 1)]
)
def test_a_tube_that_goes_on_asking_is_offered_a_session_every_second(later: float, offers: int) -> None:
    tube, base = SealingEnd(1, Held(1, 1), lots()), BaseEnd(Held(BASE, 1), lots())
    now = 100.0
    base.open(tube.close(b"x"), 1, now)
    assert len(base.due_offers(lambda _tube: b"o")) == 1
    for _ in range(2):
        base.open(tube.close(b"x"), 1, now + later)
        assert len(base.due_offers(lambda _tube: b"o")) == offers
        now += later if offers else 0.0


def test_an_offer_to_a_tube_that_was_revoked_is_worth_nothing() -> None:
    tube, keys = SealingEnd(1, Held(1, 1), lots()), Held(BASE, 1)
    base = BaseEnd(keys, lots())
    base.open(tube.close(b"x"), 1, 100.0)
    ((_, offer),) = base.due_offers(lambda _tube: b"o")
    assert tube.open(offer, 100.1, is_offer=True)
    keys._ring = ring(BASE, 1, revoked=(1,))
    base.forget_revoked()
    keys.have(1)  # even where it is believed again: it begins anew
    assert not base.open(tube.close(b"y"), 1, 100.2).is_believed


@pytest.mark.parametrize(
    ("later", "reason"), [(0.0, "late"), (LATE_WITHIN - 1e-6, "late"), (LATE_WITHIN, "end_old_session")]
)
def test_what_names_the_session_of_before_was_under_way_for_exactly_so_long(later: float, reason: str) -> None:
    ends = Ends((1,), (1,))
    ends.meet()
    old = ends.base.close(b"order", 1)
    assert old is not None
    before = ends.tube._pair
    ends.base._sessions.clear()
    ends.base.open(ends.tube.close(b"x"), 1, 50.0)
    ((_, offer),) = ends.base.due_offers(lambda _tube: b"o")
    assert ends.tube.open(offer, 100.0, is_offer=True)
    assert ends.tube._pair != before
    counted = dict(ends.tube.counters)
    assert not ends.tube.open(old, 100.0 + later, is_offer=False)
    told = {k for k, v in ends.tube.counters.items() if v > counted.get(k, 0)}
    assert told == {f"seal_{reason}"}


# what operators write and read


def test_a_value_that_is_none_is_left_out_of_a_reply_and_those_behind_it_are_not() -> None:
    spec = find_command("resend")
    good: dict[str, Any] = {"sent": 1, "complete_from": 2}
    assert checked_values(spec, good) == good
    for name in good:
        assert checked_values(spec, good | {name: "x"}) == {one: good[one] for one in good if one != name}


def test_every_number_of_a_list_is_shown_in_degrees() -> None:
    listed = Quantity("angles", ValueKind.NUMBERS, "", "rad")
    single = Quantity("angle", ValueKind.NUMBER, "", "rad")
    values = {"angles": (math.pi, -0.5 * math.pi), "angle": 0.25 * math.pi}
    assert shown_values([listed, single], values) == {
        "angles_deg": [pytest.approx(180.0), pytest.approx(-90.0)], "angle_deg": pytest.approx(45.0),
    }  # fmt: skip


@pytest.mark.parametrize(
    ("text", "is_tube"), [("0", False), ("1", True), (str(MAX_TUBE), True), (str(MAX_TUBE + 1), False), ("", False),
                          ("01", True), ("0001", False), ("1.0", False), ("²", False)],
)  # fmt: skip
def test_a_tube_is_one_of_those_that_there_can_be(text: str, is_tube: bool) -> None:
    spec = find_command("take_survey")
    if is_tube:
        assert parse_tube(spec, {"tube": text}) == int(text)
    else:
        with pytest.raises(CommandError, match=f"with N of 1..{MAX_TUBE}"):
            parse_tube(spec, {"tube": text})


# bytes on a bus


def test_messages_of_a_joint_come_so_often_and_signs_of_life_in_what_they_leave() -> None:
    """1.9 Hz of aiding and of each state, a hello of either end each second, a clock exchange each ten."""
    rates = {type(one.message): one.rate for one in steady_traffic(7)}
    assert rates == {
        Aiding: pytest.approx(1.9), NodeState: pytest.approx(7 * 1.9), Hello: pytest.approx(2.0),
        TimeRequest: pytest.approx(0.1), TimeReply: pytest.approx(0.1),
    }  # fmt: skip
    for tubes in (0, 1, 7):
        traffic = steady_traffic(tubes)
        assert presence_rate(traffic, "native") == pytest.approx(4.0 - 1.9 - 1.0)
        assert presence_rate(traffic, "tunnel") == pytest.approx(max(4.0 - 1.9 - 1.0 - 1.9 * tubes, 0.0))
    assert pytest.approx(1.9) == 1.0 / CYCLE
    assert STATE.mode is NodeMode.TRACKING


def test_the_head_of_an_fd_frame_is_stuffed_at_worst_after_five_and_then_each_four() -> None:
    nominal, _ = fd_bits(8)
    assert nominal == FD_HEAD + (1 + (FD_HEAD - 5) // 4) + TAIL


@pytest.mark.parametrize("largest", [8, 64])
def test_a_receiver_begins_each_payload_anew_whatever_it_has_had(largest: int) -> None:
    receiver = Receiver(LIMIT)
    for length in (100, 333, 1000, 77, 2000):
        for is_whole in (False, True):
            payload = bytes(k % 251 for k in range(length))
            sender, arrived, count = Sender(payload, largest), None, 0
            while not sender.is_done and (is_whole or count < 2):
                count += 1
                arrived = None
                with contextlib.suppress(TransferError):  # the one before was interrupted
                    arrived = receiver.on_frame(sender.next_frame())
                if receiver.flow is not None:
                    if sender.awaits_flow:
                        sender.on_flow(receiver.flow)
                    receiver.flow = None
            assert not is_whole or arrived == payload
    assert carry(b"x" * 200, largest)[0] == b"x" * 200


# uploads


def test_a_node_that_has_lost_its_segments_is_sent_them_again() -> None:
    made = segments()
    upload = Upload(made, 0.0)
    everything = (1 << len(made)) - 1
    for times in range(2):
        assert not upload.on_status(status(UploadPhase.PARTIAL, everything & ~1))
        due = upload.due_segments(1000.0 * (1 + times))
        assert [one.index for one in due] == [0]
        assert not upload.on_status(status(UploadPhase.PARTIAL, 0))
        due = upload.due_segments(1000.0 * (1 + times) + 500.0)
        assert [one.index for one in due] == list(range(len(made)))


@pytest.mark.parametrize("change", ["version", "digest", "count"])
def test_a_segment_of_another_block_is_no_part_of_this_one(change: str) -> None:
    one = segments()[0]
    assembly = Assembly(one.version, one.digest, one.count)
    assert assembly.belongs(one)
    other = {"version": one.version + 1, "digest": bytes(32), "count": one.count + 1}
    assert not assembly.belongs(replace(one, **{change: other[change]}))
