"""Gates: wrong calibrations of every kind are refused by name, honest ones land, and intervals hold what they state."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from groundstation.report.calibrations.calibration_answer import answer_calibration
from groundstation.report.calibrations.calibration_outcome import CalibrationOutcome
from groundstation.report.calibrations.calibration_request import AttitudesRequest, MwdRequest, TurntableRequest
from telemetry.errors import CalibrationError

G = 9.80665
POSITIONS = [
    (0, 0), (60, 0), (-60, 0), (0, 60), (0, -60), (90, 0), (-90, 0), (0, 90), (0, -90), (0, 180), (45, 120),
    (-45, -120), (30, 150), (-30, -150), (20, -45), (-20, 45),
]  # fmt: skip
MATRIX = np.array([[0.995, 0.004, -0.006], [-0.003, 1.008, 0.005], [0.007, -0.002, 0.991]])


def felt(pitch_deg: float, roll_deg: float) -> np.ndarray:
    """Truth in g, by two turns of a plumb line."""
    p, r = math.radians(pitch_deg), math.radians(roll_deg)
    return np.array([math.sin(p), math.cos(p) * math.sin(r), math.cos(p) * math.cos(r)])


def arm(seed: int = 0, noise: float = 0.002) -> tuple[np.ndarray, np.ndarray]:
    """Preset angles (n, 2) deg and readings (n, 3) m/s^2 of an accelerometer on an arm."""
    angles = np.array(POSITIONS, dtype=float)
    truth = np.array([felt(*row) for row in angles])
    random = np.random.default_rng(seed)
    return angles, G * truth @ MATRIX.T + np.array([0.05, -0.12, 0.2]) + noise * random.standard_normal(
        (len(angles), 3)
    )


def calibrated(folder: Path, angles: np.ndarray, readings: np.ndarray, *, force: bool = False) -> CalibrationOutcome:
    rows = [
        f"{k},{p:.10g},{r:.10g},{','.join(f'{v:.9g}' for v in row)}"
        for k, ((p, r), row) in enumerate(zip(angles, readings, strict=True), 1)
    ]
    path = folder / "arm.csv"
    path.write_text("\n".join(["position,pitch_deg,roll_deg,ax_mps2,ay_mps2,az_mps2", *rows]) + "\n")
    return answer_calibration(AttitudesRequest(path, force=force), "2026-01-31")


def hand_laid(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each position off by a degree or so from what the record says."""
    off = angles + np.random.default_rng(5).standard_normal(angles.shape)
    moved = np.array([felt(*row) for row in off]) - np.array([felt(*row) for row in angles])
    return angles, readings + G * moved @ MATRIX.T


