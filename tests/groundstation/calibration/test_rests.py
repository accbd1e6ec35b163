"""Calibration from rests at unknown attitudes: a real MPU-9150, and sensors made by a rigid body of the test's own."""

from __future__ import annotations

import csv
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import scipy.optimize
from scipy.spatial.transform import Rotation

from groundstation.calibration.block import from_json
from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import RecordWords, RestsRequest
from telemetry.errors import CalibrationError, LoggerError

REAL = Path(__file__).parents[2] / "data" / "records" / "mpu9150-imu0-100hz.npy"
REAL_WORDS = RecordWords(gyro=f"{2000 / 32768} deg/s", accel=f"{9.81 / 2048} m/s2")
G, RATE = 9.81, 100.0
ACCELEROMETER = np.linalg.inv(np.array([[1.01, 0.004, -0.006], [0.0, 0.99, 0.008], [0.0, 0.0, 1.004]]))
GYROSCOPE = np.array([[1.012, 0.006, -0.004], [-0.005, 0.991, 0.007], [0.003, -0.006, 1.006]])
FORCE_BIAS, RATE_BIAS = np.array([0.1, -0.2, 0.35]), np.array([0.08, 0.001, -0.019])  # m/s^2, 4.6 deg/s


def laid_down(rests: int = 24, seed: int = 1, spread: float = 1.0) -> np.ndarray:
    """Record (n, 7): s, rad/s, m/s^2 of a sensor that is turned from rest to rest about random axes."""
    random = np.random.default_rng(seed)
    pose, rates, forces = Rotation.random(random_state=seed), [], []
    for _ in range(rests):
        still = round(RATE * random.uniform(3.0, 5.0))
        rates.extend(np.zeros((still, 3)))
        forces.extend(np.tile(pose.inv().apply([0.0, 0.0, G]), (still, 1)))
        axis, angle = random.standard_normal(3), spread * random.uniform(0.8, 2.5)
        steps = round(RATE * 1.5)
        speed = angle * (1.0 - np.cos(2.0 * np.pi * (np.arange(steps) + 0.5) / steps)) * RATE / steps
        turning = speed[:, None] * axis / np.linalg.norm(axis)
        poses = pose * Rotation.from_rotvec(np.cumsum(turning, axis=0) / RATE)
        rates.extend(turning)
        forces.extend(poses.inv().apply([0.0, 0.0, G]) + 0.3 * random.standard_normal((steps, 3)))
        pose = poses[-1]
    read = np.array(rates) @ GYROSCOPE.T + RATE_BIAS + 0.002 * random.standard_normal((len(rates), 3))
    felt = np.array(forces) @ ACCELEROMETER.T + FORCE_BIAS + 0.02 * random.standard_normal((len(rates), 3))
    return np.column_stack([np.arange(len(rates)) / RATE, read, felt])


def calibrated(folder: Path, rows: np.ndarray, **options: object) -> CalibrationOutcome:
    np.save(folder / "rests.npy", rows)
    return answer_calibration(RestsRequest(folder / "rests.npy", gravity=G, **options), "2026-01-31")  # type: ignore[arg-type]


@pytest.mark.slow
def test_both_sensors_of_a_made_record_come_back(tmp_path: Path) -> None:
    outcome = calibrated(tmp_path, laid_down())
    block = from_json(outcome.document)
    assert block.sensor == "accelerometer"
    assert block.matrix == pytest.approx(ACCELEROMETER, abs=6e-4)
    assert block.bias == pytest.approx(FORCE_BIAS, abs=3e-3)
    assert outcome.gyroscope_document is not None
    turned = from_json(outcome.gyroscope_document)
    assert turned.sensor == "gyroscope"
    assert turned.matrix == pytest.approx(GYROSCOPE, abs=1.5e-3)
    assert turned.bias == pytest.approx(RATE_BIAS, abs=1e-4)
    judged = outcome.result["gyroscope"]
    assert judged["left_out_rms_deg"] < 0.1 < 0.5 < judged["uncalibrated_rms_deg"]
    assert outcome.result["residual_rms"] < 0.004 < 0.1 < outcome.result["before_rms"]


@pytest.mark.slow
def test_standard_errors_are_those_of_many_records(tmp_path: Path) -> None:
    off = []
    for seed in range(5):
        block = from_json(calibrated(tmp_path, laid_down(seed=seed)).document)
        std = np.where(block.provenance.matrix_std > 0.0, block.provenance.matrix_std, 1.0)
        off.extend(
            [*((block.matrix - ACCELEROMETER) / std).ravel(), *((block.bias - FORCE_BIAS) / block.provenance.bias_std)]
        )
    sizes = np.abs([one for one in off if one != 0.0])
    assert np.sqrt(np.mean(sizes**2)) < 1.6


