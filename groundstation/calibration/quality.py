"""Quality control of a calibrated MWD tool: twelve tool faces at one attitude must agree.

|max - min| of inclination < 0.1 deg, of azimuth < 1 deg, of G_L < 0.003 g, usually at 45 deg of inclination.
Source: drilling-tool paper, quality control.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.calibration.mwd_model import Readings, tool_face
from telemetry.errors import CalibrationError

Array = npt.NDArray[np.float64]
TOOL_FACES = 12
INCLINATION_LIMIT = math.radians(0.1)
AZIMUTH_LIMIT = math.radians(1.0)
SIZE_LIMIT = 0.003  # g
WIDEST_GAP = math.radians(
    60.0
)  # between neighbouring tool faces: twelve that go round once, with room for a rough hand
ONE_ATTITUDE = math.radians(15.0)  # a raw tool spreads a few degrees; beyond this the jig was moved
STEEPEST = math.radians(1.0)  # inclination from which an azimuth means something


@dataclass(frozen=True, slots=True)
class QualityVerdict:
    """Verdict on one quantity: its spread over the tool faces and the limit."""

    name: str
    unit: str
    spread: float
    limit: float

    @property
    def passed(self) -> bool:
        """Whether the spread is below the limit."""
        return self.spread < self.limit


@dataclass(frozen=True, slots=True)
class QualityReport:
    """Readings in the order of their tool faces, (12,) each in rad and g, and the three verdicts."""

    tool_face: Array
    inclination: Array
    azimuth: Array
    gravity_size: Array
    verdicts: tuple[QualityVerdict, QualityVerdict, QualityVerdict]

    @property
    def passed(self) -> bool:
        """Whether all three passed."""
        return all(verdict.passed for verdict in self.verdicts)

    def lines(self) -> list[str]:
        """Report for people, angles in deg: one line a tool face, one a verdict."""
        columns = np.column_stack(
            [*(np.degrees(c) for c in (self.tool_face, self.inclination, self.azimuth)), self.gravity_size]
        )
        rows = [f"{face:9.2f} {inc:11.4f} {azi:9.3f} {size:9.5f}" for face, inc, azi, size in columns]
        ends = [
            f"{v.name}: {v.spread:.4g} {v.unit}, limit {v.limit:.4g} {v.unit}: {'pass' if v.passed else 'FAIL'}"
            for v in (_shown(verdict) for verdict in self.verdicts)
        ]
        return ["tool face inclination   azimuth       G_L", *rows, *ends, "PASS" if self.passed else "FAIL"]


def judge_readings(readings: Readings) -> QualityReport:
    """Verdict on twelve readings at one attitude.

    Raises
    ------
    CalibrationError
        When the readings are not twelve tool faces around one attitude with an azimuth.
    """
    face = tool_face(readings.gravity) % (2.0 * np.pi)
    _check(readings, face)
    order = np.argsort(face)
    size, inclination, azimuth = readings.gravity_size[order], readings.tilt[order], readings.azimuth[order]
    mean = float(np.angle(np.sum(np.exp(1j * azimuth))))
    about = np.angle(np.exp(1j * (azimuth - mean)))  # so that 359.9 deg and 0.1 deg are neighbours
    verdicts = (
        QualityVerdict("inclination", "rad", float(np.ptp(inclination)), INCLINATION_LIMIT),
        QualityVerdict("azimuth", "rad", float(np.ptp(about)), AZIMUTH_LIMIT),
        QualityVerdict("G_L", "g", float(np.ptp(size)), SIZE_LIMIT),
    )
    return QualityReport(face[order], inclination, azimuth, size, verdicts)


def _check(readings: Readings, face: Array) -> None:
    if len(face) != TOOL_FACES:
        raise CalibrationError(f"quality control: expected {TOOL_FACES} readings, got {len(face)}")
    values = np.column_stack([readings.gravity, readings.field])
    bad = ~np.all(np.isfinite(values), axis=1)
    if np.any(bad):
        raise CalibrationError(f"quality control: reading {int(np.argmax(bad)) + 1} is not finite")
    gap = float(np.max(np.diff(np.sort(face), append=np.min(face) + 2.0 * np.pi)))
    if gap > WIDEST_GAP:
        raise CalibrationError(f"quality control: no tool face within {math.degrees(gap):.0f} deg, expected all around")
    spread = float(np.ptp(readings.tilt))
    if spread > ONE_ATTITUDE:
        raise CalibrationError(f"quality control: inclinations spread {math.degrees(spread):.1f} deg, not one attitude")
    upright = float(np.min(np.sin(readings.tilt)))
    if upright < math.sin(STEEPEST):
        raise CalibrationError(
            "quality control: within 1 deg of the vertical there is no azimuth, expected about 45 deg"
        )


def _shown(verdict: QualityVerdict) -> QualityVerdict:
    """The verdict in degrees where it is an angle."""
    if verdict.unit != "rad":
        return verdict
    return QualityVerdict(verdict.name, "deg", math.degrees(verdict.spread), math.degrees(verdict.limit))
