"""Covariance intersection: the weight of least determinant, and honest whatever the correlation."""

import math

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.filter.float64.update import innovation_var, intersect_covariance, joseph_update
from node.kernels.record.filter_record import STATES, Err

PSI = int(Err.YAW)
VARS = st.floats(1e-8, 1e-2)


def covariance(seed: int, yaw_var: float) -> np.ndarray:
    root = np.random.default_rng(seed).standard_normal((STATES, STATES))
    P = root @ root.T + 0.1 * np.eye(STATES)
    scale = np.ones(STATES)
    scale[PSI] = math.sqrt(yaw_var / P[PSI, PSI])
    return P * np.outer(scale, scale)


def row() -> np.ndarray:
    h = np.zeros(STATES)
    h[PSI] = 1.0
    return h


def after(P: np.ndarray, r_var: float, weight: float) -> np.ndarray:
    """Covariance of an update whose two sides have the weights w and 1 - w."""
    h, wide = row(), P / weight
    s = h @ wide @ h + r_var / (1.0 - weight)
    return wide - np.outer(wide @ h, wide @ h) / s


@given(st.integers(0, 10**6), VARS, VARS)
def test_the_weight_has_the_least_determinant(seed: int, yaw_var: float, r_var: float) -> None:
    P = covariance(seed, yaw_var)
    widened, ph = P.copy(), np.zeros(STATES)
    weight = intersect_covariance(widened, row(), r_var, ph)
    assert 0.0 < weight <= 1.0
    if weight == 1.0:
        np.testing.assert_array_equal(widened, P)
        assert yaw_var <= STATES * r_var * (1.0 + 1e-12)
        return
    np.testing.assert_allclose(widened, P / weight)
    least = np.linalg.slogdet(after(P, r_var, weight))[1]
    for other in (0.9 * weight, weight + 0.1 * (1.0 - weight)):
        assert np.linalg.slogdet(after(P, r_var, other))[1] >= least - 1e-9
    s = innovation_var(widened, row(), r_var / (1.0 - weight), ph)
    joseph_update(widened, ph, s, np.zeros(STATES))
    np.testing.assert_allclose(widened, after(P, r_var, weight), rtol=1e-6, atol=1e-9)


@given(st.integers(0, 10**6), st.floats(1e-4, 1e-2), st.floats(-1.0, 1.0))
def test_no_correlation_makes_it_overconfident(seed: int, yaw_var: float, correlation: float) -> None:
    P, r_var = covariance(seed, yaw_var), 1e-6
    widened, ph, gain = P.copy(), np.zeros(STATES), np.zeros(STATES)
    weight = intersect_covariance(widened, row(), r_var, ph)
    assert weight < 1.0
    joseph_update(widened, ph, innovation_var(widened, row(), r_var / (1.0 - weight), ph), gain)
    # errors e of the estimate and v of the measurement, correlated through the yaw: e+ = (I - K h) e + K v
    cross = correlation * math.sqrt(r_var / P[PSI, PSI]) * P[:, PSI]
    keep = np.eye(STATES) - np.outer(gain, row())
    true = keep @ P @ keep.T + r_var * np.outer(gain, gain)
    true += np.outer(keep @ cross, gain) + np.outer(gain, keep @ cross)
    scale = np.sqrt(np.diagonal(widened))
    assert np.linalg.eigvalsh((widened - true) / np.outer(scale, scale)).min() > -1e-6
