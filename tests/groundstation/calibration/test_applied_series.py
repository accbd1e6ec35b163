"""A calibration on a record in time: the truth comes back, and how far the readings were off is said."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.calibrate.calibrate import calibrate
from groundstation.calibration.block import Calibration, Provenance, write_calibration
from telemetry.records.imu_record import read_imu_record
from telemetry.records.record_reading import reading_of

GRAVITY = 9.80665  # m/s^2
MATRIX = np.array([[1.02, 0.004, -0.003], [0.001, 0.97, 0.006], [-0.002, 0.005, 1.01]])
BIAS = np.array([0.05, -0.12, 0.2])
SLOPE, BIAS_SLOPE = 2e-4 * np.eye(3), np.array([1e-3, -2e-3, 5e-4])  # a kelvin
AT = 25.0  # C
READING = reading_of("", "", "", "", 0.0, 0.0, math.inf, ())


def block(folder: Path, sensor: str, *, warm: bool = False) -> Path:
    slopes, bias_slopes = (SLOPE[None], BIAS_SLOPE[None]) if warm else (np.zeros((0, 3, 3)), np.zeros((0, 3)))
    stds = (np.zeros((3, 3)), np.zeros(3), np.zeros_like(slopes), np.zeros_like(bias_slopes))
    origin = Provenance("ab" * 32, "2026-11-27", "by hand", 0.0, *stds)
    path = folder / f"{sensor}-{warm}.json"
    write_calibration(path, Calibration(sensor, MATRIX, BIAS, slopes, bias_slopes, AT, origin))
    return path


def directions(count: int = 60) -> np.ndarray:
    """Gravity (n, 3) as a sensor feels it that is laid down here and there."""
    drawn = np.random.default_rng(7).normal(size=(count, 3))
    return GRAVITY * drawn / np.linalg.norm(drawn, axis=1)[:, None]


def record(folder: Path, truth: np.ndarray, temperature: np.ndarray | None = None) -> Path:
    """What a sensor with that matrix and bias gives, a row a tenth of a second; the gyroscope turns as it is told."""
    off = np.zeros(len(truth)) if temperature is None else temperature - AT
    matrices, biases = MATRIX + off[:, None, None] * SLOPE, BIAS + off[:, None] * BIAS_SLOPE
    force = np.einsum("nij,nj->ni", matrices, truth) + biases
    rate = np.zeros_like(truth) @ MATRIX.T + BIAS
    warm = [] if temperature is None else [temperature[:, None]]
    rows = np.hstack([0.1 * np.arange(len(truth))[:, None], force, rate, *warm])
    names = "time_s,ax_mps2,ay_mps2,az_mps2,gx_rads,gy_rads,gz_rads" + (",temperature_c" if warm else "")
    path = folder / "logger.csv"
    np.savetxt(path, rows, fmt="%.12g", delimiter=",", header=names, comments="")
    return path


def applied(*words: object) -> dict:
    done = CliRunner().invoke(calibrate, ["apply", *map(str, words), "--json"])
    assert done.exit_code == 0, done.output
    return json.loads(done.output)


def test_the_truth_comes_back_and_is_a_record_again(tmp_path: Path) -> None:
    truth, out = directions(), tmp_path / "calibrated.csv"
    path = record(tmp_path, truth)
    blocks = [word for one in ("accelerometer", "gyroscope") for word in ("--calibration", block(tmp_path, one))]
    found = applied(path, *blocks, "--out", out, "--plot", tmp_path / "both.svg")
    after = read_imu_record(out, READING)
    assert after.triad("accelerometer") == pytest.approx(truth, abs=1e-7)
    assert after.triad("gyroscope") == pytest.approx(np.zeros_like(truth), abs=1e-9)
    assert after.times() == pytest.approx(0.1 * np.arange(len(truth)))
    assert (tmp_path / "both.svg").read_text().rstrip().endswith("</svg>")
    rows = {(row["sensor"], row["when"]): row for row in found["sensors"]}
    readings = truth @ MATRIX.T + BIAS
    by_hand = math.sqrt(np.mean([(math.hypot(*row) - GRAVITY) ** 2 for row in readings]))
    assert rows["accelerometer", "before"]["off"] == pytest.approx(by_hand, rel=1e-6)
    assert rows["accelerometer", "after"]["off"] == pytest.approx(0.0, abs=1e-7)
    assert rows["gyroscope", "before"]["mean"] == pytest.approx(BIAS.tolist())
    assert rows["gyroscope", "before"]["off"] == pytest.approx(math.hypot(*BIAS))
    assert rows["accelerometer", "before"]["std"] == pytest.approx(readings.std(axis=0).tolist())
    assert found["readings"] == len(truth)


def test_a_calibration_follows_the_temperature_of_each_row(tmp_path: Path) -> None:
    truth, out = directions(), tmp_path / "calibrated.csv"
    path = record(tmp_path, truth, np.linspace(5.0, 65.0, len(truth)))
    warm, cold = (block(tmp_path, "accelerometer", warm=warm) for warm in (True, False))
    applied(path, "--calibration", warm, "--out", out)
    after = np.loadtxt(out, delimiter=",", skiprows=1)[:, 1:4]
    assert after == pytest.approx(truth, abs=1e-7)
    (_, row) = applied(path, "--calibration", cold)["sensors"]
    assert row["off"] > 0.01


@pytest.mark.parametrize(
    ("sensors", "warm", "more", "said"),
    [
        (["accelerometer"], True, [], "logger.csv: expected a column of temperatures"),
        (["accelerometer", "accelerometer"], False, [], "--calibration: expected one a sensor, got two of the same"),
        (["magnetometer"], False, [], "logger.csv: expected readings of the magnetometer"),
        (["accelerometer"], False, ["--out", "logger.csv"], "expected different files for the record"),
        (["accelerometer"], False, ["--out", "after.npy"], "--out"),
    ],
)
def test_what_cannot_be_applied_is_refused_in_a_line(
    tmp_path: Path, sensors: list[str], warm: bool, more: list[str], said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = record(tmp_path, directions(5))
    monkeypatch.chdir(tmp_path)
    blocks = []
    for number, sensor in enumerate(sensors):
        (tmp_path / str(number)).mkdir()
        blocks += ["--calibration", str(block(tmp_path / str(number), sensor, warm=warm))]
    done = CliRunner().invoke(calibrate, ["apply", path.name, *blocks, *more])
    assert done.exit_code == 2
    assert said in done.output
    assert not (tmp_path / "after.npy").exists()
