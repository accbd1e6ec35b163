"""Every kind of calibration read back whole: object, file, sheet and figures, from records whose sensors are known.

Turn tables and ovens have a closed form, which is calculated here; the coefficients that the MWD tool, the Allan record
and the rests were made of come back in `test_calibration_commands.py` and `test_rests.py`.
"""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from read_back import check, drawing, leaves, write_anew

from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import (
    AllanRequest,
    AttitudesRequest,
    CalibrationRequest,
    MagnetometerRequest,
    MwdRequest,
    QualityRequest,
    RecordWords,
    RestsRequest,
    TemperatureRequest,
    TurntableRequest,
)

INSTRUMENTS = Path(__file__).parents[3] / "scenarios" / "instruments"
DATA = Path(__file__).parents[2] / "data"
DAY = "2026-01-31"
REAL_WORDS = RecordWords(gyro=f"{2000 / 32768} deg/s", accel=f"{9.81 / 2048} m/s2")


def oven(folder: Path) -> Path:
    """Rates of a gyroscope both ways about each axis at five temperatures, with 0.01 deg/s of noise."""
    random, rows = np.random.default_rng(5), []
    matrix = np.array([[1.005, 0.003, -0.002], [-0.004, 0.993, 0.001], [0.002, -0.003, 1.002]])
    for warmth in (-10.0, 10.0, 30.0, 50.0, 71.0):
        for truth in 200.0 * np.vstack([np.eye(3), -np.eye(3)]):
            d = warmth - 30.0
            bias = np.array([0.4 + 5e-3 * d + 2e-5 * d * d, -0.2 - 8e-3 * d, 0.1 + 2e-3 * d - 4e-5 * d * d])
            read = (matrix + d * np.diag([2e-4, -1e-4, 3e-4])) @ truth + bias + 0.01 * random.standard_normal(3)
            rows.append(",".join(f"{value:.10g}" for value in (warmth, *truth, *read)))
    path = folder / "oven.csv"
    path.write_text("temperature_c,true_x,true_y,true_z,x,y,z\n" + "\n".join(rows) + "\n")
    return path


def static(folder: Path) -> Path:
    """White noise and a bias that walks, of another size on each axis, 100 a second."""
    random = np.random.default_rng(6)
    white = random.standard_normal((30_000, 3)) * [0.05, 0.07, 0.11]
    walk = np.cumsum(random.standard_normal((30_000, 3)), axis=0) * [1e-4, 2e-4, 3e-4]
    np.save(folder / "static.npy", white + walk + [0.3, -0.2, 0.1])
    return folder / "static.npy"


def kept(folder: Path, name: str, request: CalibrationRequest) -> Path:
    """File of a calibration that another one is given."""
    (folder / name).write_text(answer_calibration(request, DAY).document)
    return folder / name


def tool_of(folder: Path) -> tuple[Path, Path]:
    """Both triads of the MWD tool with twelve parameters."""
    room = INSTRUMENTS / "mwd-room.csv"
    accelerometers = kept(folder, "accelerometers.json", MwdRequest(room, "12"))
    request = MagnetometerRequest(room, "12", accelerometers, 49.0, 67.0, force=True)
    return accelerometers, kept(folder, "magnetometers.json", request)


def requests(folder: Path, kind: str) -> CalibrationRequest:
    turns, tilts, room = (INSTRUMENTS / f"{name}.csv" for name in ("turntable", "attitudes", "mwd-room"))
    made: dict[str, Any] = {
        "turntable": lambda: TurntableRequest(turns, 720.0, temperature_c=21.5),
        "turntable-jig": lambda: TurntableRequest(turns, 720.0, jig_deg=(0.02, 0.03), force=True),
        "attitudes": lambda: AttitudesRequest(tilts, temperature_c=23.0),
        "attitudes-jig": lambda: AttitudesRequest(tilts, jig_deg=(0.003, 0.002)),
        "attitudes-jig-coarse": lambda: AttitudesRequest(tilts, jig_deg=(0.05, 0.02)),
        "attitudes-warns": lambda: AttitudesRequest(DATA / "calibration" / "calibration_vn100_accel.csv"),
        "mwd": lambda: MwdRequest(room, "12"),
        "mwd-tool-face": lambda: MwdRequest(room, "12", tool_face=True, jig_deg=(0.03, 0.02)),
        "magnetometer": lambda: MagnetometerRequest(room, "12", tool_of(folder)[0], 49.0, 67.0, force=True),
        "quality": lambda: QualityRequest(INSTRUMENTS / "mwd-control.csv", *tool_of(folder)),
        "quality-nominal": lambda: QualityRequest(INSTRUMENTS / "mwd-control.csv"),
        "oven": lambda: TemperatureRequest(oven(folder)),
        "oven-steeper": lambda: TemperatureRequest(oven(folder), bias_degree=3, matrix_degree=2),
        "allan": lambda: AllanRequest(static(folder), 100.0, "deg/s"),
        "rests": lambda: RestsRequest(DATA / "records" / "mpu9150-imu0-100hz.npy", 9.81, words=REAL_WORDS),
    }
    found: CalibrationRequest = made[kind]()
    return found


