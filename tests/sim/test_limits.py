"""The bound of the study of limits, against closed forms and its own filter run on drawn errors."""

import math

import numpy as np
import pytest

from sim.studies.limits.bound import STATES, Model, NodeTimeline, bound_of, posterior_cov, step_of

NOISE, AIDING = 1e-4, 3e-4  # rad/s/sqrt(Hz), rad
WHITE = Model(NOISE, 1e-12, 1e6, 1e-12, 1e-12, 1e-12)  # nothing but white noise


def course(count: int, dt: float, spin: float, heard: slice) -> NodeTimeline:
    var = np.full(count, np.inf)
    var[heard] = AIDING**2
    return NodeTimeline(dt * np.arange(1.0, count + 1.0), np.full(count, spin), np.full(count, spin), var)


def test_a_walk_that_is_measured_settles_where_riccati_says() -> None:
    """P^2 - q P - q r = 0 for the prediction, the smoother half of q and r's geometric mean in the middle."""
    found = bound_of(WHITE, course(400, 1.0, 1.0, slice(None)), 0.0)
    q, r = NOISE**2, AIDING**2
    predicted = 0.5 * (q + math.sqrt(q * q + 4.0 * q * r))
    filtered = predicted * r / (predicted + r)
    assert found.filtered[-1] == pytest.approx(filtered, rel=1e-6)
    # two filters, one from each end, and the measurement between them
    assert found.smoothed[200] == pytest.approx(1.0 / (2.0 / predicted + 1.0 / r), rel=1e-6)
    assert found.smoothed[-1] == found.filtered[-1]


def test_a_rest_keeps_what_is_known_and_turning_on_tells_of_it() -> None:
    turned = course(100, 1.0, 1.0, slice(60, None))
    turned.spin[40:60] = 0.0  # a rest that no aiding reaches
    turned.var[0] = AIDING**2
    found = bound_of(WHITE, turned, 0.0)
    assert found.filtered[41] == pytest.approx(found.filtered[58], rel=1e-9)
    assert found.filtered[41] == pytest.approx(AIDING**2 + 39 * NOISE**2, rel=1e-4)
    assert found.smoothed[50] < AIDING**2
    assert np.all(found.smoothed <= found.filtered * (1.0 + 1e-9))


def test_errors_that_are_drawn_are_as_large_as_it_says() -> None:
    random, runs, count = np.random.default_rng(4), 2000, 30
    model = Model(NOISE, 2e-4, 20.0, 1e-3, 2e-3, 1e-5)
    given = course(count, 0.5, 1.2, slice(3, None, 2))
    given.var[0] = AIDING**2
    found = bound_of(model, given, 0.0)
    known = np.diag([1.0, model.bias_std**2, model.scale_std**2, model.stamp_std**2])
    errors = random.standard_normal((runs, STATES)) * np.sqrt(np.diag(known))
    for k in range(count):
        step, noise = step_of(model, 1.2, 0.5)
        errors = errors @ step.T + random.standard_normal((runs, STATES)) * np.sqrt(np.diag(noise))
        known = step @ known @ step.T + noise
        if np.isfinite(given.var[k]):
            row = np.array([1.0, 0.0, 0.0, 1.2])
            seen = errors @ row + AIDING * random.standard_normal(runs)
            gain = known @ row / (row @ known @ row + AIDING**2)
            errors -= seen[:, None] * gain
            known = posterior_cov(known, row, AIDING**2)
    assert np.var(errors[:, 0]) == pytest.approx(found.filtered[-1], rel=0.12)
