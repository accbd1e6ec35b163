"""The clock's filter beside the textbook's in matrices, with numbers of its own, and its state over changes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from telemetry.application.clock import ClockFilter
from telemetry.messages import TimeReply

# as decided: drift between two crystals, one exchange over one joint, random walks of offset and drift
DRIFT, JITTER, OFFSET_WALK, DRIFT_WALK = 50e-6, 0.4e-3, 2e-6, 1e-9
WAY = 3e-3  # s
ABOVE = 0.7e-8  # s^2, of rig time at the neighbour
RIG_RATE = 1.0 + 3e-6  # of the neighbour's own clock
OFFSET, RATE = 17.0, 1.0 + 20e-6  # of the neighbour's clock against ours


def neighbour(local: float) -> float:
    """The neighbour's own clock at a time of ours."""
    return OFFSET + RATE * local


def rig(local: float) -> float:
    """Rig time as the neighbour tells it."""
    return 5000.0 + RIG_RATE * (neighbour(local) - 400.0)


def exchange(clock: ClockFilter, asked: float, waits: float = 0.0, off: float = 0.0) -> None:
    """One exchange, whose answer waits on its way back and is wrong by ``off`` (s)."""
    at = neighbour(asked + WAY) + off
    told = rig(asked + WAY) + off
    clock.exchange(TimeReply(asked, at, at, told, RIG_RATE, ABOVE, 1), asked + 2.0 * WAY + waits)


class Textbook:
    """Two states, offset and drift: F P F' + Q, then the update, as matrices."""

    def __init__(self, at: float, var: float) -> None:
        self.at, self.P = at, np.diag([var, DRIFT**2])

    def predicted(self, at: float) -> np.ndarray:
        dt = at - self.at
        F = np.array([[1.0, dt], [0.0, 1.0]])
        return F @ self.P @ F.T + dt * np.diag([OFFSET_WALK**2, DRIFT_WALK**2])

    def update(self, at: float, var: float) -> None:
        P = self.predicted(at)
        H = np.array([[1.0, 0.0]])
        K = P @ H.T / (H @ P @ H.T + var)
        self.P, self.at = (np.eye(2) - K @ H) @ P, at


@pytest.mark.parametrize("gaps", [(1.0, 1.0, 1.0), (10.0, 700.0, 1300.0), (1000.0, 2.0, 1000.0)])
def test_variance_and_rate_are_the_textbooks(gaps: tuple[float, ...]) -> None:
    clock, asked = ClockFilter(), 100.0
    exchange(clock, asked)
    book = Textbook(asked + WAY, JITTER**2)
    for k, gap in enumerate(gaps):
        asked += gap
        waits = (0.0, 8e-3, 2e-3)[k]
        exchange(clock, asked, waits)
        # of what a reply waited beyond the shortest, a half may be in what it measures
        book.update(asked + WAY + 0.5 * waits, JITTER**2 + (0.5 * waits) ** 2)
        for later in (0.0, 3.0, 500.0):
            expected = book.predicted(book.at + later)[0, 0] + ABOVE
            assert clock.variance(book.at + later) == pytest.approx(expected, rel=1e-7)
        drift_std = math.sqrt(book.P[1, 1] * (1.0 + ABOVE / book.P[0, 0]))
        assert clock.drift_std == pytest.approx(drift_std, rel=1e-7)


def test_rig_time_runs_at_the_rate_that_is_told() -> None:
    clock = ClockFilter()
    for k in range(30):
        exchange(clock, 100.0 + 10.0 * k)
    for local in (400.0, 1000.0):
        moved = clock.rig_from_local(local + 1000.0) - clock.rig_from_local(local)
        assert moved == pytest.approx(1000.0 * clock.rig_rate, abs=1e-9)
        assert clock.local_from_rig(clock.rig_from_local(local)) == pytest.approx(local, abs=1e-9)
    assert clock.rig_rate == pytest.approx(RATE * RIG_RATE, abs=1e-8)
    assert clock.rig_from_local(500.0) == pytest.approx(
        rig(500.0), abs=1e-5
    )  # less what the prior of the drift holds back


@pytest.mark.parametrize("round_trip", [2.0, 2.001])
def test_a_reply_may_take_exactly_the_longest_round_trip(round_trip: float) -> None:
    clock = ClockFilter()
    clock.exchange(TimeReply(1000.0, 1001.0, 1001.0, 1001.0, 1.0, 0.0, 1), 1000.0 + round_trip)
    assert clock.synchronised == (round_trip == 2.0)


def synchronised() -> ClockFilter:
    clock = ClockFilter()
    for k in range(10):
        exchange(clock, 100.0 + k)
    return clock


def error(clock: ClockFilter, local: float) -> float:
    return clock.rig_from_local(local) - rig(local)


@pytest.mark.parametrize("rounds", [1, 3])
def test_three_that_disagree_count_in_a_row_only(rounds: int) -> None:
    clock, asked = synchronised(), 120.0
    for _ in range(rounds):
        for off in (4.0, 4.0, 0.0):  # two that lie, one that does not
            exchange(clock, asked, off=off)
            assert abs(error(clock, asked)) < 1e-3
            asked += 1.0
    for believed in (False, False, True):
        exchange(clock, asked, off=4.0)
        assert (abs(error(clock, asked) - 4.0) < 1e-2) == believed
        asked += 1.0


@pytest.mark.parametrize("times", [1, 2])
def test_a_change_of_neighbour_restarts_the_comparison_once(times: int) -> None:
    clock, asked = synchronised(), 120.0
    for _ in range(times):
        clock.change_neighbour()
        for k in range(1, 6):
            exchange(clock, asked)
            asked += 1.0
            assert clock.exchanges == k
    before = clock.variance(asked)
    exchange(clock, asked)
    assert clock.variance(asked) < before


@pytest.mark.parametrize("times", [1, 2])
def test_after_a_jump_one_step_is_unknown_and_the_next_is_told(times: int) -> None:
    clock, asked = synchronised(), 120.0
    for _ in range(times):
        clock.take_step()
        clock.doubt(0.3)
        exchange(clock, asked)
        assert math.isnan(clock.take_step())
        exchange(clock, asked + 1.0)
        assert abs(clock.take_step()) < 1e-3
        asked += 2.0
