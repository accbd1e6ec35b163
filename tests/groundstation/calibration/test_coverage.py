"""Stated intervals hold what they state: Student's quantiles, and records drawn many times over."""

import numpy as np
import pytest
from scipy.special import stdtrit

from groundstation.calibration.attitudes import fit_attitudes, true_vectors
from groundstation.calibration.coverage import coverage_factor
from groundstation.calibration.turntable import as_observations

MATRIX = np.array([[9.9, 0.2, -0.1], [-0.3, 9.7, 0.15], [0.05, -0.25, 9.85]])
BIAS = np.array([0.1, -0.2, 0.3])
RUNS = 4000
NINE = ((0, 0), (0, 90), (0, 180), (0, -90), (90, 0), (-90, 0), (45, 0), (-45, 90), (0, 45))


@pytest.mark.parametrize("degrees", [1, 2, 3, 5, 10, 72, 500])
@pytest.mark.parametrize("coverage", [0.5, 0.95, 0.99])
def test_the_factor_is_students_quantile(degrees: int, coverage: float) -> None:
    assert coverage_factor(degrees, coverage) == pytest.approx(
        float(stdtrit(degrees, 0.5 * (1.0 + coverage))), rel=1e-9
    )


def test_known_noise_has_the_normal_factor_and_many_degrees_come_near_it() -> None:
    assert coverage_factor(None) == pytest.approx(1.959964, abs=1e-6)
    assert coverage_factor(2) == pytest.approx(4.302653, abs=1e-6)
    assert coverage_factor(100_000) == pytest.approx(coverage_factor(None), rel=1e-4)


def designs(name: str) -> np.ndarray:
    if name == "turn table":
        return as_observations(np.zeros((3, 3)), np.zeros((3, 3)), 1.0)[0]
    pitch, roll = np.radians(np.array(NINE, float)).T
    nine = true_vectors(pitch, roll)
    return nine if name == "nine attitudes" else np.tile(nine, (9, 1))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "degrees"), [("turn table", 2), ("nine attitudes", 5), ("nine, nine times", 77)])
def test_the_stated_interval_covers_95_percent(name: str, degrees: int) -> None:
    """Bias and the three entries of an axis, whose noise is its own: 4000 axes each, 93 to 97 % within the interval."""
    truth, rng = designs(name), np.random.default_rng(8)
    held, narrow, axes = np.zeros(4), np.zeros(4), 0
    wanted, exact = np.column_stack([MATRIX, BIAS]), truth @ MATRIX.T + BIAS
    while axes < RUNS:
        found = fit_attitudes(truth, exact + rng.normal(0.0, 0.01, exact.shape))
        off = np.abs(np.column_stack([found.matrix, found.bias]) - wanted)
        std = np.column_stack([found.matrix_std(), found.bias_std()])
        held += np.count_nonzero(off <= found.coverage_factor() * std, axis=0)
        narrow += np.count_nonzero(off <= 1.96 * std, axis=0)
        axes += 3
    assert found.degrees == degrees
    assert np.all(held / axes > 0.93)
    assert np.all(held / axes < 0.97)
    if degrees == 2:
        assert np.all(narrow / axes < 0.84)  # what 1.96 standard errors hold
