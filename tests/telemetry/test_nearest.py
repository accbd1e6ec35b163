"""Several neighbours heard at one end: the nearest that speaks is listened to."""

import math

from hypothesis import given
from hypothesis import strategies as st

from telemetry.application.endpoint import Endpoint
from telemetry.messages import ENCODER, Side
from telemetry.transport.hop import HopLink
from telemetry.transport.nearest import SETTLE, SILENT_AFTER, Nearest

EVERY = 0.5  # s


def by_number(sender: int) -> float:
    return math.inf if sender == 99 else float(sender)


def test_nobody_is_chosen_before_the_nearest_had_time_to_speak() -> None:
    nearest = Nearest(by_number)
    assert not nearest.is_chosen(2, 10.0)
    assert not nearest.is_chosen(1, 10.5)
    assert not nearest.is_chosen(2, 10.0 + SETTLE)
    assert nearest.is_chosen(1, 10.0 + SETTLE)


def test_the_next_is_chosen_when_the_nearest_falls_silent_and_left_when_it_is_back() -> None:
    nearest = Nearest(by_number)
    t = 0.0
    while t < 10.0:
        first, second = nearest.is_chosen(1, t), nearest.is_chosen(2, t)
        assert (first, second) == (t >= SETTLE, False)
        t += EVERY
    last = t - EVERY
    heard = []
    while t < 20.0:
        heard.append((t, nearest.is_chosen(2, t)))
        t += EVERY
    assert all(chosen == (at - last > SILENT_AFTER) for at, chosen in heard)
    assert nearest.is_chosen(1, t)
    assert not nearest.is_chosen(2, t)


def test_whoever_cannot_be_there_is_never_chosen() -> None:
    nearest = Nearest(by_number)
    assert not any(nearest.is_chosen(99, t * EVERY) for t in range(40))


@given(st.lists(st.tuples(st.integers(1, 5), st.floats(0.01, 4.0)), max_size=60))
def test_one_at_a_time_is_chosen_and_nobody_nearer_was_just_heard(frames: list[tuple[int, float]]) -> None:
    nearest, now, last = Nearest(by_number), 0.0, {}
    for sender, wait in frames:
        now += wait
        chosen = nearest.is_chosen(sender, now)
        closer = [other for other, at in last.items() if other < sender and now - at <= SILENT_AFTER]
        assert not (chosen and closer)
        last[sender] = now


def test_a_frame_of_another_is_counted_and_changes_nothing() -> None:
    link, near, far = HopLink(3, 1, Nearest(by_number)), HopLink(1, 1), HopLink(2, 1)
    for step in range(10):
        now = step * EVERY
        near.send_best_effort(b"near", "x")
        far.send_best_effort(b"far", "x")
        got = [payload for frame in near.take_frames(now) for payload in link.receive(frame.payload, now, 7.0)]
        got += [payload for frame in far.take_frames(now) for payload in link.receive(frame.payload, now, 3.0)]
        assert got == ([b"near"] if now >= SETTLE else [])
    assert link.peer == (1, 1)
    assert link.margin == 7.0
    assert link.counters["overheard"] == 10 + SETTLE / EVERY


def test_distances_are_counted_in_tubes_from_the_lowest_up() -> None:
    tube = Endpoint(3, frozenset(Side), boot_count=1, reach=2)
    above = {other: tube.place.distance(Side.UPPER, other) for other in (1, 2, 4, 5, 6)}
    assert above == {1: math.inf, 2: math.inf, 4: 1.0, 5: 2.0, 6: math.inf}
    assert [tube.place.distance(Side.LOWER, other) for other in (4, 2, 1, ENCODER)] == [math.inf, 1.0, 2.0, math.inf]
    assert tube.place.distance(Side.UPPER, ENCODER) == 1.5
    tube.place.hops = 2
    assert tube.place.distance(Side.UPPER, ENCODER) == 2.5
    tube.place.hops = 3
    assert tube.place.distance(Side.UPPER, ENCODER) == math.inf
    head = Endpoint(ENCODER, frozenset(Side), boot_count=1, is_clock_root=True, reach=2)
    assert head.place.distance(Side.LOWER, 7) < head.place.distance(Side.LOWER, 6)
