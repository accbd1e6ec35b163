"""A string that rubs against the rock, by how it turns; and strings that only start, stop or are drilled with."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import KNOWN, PARTS, RECENT, RING, default_config
from node.kernels.record.node_record import new_node
from node.kernels.turns.rubbing import follow_rubbing
from node.kernels.turns.yaw_doubts import unexplained_var

Array = npt.NDArray[np.float64]
WHITE = 7.313e-3  # deg/s/sqrt(Hz), of a rate, thesis Table V.1
SPEED = 71.0  # deg/s
FINE = 64  # samples of a cycle
SHAKES = 2.0  # deg/s rms, of a string that is known to rub


class Driven:
    """A node below a head that turns or rests, told nothing but what its sensors read."""

    def __init__(self, seed: int = 0) -> None:
        self.node: Any = new_node(default_config())[0]
        self.random, self.cycles = np.random.default_rng(seed), 0
        self.state, self.guard = self.node["filter"], self.node["guard"]

    def turn(self, rates_dps: Array, torsional_dps: float = 0.0, resting: bool = False, split: bool = True) -> Driven:
        """So many cycles at mean rates (n,), with noise, and a flat vibration of 20 to 300 Hz about the axis."""
        at = (np.arange(len(rates_dps) * FINE) / FINE + self.cycles) * PERIOD
        eighths = self.vibration(at, torsional_dps).reshape(-1, PARTS, FINE // PARTS).mean(axis=2)
        eighths += rates_dps[:, None] + WHITE * math.sqrt(PARTS / PERIOD) * self.random.standard_normal(eighths.shape)
        for own in (eighths * DEG).tolist():
            self.cycle(np.array(own), resting, split)
        return self

    def vibration(self, at: Array, rms_dps: float) -> Array:
        """Sum of 60 waves at the times (n,) s, deg/s."""
        hertz, phases = self.random.uniform(20.0, 300.0, 60), self.random.uniform(0.0, math.tau, 60)
        waves = np.sin(math.tau * hertz[:, None] * at + phases[:, None]).sum(axis=0)
        return np.asarray(rms_dps * math.sqrt(2.0 / 60.0) * waves)

    def cycle(self, eighths: Array, resting: bool, split: bool) -> None:
        """One cycle of eight mean rates (rad/s), of which a sensor may tell the mean alone."""
        k, state, guard, rate = self.cycles, self.state, self.guard, float(eighths.mean())
        state["ring_rate"][k % RING, 2] = rate
        state["ring_split"][k % RECENT] = KNOWN if split else 0
        state["ring_parts"][k % RECENT] = eighths - rate
        state["ring_start"][k % RING], state["ring_end"][k % RING] = k * PERIOD, (k + 1) * PERIOD
        self.cycles = k + 1
        state["cycles"], state["now"] = k + 1, (k + 1) * PERIOD
        state["still_cycles"] = state["still_cycles"] + 1 if resting else 0
        guard["rest_cycles"] = guard["rest_cycles"] + 1 if resting else 0
        guard["rate"] = 0.0 if resting else rate
        follow_rubbing(self.node)

    def rest(self, cycles: int, torsional_dps: float = 0.0) -> Driven:
        """So many cycles at rest."""
        return self.turn(np.zeros(cycles), torsional_dps, resting=True)

    @property
    def std_deg(self) -> float:
        """Standard deviation of the yaw by it, which is what the node states of the present and of an aiding."""
        var = float(self.guard["rubbing"]["var"])
        assert self.state["systematic_var"] == pytest.approx(var, abs=1e-15)
        assert unexplained_var(self.node) == pytest.approx(var)
        return math.degrees(math.sqrt(var))


def even(cycles: int) -> Array:
    return np.full(cycles, SPEED)


@given(
    slope_dps2=st.floats(10.0, 200.0),
    speed_dps=st.floats(20.0, 340.0),
    phase=st.floats(0.0, 1.0),
    seed=st.integers(0, 99),
)
def test_a_string_that_turns_evenly_does_not_rub_however_it_starts(
    slope_dps2: float, speed_dps: float, phase: float, seed: int
) -> None:
    at = (np.arange(101) - phase) * PERIOD
    rate = np.minimum(np.clip(np.minimum(at, 45.0 - at) * slope_dps2, 0.0, None), speed_dps)
    assert Driven(seed).turn(0.5 * (rate[1:] + rate[:-1])).rest(20).std_deg == 0.0


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("ramp_s", [2.0, 4.0])
def test_nor_do_many_starts_and_stops(split: bool, ramp_s: float) -> None:
    """A stop is as uneven as a start, and the rest between the two parts them."""
    over = [0.0, ramp_s, 62.0 - ramp_s, 62.0]
    driven, ramp = Driven(4), np.interp(np.arange(120) * PERIOD, over, [0.0, SPEED, SPEED, 0.0])
    inside = np.diff(np.concatenate([[0.0], ramp]))[:, None] * (np.arange(PARTS) / PARTS - 0.4375)
    for _ in range(10):
        for own in (ramp[:, None] + inside + WHITE * driven.random.standard_normal((120, PARTS))).tolist():
            driven.cycle(np.array(own) * DEG, False, split)
        assert driven.rest(76).std_deg == 0.0


@pytest.mark.parametrize("split", [False, True])
def test_honest_noise_never_looks_like_it(split: bool) -> None:
    driven = Driven(3)
    for _ in range(20):
        driven.turn(even(200), split=split)
        assert driven.guard["rubbing"]["score"] < 12, "half of what is asked"
        assert driven.std_deg == 0.0


@pytest.mark.parametrize("ripple", [0.05, 0.3])
@pytest.mark.parametrize("swing_s", [1.2, 3.0, 8.0])
def test_a_string_whose_rate_swings_rubs(ripple: float, swing_s: float) -> None:
    swung = SPEED * (1.0 + ripple * np.sin(math.tau * PERIOD * np.arange(38) / swing_s))
    assert Driven().turn(swung).std_deg > 0.0, "within twenty seconds"


@pytest.mark.parametrize("torsional_dps", [1.2, 3.0, 10.0])
def test_a_string_that_vibrates_about_its_axis_rubs_and_one_at_rest_does_not(torsional_dps: float) -> None:
    assert Driven(5).turn(even(76), torsional_dps).std_deg > 0.0
    assert Driven(5).turn(even(76)).rest(76, torsional_dps).std_deg == 0.0


def test_what_it_may_have_turned_by_is_covered_and_no_more() -> None:
    """Three sigmas: a twist of 0.2 deg until some seconds after the stop, then a creep of 0.004 deg/s for 40 s."""
    driven = Driven(1).turn(even(60), SHAKES)
    turning = driven.std_deg
    assert 0.2 < 3.0 * turning < 0.25
    assert driven.rest(20).std_deg == turning, "it has not let go yet"
    creeping = driven.rest(40).std_deg
    assert 0.004 * 40.0 < 3.0 * creeping < 3.0 * turning
    assert driven.turn(even(1)).std_deg == turning


@pytest.mark.parametrize("of_drive", [{"torque": 200.0}, {"holding": 1}, {"wound": 1}, {"known": 1, "std": 0.01}])
def test_a_twist_that_is_told_is_not_doubted_as_well(of_drive: dict[str, float]) -> None:
    driven = Driven(1).turn(even(60), SHAKES)
    for name, value in of_drive.items():
        driven.node["twist"][name] = value
    follow_rubbing(driven.node)
    assert driven.guard["rubbing"]["var"] == 0.0
    assert driven.state["systematic_var"] == 0.0


def test_a_string_that_turns_evenly_for_five_minutes_does_not_rub_any_more() -> None:
    driven = Driven(2).turn(even(60), SHAKES)
    assert driven.turn(even(400)).std_deg > 0.0
    assert driven.turn(even(400)).std_deg == 0.0
