"""A link from session to session: nothing of the one before counts in the next, and every bound is met exactly.

Frames of the other end are packed by hand, so that each says what a real one would say late, twice or at the edge of
what it may.
"""

from __future__ import annotations

from itertools import pairwise

import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from telemetry.media.port import MAX_FRAME, Priority
from telemetry.transport.hop import (
    BEST_EFFORT_LIMIT,
    ENTRY_BYTES,
    QUEUE_LIMIT,
    SILENCE,
    WINDOW,
    Header,
    HopLink,
    pack_frame,
    parse_frame,
)
from telemetry.transport.seal import WINDOW as SEAL_WINDOW
from telemetry.transport.seal import ReplayWindow

NOW = 100.0


class Other:
    """The other end of a joint, whose frames a test writes."""

    def __init__(self, link: HopLink, address: int = 2, boot: int = 1, session: int = 0) -> None:
        self.link, self.address, self.boot, self.session = link, address, boot, session
        self.count = 0

    def says(
        self, *entries: tuple[int, bytes], ack: int = 0, mask: int = 0, ack_epoch: int | None = None, at: float = NOW
    ) -> list[bytes]:
        """What the link delivers of a frame with these entries and this acknowledgement."""
        self.count += 1
        epoch = self.boot << 24 | self.session << 8 | self.address
        header = Header(self.address, epoch, self.count, self.link.epoch if ack_epoch is None else ack_epoch, ack, mask)
        return [bytes(payload) for payload in self.link.receive(pack_frame(header, entries), at)]


def entries_of(link: HopLink, at: float) -> list[tuple[int, bytes]]:
    """What is due at a time, numbers and payloads."""
    found = [parse_frame(frame.payload) for frame in link.take_frames(at)]
    return [(number, payload) for parsed in found if parsed for number, payload in parsed[1]]


@given(st.lists(st.integers(0, 2 * SEAL_WINDOW), min_size=2, max_size=40))
@example([SEAL_WINDOW, 0])
@example([SEAL_WINDOW - 1, 0])
@example([SEAL_WINDOW + 1, 1, 1])
@example([0, SEAL_WINDOW, 0])
@example([0, SEAL_WINDOW - 1, 0])
@example([2 * SEAL_WINDOW, SEAL_WINDOW, SEAL_WINDOW + 1])
def test_a_replay_window_admits_what_is_less_than_its_width_behind_and_new(numbers: list[int]) -> None:
    window, admitted, largest = ReplayWindow(), set(), -1
    for number in numbers:
        expected = number not in admitted and largest - number < SEAL_WINDOW
        assert window.admit(number) == expected
        if expected:
            admitted.add(number)
            largest = max(largest, number)


@given(ahead=st.integers(0, 2 * WINDOW), before=st.integers(0, 3))
@example(ahead=WINDOW - 1, before=0)
@example(ahead=WINDOW, before=0)
@example(ahead=WINDOW - 1, before=2)
@example(ahead=WINDOW, before=2)
def test_a_link_takes_numbers_within_its_window_and_none_at_its_end(ahead: int, before: int) -> None:
    other = Other(HopLink(1, 1))
    for number in range(1, before + 1):
        assert other.says((number, b"x")) == [b"x"]
    assert other.says((before + 1 + ahead, b"far")) == ([b"far"] if ahead < WINDOW else [])


def test_a_link_has_no_more_on_its_way_than_the_other_end_can_note() -> None:
    link = HopLink(1, 1)
    other = Other(link)
    other.says((0, b"beat"))
    for k in range(2 * WINDOW):
        link.send_reliable(b"%d" % k)
    assert [number for number, _ in entries_of(link, NOW)] == list(range(1, WINDOW + 1))
    other.says(ack=3)
    assert [number for number, _ in entries_of(link, NOW)] == [WINDOW + 1, WINDOW + 2, WINDOW + 3]
    other.says(ack=3, mask=0b10)  # number 5 came, 4 did not: the window begins at 4 still
    assert entries_of(link, NOW) == []


@pytest.mark.parametrize("beyond", [0, 1])
def test_a_frame_is_read_up_to_the_largest_and_no_further(beyond: int) -> None:
    header = Header(2, 1 << 24 | 2, 1, 0, 0, 0)
    around = len(pack_frame(header, [(0, bytes(2**15))])) - 2**15
    frame = pack_frame(header, [(0, bytes(MAX_FRAME - around + beyond))])
    assert len(frame) == MAX_FRAME + beyond
    assert (parse_frame(frame) is not None) == (beyond == 0)


@given(shared=st.integers(1, 6), size=st.integers(0, 300), short=st.sampled_from([0, 1]))
@example(shared=2, size=0, short=0)
@example(shared=2, size=0, short=1)
def test_payloads_share_a_frame_up_to_exactly_the_limit(shared: int, size: int, short: int) -> None:
    link = HopLink(1, 1)
    link.bundle_limit = shared * (size + ENTRY_BYTES) - short
    for topic in range(2 * shared):
        link.send_best_effort(bytes(size), topic)
    counts = [len(found[1]) for frame in link.take_frames(NOW) if (found := parse_frame(frame.payload))]
    expected = max(shared - short, 1)
    assert counts[0] == expected
    assert sum(counts) == 2 * shared


