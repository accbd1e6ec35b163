"""A walk of the bias in the residuals of a fit: records drawn with designs, sizes and kinds of their own."""

from __future__ import annotations

import math

import numpy as np
import pytest
import scipy.stats

from groundstation.calibration.residual_walk import find_walk, walk_widening

RUNS = 300
NOISES = np.array([1.0, 1.5, 0.7])  # of the axes, no two alike


def wander(kind: str, size: float, count: int, random: np.random.Generator) -> np.ndarray:
    """Bias (n, 3) in the order of the readings, in noises of an axis."""
    if kind == "walk":
        return size * np.cumsum(random.standard_normal((count, 3)), axis=0)
    if kind == "ramp":
        return size * np.linspace(-1.0, 1.0, count)[:, None] * np.ones(3)
    keep, bias = math.exp(-1.0 / 5.0), np.empty((count, 3))  # a Gauss-Markov bias of five readings
    bias[0] = random.standard_normal(3)
    for k in range(1, count):
        bias[k] = keep * bias[k - 1] + math.sqrt(1.0 - keep**2) * random.standard_normal(3)
    return size * bias


def judged(kind: str, size: float, count: int) -> tuple[float, float, float]:
    """Share of records that land, of their parameters inside plain intervals, and inside the widened ones."""
    random = np.random.default_rng(20)
    landed, plain, wide = 0, [], []
    for k in range(RUNS):
        if k % 50 == 0:
            truth = random.standard_normal((count, 3))
            truth /= np.linalg.norm(truth, axis=1, keepdims=True)
            basis = np.column_stack([np.ones(count), truth])
        errors = NOISES * (random.standard_normal((count, 3)) + wander(kind, size, count, random))
        found = np.linalg.lstsq(basis, errors, rcond=None)[0]
        residuals = errors - basis @ found
        if find_walk(truth, residuals):
            continue
        landed += 1
        squares = np.outer(np.sum(residuals**2, axis=0), np.diag(np.linalg.inv(basis.T @ basis)))
        half = scipy.stats.t.ppf(0.975, count - 4) * np.sqrt(squares / (count - 4))
        plain.append(np.mean(np.abs(found.T) < half))
        wide.append(np.mean(np.abs(found.T) < half * walk_widening(truth, residuals)))
    return landed / RUNS, float(np.mean(plain)) if plain else 1.0, float(np.mean(wide)) if wide else 1.0


@pytest.mark.parametrize("count", [7, 10, 12, 18])
def test_noise_lands_and_its_intervals_hold_what_they_state(count: int) -> None:
    landed, _, wide = judged("walk", 0.0, count)
    assert landed > 0.97
    assert 0.93 < wide < 0.975


@pytest.mark.parametrize("count", [7, 9, 12, 18])
@pytest.mark.parametrize("size", [0.1, 0.25, 0.5])
def test_what_lands_of_a_walk_that_is_not_seen_holds_what_it_states(size: float, count: int) -> None:
    """Up to half of the noise from reading to reading: one record in twenty is refused at 0.25, half at 0.5 of 18."""
    landed, plain, wide = judged("walk", size, count)
    assert landed > 0.3
    assert 0.93 < wide < 0.975, (landed, plain, wide)


@pytest.mark.parametrize(
    ("kind", "size", "count"),
    [
        ("walk", 0.35, 18), ("walk", 0.7, 12), ("walk", 1.0, 9), ("walk", 1.5, 12), ("walk", 3.0, 7),
        ("walk", 3.0, 10), ("walk", 3.0, 18), ("bias", 1.0, 18), ("ramp", 1.0, 12), ("ramp", 2.0, 9),
    ],
)  # fmt: skip
def test_a_bias_that_moves_is_refused_or_in_the_intervals(kind: str, size: float, count: int) -> None:
    """Nowhere are more than seven in a hundred parameters both landed and outside; plain ones may be eighteen."""
    landed, plain, wide = judged(kind, size, count)
    assert landed * (1.0 - wide) < 0.07, (landed, plain, wide)
    assert wide >= plain


def test_the_intervals_of_a_turn_table_hold_whatever_walks() -> None:
    """Of two degrees of freedom Student's intervals are wide enough, and no walk would be seen."""
    random = np.random.default_rng(4)
    truth = np.kron(np.eye(3), np.array([[1.0], [-1.0]]))
    basis = np.column_stack([np.ones(6), truth])
    for size in (0.0, 0.5, 2.0, 20.0):
        errors = random.standard_normal((2000, 6)) + size * np.cumsum(random.standard_normal((2000, 6)), axis=1)
        found = errors @ np.linalg.pinv(basis).T
        squares = np.sum((errors - found @ basis.T) ** 2, axis=1, keepdims=True)
        half = scipy.stats.t.ppf(0.975, 2) * np.sqrt(squares / 2 * np.diag(np.linalg.inv(basis.T @ basis)))
        assert 0.93 < np.mean(np.abs(found) < half) < 0.97


def test_a_plain_walk_does_not_land() -> None:
    assert judged("walk", 1.5, 18)[0] < 0.05
    assert judged("ramp", 3.0, 18)[0] < 0.01


def test_few_readings_and_exact_ones_show_no_walk() -> None:
    truth = np.vstack([np.eye(3), -np.eye(3)])
    walked = np.cumsum(np.random.default_rng(1).standard_normal((6, 3)), axis=0)
    assert not find_walk(truth, walked)
    assert np.all(walk_widening(truth, walked) == 1.0)
    many = np.random.default_rng(2).standard_normal((20, 3))
    assert not find_walk(many, np.zeros((20, 3)))
    assert np.all(walk_widening(many, np.zeros((20, 3))) == 1.0)


def test_the_factors_do_not_know_the_unit() -> None:
    random = np.random.default_rng(3)
    truth, residuals = random.standard_normal((20, 3)), np.cumsum(random.standard_normal((20, 3)), axis=0)
    basis = np.column_stack([np.ones(20), truth])
    residuals = residuals - basis @ np.linalg.lstsq(basis, residuals, rcond=None)[0]
    factors = walk_widening(truth, residuals)
    assert factors.max() > 1.2
    assert walk_widening(truth, 1e-3 * residuals) == pytest.approx(factors)
    assert find_walk(truth, 1e-3 * residuals) == find_walk(truth, residuals)
