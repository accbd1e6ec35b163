"""Quality control: each limit, the order of the tool faces, azimuths across north, and what is no control."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.calibration.mwd_model import Readings, gravity_inclination, magnetic_azimuth
from groundstation.calibration.quality import TOOL_FACES, judge_readings
from sim.instruments.mwd_jig import true_vectors
from telemetry.errors import CalibrationError

FACES = 2.0 * math.pi * np.arange(TOOL_FACES) / TOOL_FACES
DEG = math.pi / 180.0


def readings(inclination: np.ndarray | float, azi: np.ndarray | float, faces: np.ndarray = FACES) -> Readings:
    same = np.ones(len(faces))
    gravity, field = true_vectors(inclination * same, faces, azi * same)
    sizes = np.linalg.norm(gravity, axis=1), np.linalg.norm(field, axis=1)
    return Readings(gravity, field, *sizes, gravity_inclination(gravity), magnetic_azimuth(gravity, field))


def one_off(angle: float) -> np.ndarray:
    return np.where(np.arange(TOOL_FACES) == 5, angle, 0.0)


@given(inclination=st.floats(10.0 * DEG, 120.0 * DEG), azi=st.floats(0.0, 2.0 * math.pi))
def test_a_perfect_tool_passes_at_any_attitude(inclination: float, azi: float) -> None:
    report = judge_readings(readings(inclination, azi))
    assert report.passed
    assert all(v.spread < 1e-10 for v in report.verdicts)


@pytest.mark.parametrize(("off_deg", "passed"), [(0.09, True), (0.11, False)])
def test_inclination_may_spread_a_tenth_of_a_degree(off_deg: float, passed: bool) -> None:
    report = judge_readings(readings(45.0 * DEG + one_off(off_deg * DEG), 1.0))
    assert report.verdicts[0].passed is passed
    assert report.passed is passed
    assert report.verdicts[0].spread == pytest.approx(off_deg * DEG)


@pytest.mark.parametrize(("off_deg", "passed"), [(0.9, True), (1.1, False)])
@pytest.mark.parametrize("azi", [0.0, 1.0, 2.0 * math.pi - 1e-3])
def test_azimuth_may_spread_one_degree_also_across_north(off_deg: float, passed: bool, azi: float) -> None:
    report = judge_readings(readings(45.0 * DEG, azi + one_off(off_deg * DEG)))
    assert report.verdicts[1].passed is passed
    assert report.verdicts[1].spread == pytest.approx(off_deg * DEG)


@pytest.mark.parametrize(("off", "passed"), [(0.0029, True), (0.0031, False)])
def test_size_may_spread_three_thousandths(off: float, passed: bool) -> None:
    r = readings(45.0 * DEG, 1.0)
    grown = 1.0 + one_off(off)
    seen = Readings(r.gravity * grown[:, None], r.field, r.gravity_size * grown, r.field_size, r.tilt, r.azimuth)
    assert judge_readings(seen).verdicts[2].passed is passed


def test_the_report_lists_the_tool_faces_in_order_with_the_verdicts() -> None:
    report = judge_readings(readings(45.0 * DEG + one_off(0.2 * DEG), 1.0, FACES[::-1]))
    assert np.all(np.diff(report.tool_face) > 0.0)
    lines = report.lines()
    assert len(lines) == 1 + TOOL_FACES + 3 + 1
    assert "inclination: 0.2 deg, limit 0.1 deg: FAIL" in lines
    assert lines[-1] == "FAIL"


def test_eleven_readings_are_refused() -> None:
    with pytest.raises(CalibrationError, match="expected 12"):
        judge_readings(readings(45.0 * DEG, 1.0, FACES[:11]))


def test_half_a_turn_is_refused() -> None:
    with pytest.raises(CalibrationError, match="all around"):
        judge_readings(readings(45.0 * DEG, 1.0, FACES / 2.0))


def test_a_moved_jig_is_refused() -> None:
    with pytest.raises(CalibrationError, match="not one attitude"):
        judge_readings(readings(45.0 * DEG + one_off(0.5), 1.0))


def test_the_vertical_is_refused() -> None:
    with pytest.raises(CalibrationError, match="no azimuth"):
        judge_readings(readings(0.5 * DEG, 1.0))


def test_nan_is_named() -> None:
    r = readings(45.0 * DEG, 1.0)
    r.gravity[3, 1] = math.nan
    with pytest.raises(CalibrationError, match="reading 4"):
        judge_readings(r)