def test_an_end_is_up_until_exactly_its_silence_is_over() -> None:
    link = HopLink(1, 1)
    Other(link).says((0, b"beat"))
    assert link.is_up(NOW + SILENCE)
    assert not link.is_up(NOW + SILENCE + 1e-6)


def test_what_is_not_acknowledged_is_sent_at_growing_intervals_and_then_every_two_seconds() -> None:
    link = HopLink(1, 1)
    other = Other(link)
    link.send_reliable(b"kept")
    sent = []
    for step in range(20 * 200):
        at = NOW + step / 200.0
        if step % 100 == 0:
            other.says((0, b"beat"), at=at)
        if (1, b"kept") in entries_of(link, at):
            sent.append(at)
    waits = [round(later - earlier, 3) for earlier, later in pairwise(sent)]
    assert waits[:5] == [0.06, 0.12, 0.24, 0.48, 0.96]
    assert waits[6:] == [2.0] * len(waits[6:])
    assert len(waits[6:]) >= 7


def carried(link: HopLink, other: HopLink, steps: int = 40) -> list[bytes]:
    """What the other end is given until nothing waits, the first to come first."""
    got: list[bytes] = []
    for step in range(steps):
        at = NOW + 0.05 * step
        for one, two in ((other, link), (link, other)):
            one.send_best_effort(b"beat", "beat")
            for frame in one.take_frames(at):
                found = two.receive(frame.payload, at)
                got += [bytes(payload) for payload in found if two is other and payload != b"beat"]
    assert link.waiting == 0
    return got


def test_a_full_link_drops_the_oldest_that_must_arrive_and_keeps_the_order_of_the_rest() -> None:
    link = HopLink(1, 1)
    given_to_it = [b"%d" % k for k in range(QUEUE_LIMIT + 5)]
    for payload in given_to_it:
        link.send_reliable(payload)
    assert carried(link, HopLink(2, 1)) == given_to_it[5:]
    assert link.counters["reliable_dropped"] == 5


def test_a_full_link_drops_the_topic_that_was_told_longest_ago() -> None:
    link = HopLink(1, 1)
    for topic in range(BEST_EFFORT_LIMIT):
        link.send_best_effort(b"%d" % topic, topic, Priority.STATE)
    link.send_best_effort(b"0 again", 0, Priority.STATE)  # the newest now
    for topic in range(BEST_EFFORT_LIMIT, BEST_EFFORT_LIMIT + 3):
        link.send_best_effort(b"%d" % topic, topic, Priority.STATE)
    kept = [payload for _, payload in entries_of(link, NOW)]
    new = [b"0 again", *(b"%d" % topic for topic in range(BEST_EFFORT_LIMIT, BEST_EFFORT_LIMIT + 3))]
    assert kept == [b"%d" % topic for topic in range(4, BEST_EFFORT_LIMIT)] + new


@pytest.mark.parametrize("again", [1, 2])
def test_an_acknowledgement_of_a_session_before_settles_nothing(again: int) -> None:
    link = HopLink(1, 1)
    Other(link).says((0, b"beat"))
    for payload in (b"a", b"b", b"c"):
        link.send_reliable(payload)
    assert [number for number, _ in entries_of(link, NOW)] == [1, 2, 3]
    for session in range(again):
        before = link.epoch
        restarted = Other(link, boot=2 + session)
        restarted.says((0, b"beat"), ack_epoch=before, ack=3, at=NOW + 10.0 * (session + 1))
        assert link.epoch != before
        assert sorted(entries_of(link, NOW + 10.0 * (session + 1))) == [(1, b"a"), (2, b"b"), (3, b"c")]
        restarted.says(ack_epoch=before, ack=3, at=NOW + 10.0 * (session + 1))  # and a frame that was late
        assert link.waiting == 3
    restarted.says(ack=3, at=NOW + 10.0 * again)
    assert link.waiting == 0


@pytest.mark.parametrize("again", [1, 2])
def test_numbers_noted_in_a_session_hide_none_of_the_next(again: int) -> None:
    link = HopLink(1, 1)
    for session in range(again):
        other = Other(link, session=session)
        assert other.says((1, b"first"), (3, b"third"), (6, b"sixth")) == [b"first", b"third", b"sixth"]
    fresh = Other(link, session=again)
    wanted = [(number, b"%d" % number) for number in range(1, 9)]
    assert fresh.says(*wanted) == [payload for _, payload in wanted]


def test_losses_are_counted_from_the_first_frame_of_a_process_that_started_again() -> None:
    link = HopLink(1, 1)
    other = Other(link)
    for _ in range(60):
        other.says((0, b"beat"))
    assert link.quality == pytest.approx(1.0)
    restarted = Other(link, boot=2)
    for _ in range(200):
        restarted.says((0, b"beat"))
        restarted.count += 1  # and one that was lost
    # a frame arrives and one is missed: q <- q r^2 + (1 - r), with r = 31/32, comes to rest at (1 - r) / (1 - r^2)
    assert link.quality == pytest.approx(1.0 / (1.0 + 31.0 / 32.0), abs=0.01)


def test_another_neighbour_does_not_inherit_the_losses_of_the_one_before() -> None:
    link = HopLink(1, 1)
    for address in (2, 3, 4):
        other = Other(link, address=address)
        other.says((0, b"beat"))
        assert link.quality == pytest.approx(1.0)
        for _ in range(50):
            other.count += 5
            other.says((0, b"beat"))
        assert link.quality < 0.5
