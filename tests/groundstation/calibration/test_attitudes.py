"""Least squares over attitudes: published numbers, its own statistics, and designs that cannot work."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from groundstation.calibration.attitudes import fit_attitudes, fit_free_yaw, true_vectors
from groundstation.calibration.calibration_records import read_attitudes, read_turn_table
from groundstation.calibration.turntable import as_observations, turntable_alignment
from telemetry.errors import CalibrationError

DATA = Path(__file__).parents[2] / "data" / "calibration"
VN100_MATRIX = [[-3.69569, 9.05279, 0.83102], [-9.05855, -3.69281, -0.86393], [-0.01440, 0.29226, 9.86523]]
VN100_BIAS = [-1.07602, 0.97293, 0.41077]
VN100_PRINTED = np.array([[-3.820, 8.100, -1.465], [-9.005, -3.826, 0.966], [-0.012, 0.293, 9.625]])
MATRIX = np.array([[9.9, 0.2, -0.1], [-0.3, 9.7, 0.15], [0.05, -0.25, 9.85]])
BIAS = np.array([0.1, -0.2, 0.3])
NAN = float("nan")


def presets(*degrees: tuple[float, float]) -> np.ndarray:
    pitch, roll = np.radians(np.array(degrees)).T
    return true_vectors(pitch, roll)


SIX = presets((0, 0), (0, 90), (0, 180), (0, -90), (90, 0), (-90, 0))
SCATTERED = presets((0, 0), (30, 20), (-40, 70), (60, -100), (-10, 170), (5, 45), (-70, -30), (20, -150))


def vn100() -> tuple[np.ndarray, np.ndarray]:
    record = read_attitudes(DATA / "calibration_vn100_accel.csv")
    return true_vectors(record.pitch, record.roll), record.readings


def rotation(yaw: float) -> np.ndarray:
    c, s = math.cos(yaw), math.sin(yaw)
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def test_truth_of_presets() -> None:
    half = math.sqrt(0.5)
    np.testing.assert_allclose(
        presets((0, 0), (90, 0), (0, 90), (0, 180), (45, 90)),
        [[0, 0, 1], [1, 0, 0], [0, 1, 0], [0, 0, -1], [half, half, 0]],
        atol=1e-15,
    )


def test_the_exact_answer_of_the_drill_head() -> None:
    result = fit_attitudes(*vn100())
    assert np.abs(result.matrix - VN100_MATRIX).max() < 1e-5
    assert np.abs(result.bias - VN100_BIAS).max() < 1e-5
    assert result.rank == 4


def test_the_home_position_carries_the_drill_head_with_a_lever_of_66() -> None:
    result = fit_attitudes(*vn100())
    assert result.levers[0] == pytest.approx(1.0 / (1.0 - math.cos(math.radians(10.0))), rel=1e-9)
    assert round(float(result.levers[0])) == 66
    assert result.levers[1:].max() < 10.0
    assert result.condition == pytest.approx(413.279, abs=1e-3)
    # What rests on the lever is worth little: the vertical column and the bias, not the x, y block.
    assert result.matrix_std()[0, 2] > 20.0 * result.matrix_std()[0, 0]


def test_eight_positions_at_one_tilt_are_refused_and_home_is_named() -> None:
    truth, readings = vn100()
    with pytest.raises(
        CalibrationError, match=r"^attitudes: expected a design of rank 4, got 3 of 4: add the attitude "
    ):
        fit_attitudes(truth[1:], readings[1:])
    with pytest.raises(CalibrationError, match=r"add the attitude home \(pitch 0, roll 0\)$"):
        fit_attitudes(truth[1:], readings[1:])


@pytest.mark.parametrize(
    ("truth", "rank", "missing"),
    [
        (SIX[[0, 0, 0, 0, 0]], 1, "attitudes pitch 0, roll 90 deg; pitch 0, roll -90 deg; pitch 90 deg, roll 0"),
        (SIX[[0, 1, 2, 3, 3]], 3, "attitude pitch 90 deg, roll 0"),
        (SIX[[0, 2, 0, 2, 0]], 2, "attitudes pitch 0, roll 90 deg; pitch 90 deg, roll 0"),
        (SIX[[1, 3, 4, 5, 1]], 3, r"attitude home \(pitch 0, roll 0\)"),
        (np.zeros((5, 3)), 1, "attitudes home .*; pitch 0, roll 90 deg; "),
    ],
)
def test_a_design_that_lacks_an_axis_says_which_attitude_it_lacks(truth: np.ndarray, rank: int, missing: str) -> None:
    with pytest.raises(CalibrationError, match=f"got {rank} of 4: add the {missing}"):
        fit_attitudes(truth, truth @ MATRIX.T + BIAS)


@pytest.mark.parametrize("keep", [[0, 1, 2, 3, 3], [1, 3, 4, 5, 1], [0, 2, 0, 2, 0]])
def test_the_attitudes_named_complete_the_design(keep: list[int]) -> None:
    named = {"home": (0, 0), "pitch 0, roll 90": (0, 90), "pitch 90 deg": (90, 0), "pitch 0, roll -90": (0, -90)}
    truth = SIX[keep]
    with pytest.raises(CalibrationError) as refused:
        fit_attitudes(truth, truth @ MATRIX.T + BIAS)
    added = presets(*(preset for words, preset in named.items() if words in str(refused.value)))
    whole = np.vstack([truth, added])
    np.testing.assert_allclose(fit_attitudes(whole, whole @ MATRIX.T + BIAS).matrix, MATRIX, atol=1e-12)


def test_the_balanced_design_is_the_turn_table() -> None:
    table = read_turn_table(DATA / "calibration_node_a1_gyro.csv", 720.0)
    basic = turntable_alignment(table.positive, table.negative, table.reference)
    result = fit_attitudes(*as_observations(table.positive, table.negative, table.reference))
    assert np.abs(result.matrix - basic.matrix).max() < 1e-13
    assert np.abs(result.bias - basic.bias).max() < 1e-13
    np.testing.assert_allclose(result.residuals, np.tile(basic.residuals, (2, 1)), atol=1e-12)
    assert result.residual_rms() == pytest.approx(basic.residual_rms())


@given(
    angles=st.lists(st.tuples(st.floats(-90.0, 90.0), st.floats(-180.0, 180.0)), min_size=5, max_size=12),
    entries=st.lists(st.floats(-1.0, 1.0), min_size=12, max_size=12),
)
def test_the_sensor_that_read_comes_back(angles: list[tuple[float, float]], entries: list[float]) -> None:
    truth = presets(*angles)
    values = np.linalg.svd(np.column_stack([np.ones(len(truth)), truth]), compute_uv=False)
    assume(values[-1] > 1e-2 * values[0])
    matrix, bias = 9.81 * np.eye(3) + np.array(entries[:9]).reshape(3, 3), np.array(entries[9:])
    result = fit_attitudes(truth, truth @ matrix.T + bias)
    np.testing.assert_allclose(result.matrix, matrix, atol=1e-10)
    np.testing.assert_allclose(result.bias, bias, atol=1e-10)


def test_the_parameters_are_in_the_order_of_the_equation() -> None:
    """H_i = [I3, kron(I3, f_i^T)] and its normal equations, written out."""
    rng = np.random.default_rng(3)
    roots = rng.normal(size=(8, 3, 3)) + 2.0 * np.eye(3)
    covs = roots @ np.swapaxes(roots, 1, 2)
    readings = SCATTERED @ MATRIX.T + BIAS + rng.normal(size=(8, 3))
    design = np.concatenate([np.hstack([np.eye(3), np.kron(np.eye(3), f)]) for f in SCATTERED])
    weights = np.zeros((24, 24))
    for k, cov in enumerate(covs):
        weights[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] = np.linalg.inv(cov)
    normal = design.T @ weights @ design
    expected = np.linalg.solve(normal, design.T @ weights @ readings.ravel())
    result = fit_attitudes(SCATTERED, readings, covs)
    np.testing.assert_allclose(np.concatenate([result.bias, result.matrix.ravel()]), expected, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(result.cov, np.linalg.inv(normal), rtol=1e-8, atol=1e-9)
    np.testing.assert_allclose(result.residuals.ravel(), readings.ravel() - design @ expected, atol=1e-9)
    stds = np.concatenate([result.bias_std(), *result.matrix_std()])
    np.testing.assert_allclose(np.diag(result.cov), stds**2, rtol=1e-14)


def test_equal_covariances_weigh_as_none_do() -> None:
    truth, readings = vn100()
    weighted, plain = (
        fit_attitudes(truth, readings, np.tile(1e-4 * np.eye(3), (9, 1, 1))),
        fit_attitudes(truth, readings),
    )
    np.testing.assert_allclose(weighted.matrix, plain.matrix, atol=1e-10)
    np.testing.assert_allclose(weighted.bias, plain.bias, atol=1e-10)


def test_a_reading_nobody_trusts_does_not_count() -> None:
    readings = SCATTERED @ MATRIX.T + BIAS
    readings[3] += 5.0
    covs = np.tile(1e-6 * np.eye(3), (8, 1, 1))
    assert np.abs(fit_attitudes(SCATTERED, readings, covs).bias - BIAS).max() > 0.1
    covs[3] = 1e6 * np.eye(3)
    np.testing.assert_allclose(fit_attitudes(SCATTERED, readings, covs).bias, BIAS, atol=1e-9)


@pytest.mark.parametrize("known", [True, False])
def test_the_standard_errors_are_those_of_many_repetitions(known: bool) -> None:
    rng, std = np.random.default_rng(11), np.array([0.01, 0.02, 0.05])
    covs = np.tile(np.diag(std**2), (8, 1, 1)) if known else None
    repetitions = [
        fit_attitudes(SCATTERED, SCATTERED @ MATRIX.T + BIAS + std * rng.normal(size=(8, 3)), covs) for _ in range(600)
    ]
    scatter = np.std([np.concatenate([r.bias, r.matrix.ravel()]) for r in repetitions], axis=0)
    claimed = np.sqrt(np.mean([np.diag(r.cov) for r in repetitions], axis=0))
    # 600 repetitions tell a standard deviation to 3 %; the worst of twelve stays within four of those.
    np.testing.assert_allclose(claimed, scatter, rtol=0.12)


def test_four_attitudes_need_the_covariances_of_their_readings() -> None:
    truth = SIX[[0, 1, 3, 4]]
    readings = truth @ MATRIX.T + BIAS
    with pytest.raises(CalibrationError, match="expected covariances or 5 readings or more, got 4 of an axis"):
        fit_attitudes(truth, readings)
    result = fit_attitudes(truth, readings, np.tile(1e-4 * np.eye(3), (4, 1, 1)))
    np.testing.assert_allclose(result.matrix, MATRIX, atol=1e-12)
    # The z bias is half the sum of opposite readings along y, two readings of 0.01 each.
    np.testing.assert_allclose(result.bias_std(), 0.01 / math.sqrt(2.0))


def test_the_print_agrees_in_its_xy_block_after_a_yaw_of_the_rig_but_for_its_misprint() -> None:
    truth, readings = vn100()
    without = VN100_PRINTED.copy()
    without[0, 1] = NAN
    result = fit_free_yaw(truth, readings, without)
    assert math.degrees(result.yaw) == pytest.approx(0.8, abs=0.05)
    difference = np.abs(result.matrix - VN100_PRINTED)
    assert difference[[0, 1, 1], [0, 0, 1]].max() < 0.005
    assert difference[0, 1] == pytest.approx(0.9, abs=0.005)  # 8.100 for 9.0..
    # The vertical column rests on one reading, and there the print is another sensor.
    assert difference[:2, 2].min() > 1.8
    assert np.abs(fit_attitudes(truth, readings).matrix - VN100_PRINTED)[[0, 1, 1], [0, 0, 1]].max() > 0.05


@given(yaw=st.floats(-3.1, 3.1), hidden=st.sampled_from([None, (0, 0), (0, 1), (1, 0), (1, 1)]))
def test_a_rig_that_stands_turned_is_found(yaw: float, hidden: tuple[int, int] | None) -> None:
    readings = SCATTERED @ rotation(yaw).T @ MATRIX.T + BIAS
    like = MATRIX.copy()
    if hidden is not None:
        like[hidden] = NAN
    result = fit_free_yaw(SCATTERED, readings, like)
    assert math.remainder(result.yaw - yaw, 2.0 * math.pi) == pytest.approx(0.0, abs=1e-10)
    np.testing.assert_allclose(result.matrix, MATRIX, atol=1e-9)
    np.testing.assert_allclose(result.bias, BIAS, atol=1e-10)


def test_a_free_yaw_changes_no_residual() -> None:
    truth, readings = vn100()
    free, fixed = fit_free_yaw(truth, readings, VN100_PRINTED), fit_attitudes(truth, readings)
    np.testing.assert_allclose(
        readings - (truth @ rotation(free.yaw).T @ free.matrix.T + free.bias), fixed.residuals, atol=1e-10
    )


def test_the_standard_errors_under_a_free_yaw_are_those_of_many_repetitions() -> None:
    rng = np.random.default_rng(5)
    repetitions = [
        fit_free_yaw(SCATTERED, SCATTERED @ rotation(0.3).T @ MATRIX.T + BIAS + 0.02 * rng.normal(size=(8, 3)), MATRIX)
        for _ in range(600)
    ]
    parameters = [np.concatenate([[r.yaw], r.bias, r.matrix.ravel()]) for r in repetitions]
    claimed = np.sqrt(np.mean([np.concatenate([[r.yaw_std**2], np.diag(r.cov)]) for r in repetitions], axis=0))
    np.testing.assert_allclose(claimed, np.std(parameters, axis=0), rtol=0.12)


@pytest.mark.parametrize("like", [np.zeros((3, 3)), np.full((3, 3), NAN)])
def test_a_yaw_that_nothing_fixes_is_refused(like: np.ndarray) -> None:
    with pytest.raises(CalibrationError, match="expected a matrix that tells x from y"):
        fit_free_yaw(SCATTERED, SCATTERED @ MATRIX.T, like)


@pytest.mark.parametrize(
    ("truth", "readings", "covs", "reason"),
    [
        (SIX, SIX[:5], None, r"expected \(n, 3\) truth and readings, got \(6, 3\) and \(5, 3\)"),
        (SIX[:, :2], SIX[:, :2], None, r"expected \(n, 3\) truth and readings"),
        (SIX[:0], SIX[:0], None, r"expected \(n, 3\) truth and readings"),
        (SIX, np.where(np.arange(6)[:, None] == 4, NAN, SIX), None, r"expected finite numbers, got .* at attitude 4"),
        (SIX, SIX, np.tile(np.eye(3), (5, 1, 1)), "expected a positive definite"),
        (SIX, SIX, np.tile(np.diag([1.0, 1.0, -1.0]), (6, 1, 1)), "expected a positive definite"),
        (SIX, SIX, np.full((6, 3, 3), NAN), "expected a positive definite"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(
    truth: np.ndarray, readings: np.ndarray, covs: np.ndarray | None, reason: str
) -> None:
    with pytest.raises(CalibrationError, match=reason):
        fit_attitudes(truth, readings, covs)
