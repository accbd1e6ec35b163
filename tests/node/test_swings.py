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
from node.kernels.turns.swings import follow_swing, swing_var

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
