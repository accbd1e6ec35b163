"""The direction at the collar as it was told beside what the first station says. No I/O."""

from __future__ import annotations

import math

import numpy as np

from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.survey.fusion.fusion import Weighting
from groundstation.survey.fusion.resolve import direction_angles

CONTRADICTS = 4.0  # sigmas


def collar_doubt(hole: SurveyedHole, curvature_std: float) -> str:
    """How the first station contradicts the collar, in words; empty where it does not, or there is none.

    Between the two the hole may bend by a curvature (rad/m).
    """
    station = next((one for one in hole.stations if one.md > 0.0), None)
    if station is None:
        return ""
    first, collar = station.fused(Weighting.BAYES), hole.collar  # an adjusted hole is adjusted to the collar too
    bend = (curvature_std * station.md) ** 2
    apart = first.lean - collar.lean
    cov = first.total_cov + collar.total_cov + bend * np.eye(2)
    sigmas = math.sqrt(float(apart @ np.linalg.solve(cov, apart)))
    if sigmas < CONTRADICTS:
        return ""
    inclination, azimuth = map(math.degrees, direction_angles(first.lean, first.down))
    return (
        f"the station at {station.md:.1f} m contradicts it by {sigmas:.0f} sigma: it leans {inclination:.2f} deg "
        f"to {azimuth:.0f} deg"
    )
