"""Legs of a trajectory: how far each goes, and which of them no arc of minimum curvature goes along.

Frame: north, east, down; m and rad.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.fusion.resolve import direction_angles
from groundstation.survey.well.arcs import arc_displacements, bend_angles
from groundstation.survey.well.methods import OPPOSITE, Method, leg_displacement

Array = npt.NDArray[np.float64]
BACKWARDS = -0.99  # cosine of a bend, short of which none is nearly opposite


def leg_displacements(method: Method, mds: Array, tangents: Array) -> Array:
    """Displacements (n, 3) from station to station, of depths (n + 1,) and tangents (n + 1, 3)."""
    upper, lower, lengths = tangents[:-1], tangents[1:], mds[1:] - mds[:-1]
    if method is Method.MINIMUM_CURVATURE:
        return arc_displacements(lengths, upper, lower)
    if method is Method.BALANCED_TANGENTIAL:
        return np.asarray((0.5 * lengths)[:, None] * (upper + lower))
    angles = [direction_angles(tangent[:2], float(tangent[2])) for tangent in tangents]
    return np.array(
        [
            leg_displacement(math, method, length, *before, *after)
            for length, (before, after) in zip(lengths.tolist(), itertools.pairwise(angles), strict=True)
        ]
    )


def check_bends(method: Method, mds: Sequence[float], tangents: Array) -> None:
    """Refuse legs of which minimum curvature has no arc.

    Raises
    ------
    SurveyError
        With the depths of the first leg that turns back on itself.
    """
    upper, lower = tangents[:-1], tangents[1:]
    if method is not Method.MINIMUM_CURVATURE or np.vecdot(upper, lower).min(initial=1.0) > BACKWARDS:
        return
    for leg in np.flatnonzero(bend_angles(upper, lower) > math.pi - OPPOSITE).tolist():
        above, below = mds[leg], mds[leg + 1]
        raise SurveyError(f"trajectory: the hole turns back on itself between {above:g} and {below:g} m")
