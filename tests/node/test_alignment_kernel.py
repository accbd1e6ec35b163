"""The middle of gravity's circle: known answers, every mount and lean, and standard errors that hold."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from node.firmware.alignment_orders import angles_of, tube_rotation
from node.kernels.arithmetic.formats import DEG
from node.kernels.record.sensor_record import OFFSET, SWEEP, new_mount
from node.kernels.sensors.alignment import extreme_var, fit_circle, take_extremes, to_tube
from node.kernels.sensors.sweep import add_to_sweep

G = 9.81
tilts = st.floats(-9.0 * DEG, 9.0 * DEG)
METHODS = {"circle": fit_circle, "extremes": take_extremes}


def axis_of(pitch: float, roll: float) -> np.ndarray:
    return np.array([math.sin(pitch), math.cos(pitch) * math.sin(roll), math.cos(pitch) * math.cos(roll)])


def swept(
    pitch: float,
    roll: float,
    lean: float,
    angles: np.ndarray,
    first: float = 0.3,
    noise: float = 0.0,
    seed: int = 0,
    told: np.ndarray | None = None,
) -> np.ndarray:
    """Sums of a turn through ``angles`` (rad), of which the node is ``told`` others."""
    heading = first - angles
    upright = np.full(angles.shape, np.cos(lean))
    down = np.stack([np.sin(lean) * np.cos(heading), np.sin(lean) * np.sin(heading), upright])
    force = -G * (tube_rotation(axis_of(pitch, roll)).T @ down).T
    force = force + G * noise * np.random.default_rng(seed).standard_normal(force.shape)
    sweep = np.zeros(1, SWEEP)
    for f, angle in zip(force, angles if told is None else told, strict=True):
        add_to_sweep(sweep[0], f, angle)
    return sweep


def offset(sweep: np.ndarray, method: str = "circle") -> np.ndarray:
    found = np.zeros(1, OFFSET)
    assert METHODS[method](sweep[0], found[0]) == 1
    return found[0]


def turns(count: float, samples: int = 195) -> np.ndarray:
    return (np.arange(samples) + 0.5) * count * math.tau / samples


@given(tilts, tilts, st.floats(0.1 * DEG, 50.0 * DEG), st.floats(1.0, 5.0), st.floats(0.0, math.tau), st.booleans())
@pytest.mark.slow
def test_without_noise_the_circle_is_exact_for_every_mount_and_lean(
    pitch: float, roll: float, lean: float, count: float, first: float, backward: bool
) -> None:
    found = offset(swept(pitch, roll, lean, (-1.0 if backward else 1.0) * turns(count), first))
    assert (found["pitch"], found["roll"]) == pytest.approx((pitch, roll), abs=1e-7)
    assert found["lean"] == pytest.approx(lean, abs=1e-7)
    assert found["noise"] < 1e-6
    np.testing.assert_allclose(found["axis"], axis_of(pitch, roll), atol=1e-7)


@given(tilts, tilts, st.floats(0.1 * DEG, 50.0 * DEG), st.integers(1, 5), st.floats(0.0, math.tau))
def test_the_extremes_miss_by_no_more_than_their_samples_are_apart(
    pitch: float, roll: float, lean: float, count: int, first: float
) -> None:
    found, apart = offset(swept(pitch, roll, lean, turns(count), first), "extremes"), math.tau * count / 195.0
    assert abs(found["axis"][0] - axis_of(pitch, roll)[0]) * math.cos(lean) < math.sin(lean) * apart**2 / 8.0 + 1e-9


def test_an_uneven_turn_is_a_turn() -> None:
    angles = np.cumsum(np.random.default_rng(1).uniform(0.01, 0.12, 195))
    found = offset(swept(0.01, -0.02, 2.0 * DEG, angles))
    assert found["pitch"] == pytest.approx(0.01, abs=1e-5)
    assert found["roll"] == pytest.approx(-0.02, abs=1e-5)


@pytest.mark.parametrize("scale", [-2e-2, 1e-3, 2e-2])
def test_a_wrong_scale_of_the_gyroscope_does_not_pull_the_middle(scale: float) -> None:
    angles, lean = turns(2), 2.0 * DEG
    found = offset(swept(0.01, -0.02, lean, angles, told=angles * (1.0 + scale)))
    pulled = scale * lean  # what the middle would be off by if the drift were not free
    assert math.hypot(found["pitch"] - 0.01, found["roll"] + 0.02) < 0.1 * abs(pulled) + 1e-7


@pytest.mark.parametrize("samples", [0, 1, 3])
def test_too_few_samples_have_no_middle(samples: int) -> None:
    found = np.zeros(1, OFFSET)
    sweep = swept(0.0, 0.0, 0.1, turns(2, 195)[:samples])
    assert fit_circle(sweep[0], found[0]) == 0
    assert take_extremes(sweep[0], found[0]) == 0


@pytest.mark.parametrize("share", [0.0, 0.25])
def test_an_arc_has_no_middle(share: float) -> None:
    sweep = swept(0.0, 0.0, 0.1, turns(share), noise=1e-4)
    assert fit_circle(sweep[0], np.zeros(1, OFFSET)[0]) == 0


@pytest.mark.slow
@pytest.mark.parametrize("method", METHODS)
@pytest.mark.parametrize("lean", [0.3, 10.0, pytest.param(2.0, marks=pytest.mark.statistical)])
@pytest.mark.parametrize("count", [1, 4, pytest.param(2, marks=pytest.mark.statistical)])
def test_the_standard_errors_are_those_of_many_turns(method: str, lean: float, count: int) -> None:
    """150 turns, two axes each: the ratio of variances has a standard error of sqrt(2 / 300) = 0.08."""
    random = np.random.default_rng(7)
    squares = []
    for seed in range(150):
        sweep = swept(0.01, -0.02, lean * DEG, turns(count, 98 * count), random.uniform(0, math.tau), 0.02 * DEG, seed)
        found = offset(sweep, method)
        squares += [(found["pitch"] - 0.01) ** 2 / found["pitch_std"] ** 2]
        squares += [(found["roll"] + 0.02) ** 2 / found["roll_std"] ** 2]
    assert 0.7 < np.mean(squares) < 1.35


def test_the_published_errors_are_those_of_a_noise_of_two_hundredths_of_a_degree() -> None:
    sweep = swept(0.0, 0.0, 2.0 * DEG, turns(2), noise=0.02 * DEG)
    assert offset(sweep)["noise"] == pytest.approx(0.02 * DEG, rel=0.1)
    assert offset(sweep)["pitch_std"] / DEG == pytest.approx(0.0014, rel=0.1)
    assert offset(sweep, "extremes")["pitch_std"] / DEG == pytest.approx(0.0086, rel=0.1)


@pytest.mark.parametrize(("samples", "variance"), [(1, 1.0), (2, 1.0 - 1.0 / math.pi)])
def test_the_largest_of_plain_normals_has_its_known_variance(samples: int, variance: float) -> None:
    assert extreme_var(0.0, samples) == pytest.approx(variance, abs=0.005)


@given(tilts, tilts, st.lists(st.floats(-20.0, 20.0), min_size=3, max_size=3))
def test_the_turn_into_the_tube_is_a_rotation_that_takes_the_axis_to_z(
    pitch: float, roll: float, values: list[float]
) -> None:
    axis, vector = axis_of(pitch, roll), np.array(values)
    turned = vector.copy()
    to_tube(axis, turned)
    assert np.linalg.norm(turned) == pytest.approx(np.linalg.norm(vector), abs=1e-12)
    np.testing.assert_allclose(turned, tube_rotation(axis) @ vector, atol=1e-12)
    held = axis.copy()
    to_tube(axis, held)
    np.testing.assert_allclose(held, [0.0, 0.0, 1.0], atol=1e-15)
    across = np.cross(axis, [0.0, 0.0, 1.0])
    kept = across.copy()
    to_tube(axis, kept)
    np.testing.assert_allclose(kept, across, atol=1e-14)  # no part about the axis
    assert angles_of(axis) == pytest.approx((pitch, roll), abs=1e-12)


def test_a_mount_never_aligned_touches_no_bit() -> None:
    vector = np.array([-0.0, 1e-300, -0.0])
    before = vector.tobytes()
    to_tube(new_mount()[0]["axis"][0], vector)
    assert vector.tobytes() == before
