"""Orders of a chip over plain records: every refusal at its bound, every field that an order sets, events in order."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from node.kernels.record.events import Code
from node.translation import chip_orders

SECOND, TURN, EVENT_ONE = 1 << 28, 1 << 24, 1 << 24
NOTHING = 1 << 60


def node(**change: Any) -> Any:
    """A node that stands, knows its bias and has no fault; every number is one that an order must clear."""
    events = SimpleNamespace(
        told=5, said=5, ring=[SimpleNamespace(code=0, numbers=[9] * 10) for _ in range(32)],
    )  # fmt: skip
    made: dict[str, Any] = {
        "filter": SimpleNamespace(still_cycles=4, mode=chip_orders.STATIC_BIAS + 1, now_rate=0, surveyed=1),
        "slow_cycles": 0,
        "guard": SimpleNamespace(gyro=SimpleNamespace(fault=0), force=SimpleNamespace(fault=0)),
        "aligner": SimpleNamespace(method=0, wanted=7, ordered_at=7, last_end=7, steady=7, slow=7, angle=7, sense=7),
        "mount": SimpleNamespace(aligning=0),
        "recording": SimpleNamespace(
            running=0, command=7, seconds=7, begun=7,
            sums=SimpleNamespace(samples=7, temperature=7, moved=7, mean=[7] * 6, last=[7] * 6, steps=[7] * 6,
                                 scatter=np.full((6, 6), 7)),
        ),
        "events": events,
    }  # fmt: skip
    return [SimpleNamespace(**made | change)]


@pytest.mark.parametrize(
    ("seconds", "answer"),
    [(5 * SECOND, 0), (5 * SECOND - 1, 1), (3600 * SECOND, 0), (3600 * SECOND + 1, 1), (0, 1)],
)
def test_a_record_is_of_five_seconds_to_an_hour(seconds: int, answer: int) -> None:
    nodes = node()
    assert chip_orders.order_record(nodes, seconds, 42) == answer
    recording = nodes[0].recording
    if answer:
        assert (recording.running, recording.command, recording.sums.samples) == (0, 7, 7)
        return
    assert (recording.running, recording.command, recording.seconds, recording.begun) == (1, 42, seconds, NOTHING)
    sums = recording.sums
    assert (sums.samples, sums.temperature, sums.moved) == (0, 0, 0)
    assert (sums.mean, sums.last, sums.steps) == ([0] * 6, [0] * 6, [0] * 6)
    assert not sums.scatter.any()


@pytest.mark.parametrize(
    ("still", "knows_bias", "slow", "stands"),
    [(4, True, 0, True), (3, True, 9, False), (3, False, 4, True), (3, False, 3, False), (4, False, 0, True)],
)
def test_a_node_stands_after_four_cycles_or_slow_without_its_bias(
    still: int, knows_bias: bool, slow: int, stands: bool
) -> None:
    nodes = node(slow_cycles=slow)
    nodes[0].filter.still_cycles = still
    nodes[0].filter.mode = chip_orders.STATIC_BIAS + int(knows_bias)
    assert chip_orders.is_at_rest(nodes[0]) is stands
    assert chip_orders.order_record(nodes, 10 * SECOND, 1) == (0 if stands else 2)


def test_a_survey_is_due_again() -> None:
    nodes = node()
    assert chip_orders.order_survey(nodes) == 0
    assert nodes[0].filter.surveyed == 0


@pytest.mark.parametrize(
    ("change", "method", "turns", "answer"),
    [
        ({}, 1, TURN, 0), ({}, 2, 20 * TURN, 0), ({}, 1, TURN - 1, 1), ({}, 2, 20 * TURN + 1, 1), ({}, 0, 2 * TURN, 1),
        ({}, 3, 2 * TURN, 1), ({"mode": 0}, 1, TURN, 3), ({"gyro": 1}, 1, TURN, 4), ({"force": 1}, 1, TURN, 4),
        ({"rate": 1}, 1, TURN, 5), ({"rate": -1}, 1, TURN, 5), ({"method": 2}, 1, TURN, 6),
    ],
)  # fmt: skip
def test_an_alignment_is_begun_or_refused_for_its_reason(
    change: dict[str, int], method: int, turns: int, answer: int
) -> None:
    nodes = node()
    one, fastest = nodes[0], chip_orders.FASTEST
    one.filter.now_rate = {1: fastest + 1, -1: -fastest - 1}.get(change.get("rate", 0), fastest)
    one.filter.mode = chip_orders.STATIC_BIAS if "mode" in change else one.filter.mode
    one.guard.gyro.fault, one.guard.force.fault = change.get("gyro", 0), change.get("force", 0)
    one.aligner.method = change.get("method", 0)
    assert chip_orders.order_alignment(nodes, method, turns) == answer
    if answer:
        assert (one.mount.aligning, one.events.told, one.aligner.wanted) == (0, 5, 7)
        return
    a = one.aligner
    assert (a.method, a.wanted, a.ordered_at, a.last_end) == (method, turns, NOTHING, NOTHING)
    assert (a.steady, a.slow, a.angle, a.sense, one.mount.aligning) == (0, 0, 0, 0, 1)
    numbers = np.zeros(10, np.int64)
    assert chip_orders.next_event(nodes, numbers) == Code.ALIGNMENT_BEGUN
    assert numbers.tolist() == [method * EVENT_ONE, turns, NOTHING, NOTHING, 9, 9, 9, 9, 9, 9]
    assert chip_orders.next_event(nodes, numbers) == 0


@pytest.mark.parametrize(("told", "first"), [(5, 0), (32, 0), (33, 1), (70, 38)])
def test_events_are_said_once_each_from_the_oldest_that_is_kept(told: int, first: int) -> None:
    nodes, numbers = node(), np.zeros(10, np.int64)
    events = nodes[0].events
    events.told, events.said = 0, 0
    for k in range(told):
        event = events.ring[k % 32]
        event.code, event.numbers = 100 + k, [k] * 10
        events.told += 1
    said = []
    while code := chip_orders.next_event(nodes, numbers):
        said.append((code, int(numbers[0]), int(numbers[9])))
    assert said == [(100 + k, k, k) for k in range(first, told)]
