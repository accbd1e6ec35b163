"""The error model against the integrator it linearises, and the properties of a covariance."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.filter.float64.propagation import propagate_covariance
from node.kernels.filter.float64.update import innovation_var, joseph_update
from node.kernels.record.filter_record import STATES, Err, default_config


def random_covariance(seed: int) -> np.ndarray:
    root = np.random.default_rng(seed).normal(size=(STATES, STATES))
    return root @ root.T


def transition(wz: float, dt: float) -> np.ndarray:
    """F by propagating unit errors without noise."""
    config = default_config()
    for name in ("gyro_noise", "bias_std", "still_walk", "stamp_walk"):
        config[0][name] = 0.0
    f = np.zeros((STATES, STATES))
    for i in range(STATES):
        for j in range(i, STATES):
            P = np.zeros((STATES, STATES))
            P[i, j] = P[j, i] = 1.0
            propagate_covariance(P, wz, dt, 1.0, config[0])
            if i == j:
                f[:, i] = np.sqrt(np.diag(P))
    return f


@pytest.mark.slow
def test_yaw_error_grows_with_bias_and_scale_as_the_integrator_does() -> None:
    wz, dt = 1.2, PERIOD
    f = transition(wz, dt)
    assert f[Err.YAW, Err.BIAS_Z] == pytest.approx(dt)
    assert f[Err.YAW, Err.SCALE] == pytest.approx(wz * dt)
    assert f[Err.BIAS_Z, Err.BIAS_Z] == pytest.approx(math.exp(-dt / default_config()[0]["bias_tau"][2]))


def test_tilt_error_turns_with_the_spin() -> None:
    f = transition(1.2, PERIOD)
    assert f[Err.TILT_X, Err.TILT_X] == pytest.approx(abs(math.cos(1.2 * PERIOD)))
    assert f[Err.TILT_Y, Err.TILT_X] == pytest.approx(abs(math.sin(1.2 * PERIOD)))


def test_bias_variance_settles_at_the_gauss_markov_variance() -> None:
    config = default_config()
    P = np.zeros((STATES, STATES))
    for _ in range(2000):
        propagate_covariance(P, 0.0, PERIOD, 1.0, config[0])
    for axis in range(3):
        assert P[Err.BIAS_X + axis, Err.BIAS_X + axis] == pytest.approx(config[0]["bias_std"][axis] ** 2, rel=1e-6)


def test_angle_random_walk_alone_grows_as_the_root_of_time() -> None:
    config = default_config()
    config[0]["bias_std"] = 0.0
    P = np.zeros((STATES, STATES))
    for _ in range(190):
        propagate_covariance(P, 0.0, PERIOD, 1.0, config[0])
    assert math.sqrt(P[Err.YAW, Err.YAW]) == pytest.approx(config[0]["gyro_noise"][2] * math.sqrt(100.0))


@given(st.integers(0, 10_000), st.floats(-6.0, 6.0), st.floats(1e-3, 5.0))
def test_covariance_stays_symmetric_and_positive(seed: int, wz: float, dt: float) -> None:
    P = random_covariance(seed)
    propagate_covariance(P, wz, dt, 1.0, default_config()[0])
    assert np.array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > -1e-9 * np.trace(P)


@given(st.integers(0, 10_000), st.floats(1e-6, 1e3))
def test_joseph_form_is_the_textbook_update(seed: int, r_var: float) -> None:
    P = random_covariance(seed)
    h = np.random.default_rng(seed + 1).normal(size=STATES)
    before = P.copy()
    ph, gain = np.zeros(STATES), np.zeros(STATES)
    s = innovation_var(P, h, r_var, ph)
    joseph_update(P, ph, s, gain)
    k = before @ h / (h @ before @ h + r_var)
    left = np.eye(STATES) - np.outer(k, h)
    expected = left @ before @ left.T + r_var * np.outer(k, k)
    assert s == pytest.approx(h @ before @ h + r_var)
    np.testing.assert_allclose(P, expected, rtol=1e-7, atol=1e-7 * np.trace(before))
    np.testing.assert_allclose(gain, k, rtol=1e-9, atol=1e-12)
    assert np.array_equal(P, P.T)
    assert np.linalg.eigvalsh(P).min() > -1e-9 * np.trace(before)
