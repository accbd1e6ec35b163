"""Static records at preset attitudes against matrices that are known."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration.field_calibration import (
    Rest,
    calibrate_accelerometer,
    force_inclination,
    inclination_rms,
    true_specific_forces,
)
from telemetry import frozen
from telemetry.errors import CalibrationError
from telemetry.messages import Matrix3, StaticRecord

G, DAY = 9.81, "2024-05-31"
PRESETS = [(0, 0), (0, 45), (0, 90), (0, 135), (0, 180), (0, -135), (0, -90), (0, -45), (45, 0), (90, 0), (-90, 0)]
COV: Matrix3 = ((1e-5, 0.0, 0.0), (0.0, 1e-5, 0.0), (0.0, 0.0, 1e-5))
NONE = (np.eye(3), np.zeros(3))


def rest(pitch_deg: float, roll_deg: float, matrix: np.ndarray, bias: np.ndarray, noise: np.ndarray) -> Rest:
    p, r = math.radians(pitch_deg), math.radians(roll_deg)
    down = np.array([math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)])
    x, y, z = (float(v) for v in matrix @ (-G * down) + bias + noise)
    zero = (0.0, 0.0, 0.0)
    return Rest(p, r, StaticRecord(3, 1, 7, 1.0, 21.0, 38, zero, COV, (x, y, z), COV, 25.0, False))


def rests(matrix: np.ndarray = NONE[0], bias: np.ndarray = NONE[1], std: float = 0.0, seed: int = 0) -> list[Rest]:
    random = np.random.default_rng(seed)
    return [rest(p, r, matrix, bias, std * random.standard_normal(3)) for p, r in PRESETS]


small = st.floats(-0.05, 0.05)


@given(st.lists(small, min_size=9, max_size=9), st.lists(st.floats(-0.5, 0.5), min_size=3, max_size=3))
def test_any_matrix_and_bias_come_back(off: list[float], offset: list[float]) -> None:
    matrix, bias = np.eye(3) + np.array(off).reshape(3, 3), np.array(offset)
    if np.linalg.cond(matrix) >= 1.25:
        with pytest.raises(CalibrationError, match=r"^axes: "):
            calibrate_accelerometer(rests(matrix, bias), G, DAY)
        return
    result = calibrate_accelerometer(rests(matrix, bias), G, DAY)
    np.testing.assert_allclose(result.calibration.matrix, matrix, atol=1e-12)
    np.testing.assert_allclose(result.calibration.bias, bias, atol=1e-11)
    assert result.residual_rms < 1e-11
    assert inclination_rms(rests(matrix, bias), matrix, bias) < 1e-6


def test_standard_errors_are_those_of_repeated_calibrations() -> None:
    """The truth lies within the stated errors as often as it should, over 200 calibrations."""
    scores = []
    for seed in range(200):
        solved = calibrate_accelerometer(rests(std=0.002, seed=seed), G, DAY)
        off = np.concatenate(
            [
                solved.fit.bias / solved.fit.bias_std(),
                ((solved.fit.matrix - np.eye(3)) / solved.fit.matrix_std()).ravel(),
            ]
        )
        scores.append(off)
    freedom = len(PRESETS) - 4  # of Student's distribution, an axis has a noise of its own
    assert np.mean(np.square(scores)) == pytest.approx(freedom / (freedom - 2), rel=0.1)
    assert solved.residual_rms == pytest.approx(0.002, rel=0.4)


def test_the_home_position_hangs() -> None:
    np.testing.assert_allclose(true_specific_forces(rests()[:1], G), [[0.0, 0.0, -G]])
    assert force_inclination(true_specific_forces(rests(), 1.0))[:5] == pytest.approx(
        np.radians([0.0, 45.0, 90.0, 135.0, 180.0])
    )


def test_a_calibration_says_where_it_comes_from_and_is_the_same_for_the_same_records() -> None:
    one, other = (
        calibrate_accelerometer(rests(std=1e-3), G, DAY).calibration,
        calibrate_accelerometer(rests(std=1e-3), G, DAY).calibration,
    )
    assert one.sha256() == other.sha256()
    assert (
        one.provenance.input_sha256
        != calibrate_accelerometer(rests(std=1e-3, seed=1), G, DAY).calibration.provenance.input_sha256
    )
    assert "11 attitudes" in one.provenance.design
    assert (one.sensor, one.reference) == ("accelerometer", 25.0)


def spoil(place: int, **changes: object) -> list[Rest]:
    made = rests()
    made[place] = replace(made[place], record=frozen.replace(made[place].record, **changes))
    return made


@pytest.mark.parametrize(
    ("wrong", "named"),
    [
        (rests()[:8], "9 or more .* got 8"),
        ([], "got 0"),
        (spoil(2, moved=True), "pitch 0 deg, roll 90 deg: expected a record at rest, it moved"),
        (spoil(3, samples=2), "roll 135 deg.* samples"),
        (spoil(4, force=(0.0, 0.0, 1.0)), "roll 180 deg: expected a force near 9.81"),
        (spoil(4, force=(math.nan, 0.0, -9.81)), "roll 180 deg: expected a force"),
        ([rests()[0]] * 12, "rank 4, got 1 of 4.*roll 90"),
        ([*rests()[:8], rests()[1]], "rank 4, got 3 of 4.*pitch 90"),
        ([rest(p / 20, r / 20, *NONE, np.zeros(3)) for p, r in PRESETS], "condition up to 10"),
    ],
)  # fmt: skip
def test_what_is_no_calibration_is_refused_with_the_reason(wrong: list[Rest], named: str) -> None:
    with pytest.raises(CalibrationError, match=named):
        calibrate_accelerometer(wrong, G, DAY)


@pytest.mark.parametrize(
    ("matrix", "named"),
    [
        (np.diag([1.0, -1.0, 1.0]), "^right-handed: the axes are left-handed"),
        (np.eye(3)[[1, 0, 2]], "^right-handed: the axes are left-handed"),
        (np.diag([0.9, 1.15, 1.0]), "^axes: the axes are not three alike"),
    ],
    ids=["mirrored", "exchanged", "one weak"],
)
def test_axes_that_are_no_sensor_s_are_refused_though_nothing_is_left_in_the_residuals(
    matrix: np.ndarray, named: str
) -> None:
    with pytest.raises(CalibrationError, match=named):
        calibrate_accelerometer(rests(matrix), G, DAY)
    turned = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])  # a mount turned by a right angle
    assert calibrate_accelerometer(rests(turned), G, DAY).residual_rms < 1e-11


def test_an_attitude_that_was_not_the_one_told_is_named() -> None:
    made = rests(std=0.001)
    made[5] = replace(made[5], roll=math.radians(-130.0))
    with pytest.raises(CalibrationError, match="roll -130 deg: was it this attitude"):
        calibrate_accelerometer(made, G, DAY)