def swapped(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    readings = readings.copy()
    readings[[1, 3]] = readings[[3, 1]]
    return angles, readings


def mirrored(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings * [1.0, -1.0, 1.0]


def exchanged(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings[:, [1, 0, 2]]


def bent(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings * (1.0 + 0.03 * (readings / G) ** 2)


def slightly_bent(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings + 0.001 * G * (readings / G) ** 3


def warmed(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings + np.linspace(0.0, 0.04, len(readings))[:, None]


def clipped(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, np.clip(readings, -9.2, 9.2)


def other_reference(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings / 1.8


def pasted(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return np.tile(angles, (3, 1)), np.tile(readings, (3, 1))


def one_weak(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return angles, readings * [1.0, 1.0, 0.72]


def one_moved(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    readings = readings.copy()
    readings[7] += [0.0, 0.3, 0.1]
    return angles, readings


def one_nudged(angles: np.ndarray, readings: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """By 0.07 deg: far below what residuals may be, and a dozen times the noise."""
    readings = readings.copy()
    readings[12] += [0.0, -0.012, 0.0]
    return angles, readings


@pytest.mark.parametrize(
    ("wrong", "gate"),
    [
        (hand_laid, "residual: .* was it this attitude"),
        (swapped, "residual: .* the largest is at [24]: "),
        (mirrored, "right-handed: "),
        (exchanged, "right-handed: "),
        (bent, "linear: axis . is bent by"),
        (slightly_bent, "linear: axis . is bent by 0.0[789]"),
        (warmed, "drift: "),
        (clipped, r"range: \d+ readings stand at \+-9.2"),
        (other_reference, "scale: the axes answer with 0.5"),
        (pasted, "duplicates: 32 readings stand twice, as 1 and 17"),
        (one_weak, "axes: the axes are not three alike"),
        (one_moved, "residual: .* the largest is at 8"),
        (one_nudged, r"attitude: 13 lies \d+(\.\d)? times as far off as the others scatter"),
    ],
)
def test_a_wrong_record_of_an_arm_is_refused_by_name_and_forced_with_its_finding(
    tmp_path: Path, wrong: object, gate: str
) -> None:
    angles, readings = arm(noise=0.001)
    assert callable(wrong)
    angles, readings = wrong(angles, readings)
    with pytest.raises(CalibrationError, match=rf"arm\.csv: refused by .*{gate}"):
        calibrated(tmp_path, angles, readings)
    forced = calibrated(tmp_path, angles, readings, force=True)
    name = gate.partition(":")[0]
    assert any(found.startswith(name) for found in forced.result["forced"])
    assert f"forced past {name}: " in forced.document or f"; forced past {name}: " in forced.result["design"]
    assert any(fact == "Forced past" and text.startswith(name) for fact, text in forced.sheet.facts)


def table(scale: float = 1.0, turn: np.ndarray | None = None) -> np.ndarray:
    """Turn table (3, 6) of a gyroscope at 500 deg/s: rows turned axes, a pair of columns each sensor axis."""
    random = np.random.default_rng(2)
    matrix = MATRIX if turn is None else turn @ MATRIX
    pairs = [[500.0 * sign * scale * matrix[:, r] for sign in (1.0, -1.0)] for r in range(3)]
    rows = np.array([[pairs[r][sign][s] for s in range(3) for sign in (0, 1)] for r in range(3)])
    return rows + np.tile([4.0, 4.0, -1.0, -1.0, 0.5, 0.5], (3, 1)) + 0.05 * random.standard_normal((3, 6))


def turned(folder: Path, rows: np.ndarray, *, force: bool = False) -> CalibrationOutcome:
    lines = [f"{axis},{','.join(f'{v:.9g}' for v in row)}" for axis, row in zip("xyz", rows, strict=True)]
    path = folder / "table.csv"
    path.write_text("\n".join(["axis,x_pos,x_neg,y_pos,y_neg,z_pos,z_neg", *lines]) + "\n")
    return answer_calibration(TurntableRequest(path, 500.0, force=force), "2026-01-31")


@pytest.mark.parametrize(
    ("rows", "gate"),
    [
        (table(1.0 / 1.8), "scale: "),
        (table(turn=np.diag([1.0, -1.0, 1.0])), "right-handed: "),
        (table(turn=np.eye(3)[[1, 0, 2]]), "right-handed: "),
        (np.clip(table(), -480.0, 480.0), "range: "),
        (table() + np.array([[0.0], [4.0], [9.0]]), "residual: "),
    ],
    ids=["reference", "mirrored", "exchanged", "clipped", "warmed"],
)
def test_a_wrong_turn_table_is_refused_by_name(tmp_path: Path, rows: np.ndarray, gate: str) -> None:
    with pytest.raises(CalibrationError, match=rf"table\.csv: refused by .*{gate}"):
        turned(tmp_path, rows)
    assert turned(tmp_path, rows, force=True).result["forced"]
    assert turned(tmp_path, table()).result["forced"] == []
    # a mount that is turned by a right angle is right-handed and lands
    assert turned(tmp_path, table(turn=np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]]))).result["forced"] == []


def test_an_mwd_tool_whose_faces_run_backwards_or_whose_wires_are_exchanged_is_refused(tmp_path: Path) -> None:
    bench = Path(__file__).parents[3] / "scenarios" / "instruments" / "mwd-room.csv"
    lines = bench.read_text().splitlines()
    head = next(k for k, line in enumerate(lines) if line.startswith("tilt_deg"))
    path = tmp_path / "tool.csv"

    def rewritten(change: object) -> MwdRequest:
        assert callable(change)
        rows = [line.split(",") for line in lines[head + 1 :]]
        path.write_text("\n".join([*lines[: head + 1], *(",".join(change(row)) for row in rows)]) + "\n")
        return MwdRequest(path, "12", tool_face=True)

    assert answer_calibration(rewritten(lambda row: row), "2026-01-31").result["forced"] == []
    backwards = rewritten(lambda row: [row[0], f"{(360.0 - float(row[1])) % 360.0:.3f}", *row[2:]])
    with pytest.raises(CalibrationError, match="tool face: turns against the jig's"):
        answer_calibration(backwards, "2026-01-31")
    wires = rewritten(lambda row: [*row[:3], row[4], row[3], *row[5:]])
    with pytest.raises(CalibrationError, match="tool face: turns against the jig's"):
        answer_calibration(wires, "2026-01-31")
    rewritten(lambda row: [*row[:3], row[4], row[3], *row[5:]])
    forced = answer_calibration(replace(wires, force=True), "2026-01-31")
    assert any(found.startswith("tool face: turns against") for found in forced.result["forced"])
    assert "forced past tool face: " in forced.result["design"]
    assert any(fact == "Forced past" and text.startswith("tool face") for fact, text in forced.sheet.facts)
    twice = rewritten(lambda row: row)
    path.write_text(path.read_text() + "\n".join(lines[head + 1 :]) + "\n")
    with pytest.raises(CalibrationError, match="duplicates: 84 readings stand twice"):
        answer_calibration(twice, "2026-01-31")


def test_honest_records_are_not_refused(tmp_path: Path) -> None:
    refused = 0
    for seed in range(150):
        try:
            calibrated(tmp_path, *arm(seed))
        except CalibrationError:
            refused += 1
    assert refused <= 4


@pytest.mark.parametrize(
    ("kind", "most"),
    [("white", 1.0), ("duplicates", 0.0), ("cubic", 0.05), ("small walk", 1.0), ("walk", 0.08)],
    ids=["white", "duplicates", "0.1 % cubic", "walk of half the noise", "walk of twice the noise"],
)
def test_intervals_hold_95_percent_or_the_record_is_refused(tmp_path: Path, kind: str, most: float) -> None:
    """Of every hundred parameters ninety-three are refused with their record or lie within their interval."""
    held, landed, runs = [], 0, 120
    for seed in range(runs):
        angles, readings = arm(seed, 0.001)
        random = np.random.default_rng(1000 + seed)
        if kind == "duplicates":
            angles, readings = pasted(angles, readings)
        if kind == "cubic":
            angles, readings = slightly_bent(angles, readings)
        if kind.endswith("walk"):
            step = 0.002 if kind == "walk" else 0.0005
            readings = readings + step * np.cumsum(random.standard_normal(readings.shape), axis=0)
        try:
            found = calibrated(tmp_path, angles, readings).result
        except CalibrationError:
            continue
        landed += 1
        off = np.abs(np.array(found["matrix"]) - G * MATRIX) / np.array(found["expanded_uncertainty"]["matrix"])
        bias = np.abs(np.array(found["bias"]) - [0.05, -0.12, 0.2]) / np.array(found["expanded_uncertainty"]["bias"])
        held.extend([*(off.ravel() < 1.0), *(bias < 1.0)])
    outside = 12 * landed - sum(held)
    assert landed <= most * runs, landed
    assert outside <= 0.07 * 12 * runs, (landed, outside)
    if kind == "white":
        assert landed >= runs - 3
        assert 0.93 < np.mean(held) < 0.97


def test_what_a_certificate_widens_it_says(tmp_path: Path) -> None:
    said = set()
    for seed in range(40):
        angles, readings = arm(seed, 0.001)
        random = np.random.default_rng(seed)
        walked = readings + 0.0005 * np.cumsum(random.standard_normal(readings.shape), axis=0)
        try:
            outcome = calibrated(tmp_path, angles, walked)
        except CalibrationError:
            continue
        factor = outcome.result["widened"]
        facts = [text for fact, text in outcome.sheet.facts if fact == "Intervals"]
        assert facts == ([f"up to {factor:g} times wider, for the order of the residuals"] if factor > 1.0 else [])
        said.add(factor > 2.0)
    assert said == {True, False}
