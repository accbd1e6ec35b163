"""A stretch of the hole that takes another direction at a time: the hole after it, and when."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole
from sim.world.path_section import MovedSection

Array = npt.NDArray[np.float64]
STEP = 0.05  # m, at which the hole is followed where it moved


class MovedHole(NamedTuple):
    """The hole from a rig time (s) on."""

    at: float
    hole: Borehole


def move_hole(hole: Borehole, section: MovedSection, begin: float) -> MovedHole:
    """The hole after a stretch of it has leaned over; ``begin`` (s) is the rig time at the start.

    What lies below keeps its direction and shifts aside.

    Raises
    ------
    ScenarioError
        When the path turns back for it.
    """
    reach = np.array([section.from_m - section.ramp_m, section.to_m + section.ramp_m])
    low, high = np.clip(reach, 0.0, hole.length).tolist()
    dense = np.linspace(low, high, max(math.ceil((high - low) / STEP), 1) + 1)
    md = np.unique(np.concatenate([hole.md, dense]))
    tangent = hole.tangent(md)[0]
    turned = np.radians([section.north_deg, section.east_deg, 0.0])
    tangent = tangent + moved_share(section, md)[:, None] * turned
    lean = np.hypot(tangent[:, 0], tangent[:, 1])
    inclination, azimuth = np.arctan2(lean, tangent[:, 2]), np.arctan2(tangent[:, 1], tangent[:, 0])
    return MovedHole(begin + section.after_s, Borehole(md, inclination, azimuth, "path.moved"))


def moved_share(section: MovedSection, md: Array) -> Array:
    """How much of the change a depth (n,) takes part in: 1 inside, a smooth step to 0 above and below."""
    outside = np.maximum(np.maximum(section.from_m - md, md - section.to_m), 0.0)
    share = np.clip(1.0 - outside / section.ramp_m, 0.0, 1.0)
    return np.asarray(share * share * (3.0 - 2.0 * share))
