"""Straight holes whose instrument errs in its azimuth by one number."""

import math

import numpy as np

from groundstation.survey.tools.instruments import PropagationMode, SurveyTool, Term
from groundstation.survey.well.clearance import ClearanceHole
from groundstation.survey.well.error_sources import Leg, WellSurvey

DEG = math.pi / 180.0


def straight_hole(
    north: float, length: float = 100.0, azimuth: float = 0.0, serial: str = "", steep: float = 0.0
) -> ClearanceHole:
    """Hole that leans by ``steep``, with an azimuth error of 1 deg that one instrument makes."""
    tool = SurveyTool("t", "t", (Term("A", 1.0, "deg", PropagationMode.SYSTEMATIC, ("0", "0", "1")),))
    md = np.linspace(0.0, length, 11)
    i, a = np.full(11, steep), np.full(11, azimuth)
    step = np.array([math.sin(steep) * math.cos(azimuth), math.sin(steep) * math.sin(azimuth), math.cos(steep)])
    places = np.array([north, 0.0, 0.0]) + md[:, None] * step
    return ClearanceHole(WellSurvey(md, i, a, places[:, 2]), places, (Leg(tool),), 0.5, serial)
