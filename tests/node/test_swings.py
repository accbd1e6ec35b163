"""A drive that swings between cycles: told from a ramp, and worth what the filter's interpolation is wrong by."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import RING, default_config
from node.kernels.record.node_record import new_node
from node.kernels.turns.swings import explains_jump, follow_inside, follow_swing, is_beat, swing_var

Array = npt.NDArray[np.float64]
SPEED = math.radians(71.0)


def swung(rates: Array) -> list[float]:
    """Variance (rad^2) after each cycle of these mean rates (n,) rad/s."""
    node = new_node(default_config())
    state, found = node["filter"][0], []
    for k, rate in enumerate(rates.tolist()):
        state["ring_rate"][k % RING, 2] = rate
        state["cycles"] = k + 1
        follow_swing(node[0])
        found.append(swing_var(node[0]))
    return found


def mean_rates(angle: Array) -> Array:
    return np.diff(angle) / PERIOD


@given(
    slope_dps2=st.floats(5.0, 200.0),
    speed_dps=st.floats(5.0, 340.0),
    phase=st.floats(0.0, 1.0),
    seed=st.integers(0, 1000),
)
def test_a_ramp_up_and_down_is_no_swing(slope_dps2: float, speed_dps: float, phase: float, seed: int) -> None:
    fine = np.arange(0.0, 400.0, 0.001)
    rate = np.clip(np.minimum(fine - 20.0 - phase, 380.0 - fine) * math.radians(slope_dps2), 0.0, None)
    angle = np.cumsum(np.minimum(rate, math.radians(speed_dps))) * 0.001
    rates = mean_rates(np.interp(np.arange(0.0, 399.0, PERIOD), fine, angle))
    noise = math.radians(0.0101) * np.random.default_rng(seed).standard_normal(len(rates))
    assert not any(swung(rates + noise))


@pytest.mark.parametrize("ripple", [0.2, 0.5, 1.0])
@pytest.mark.parametrize("swing_s", [3.0, 4.0, 6.0])
def test_a_ripple_is_worth_its_bends(ripple: float, swing_s: float) -> None:
    cycles = np.arange(64)
    variances = swung(SPEED * (1.0 + ripple * np.cos(math.tau * PERIOD * cycles / swing_s)))
    assert next(k for k, var in enumerate(variances) if var > 0.0) < 20
    bend = ripple * SPEED * (1.0 - math.cos(math.tau * PERIOD / swing_s))
    assert np.mean(variances[-12:]) == pytest.approx(0.5 * (bend * PERIOD / (36.0 * math.sqrt(3.0))) ** 2, rel=0.15)


def test_a_drive_that_has_stopped_swings_no_more() -> None:
    ends = PERIOD * np.arange(0, 60)
    turned = SPEED * (ends + 0.6 / math.tau * np.sin(math.tau * ends / 4.0))
    variances = swung(np.concatenate([mean_rates(turned), np.zeros(20)]))
    assert variances[58] > 0.0
    assert not any(variances[-8:])


class Beating:
    """A node under a head that swings inside its cycles: it sees their means, and the encoder's rate at an aiding."""

    def __init__(self) -> None:
        self.nodes = new_node(default_config())
        self.node = self.nodes[0]
        self.cycles = 0

    def aid(self, mean: float, told: float, innovation: float = 0.0) -> None:
        state = self.node["filter"]
        state["ring_rate"][self.cycles % RING, 2] = mean
        self.cycles += 1
        state["cycles"], state["innovation"] = self.cycles, innovation
        self.node["guard"]["rate"] = told
        follow_inside(self.node)


@pytest.mark.parametrize("swing_s", [0.46, 0.5, 0.55, 0.6])
def test_a_beat_is_no_step_of_the_gyroscope(swing_s: float) -> None:
    """Of w (1 + r cos x), x = 2 pi t / T, the angle is off by r w T sin x / (2 pi), taken once a cycle."""
    beating, ripple = Beating(), 0.3
    phase = math.tau * PERIOD / swing_s * np.arange(60)
    off = ripple * SPEED * swing_s / math.tau * np.sin(phase)
    for k in range(60):
        beating.aid(SPEED, SPEED * (1.0 + ripple * math.cos(phase[k])), float(off[k]))
    grown = np.diff(off) / PERIOD
    assert is_beat(beating.node, float(np.max(np.abs(grown)) / math.sqrt(2.0)))
    assert explains_jump(beating.node)


@pytest.mark.parametrize("step_dps", [0.2, 1.0, 3.0, 8.0])
def test_a_step_of_the_gyroscope_is_no_beat(step_dps: float) -> None:
    stepped = Beating()
    for k in range(30):
        stepped.aid(SPEED + math.radians(step_dps) * (k > 10), SPEED, math.radians(1.0))
    assert not is_beat(stepped.node, math.radians(step_dps))


def test_an_even_drive_explains_no_jump() -> None:
    even, random = Beating(), np.random.default_rng(3)
    for _ in range(40):
        even.aid(SPEED, SPEED + math.radians(0.3) * float(random.standard_normal()), math.radians(1.0))
    assert not explains_jump(even.node)
    assert not is_beat(even.node, math.radians(0.2))
