"""The integer covariance: positive, symmetric, within its range, and that of the float64 kernel."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import CEILING, DEG, PERIOD, VAR_Q
from node.kernels.filter.fixed.propagation import limit_variance, widen_variance
from node.kernels.filter.fixed.update import innovation_var, joseph_update
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.record.filter_record import STATES, CycleStatus, Err, default_config, new_state
from node.kernels.record.integer_filter import FIXED_STATE
from node.kernels.step.fixed_node import FixedNode
from node.kernels.string.relay import offer_aiding

G = 9.81


class Pair:
    """Both kernels on the same inputs."""

    def __init__(self) -> None:
        self.config = default_config()[0]
        self.reference, self.shadow = new_state(default_config())[0], new_state(default_config())[0]
        self.fixed = FixedNode()
        self.now, self.sequence = 1000.0, 0

    def cycle(self, rate: np.ndarray, force: np.ndarray, dt: float = PERIOD) -> CycleStatus:
        end = self.now + dt
        self.expected = CycleStatus(run_cycle(self.reference, self.config, rate, force, self.now, end, 1))
        status = CycleStatus(self.fixed.run_cycle(self.shadow, self.config, rate, force, self.now, end, 1))
        self.now = end
        return status

    def aid(self, yaw: float, age: float, var: float = (0.003 * DEG) ** 2) -> None:
        self.sequence += 1
        given = (yaw, var, 0.0, 0.0, self.now - age, self.sequence, 0)
        offer_aiding(self.reference, self.config, *given)
        self.fixed.offer_aiding(self.shadow, self.config, *given)

    def check(self) -> None:
        P = self.fixed.state["P"]
        assert (P == P.T).all()
        assert (np.diag(P) >= 0).all()
        shown = self.shadow["P"]
        scale = 1.0 / np.sqrt(np.maximum(np.diag(shown), 1e-30))
        assert np.linalg.eigvalsh(shown * scale[:, None] * scale[None, :]).min() > -1e-5


STEP = st.tuples(
    st.floats(-5.0, 5.0), st.integers(1, 60), st.booleans(), st.floats(0.0, 1.5), st.floats(0.05, 1.4), st.floats(0, 3)
)


@settings(max_examples=15, deadline=None)
@given(st.lists(STEP, min_size=1, max_size=8), st.integers(0, 2**32 - 1))
def test_whatever_comes_the_covariance_stays_one(
    steps: list[tuple[float, int, bool, float, float, float]], seed: int
) -> None:
    pair, random = Pair(), np.random.default_rng(seed)
    for spin, cycles, moving, age, dt, inclination in steps:
        for _ in range(cycles):
            rate = 1e-4 * random.standard_normal(3) + (np.array([0.0, 0.0, spin]) if moving else 0.0)
            force = -G * np.array([np.sin(inclination), 0.0, np.cos(inclination)]) + 3e-3 * random.standard_normal(3)
            status = pair.cycle(rate, force, dt)
            assert CycleStatus.FILTER_FAULT not in status
            pair.aid(float(random.uniform(0, 6)), age)
            pair.check()  # corrections by such impossible readings may be held, and are then counted


@pytest.mark.slow
def test_the_covariances_agree_entry_by_entry() -> None:
    pair, random = Pair(), np.random.default_rng(5)
    yaw = 1.0
    for k in range(3000):
        spin = 71.0 * DEG if k % 300 > 110 else 0.0
        force = -G * np.array([-0.3 * np.cos(yaw), 0.3 * np.sin(yaw), 0.954])
        pair.cycle(np.array([0.0, 0.0, spin]) + 1e-4 * random.standard_normal(3), force)
        yaw += spin * PERIOD
        pair.aid(yaw % (2 * np.pi), 0.05)
        if k % 100 == 0:
            P, found = pair.reference["P"], pair.shadow["P"]
            sigma = np.sqrt(np.diag(P))
            np.testing.assert_allclose(found / np.outer(sigma, sigma), P / np.outer(sigma, sigma), atol=1e-4)


@pytest.mark.slow
def test_an_outage_without_end_is_held_and_counted() -> None:
    pair = Pair()
    for _ in range(200):
        pair.cycle(np.zeros(3), np.array([0.0, 0.0, -G]))
    pair.aid(1.0, 0.0)
    for k in range(30_000):
        pair.cycle(np.array([0.0, 0.0, 5.0]), np.array([0.0, 0.0, -G]))
        if k % 500 == 0:
            pair.check()
    assert pair.fixed.overflows > 0
    assert pair.shadow["P"][Err.YAW, Err.YAW] == pytest.approx(12.0, rel=0.07)
    assert (pair.fixed.state["P"].diagonal() <= CEILING).all()


def test_holding_a_variance_keeps_the_correlations() -> None:
    record = np.zeros(1, FIXED_STATE)[0]
    root = np.random.default_rng(1).normal(size=(STATES, STATES))
    P = (root @ root.T) * 2.0**VAR_Q / 8.0
    P[2, :] *= 5.0
    P[:, 2] *= 5.0
    fixed = P.astype(np.int64)
    limit_variance(record, fixed, 2)
    scale, before = 1.0 / np.sqrt(np.diag(fixed)), 1.0 / np.sqrt(np.diag(P))
    np.testing.assert_allclose(fixed * np.outer(scale, scale), P * np.outer(before, before), atol=1e-12)
    assert fixed[2, 2] <= CEILING
    assert record["overflows"] == 1


def test_a_variance_is_widened_to_the_end_of_its_range() -> None:
    record, P = np.zeros(1, FIXED_STATE)[0], np.zeros((STATES, STATES), np.int64)
    widen_variance(record, P, 2, 5)
    assert (P[2, 2], record["overflows"]) == (5, 0)
    widen_variance(record, P, 2, CEILING)
    assert (P[2, 2], record["overflows"]) == (CEILING, 1)


@pytest.mark.parametrize("variance", [3e-9, 1e-4, 1.0, 10.0])
def test_a_rounded_gain_leaves_the_variance_it_should(variance: float) -> None:
    state, r = np.zeros(1, FIXED_STATE)[0], 1e-12
    state["P"][2, 2] = round(variance * 2.0**VAR_Q)
    joseph_update(state, innovation_var(state, 2, 1 << 31, 7, 0, round(r * 2.0**VAR_Q)))
    assert state["P"][2, 2] * 2.0**-VAR_Q == pytest.approx(r * variance / (r + variance), rel=1e-3)
