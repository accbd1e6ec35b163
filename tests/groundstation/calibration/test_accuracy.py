"""Accuracy, precision and their posterior against published figures."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration.accuracy import (
    Accuracy,
    Characteristic,
    combined_accuracy,
    relative_error,
    sensor_characteristic,
)
from telemetry.errors import CalibrationError

PRESET_DEG = np.array([0.5, 1.0, 1.5, 2.5, 3.5, 5.0, 10.0])
MEAN_DEG = np.array([0.488, 1.006, 1.480, 2.478, 3.429, 4.982, 9.966])
STD_DEG = np.array([0.027, 0.022, 0.038, 0.025, 0.141, 0.014, 0.029])
FIRST, SECOND, THIRD = Accuracy(1.126, 0.0422), Accuracy(0.168, 0.0051), Accuracy(0.1, 1e-4)
SENSOR = st.builds(Accuracy, st.floats(0.0, 10.0), st.floats(1e-3, 1e3))


def test_the_relative_error_of_each_printed_mean() -> None:
    expected = [2.4, 0.6, 1.3333333, 0.88, 2.0285714, 0.36, 0.34]
    np.testing.assert_allclose(relative_error(PRESET_DEG, MEAN_DEG), expected, atol=1e-7)


def test_the_overall_figures_are_the_printed_ones_within_the_rounding_of_the_printed_means() -> None:
    error = relative_error(PRESET_DEG, MEAN_DEG)
    overall = Characteristic(PRESET_DEG, MEAN_DEG, STD_DEG, error).overall()
    rounding = float(np.mean(100.0 * 0.0005 / PRESET_DEG))
    assert abs(overall.error - FIRST.error) < rounding < 0.034
    assert abs(overall.std - FIRST.std) < 0.0005


def test_two_sensors() -> None:
    posterior = combined_accuracy(FIRST, SECOND)
    assert posterior.error == pytest.approx(0.18179, abs=5e-6)
    assert posterior.std == pytest.approx(5.0632e-3, abs=5e-8)


def test_three_sensors() -> None:
    posterior = combined_accuracy(FIRST, SECOND, THIRD)
    assert posterior.error == pytest.approx(0.1000319, abs=5e-8)
    assert posterior.std == pytest.approx(9.99805e-5, abs=5e-11)


@given(first=SENSOR, second=SENSOR)
def test_two_sensors_by_the_equation(first: Accuracy, second: Accuracy) -> None:
    posterior = combined_accuracy(first, second)
    variances = first.std**2, second.std**2
    assert posterior.error == pytest.approx(
        (first.error * variances[1] + second.error * variances[0]) / sum(variances), abs=1e-12
    )
    assert posterior.std**-2 == pytest.approx(first.std**-2 + second.std**-2)


@given(sensors=st.lists(SENSOR, min_size=3, max_size=5))
def test_the_order_of_the_sensors_does_not_matter(sensors: list[Accuracy]) -> None:
    at_once, one_by_one = combined_accuracy(*sensors), combined_accuracy(*sensors[-2:])
    for sensor in reversed(sensors[:-2]):
        one_by_one = combined_accuracy(sensor, one_by_one)
    assert at_once.error == pytest.approx(one_by_one.error, abs=1e-9)
    assert at_once.std == pytest.approx(one_by_one.std)
    assert at_once.std < min(sensor.std for sensor in sensors)


def test_one_sensor_is_its_own_posterior() -> None:
    assert combined_accuracy(FIRST) == FIRST


def test_extreme_standard_deviations_neither_overflow_nor_vanish() -> None:
    assert combined_accuracy(Accuracy(1.0, 1e-200), Accuracy(3.0, 1e-200)).error == pytest.approx(2.0)
    assert combined_accuracy(Accuracy(1.0, 1e200), Accuracy(3.0, 1e200)).error == pytest.approx(2.0)


def test_a_characteristic_from_records() -> None:
    result = sensor_characteristic(np.array([-2.0, 4.0]), [np.array([-1.9, -2.3]), np.array([3.8, 4.0, 4.2])])
    np.testing.assert_allclose(result.mean, [-2.1, 4.0])
    np.testing.assert_allclose(result.std, [0.4 / math.sqrt(2.0), 0.2])
    np.testing.assert_allclose(result.error, [5.0, 0.0], atol=1e-12)


@pytest.mark.parametrize("records", [[], [np.ones(3)], [np.ones(3), np.ones(1)]])
def test_a_preset_without_readings_is_refused(records: list[np.ndarray]) -> None:
    with pytest.raises(CalibrationError, match="expected 2 readings or more of 2 presets, got"):
        sensor_characteristic(np.array([1.0, 2.0]), records)


def test_nothing_is_relative_to_zero() -> None:
    with pytest.raises(CalibrationError, match="expected presets other than 0"):
        relative_error(np.array([1.0, 0.0]), np.array([1.0, 0.1]))


@pytest.mark.parametrize(("preset", "mean"), [([1.0, np.nan], [1.0, 1.0]), ([1.0], [np.inf]), ([1.0, 2.0], [1.0])])
def test_numbers_that_do_not_fit_are_refused(preset: list[float], mean: list[float]) -> None:
    with pytest.raises(CalibrationError, match="expected a finite mean of each preset"):
        relative_error(np.array(preset), np.array(mean))


@pytest.mark.parametrize(("error", "std"), [(1.0, 0.0), (1.0, -1.0), (np.nan, 1.0), (1.0, np.inf)])
def test_an_accuracy_that_is_none_is_refused(error: float, std: float) -> None:
    with pytest.raises(CalibrationError, match="expected a finite error and std > 0"):
        Accuracy(error, std)


def test_no_sensor_has_no_posterior() -> None:
    with pytest.raises(CalibrationError, match="expected at least one sensor, got none"):
        combined_accuracy()
