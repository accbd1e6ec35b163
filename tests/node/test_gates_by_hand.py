"""What a node lets in, by hand: a cycle's times at each bound, and what an epoch that begins makes void."""

from __future__ import annotations

import math
from typing import Any

import pytest

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.events import Code
from node.kernels.record.filter_record import Err, default_config
from node.kernels.record.node_record import new_node
from node.kernels.turns.gates import admits_cycle

HAIR = 1.0 + 1e-9
RATE = 0.3  # rad/s, at which the string turned at the end of the cycle before
LAST = 7  # number of the aiding that came last


def node_at(now: float, cycles: int = 5) -> Any:
    """A node whose last cycle ended at ``now`` (s, own clock) and knew its yaw."""
    node = new_node(default_config())[0]
    state = node["filter"]
    state["now"], state["cycles"], state["now_rate"], state["yaw_known"] = now, cycles, RATE, 1
    state["last_sequence"], state["P"][Err.YAW, Err.YAW] = LAST, 1e-6
    return node


def jumps_of(node: Any) -> list[float]:
    """By how much (s) each jump is told to be, in their order."""
    events = node["events"]
    told = events["ring"][: int(events["told"])]
    assert all(int(event["code"]) == Code.CLOCK_JUMPED for event in told)
    return [float(event["numbers"][0]) for event in told]


@pytest.mark.parametrize(
    ("begin", "end", "admitted", "jumped"),
    [
        (0.0, PERIOD, True, False), (0.0, 10.0 * PERIOD, True, False), (0.0, 10.0 * PERIOD * HAIR, False, True),
        (0.0, 0.0, False, True), (PERIOD, 0.0, False, True), (math.nan, PERIOD, False, True),
        (0.0, math.nan, False, True), (0.0, math.inf, False, True), (10.0 * PERIOD, 11.0 * PERIOD, True, False),
        (10.0 * PERIOD * HAIR, 11.0 * PERIOD, True, True), (-PERIOD, PERIOD, True, False),
        (-PERIOD * HAIR, PERIOD, True, True),
    ],
)  # fmt: skip
def test_a_cycle_lasts_up_to_ten_periods_and_follows_the_last_within_one_before_and_ten_after(
    begin: float, end: float, admitted: bool, jumped: bool
) -> None:
    node = node_at(0.0)
    for again in (False, True):
        assert bool(admits_cycle(node, begin, end)) == admitted
        assert bool(node["guard"]["jumped"]) == (jumped and not (again and admitted))  # a new epoch follows nothing
    told = jumps_of(node)
    assert len(told) == jumped  # once, however many follow
    if jumped and math.isfinite(begin):
        assert told[0] == begin
    state, begins_anew = node["filter"], jumped and admitted
    assert (int(state["yaw_known"]), int(state["last_sequence"])) == ((0, -1) if begins_anew else (1, LAST))
    if begins_anew:
        assert float(state["P"][Err.YAW, Err.YAW]) > 3.0  # any yaw


def test_a_clock_that_goes_on_after_a_jump_may_jump_again_and_the_first_cycle_may_begin_anywhere() -> None:
    node = node_at(0.0)
    for begin in (50.0, 50.0 + PERIOD, -3.0):
        assert admits_cycle(node, begin, begin + PERIOD)
        node["filter"]["cycles"], node["filter"]["now"] = 1, begin + PERIOD
    assert jumps_of(node) == pytest.approx([50.0, -53.0 - 2.0 * PERIOD])
    first = node_at(0.0, cycles=0)
    assert admits_cycle(first, 1e6, 1e6 + PERIOD)
    assert jumps_of(first) == []


@pytest.mark.parametrize(("begin", "opened"), [(0.0, 0.0), (0.5 * PERIOD, 0.0), (-0.5 * PERIOD, 0.5 * RATE * PERIOD)])
def test_a_turn_that_two_cycles_count_is_in_doubt(begin: float, opened: float) -> None:
    node = node_at(0.0)
    assert admits_cycle(node, begin, begin + PERIOD)
    assert float(node["filter"]["P"][Err.YAW, Err.YAW]) == pytest.approx(1e-6 + opened**2, rel=1e-12)
