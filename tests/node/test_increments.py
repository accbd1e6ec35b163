"""The inside of a cycle by its parts: exact where the rate is a line, bounded where it bends or jumps."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from one_node import node_of

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.filter.increments import bent_angle, mean_excess_rate
from node.kernels.record.filter_record import (
    BEGAN_STILL,
    ENDED_STILL,
    KNOWN,
    PARTS,
    RECENT,
    RING,
    default_config,
    new_state,
)
from node.kernels.record.node_record import BEHIND, LATE, PART, READING, SPLIT, WX
from node.kernels.record.ring import is_split, stood_still
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.node_step import node_step
from node.process.drivers.fifo_window import parts_of

INSIDE = st.floats(0.0, 1.0)
CYCLES = 5
MIDDLE = 2  # cycle that is looked at, with two on either side
Course = Callable[[float], float]  # angle (rad) by time (s)


def ring_of(turned: Course) -> np.void:
    """A filter whose last cycles turned as told, part by part."""
    state = new_state(default_config())[0]
    for cycle in range(CYCLES):
        begin, end = cycle * PERIOD, (cycle + 1) * PERIOD
        borders = np.linspace(begin, end, PARTS + 1)
        rates = np.diff([turned(t) for t in borders]) * (PARTS / PERIOD)
        state["ring_start"][cycle], state["ring_end"][cycle] = begin, end
        state["ring_rate"][cycle, 2] = rates.mean()
        state["ring_split"][cycle], state["ring_parts"][cycle] = KNOWN, rates - rates.mean()
    state["cycles"] = CYCLES
    return state


def angle(state: np.void, begin: float, end: float) -> float:
    """What the ring says was turned from ``begin`` to ``end`` of the middle cycle."""
    return float((state["ring_rate"][MIDDLE, 2] + mean_excess_rate(state, MIDDLE, begin, end)) * (end - begin))


@given(st.floats(-1.2, 1.2), st.floats(-0.6, 0.6), INSIDE, INSIDE)
def test_where_the_rate_is_a_line_every_angle_is_exact(rate: float, slope: float, one: float, other: float) -> None:
    state = ring_of(lambda t: rate * t + 0.5 * slope * t * t)
    begin, end = (PERIOD * (MIDDLE + x) for x in sorted((one, other)))
    assert angle(state, begin, end) == pytest.approx(rate * (end - begin) + 0.5 * slope * (end**2 - begin**2), abs=1e-9)
    assert bent_angle(state, MIDDLE, end) == pytest.approx(0.0, abs=1e-9)


@given(INSIDE, INSIDE, st.floats(-1.0, 1.0))
def test_angles_add_up(one: float, other: float, slope: float) -> None:
    state = ring_of(lambda t: slope * abs(t - 2.3 * PERIOD) * (t - 2.3 * PERIOD))
    begin, end = PERIOD * MIDDLE, PERIOD * (MIDDLE + 1)
    first, second = sorted((begin + one * PERIOD, begin + other * PERIOD))
    parts = angle(state, begin, first) + angle(state, first, second) + angle(state, second, end)
    assert parts == pytest.approx(state["ring_rate"][MIDDLE, 2] * PERIOD, abs=1e-9)


@given(st.floats(-1.0, 2.0), INSIDE)
def test_where_a_ramp_begins_or_ends_the_angle_is_off_by_no_more_than_its_bend_says(kink: float, at: float) -> None:
    """A stop from 35 deg/s^2 somewhere in the cycle or beside it."""
    slope, stop = 35.0 * DEG, PERIOD * (MIDDLE + kink)
    state = ring_of(lambda t: -0.5 * slope * min(t - stop, 0.0) ** 2)
    begin, end = PERIOD * MIDDLE, PERIOD * (MIDDLE + at)
    truth = -0.5 * slope * (min(end - stop, 0.0) ** 2 - min(begin - stop, 0.0) ** 2)
    assert abs(angle(state, begin, end) - truth) <= 1.02 * abs(bent_angle(state, MIDDLE, end)) + 1e-9


@given(INSIDE, INSIDE)
def test_where_the_head_stops_dead_the_parts_beside_it_say_so(stop: float, at: float) -> None:
    rate, dead = 15.0 * DEG, PERIOD * (MIDDLE + stop)
    state = ring_of(lambda t: rate * min(t - dead, 0.0))
    begin, end = PERIOD * MIDDLE, PERIOD * (MIDDLE + at)
    off = angle(state, begin, end) - rate * (min(end, dead) - begin)
    assert abs(off) <= 1.5 * abs(bent_angle(state, MIDDLE, end)) + 1e-9


def test_the_oldest_parts_are_those_of_the_coming_cycle_already() -> None:
    state = new_state(default_config())[0]
    state["cycles"], state["ring_split"] = 20, KNOWN
    assert [cycle for cycle in range(25) if is_split(state, cycle)] == list(range(20 - RECENT + 1, 20))


@pytest.mark.parametrize(
    ("before", "after", "still"), [(0, 0, False), (ENDED_STILL, 0, False), (0, BEGAN_STILL, False)]
)
def test_a_cycle_between_two_that_turned_is_no_rest(before: int, after: int, still: bool) -> None:
    state = between(before, after)
    assert stood_still(state, 1) is still


def test_a_cycle_is_a_rest_where_its_neighbours_are_at_rest_as_far_as_they_touch_it() -> None:
    assert stood_still(between(ENDED_STILL, BEGAN_STILL), 1)
    assert not stood_still(between(BEGAN_STILL, ENDED_STILL), 1)


def between(before: int, after: int) -> np.void:
    """Three cycles of which the one in the middle is quiet, beside two that turned somewhere."""
    state = new_state(default_config())[0]
    state["cycles"], state["ring_quiet"][1] = 3, 1
    state["ring_split"][:3] = KNOWN | before, KNOWN, KNOWN | after
    return state


@given(st.floats(-1.2, 1.2), st.floats(-0.6, 0.6), st.floats(0.0, 0.03), st.floats(0.0, 0.03), st.integers(20, 300))
def test_a_driver_shares_frames_between_the_parts(rate: float, slope: float, since: float, late: float, n: int) -> None:
    """Of a rate that is a line the parts are off by what a frame bends within itself."""
    window = -since, PERIOD - late
    length = (window[1] - window[0]) / n
    frames = rate + slope * (window[0] + (np.arange(n) + 0.5) * length)
    told = np.array(parts_of(frames, window, 0.0, PERIOD))
    borders = np.array([-since, *np.linspace(0.0, PERIOD, PARTS + 1)[:-1], PERIOD - late])
    lengths = np.diff(borders)
    middles = 0.5 * (borders[1:] + borders[:-1])
    known = lengths > 1e-9
    np.testing.assert_allclose(
        (told * lengths)[known], ((rate + slope * middles) * lengths)[known], atol=abs(slope) * length**2 / 4.0 + 1e-12
    )
    assert np.sum(told * lengths) == pytest.approx(frames.mean() * (window[1] - window[0]), abs=1e-9)


@pytest.mark.parametrize(
    ("count", "window"),
    [(15, (0.0, PERIOD)), (26, (0.01, PERIOD)), (26, (0.0, 0.85 * PERIOD)), (26, (0.0, PERIOD + 0.01))],
)
def test_a_window_that_is_not_the_cycles_is_not_looked_into(count: int, window: tuple[float, float]) -> None:
    assert parts_of(np.ones(count), window, 0.0, PERIOD) == ()


class Turned:
    """A node whose IMUs turn about an axis with a FIFO whose windows end late."""

    def __init__(self, turned: Course, imus: int = 1, late: float = 0.0, gain: float = 1.0) -> None:
        self.nodes, self.settings, _ = node_of(imus, 0, np.random.default_rng(1))
        self.nodes["filter"]["mode"] = 3
        self.nodes["mount"]["axis"] = 0.0, 0.0, 1.0
        self.parameters = np.concatenate([identity_parameters()] * (1 + imus))
        self.parameters["identity"][0] = int(gain == 1.0)
        self.parameters["gyroscope"]["matrix"][0, 0, 2, 2] = gain
        self.turned, self.late, self.imus, self.gain, self.k = turned, late, imus, gain, 0

    def step(self, spoil: Callable[[np.ndarray], None] | None = None) -> np.void:
        """Give it the next cycle; returns its filter."""
        begin, end = self.k * PERIOD, (self.k + 1) * PERIOD
        window = begin - (self.late if self.k else 0.0), end - self.late
        borders = np.array([window[0], *np.linspace(begin, end, PARTS + 1)[:-1], window[1]])
        angles = np.array([self.turned(t) for t in borders])
        lengths = np.diff(borders)
        rates = np.divide(np.diff(angles), lengths, out=np.zeros(PARTS + 1), where=lengths > 0.0)
        readings = np.zeros((self.imus, READING))
        readings[:, WX + 2] = self.gain * (angles[-1] - angles[0]) / (window[1] - window[0])
        readings[:, WX : WX + 3] += 1e-9 * self.k  # a reading that repeats itself is a fault
        readings[:, 3:6] = np.array([0.0, 0.0, -9.81]) + 1e-6 * self.k
        readings[:, LATE], readings[:, SPLIT], readings[:, BEHIND:] = self.late, 1.0, self.gain * rates
        if spoil is not None:
            spoil(readings)
        moment = np.array([begin, end, 1.0, 1.0, 1e-6, 1.0, 0.0, 0.0])
        node_step(self.nodes, self.settings, self.parameters, readings, moment)
        self.k += 1
        return self.nodes[0]["filter"]

    def known(self, cycle: int) -> np.ndarray:
        """Rates of the parts of a cycle as the ring has them."""
        state = self.nodes[0]["filter"]
        return state["ring_rate"][cycle % RING, 2] + state["ring_parts"][cycle % RECENT]

    def true(self, cycle: int) -> np.ndarray:
        """Rates of the parts."""
        borders = np.linspace(cycle * PERIOD, (cycle + 1) * PERIOD, PARTS + 1)
        return np.diff([self.turned(t) for t in borders]) * (PARTS / PERIOD)


def ramp(t: float) -> float:
    """From rest to 71 deg/s, from 1.3 s on in two seconds."""
    slope = 35.5 * DEG
    return 0.5 * slope * min(max(t - 1.3, 0.0), 2.0) ** 2 + 71.0 * DEG * max(t - 3.3, 0.0)


@pytest.mark.parametrize("late", [0.0, 0.004, 0.03])
@pytest.mark.parametrize("imus", [1, 3])
def test_what_a_late_window_lacks_the_next_one_puts_right(late: float, imus: int) -> None:
    """Cycle by cycle over the start of a ramp and its end, to a ten-thousandth of a degree a part."""
    node = Turned(ramp, imus, late)
    node.step()
    for cycle in range(1, 10):
        node.step()
        if cycle > 1:
            off = (node.known(cycle - 1) - node.true(cycle - 1)) * PERIOD / PARTS
            assert np.abs(off[:-1]).max() < 1e-4 * DEG, cycle
            assert abs(off[-1]) < (0.01 if late else 1e-4) * DEG, cycle
            assert abs(off.sum()) < (0.01 if late else 1e-4) * DEG, cycle


def test_parts_are_corrected_as_readings_are() -> None:
    node = Turned(ramp, gain=1.03)
    for _ in range(6):
        node.step()
    np.testing.assert_allclose(node.known(5), node.true(5), atol=1e-6)


def test_parts_about_a_leaning_axis_are_those_about_the_axis() -> None:
    lean = math.radians(3.0)
    node = Turned(ramp)
    node.nodes["mount"]["axis"][:, 0] = math.sin(lean), 0.0, math.cos(lean)

    def leaning(readings: np.ndarray) -> None:
        rates = readings[0, WX + 2]
        readings[0, WX], readings[0, WX + 2] = rates * math.sin(lean), rates * math.cos(lean)
        readings[0, BEHIND:] *= math.cos(lean)

    for _ in range(6):
        node.step(leaning)
    np.testing.assert_allclose(node.known(5), node.true(5), atol=1e-6)


def spoilt_part(readings: np.ndarray) -> None:
    readings[-1, PART + 3] = math.nan


def untold(readings: np.ndarray) -> None:
    readings[-1, SPLIT] = 0.0


def at_its_range(readings: np.ndarray) -> None:
    readings[:, WX + 2] = 20.0


@pytest.mark.parametrize(
    ("spoil", "imus"), [(spoilt_part, 1), (spoilt_part, 3), (untold, 1), (untold, 3), (at_its_range, 1)]
)
def test_a_cycle_whose_inside_is_not_known_for_sure_is_its_mean_alone(
    spoil: Callable[[np.ndarray], None], imus: int
) -> None:
    node = Turned(ramp, imus)
    for _ in range(4):
        state = node.step()
    assert is_split(state, 3)
    state = node.step(spoil)
    assert state["cycles"] == 5
    assert not is_split(state, 4)