KINDS = (
    "turntable", "turntable-jig", "attitudes", "attitudes-jig", "attitudes-jig-coarse", "attitudes-warns", "mwd",
    "mwd-tool-face", "magnetometer", "quality", "quality-nominal", "oven", "oven-steeper", "allan", "rests",
)  # fmt: skip


def told(outcome: CalibrationOutcome) -> Iterator[str]:
    """Object, file, sheet and every stroke of the figures."""
    yield from leaves(outcome.result)
    for name, text in (("file", outcome.document), ("gyroscope", outcome.gyroscope_document)):
        if text is not None and outcome.block_sha256 is not None:
            yield from leaves(json.loads(text), name)
    sheet = outcome.sheet
    yield f"sheet: {sheet.title}"
    yield from (f"fact: {name}: {value}" for name, value in sheet.facts)
    for table in sheet.tables:
        yield f"table: {table.title}: {' | '.join(table.columns)}"
        yield from (f"row: {' | '.join(row)}" for row in table.rows)
    yield from (f"warning: {words}" for words in sheet.warnings)
    for panel in outcome.panels():
        figure = Figure()
        FigureCanvasAgg(figure)
        panel.draw(figure)
        yield f"panel: {panel.caption}, {panel.height:g}"
        yield from drawing(figure)


def calibrated(folder: Path, kind: str) -> CalibrationOutcome:
    return answer_calibration(requests(folder, kind), DAY)


@pytest.mark.parametrize("kind", KINDS)
def test_a_calibration_is_told_as_approved(tmp_path: Path, kind: str) -> None:
    outcome = calibrated(tmp_path, kind)
    check(f"calibration-{kind}", told(outcome))
    assert outcome.record_sha256 == hashlib.sha256(requests(tmp_path, kind).file.read_bytes()).hexdigest()


def test_a_turn_table_in_its_closed_form(tmp_path: Path) -> None:
    """A column of the matrix is half the difference of both ways over the rate, the bias the mean of all six."""
    rows = [line.split(",")[1:] for line in (INSTRUMENTS / "turntable.csv").read_text().splitlines()[2:]]
    read = np.array(rows, float)  # turned axis, then x+ x- y+ y- z+ z-
    found = calibrated(tmp_path, "turntable").result
    np.testing.assert_allclose(found["matrix"], ((read[:, 0::2] - read[:, 1::2]) / 1440.0).T, rtol=1e-9)
    np.testing.assert_allclose(found["bias"], 0.5 * (read[:, 0::2] + read[:, 1::2]).mean(axis=0), rtol=1e-9)
    residuals = np.array([one["residual"] for one in found["attitudes"]])
    assert found["residual_rms"] == pytest.approx(math.sqrt(float(np.mean(residuals**2))), rel=1e-9)


def test_an_oven_in_an_independent_solution(tmp_path: Path) -> None:
    """Each axis is a linear system of its own: rates and rates times T - 30, and powers of T - 30."""
    rows = np.loadtxt(oven(tmp_path), delimiter=",", skiprows=1)
    middle = calibrated(tmp_path, "oven").result["reference_c"]
    d = rows[:, :1] - middle
    design = np.hstack([rows[:, 1:4], d * rows[:, 1:4], np.ones_like(d), d, d * d])
    solved = np.linalg.lstsq(design, rows[:, 4:], rcond=None)[0].T
    block = json.loads(calibrated(tmp_path, "oven").document)["calibration"]
    np.testing.assert_allclose(block["matrix"], solved[:, :3], rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(np.degrees(block["bias"]), solved[:, 6], rtol=1e-9)
    np.testing.assert_allclose(np.degrees(block["bias_slopes"]), solved[:, 7:].T, rtol=1e-8)


if __name__ == "__main__":
    write_anew({f"calibration-{kind}": lambda folder, kind=kind: told(calibrated(folder, kind)) for kind in KINDS})
