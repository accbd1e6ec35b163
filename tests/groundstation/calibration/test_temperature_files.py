"""Calibration over temperature from a file: coefficients, intervals and what a node applies, and refusals by name."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from groundstation.calibration.block import from_json
from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import TemperatureRequest
from telemetry.calibration import sensor_parameters
from telemetry.errors import CalibrationError

OVEN = (-10.0, 10.0, 30.0, 50.0, 70.0)
BIAS = np.array([[0.4, -0.2, 0.1], [5e-3, -8e-3, 2e-3], [2e-5, 1e-5, -4e-5]])  # deg/s by powers of T - 30
MATRIX = np.array([[1.005, 0.003, -0.002], [-0.004, 0.993, 0.001], [0.002, -0.003, 1.002]])
SLOPE = np.diag([2e-4, -1e-4, 3e-4])


def record(noise: float = 0.01, seed: int = 1, oven: tuple[float, ...] = OVEN) -> np.ndarray:
    """Rows (n, 7): C, true and read rates in deg/s, each axis both ways at each temperature."""
    random, rows = np.random.default_rng(seed), []
    for warmth in oven:
        for truth in 200.0 * np.vstack([np.eye(3), -np.eye(3)]):
            d = warmth - 30.0
            read = (MATRIX + SLOPE * d) @ truth + BIAS[0] + BIAS[1] * d + BIAS[2] * d * d
            rows.append([warmth, *truth, *(read + noise * random.standard_normal(3))])
    return np.array(rows)


def calibrated(folder: Path, rows: np.ndarray, **options: object) -> CalibrationOutcome:
    path = folder / "oven.csv"
    text = "\n".join(",".join(f"{v:.10g}" for v in row) for row in rows)
    path.write_text(f"temperature_c,true_x,true_y,true_z,x,y,z\n{text}\n")
    return answer_calibration(TemperatureRequest(path, **options), "2026-01-31")  # type: ignore[arg-type]


def test_a_node_applies_what_the_oven_showed(tmp_path: Path) -> None:
    block = from_json(calibrated(tmp_path, record(noise=0.0)).document)
    assert block.sensor == "gyroscope"
    assert block.reference == 30.0
    assert block.valid == (-10.0, 70.0)
    assert np.degrees(block.bias) == pytest.approx(BIAS[0], abs=1e-8)
    assert np.degrees(block.bias_slopes) == pytest.approx(BIAS[1:], abs=1e-9)
    assert block.matrix == pytest.approx(MATRIX, abs=1e-9)
    assert block.matrix_slopes[0] == pytest.approx(SLOPE, abs=1e-11)
    applied = sensor_parameters(block)
    assert math.degrees(applied.bias_slopes[0][1]) == pytest.approx(-8e-3)


def test_intervals_hold_95_percent(tmp_path: Path) -> None:
    held = []
    for seed in range(60):
        found = calibrated(tmp_path, record(seed=seed)).result
        assert found["valid_c"] == [-10.0, 70.0]
        wide = found["expanded_uncertainty"]
        held.extend((np.abs(np.array(found["bias"]) - BIAS) < wide["bias"]).ravel())
        held.extend((np.abs(np.array(found["matrix"]) - [MATRIX, SLOPE]) < wide["matrix"]).ravel())
    assert 0.93 < np.mean(held) < 0.97


def exchanged(rows: np.ndarray) -> np.ndarray:
    return rows[:, [0, 1, 2, 3, 5, 4, 6]]


def moved(rows: np.ndarray) -> np.ndarray:
    rows = rows.copy()
    rows[7, 5] += 9.0
    return rows


@pytest.mark.parametrize(
    ("rows", "says"),
    [
        (record(oven=(10.0, 30.0, 50.0)), "line 19: expected 4 temperatures or more, 3 K apart, got 10, 30, 50 C"),
        (record(oven=(10.0, 11.0, 12.0, 50.0)), "got 10, 50 C"),
        (record() + np.array([273.15, 0, 0, 0, 0, 0, 0]), r"line 2: expected a temperature .*kelvin\?"),
        (exchanged(record()), "refused by right-handed"),
        (moved(record()), "residual: .* the largest is in line 9"),
        (np.tile(record(), (2, 1)), "duplicates: 30 rows stand twice"),
        (record() / np.array([1, 1, 1, 1, 1.8, 1.8, 1.8]), "scale: the axes answer with 0.5"),
    ],
    ids=["three", "close", "kelvin", "exchanged", "moved", "pasted", "reference"],
)
def test_what_gives_no_polynomials_is_refused_by_name(tmp_path: Path, rows: np.ndarray, says: str) -> None:
    with pytest.raises(CalibrationError, match=rf"oven\.csv.*{says}"):
        calibrated(tmp_path, rows)


def test_a_forced_one_says_so(tmp_path: Path) -> None:
    outcome = calibrated(tmp_path, moved(record()), force=True)
    assert outcome.result["forced"][0].startswith("residual: ")
    assert "forced past residual: " in from_json(outcome.document).provenance.design
