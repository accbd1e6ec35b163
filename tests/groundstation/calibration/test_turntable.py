"""Basic alignment against published tables, and against itself turned round."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration.calibration_records import STANDARD_GRAVITY, read_turn_table
from groundstation.calibration.turntable import as_observations, check_invertible, correct_readings, turntable_alignment
from telemetry.errors import CalibrationError

DATA = Path(__file__).parents[2] / "data" / "calibration"
A1_MATRIX = [
    [0.9945843, -0.017076546, -0.003499657],
    [0.014795547, 0.996093741, -0.004001168],
    [-0.001135443, -0.007539215, 0.996815294],
]
A1_BIAS_DPS = [0.167255742, 3.803049838, 1.007222273]
VN100_MATRIX = [[-0.929, -0.360, -0.013], [0.371, -0.932, 0.004], [0.001, -0.001, 0.998]]
VN100_BIAS_DPS = [-0.046, -0.190, -0.008]
SMALL = st.floats(-0.2, 0.2)


@st.composite
def sensors(draw: st.DrawFn) -> tuple[np.ndarray, np.ndarray]:
    """Matrix and bias of a sensor whose misalignment is not symmetric."""
    matrix = np.eye(3) + np.array(draw(st.lists(SMALL, min_size=9, max_size=9))).reshape(3, 3)
    return matrix, np.array(draw(st.lists(st.floats(-5.0, 5.0), min_size=3, max_size=3)))


def table_of(matrix: np.ndarray, bias: np.ndarray, reference: float) -> tuple[np.ndarray, np.ndarray]:
    """What the sensor reads when each axis is turned in turn: one row a run."""
    return (
        np.array([matrix @ (reference * axis) + bias for axis in np.eye(3)]),
        np.array([matrix @ (-reference * axis) + bias for axis in np.eye(3)]),
    )


def test_every_printed_digit_of_node_a1() -> None:
    table = read_turn_table(DATA / "calibration_node_a1_gyro.csv", 720.0)
    result = turntable_alignment(table.positive, table.negative, table.reference)
    assert np.abs(result.matrix - A1_MATRIX).max() < 1e-9
    assert np.abs(result.bias - A1_BIAS_DPS).max() < 1e-8


def test_in_radians_the_matrix_stays_and_the_bias_turns_with_the_unit() -> None:
    table = read_turn_table(DATA / "calibration_node_a1_gyro.csv", 720.0, unit=np.pi / 180.0)
    result = turntable_alignment(table.positive, table.negative, table.reference)
    assert table.reference == pytest.approx(4.0 * np.pi)
    assert np.abs(result.matrix - A1_MATRIX).max() < 1e-9
    assert np.abs(np.degrees(result.bias) - A1_BIAS_DPS).max() < 1e-8


def test_the_vn100_to_the_printed_decimals() -> None:
    table = read_turn_table(DATA / "calibration_vn100_gyro.csv", 200.0)
    result = turntable_alignment(table.positive, table.negative, table.reference)
    # One bias is exactly half way between two decimals, and the print rounds it away from zero.
    assert np.abs(result.matrix - VN100_MATRIX).max() < 0.0005
    assert np.abs(result.bias - VN100_BIAS_DPS).max() < 0.0005 + 1e-12


def test_rows_read_as_sensor_axes_would_give_the_transpose_and_wrong_biases() -> None:
    table = read_turn_table(DATA / "calibration_node_a1_gyro.csv", 720.0)
    right = turntable_alignment(table.positive, table.negative, table.reference)
    wrong = turntable_alignment(table.positive.T, table.negative.T, table.reference)
    assert np.abs(wrong.matrix - right.matrix.T).max() < 1e-15
    assert np.abs(right.matrix - right.matrix.T).max() > 0.03
    assert np.abs(wrong.bias - A1_BIAS_DPS).max() > 1.0


@given(sensor=sensors(), reference=st.floats(0.5, 720.0))
def test_the_sensor_that_made_the_table_comes_back(sensor: tuple[np.ndarray, np.ndarray], reference: float) -> None:
    matrix, bias = sensor
    result = turntable_alignment(*table_of(matrix, bias, reference), reference)
    np.testing.assert_allclose(result.matrix, matrix, atol=1e-13 * (1.0 + 10.0 / reference))
    np.testing.assert_allclose(result.bias, bias, atol=1e-12)
    assert result.residual_rms() < 1e-12


@given(sensor=sensors(), truth=st.lists(st.floats(-20.0, 20.0), min_size=6, max_size=6))
def test_the_correction_undoes_the_sensor(sensor: tuple[np.ndarray, np.ndarray], truth: list[float]) -> None:
    matrix, bias = sensor
    vectors = np.array(truth).reshape(2, 3)
    np.testing.assert_allclose(correct_readings(vectors @ matrix.T + bias, matrix, bias), vectors, atol=1e-11)


def test_one_reading_is_corrected_as_a_row_of_many() -> None:
    matrix, bias = np.array(A1_MATRIX), np.array(A1_BIAS_DPS)
    readings = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    np.testing.assert_array_equal(
        correct_readings(readings[1], matrix, bias), correct_readings(readings, matrix, bias)[1]
    )


def test_an_accelerometer_is_aligned_with_its_axes_up_and_down() -> None:
    matrix, bias = np.array([[1.01, 0.02, 0.0], [-0.01, 0.98, 0.03], [0.0, 0.01, 1.0]]), np.array([0.1, -0.2, 0.3])
    result = turntable_alignment(*table_of(matrix, bias, STANDARD_GRAVITY), STANDARD_GRAVITY)
    np.testing.assert_allclose(result.matrix, matrix, atol=1e-14)
    np.testing.assert_allclose(result.bias, bias, atol=1e-14)


def test_the_residuals_are_the_disagreement_of_the_three_biases() -> None:
    positive, negative = table_of(np.eye(3), np.zeros(3), 1.0)
    shifted = np.array([[0.3, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    result = turntable_alignment(positive + shifted, negative + shifted, 1.0)
    np.testing.assert_allclose(result.bias, [0.1, 0.0, 0.0], atol=1e-15)
    np.testing.assert_allclose(result.residuals[:, 0], [0.2, -0.1, -0.1], atol=1e-15)
    assert result.residual_rms() == pytest.approx(np.sqrt(0.06 / 9.0))


def test_observations_are_six_runs_with_their_truth() -> None:
    matrix, bias = np.array(A1_MATRIX), np.array(A1_BIAS_DPS)
    truth, readings = as_observations(*table_of(matrix, bias, 2.0), 2.0)
    np.testing.assert_allclose(readings, truth @ matrix.T + bias, atol=1e-14)


@pytest.mark.parametrize("reference", [0.0, -1.0, float("nan"), float("inf")])
def test_a_reference_that_is_none_is_refused(reference: float) -> None:
    with pytest.raises(CalibrationError, match="expected a positive reference, got"):
        turntable_alignment(np.eye(3), -np.eye(3), reference)


def test_readings_of_another_shape_are_refused() -> None:
    with pytest.raises(CalibrationError, match=r"expected \(3, 3\) readings, got \(2, 3\)"):
        turntable_alignment(np.ones((2, 3)), np.ones((3, 3)), 1.0)


@pytest.mark.parametrize(
    "matrix", [np.ones((3, 3)), np.zeros((3, 3)), np.diag([1.0, 1.0, 1e-9]), np.diag([1.0, 1.0, float("nan")])]
)
def test_a_sensor_without_three_axes_is_refused(matrix: np.ndarray) -> None:
    with pytest.raises(CalibrationError, match="three independent sensor axes"):
        check_invertible(matrix)
    with pytest.raises(CalibrationError, match="three independent sensor axes"):
        turntable_alignment(matrix.T, -matrix.T, 1.0)