@pytest.mark.slow
def test_rests_that_were_not_used_are_judged_by_the_other_half_and_by_an_independent_solver(tmp_path: Path) -> None:
    rows = laid_down(seed=4)
    found = calibrated(tmp_path, rows).result
    means = np.array([rows[a - 1 : b, 4:7].mean(axis=0) for a, b in (rest["lines"] for rest in found["rests"])])

    def sizes(p: np.ndarray, of: np.ndarray) -> np.ndarray:
        shape = np.array([[p[0], p[1], p[2]], [0.0, p[3], p[4]], [0.0, 0.0, p[5]]])
        return np.linalg.norm((of - p[6:]) @ shape.T, axis=1) - G

    left = []
    for first in (0, 1):
        start = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0]
        solved = scipy.optimize.least_squares(sizes, start, args=(means[first::2],), xtol=1e-15, ftol=1e-15, gtol=1e-15)
        left.extend(sizes(solved.x, means[1 - first :: 2]))
    assert found["left_out_rms"] == pytest.approx(np.sqrt(np.mean(np.square(left))), rel=1e-3)
    assert found["left_out_rms"] > found["residual_rms"]


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 1])
def test_a_real_mpu_9150_keeps_gravity_at_rests_and_turns_that_were_not_used(number: int) -> None:
    record = REAL.with_name(f"mpu9150-imu{number}-100hz.npy")
    outcome = answer_calibration(RestsRequest(record, gravity=G, rate=100.0, words=REAL_WORDS), "2026-01-31")
    found = outcome.result
    assert found["before_rms"] > 0.2
    assert found["residual_rms"] <= 0.003
    assert found["left_out_rms"] <= 0.005
    turned = found["gyroscope"]
    assert turned["left_out_rms_deg"] < 0.5 * turned["uncalibrated_rms_deg"]
    assert found["forced"] == []
    assert len(found["rests"]) > 15
    assert "'" not in outcome.document
    with (Path(__file__).parents[3] / "docs" / "results" / "rests.csv").open(encoding="utf-8") as file:
        told = list(csv.DictReader(file))[number]
    printed = [told["after_mps2"], told["not_used_mps2"], told["turns_not_used_deg"]]
    assert printed == [
        f"{found['residual_rms']:.5f}",
        f"{found['left_out_rms']:.5f}",
        f"{turned['left_out_rms_deg']:.4f}",
    ]


def test_without_a_rate_the_accelerometer_lands_alone() -> None:
    outcome = answer_calibration(RestsRequest(REAL, gravity=G, words=REAL_WORDS), "2026-01-31")
    assert outcome.result["residual_rms"] <= 0.003
    assert outcome.gyroscope_document is None
    assert "expected --rate" in outcome.result["why_no_gyroscope"]


@pytest.mark.slow
@pytest.mark.parametrize(
    ("wrong", "gate"),
    [
        (np.diag([1.0, -1.0, 1.0]), "right-handed: the axes are left-handed"),
        (np.eye(3)[[1, 0, 2]], "right-handed: the axes are left-handed"),
        (np.eye(3) / 1.8, "scale: the axes answer with 0.5"),
        (np.diag([1.0, 1.0, 0.75]), "axes: the axes are not three alike"),
    ],
    ids=["mirrored", "exchanged", "scale", "one weak"],
)
def test_a_gyroscope_that_is_none_of_this_sensor_is_refused_by_name_and_the_other_lands(
    tmp_path: Path, wrong: np.ndarray, gate: str
) -> None:
    rows = laid_down(seed=2)
    rows[:, 1:4] = rows[:, 1:4] @ wrong.T
    outcome = calibrated(tmp_path, rows)
    assert outcome.gyroscope_document is None
    assert outcome.result["why_no_gyroscope"].startswith("refused by ")
    assert gate in outcome.result["why_no_gyroscope"]
    assert outcome.result["forced"] == []
    forced = calibrated(tmp_path, rows, force=True)
    assert forced.gyroscope_document is not None
    assert any(found.startswith(gate.partition(":")[0]) for found in forced.result["forced"])
    assert f"forced past {gate.partition(':')[0]}" in from_json(forced.gyroscope_document).provenance.design


@pytest.mark.slow
def test_turns_that_were_not_read_are_refused_by_name(tmp_path: Path) -> None:
    """A gyroscope that misses a third of every turn about z has no matrix that explains the turns."""
    rows = laid_down(seed=3)
    rows[:, 3] = np.clip(rows[:, 3], -0.6, 0.6)
    refused = calibrated(tmp_path, rows).result["why_no_gyroscope"]
    assert "turns: " in refused
    assert "deg rms at turns that were not used, expected up to 1" in refused


@pytest.mark.slow
def test_a_bias_is_no_motion_and_a_steady_turn_is_no_rest(tmp_path: Path) -> None:
    rows = laid_down()
    still = [rest["lines"] for rest in calibrated(tmp_path, rows).result["rests"]]
    assert len(still) == 24
    moved = np.flatnonzero(np.abs(rows[:, 1:4] - RATE_BIAS).max(axis=1) > 0.05)
    assert not any(np.any((moved >= a) & (moved < b)) for a, b in still)


@pytest.mark.parametrize(
    ("lay", "says"),
    [
        (lambda: laid_down(rests=8), r"rests\.npy: rests: expected 12 or more at different attitudes, got 8"),
        (lambda: laid_down(spread=0.02), r"expected attitudes that tell nine parameters apart"),
        (lambda: laid_down()[:90], r"expected 100 rows or more, got 90"),
        (
            lambda: laid_down()[:, [0, 1, 2, 3, 4, 4, 4]] * np.array([1, 1, 1, 1, 1, 0.1, 3]),
            "refused by|expected attitudes",
        ),
    ],
    ids=["few", "alike", "short", "no gravity"],
)
def test_what_gives_no_calibration_is_refused_by_name(tmp_path: Path, lay: Callable[[], np.ndarray], says: str) -> None:
    with pytest.raises(CalibrationError, match=says):
        calibrated(tmp_path, lay())


def test_a_record_in_g_that_says_so_not_is_refused(tmp_path: Path) -> None:
    with pytest.raises(LoggerError, match="they look in g"):
        calibrated(tmp_path, laid_down() / np.array([1, 1, 1, 1, G, G, G]))
