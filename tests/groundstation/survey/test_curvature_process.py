"""The path between stations against the matrix exponential of the same linear system."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import expm

from groundstation.survey.path.curvature_process import process_step

lengths = st.floats(0.01, 60.0)
correlation_lengths = st.floats(2.0, 1000.0)


@given(lengths, correlation_lengths)
def test_a_step_is_that_of_the_linear_system(length: float, correlation_length: float) -> None:
    """Van Loan, IEEE Trans. Automat. Contr. 23 (1978): transition and noise from one exponential, a part at a time."""
    parts = max(1, int(np.ceil(length / correlation_length)))
    small, noise = exact_step(length / parts, correlation_length)
    whole, gathered = np.eye(3), np.zeros((3, 3))
    for _ in range(parts):
        whole, gathered = small @ whole, small @ gathered @ small.T + noise
    transition, found = process_step(length, correlation_length)
    size = np.sqrt(np.outer(np.diag(gathered), np.diag(gathered)))
    assert transition == pytest.approx(whole, rel=1e-9, abs=1e-9)
    assert found / size == pytest.approx(gathered / size, abs=1e-8)


@given(lengths, lengths, correlation_lengths)
def test_two_legs_are_one_leg(first: float, second: float, correlation_length: float) -> None:
    upper, upper_noise = process_step(first, correlation_length)
    lower, lower_noise = process_step(second, correlation_length)
    transition, noise = process_step(first + second, correlation_length)
    assert lower @ upper == pytest.approx(transition, rel=1e-9, abs=1e-12)
    assert lower @ upper_noise @ lower.T + lower_noise == pytest.approx(noise, rel=1e-8, abs=1e-15)


def exact_step(length: float, correlation_length: float) -> tuple[np.ndarray, np.ndarray]:
    drift = np.array([[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0, 0.0, -1.0 / correlation_length]])
    block = np.zeros((6, 6))
    block[:3, :3], block[3:, 3:], block[2, 5] = -drift, drift.T, 2.0 / correlation_length
    found = expm(block * length)
    return found[3:, 3:].T, found[3:, 3:].T @ found[:3, 3:]
