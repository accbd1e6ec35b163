"""Calibrations by closed forms and by draws: what they find, how well they say they know it, and where a gate shuts."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from groundstation.calibration.accuracy import Accuracy, combined_accuracy, relative_error, sensor_characteristic
from groundstation.calibration.attitudes import AttitudeFit
from groundstation.calibration.bias_model import (
    FilterNoise,
    drift_std,
    filter_noise,
    fit_bias_model,
    gauss_markov_variance,
    seen_drift,
)
from groundstation.calibration.gravity_sphere import PARAMETERS, fit_gravity_sphere
from groundstation.calibration.intervals import Interval
from groundstation.calibration.jig import Jig, combined_uncertainty, settings_of
from groundstation.calibration.mwd_design import with_jig
from groundstation.calibration.mwd_model import Readings
from groundstation.calibration.quality import QualityVerdict, judge_readings
from groundstation.calibration.rest_finder import MARGIN, SHORTEST, WINDOW, find_rests
from groundstation.calibration.turntable import turntable_alignment
from groundstation.report.calibrations.linear_outcome import LinearCalibration, errors_of, linear_block
from groundstation.report.calibrations.rests_outcome import gravity_gates, rms_deg
from groundstation.report.calibrations.temperature_outcome import (
    block_of_fit,
    provenance_of,
    temperatures_of,
    warmed_gates,
)
from groundstation.report.calibrations.triad_outcome import errors_json
from telemetry.errors import CalibrationError

GRAVITY = 9.81


# accuracy


def test_accuracy_of_a_sensor_and_of_two_together() -> None:
    found = sensor_characteristic(np.array([10.0, -20.0]), [np.array([9.0, 10.0, 12.5]), np.array([-19.0, -20.0])])
    assert found.mean.tolist() == pytest.approx([10.5, -19.5])
    assert found.std.tolist() == pytest.approx([math.sqrt((1.5**2 + 0.5**2 + 2.0**2) / 2.0), math.sqrt(0.5)])
    assert found.error.tolist() == pytest.approx([5.0, 2.5])
    assert relative_error(np.array([4.0]), np.array([5.0])).tolist() == [25.0]
    overall = found.overall()
    assert (overall.error, overall.std) == pytest.approx((3.75, float(np.mean(found.std))))
    both = combined_accuracy(Accuracy(2.0, 0.3), Accuracy(5.0, 0.4))
    assert both.error == pytest.approx((2.0 * 0.16 + 5.0 * 0.09) / 0.25)
    assert both.std == pytest.approx(1.0 / math.sqrt(1.0 / 0.09 + 1.0 / 0.16))
    with pytest.raises(CalibrationError, match="expected presets other than 0"):
        relative_error(np.array([0.0]), np.array([1.0]))


# an accelerometer at rest wherever it lies

MATRIX = np.array([[1.02, 0.01, -0.02], [0.0, 0.97, 0.015], [0.0, 0.0, 1.01]])
BIAS = np.array([0.05, -0.08, 0.11])


def rests(count: int, std: float, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    ways = random.standard_normal((count, 3))
    force = GRAVITY * ways / np.linalg.norm(ways, axis=1, keepdims=True)
    return force @ MATRIX.T + BIAS + std * random.standard_normal((count, 3))


def test_gravity_alone_tells_matrix_and_bias_as_well_as_it_says() -> None:
    upper = np.triu_indices(3)
    exact = fit_gravity_sphere(rests(40, 0.0, 1), GRAVITY)
    assert exact.matrix == pytest.approx(MATRIX, abs=1e-9)
    assert exact.bias == pytest.approx(BIAS, abs=1e-9)
    of_bias, of_matrix, of_residuals = [], [], []
    for seed in range(60):
        fit = fit_gravity_sphere(rests(30, 0.01, seed), GRAVITY)
        of_bias.append(((fit.bias - BIAS) / fit.bias_std) ** 2)
        of_matrix.append(((fit.matrix - MATRIX)[upper] / fit.matrix_std[upper]) ** 2)
        of_residuals.append(float(np.sum(fit.residuals**2)))
    assert 0.75 < np.mean(of_bias) < 1.3
    assert 0.75 < np.mean(of_matrix) < 1.3
    assert np.mean(of_residuals) == pytest.approx(0.01**2 * (30 - PARAMETERS), rel=0.15)


def test_what_is_said_of_a_matrix_holds_for_axes_of_different_scales() -> None:
    scales = np.diag([1.8, 0.6, 1.0])
    off: list[np.ndarray] = []
    said: list[np.ndarray] = []
    for seed in range(40):
        fit = fit_gravity_sphere((rests(30, 0.01, seed) - BIAS) @ scales.T, GRAVITY)
        off.append(np.diag(fit.matrix - scales @ MATRIX) ** 2)
        said.append(np.diag(fit.matrix_std) ** 2)
    assert np.mean(off, axis=0) / np.mean(said, axis=0) == pytest.approx(1.0, rel=0.5)


def test_a_rest_that_is_left_out_is_judged_by_the_other_half() -> None:
    means = rests(40, 0.02, 7)
    fit = fit_gravity_sphere(means, GRAVITY)
    for first in (0, 1):
        half = fit_gravity_sphere(means[first::2], GRAVITY)
        others = means[1 - first :: 2]
        sizes = np.linalg.norm(np.linalg.solve(half.matrix, (others - half.bias).T).T, axis=1)
        assert fit.left_out[1 - first :: 2] == pytest.approx(sizes - GRAVITY, abs=1e-9)
    assert fit.left_out_rms() == pytest.approx(math.sqrt(float(np.mean(fit.left_out**2))))
    assert fit.residual_rms() == pytest.approx(math.sqrt(float(np.mean(fit.residuals**2))))
    flat = means.copy()
    flat[:, 2] = 0.3
    with pytest.raises(CalibrationError, match="nine parameters apart"):
        fit_gravity_sphere(GRAVITY * flat / np.linalg.norm(flat, axis=1, keepdims=True), GRAVITY)


@pytest.mark.parametrize(("still", "count"), [(SHORTEST + WINDOW - 1, 1), (SHORTEST + WINDOW - 2, 0)])
def test_a_rest_lasts_so_many_rows_and_keeps_off_both_its_ends(still: int, count: int) -> None:
    random = np.random.default_rng(2)
    force = random.standard_normal((2000, 3))
    force[500 : 500 + still] *= 1e-3
    force[1200:1500] *= 1e-3
    none = np.zeros(2000, dtype=bool)
    long = slice(1200 + WINDOW // 2 + MARGIN, 1500 - WINDOW // 2 + 1 - MARGIN)
    found = find_rests(force, None, none)
    assert len(found) == 1 + count
    assert found[-1] == long
    if count:
        assert (found[0].start, found[0].stop) == (500 + WINDOW // 2 + MARGIN, 500 + WINDOW // 2 + SHORTEST - MARGIN)
    broken = none.copy()
    broken[1350] = True
    assert [part for part in find_rests(force, None, broken) if part.start > 1000] == [
        slice(long.start, 1350 - MARGIN), slice(1350 + MARGIN, long.stop),
    ]  # fmt: skip


def test_a_sensor_that_is_still_held_is_at_rest_for_its_force_alone_and_one_that_turns_for_neither() -> None:
    random = np.random.default_rng(3)
    force, rate = random.standard_normal((3000, 3)), random.standard_normal((3000, 3))
    for begin in range(0, 3000, 500):
        force[begin : begin + 300] *= 1e-3
        rate[begin : begin + 300] *= 1e-3
    rate[1000:1300] = random.standard_normal((300, 3))  # held by a hand
    rate[1500:1800] += [0.0, 0.0, 0.5]  # turned steadily
    none = np.zeros(3000, dtype=bool)
    assert [round(part.start, -2) for part in find_rests(force, None, none)] == [0, 500, 1000, 1500, 2000, 2500]
    assert [round(part.start, -2) for part in find_rests(force, rate, none)] == [0, 500, 2000, 2500]
    force[500:800] = random.standard_normal((300, 3))  # shaken without a turn
    assert [round(part.start, -2) for part in find_rests(force, rate, none)] == [0, 2000, 2500]
    rate[2000:2300] += [0.0, 0.0, 0.4]
    two = find_rests(force[1400:2400], rate[1400:2400], none[1400:2400])
    assert len(two) == 2  # of two none is the odd one


# a turn table, and rows of a result


def test_a_turn_table_shows_a_column_an_axis_and_a_bias_each() -> None:
    matrix = np.array([[1.0, 0.01, 0.02], [0.03, 1.1, 0.04], [0.05, 0.06, 0.9]])
    biases = np.array([[0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8, 1.5]])  # row: the axis that is turned
    found = turntable_alignment(20.0 * matrix.T + biases, -20.0 * matrix.T + biases, 20.0)
    assert found.matrix == pytest.approx(matrix)
    assert found.bias == pytest.approx([0.4, 0.5, 0.8])
    assert found.residuals == pytest.approx(biases - [0.4, 0.5, 0.8])
    assert found.residual_rms() == pytest.approx(math.sqrt(float(np.mean((biases - [0.4, 0.5, 0.8]) ** 2))))


def linear(**change: Any) -> LinearCalibration:
    fit = AttitudeFit(
        np.diag([2.0, 4.0, 5.0]), np.array([0.1, 0.2, 0.3]), np.diag(np.arange(1.0, 13.0) ** 2), np.full((2, 3), 0.5),
        1.0, 4, np.ones(2), degrees=5,
    )  # fmt: skip
    given = {
        "fit": fit, "names": ("a", "b"), "truth": np.eye(3)[:2],
        "readings": np.array([[2.1, 0.2, 0.3], [0.1, 4.2, 0.7]]), "truth_si": 9.8,
        "reading_si": 2.0, "unit": "m/s2", "matrix_unit": "", "sensor": "accelerometer", "design": "d",
        "record_sha256": "a" * 64,
    }  # fmt: skip
    return LinearCalibration(**(given | change))


def test_a_block_is_in_si_of_readings_over_truths() -> None:
    block = linear_block(linear(), "2026-01-01", 31.0)
    assert block.matrix == pytest.approx(np.diag([2.0, 4.0, 5.0]) * 2.0 / 9.8)
    assert block.bias == pytest.approx([0.2, 0.4, 0.6])
    assert block.reference == 31.0
    assert block.provenance.residual_rms == pytest.approx(2.0 * linear().fit.residual_rms())
    assert block.provenance.bias_std == pytest.approx([2.0, 4.0, 6.0])
    assert block.provenance.matrix_std == pytest.approx(np.arange(4.0, 13.0).reshape(3, 3) * 2.0 / 9.8)
    assert linear_block(linear(), "2026-01-01", None).reference == 25.0
    errors = errors_of(linear(truth_si=3.0, reading_si=2.0))
    before = [math.hypot(2.1 - 1.5, 0.2, 0.3), math.hypot(0.1, 4.2 - 1.5, 0.7)]
    after = [1.5 * math.hypot(0.0, 0.0, 0.0), 1.5 * math.hypot(0.0, 0.0, 0.4 / 5.0)]
    assert errors.before == pytest.approx(before)
    assert errors.after == pytest.approx(after, abs=1e-12)


def gravity_fit(residual: float, left: float, sizes: tuple[float, float, float] = (1.0, 1.0, 1.0)) -> Any:
    return SimpleNamespace(matrix=np.diag(sizes), residual_rms=lambda: residual, left_out_rms=lambda: left)


@pytest.mark.parametrize(
    ("fit", "before", "shut"),
    [
        (gravity_fit(0.02, 0.04), 0.021, []),
        (gravity_fit(0.0201, 0.04), 0.03, ["residual"]),
        (gravity_fit(0.02, 0.0401), 0.03, ["halves"]),
        (gravity_fit(0.02, 0.04), 0.0199, ["gain"]),
        (gravity_fit(0.01, 0.01, (0.71, 1.0, 1.39)), 0.03, []),
        (gravity_fit(0.01, 0.01, (0.69, 1.0, 1.0)), 0.03, ["scale"]),
        (gravity_fit(0.01, 0.01, (1.41, 1.0, 1.0)), 0.03, ["scale"]),
    ],
)
def test_gates_of_rests_shut_beyond_their_bounds(fit: Any, before: float, shut: list[str]) -> None:
    means = np.array([[0.0, 0.0, GRAVITY + before], [0.0, 0.0, -(GRAVITY - before)]])
    found = gravity_gates(fit, means, GRAVITY)
    assert [gate.name for gate in found if not gate.holds] == shut


def test_temperatures_are_two_where_they_are_more_than_three_kelvin_apart() -> None:
    assert temperatures_of(np.array([20.0, 10.0, 13.0, 16.1, 12.9, 23.05])) == [10.0, 16.1, 20.0, 23.05]
    model = SimpleNamespace(
        matrix=np.array([np.eye(3), 0.1 * np.eye(3)]), bias=np.array([[1.0, 2.0, 3.0], [0.1, 0.2, 0.3]]), reference=22.0
    )
    fit: Any = SimpleNamespace(
        model=model, residual_rms=lambda: 4.0, matrix_std=model.matrix + 7.0, bias_std=model.bias + 6.0
    )
    told = provenance_of("a" * 64, "2026-01-01", "d", fit, 0.5)
    assert (told.residual_rms, told.bias_std) == (2.0, pytest.approx(0.5 * fit.bias_std[0]))
    assert told.matrix_std == pytest.approx(fit.matrix_std[0])
    assert told.matrix_slopes_std == pytest.approx(fit.matrix_std[1:])
    assert told.bias_slopes_std == pytest.approx(0.5 * fit.bias_std[1:])
    block = block_of_fit(fit, 0.5, "gyroscope", told, (10.0, 23.05))
    assert block.valid == (10.0, 23.05)
    assert block.matrix == pytest.approx(np.eye(3))
    assert block.bias == pytest.approx([0.5, 1.0, 1.5])
    assert (block.matrix_slopes, block.bias_slopes) == (
        pytest.approx(0.1 * np.eye(3)[None]),
        pytest.approx(np.array([[0.05, 0.1, 0.15]])),
    )


@pytest.mark.parametrize(
    ("residual", "scale", "sensor", "shut"),
    [
        (0.0199, 1.0, "accelerometer", []), (0.0201, 1.0, "accelerometer", ["residual"]),
        (0.0099, 1.0, "gyroscope", []),
        (0.0101, 1.0, "gyroscope", ["residual"]), (0.001, 0.69, "gyroscope", ["scale"]),
        (0.001, 1.41, "accelerometer", ["scale"]), (0.001, -1.0, "gyroscope", ["right-handed"]),
    ],
)  # fmt: skip
def test_gates_of_a_warmed_sensor_shut_beyond_their_bounds(
    residual: float, scale: float, sensor: str, shut: list[str]
) -> None:
    """Twenty rows with eight unknowns each: of the residuals as much is left as twelve rows have."""
    ends = np.array([np.eye(3), scale * np.eye(3)])
    fit: Any = SimpleNamespace(
        model=SimpleNamespace(bias=np.zeros((2, 3)), matrix=np.zeros((2, 3, 3)), matrix_at=lambda _: ends),
        residuals=np.full((20, 3), residual * math.sqrt(12.0 / 20.0)),
    )
    record: Any = SimpleNamespace(
        temperature=np.arange(20.0), truth=np.linspace(-5.0, 5.0, 60).reshape(20, 3), readings=np.zeros((20, 3)),
        lines=list(range(20)),
    )  # fmt: skip
    assert [gate.name for gate in warmed_gates(record, fit, 1.0, sensor) if not gate.holds] == shut


def test_errors_of_a_triad_are_shown_in_degrees() -> None:
    found = errors_json(SimpleNamespace(size_max=0.4, size_rms=0.3, angle_max=0.02, angle_rms=0.01), "ut", "dip_deg")
    assert found == {
        "size_max_ut": 0.4, "size_rms_ut": 0.3, "dip_max_deg": pytest.approx(math.degrees(0.02)),
        "dip_rms_deg": pytest.approx(math.degrees(0.01)),
    }  # fmt: skip
    assert rms_deg(np.array([0.03, -0.04])) == pytest.approx(math.degrees(math.sqrt(0.00125)))


# twelve tool faces


def twelve(widest_gap_deg: float = 30.0, off: float = 0.0, tilt_deg: float = 45.0, first_deg: float = 0.0) -> Readings:
    faces = np.radians(first_deg + (360.0 - widest_gap_deg) / 11.0 * np.arange(12))
    gravity = np.column_stack([np.cos(faces), np.sin(faces), np.ones(12)])
    tilt, azimuth = np.full(12, math.radians(tilt_deg)), np.full(12, 0.01)
    size = np.ones(12)
    tilt[3] += math.radians(0.1) + off
    azimuth[5] -= math.radians(1.0) + off - math.tau
    size[7] += 0.003 + off
    return Readings(gravity, np.ones((12, 3)), size, size, tilt, azimuth)


def test_twelve_tool_faces_agree_below_their_limits_and_lie_all_around() -> None:
    assert not QualityVerdict("a", "g", 0.003, 0.003).passed
    assert [verdict.passed for verdict in judge_readings(twelve(off=1e-6)).verdicts] == [False] * 3
    report = judge_readings(twelve(off=-1e-6))
    assert ([verdict.passed for verdict in report.verdicts], report.passed) == ([True] * 3, True)
    for first in range(0, 360, 15):  # wherever the gap lies, also across zero
        judge_readings(twelve(59.9, first_deg=first))
        with pytest.raises(CalibrationError, match="no tool face within 61 deg"):
            judge_readings(twelve(60.6, first_deg=first))
    leaning = twelve()
    leaning.tilt[0] = math.radians(0.9)
    with pytest.raises(CalibrationError, match="not one attitude"):
        judge_readings(leaning)
    with pytest.raises(CalibrationError, match="within 1 deg of the vertical"):
        judge_readings(twelve(tilt_deg=0.95))


# a jig that is itself off


def test_what_a_jig_does_is_in_the_deviation_and_out_of_the_noise() -> None:
    random = np.random.default_rng(4)
    truth = np.repeat(random.standard_normal((6, 3)), 2, axis=0)
    basis = np.column_stack([truth, np.ones(12)])
    matrix, jig = np.array([[1.1, 0.02, 0.0], [0.0, 0.9, 0.03], [0.01, 0.0, 1.0]]), Jig(0.02, 0.01)
    settings = settings_of(truth)
    assert [int(np.sum(settings == one)) for one in np.unique(settings)] == [2] * 6
    gain = np.linalg.pinv(basis)
    drawn = 0.01 * random.standard_normal((12, 3))
    residuals = 8.0 * (drawn - basis @ gain @ drawn)
    found = combined_uncertainty(basis, residuals, truth, matrix, settings, jig)
    for axis in range(3):
        cov = np.zeros((12, 12))
        for one, other in np.ndindex(12, 12):
            share = 0.02**2 * (settings[one] == settings[other]) + 0.01**2 * (one == other)
            turns = [np.array([np.cross(unit, truth[row]) for unit in np.eye(3)]).T for row in (one, other)]
            cov[one, other] = share * float(matrix[axis] @ turns[0] @ turns[1].T @ matrix[axis])
        left = np.eye(12) - basis @ gain
        noise = (float(residuals[:, axis] @ residuals[:, axis]) - float(np.trace(left @ cov))) / 8.0
        assert noise > 0.0
        expected = np.sqrt(np.diag(gain @ (cov + noise * np.eye(12)) @ gain.T))
        assert found.std[:, axis] == pytest.approx(expected)


def test_beyond_its_knots_an_interval_grows_as_the_root_of_the_squares() -> None:
    interval = Interval(np.array([0.0, 2.0]), np.array([0.3, 1.5]))
    assert interval.half_width(np.exp([1.0, 2.0, 5.0, -1.0])) == pytest.approx(np.exp([0.9, 1.5, 3.0, 0.3]))


def test_a_lean_of_the_jig_is_one_error_at_each_tilt_and_another_at_each_tool_face_upright() -> None:
    random = np.random.default_rng(9)
    angle = np.array([0.0, 0.0, 0.5, 0.5, 0.5, 1.2, 1.2])
    rows = random.standard_normal((7, 4, 3))
    problem: Any = SimpleNamespace(
        angle=angle, residual_jacobian=lambda _: rows.reshape(28, 3), on_axis=lambda: angle == 0.0,
        residuals=lambda _: np.zeros(28),
    )  # fmt: skip
    weights = np.diag([2.0, 3.0, 5.0])
    for jig in (Jig(0.02, 0.0), Jig(0.0, 0.03), Jig(0.02, 0.03)):
        normal = np.zeros((3, 3))
        for one, other in np.ndindex(7, 7):
            if angle[one] > 0.0:
                share = jig.common**2 * (angle[one] == angle[other]) + jig.random**2 * (one == other)
                normal += share * np.outer(rows[one, 1], rows[other, 1])
        for row in rows[:2]:
            normal += (jig.common**2 + jig.random**2) * (np.outer(row[1], row[1]) + np.outer(row[2], row[2]))
        cov, noise = with_jig(problem, np.zeros(3), weights, jig)
        assert cov == pytest.approx(weights @ normal @ weights)
        assert noise == 0.0


# what a filter takes of a sensor's noise


def variances_of(t: np.ndarray, white: float, bias: float, tau: float) -> np.ndarray:
    return np.asarray(white**2 / t + bias**2 * gauss_markov_variance(t, tau))


def test_an_allan_variance_of_a_bias_is_that_of_its_covariances() -> None:
    """Half the mean square of the difference of two neighbouring means of a process of exp(-|t| / 7)."""
    for tau in (0.5, 6.0, 90.0):
        t = tau * (np.arange(1000) + 0.5) / 1000
        same = float(np.mean(np.exp(-np.abs(t[:, None] - t) / 7.0)))
        next_to = float(np.mean(np.exp(-np.abs(t[:, None] - t - tau) / 7.0)))
        assert float(gauss_markov_variance(tau, 7.0)) == pytest.approx(same - next_to, rel=1e-3)


def test_a_curve_through_two_points_passes_through_them() -> None:
    found = filter_noise(0.02, 0.008, 40.0)
    assert found.bias_tau == pytest.approx(40.0 / 1.89)
    through = variances_of(np.array([1.0, 40.0]), found.white, found.bias_std, found.bias_tau)
    assert np.sqrt(through) == pytest.approx([0.02, 0.008])
    for one, floor, at in ((0.02, 0.5, 40.0), (0.02, 0.0001, 40.0), (0.02, 0.008, 1.0)):
        with pytest.raises(CalibrationError, match="filter noise"):
            filter_noise(one, floor, at)


@pytest.mark.parametrize(("learnt", "span", "tau"), [(60.0, 300.0, 40.0), (20.0, 5.0, 200.0)])
def test_a_drift_is_that_of_the_covariances_of_its_bias(learnt: float, span: float, tau: float) -> None:
    count = 1500
    t = np.concatenate([learnt * (np.arange(count) + 0.5) / count, learnt + span * (np.arange(count) + 0.5) / count])
    weights = np.concatenate([np.full(count, -span / count), np.full(count, span / count)])
    bias = float(weights @ np.exp(-np.abs(t[:, None] - t) / tau) @ weights)
    white = 0.01**2 * (span + span**2 / learnt)
    found = drift_std(FilterNoise(0.01, 0.02, tau), span, learnt)
    assert found == pytest.approx(math.sqrt(white + 0.02**2 * bias), rel=1e-3)
    rate = 4.0
    ramp = 0.003 * np.arange(round(rate * 5.0 * (learnt + span))) / rate
    assert seen_drift(ramp, rate, span, learnt) == pytest.approx(0.003 * span * (span + learnt) / 2.0, rel=1e-3)
    assert seen_drift(ramp[: round(rate * 2.9 * (learnt + span))], rate, span, learnt) is None


def test_a_bias_that_a_curve_shows_is_fitted_and_one_that_it_hides_has_a_bound() -> None:
    t = np.geomspace(0.25, 600.0, 34)
    confidence = 0.01 * np.sqrt(t / t[0])
    found = fit_bias_model(t, np.sqrt(variances_of(t, 0.02, 0.01, 25.0)), confidence)
    assert not found.is_bound
    assert (found.white, found.bias_std, found.bias_tau) == pytest.approx((0.02, 0.01, 25.0), rel=0.3)
    used = 1.0 + 1.0 / (2.0 * confidence**2) >= 6.0
    longest = t[used][-1] / 1.89
    white = variances_of(t, 0.02, 0.0, 1.0)[used]
    error = np.hypot(2.0 * confidence[used], 0.1) * white
    design = np.stack([1.0 / t[used], gauss_markov_variance(t[used], longest)], axis=1) / error[:, None]
    std = math.sqrt(np.linalg.inv(design.T @ design)[1, 1])
    hidden = fit_bias_model(t, np.sqrt(variances_of(t, 0.02, 0.0, 1.0)), confidence)
    assert (hidden.is_bound, hidden.bias_tau, hidden.white) == (True, pytest.approx(longest), pytest.approx(0.02))
    assert hidden.bias_std == pytest.approx(math.sqrt(1.645 * std))
    for times, is_bound in ((1.0, True), (6.0, False)):
        curve = np.sqrt(variances_of(t, 0.02, math.sqrt(times * std), longest))
        assert fit_bias_model(t, curve, confidence).is_bound == is_bound
