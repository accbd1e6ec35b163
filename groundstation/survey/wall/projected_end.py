"""Where a column will end, foreseen from its last station: a mixture, its cone, and the chance that it ends within.

The hole goes on as the process of its own curvature (`groundstation.survey.path`), not straight: what its directions
say of how it bends is the mean, what they do not say is the spread. Nothing is steered meanwhile.
Frame: the two axes of the design across its axis (north and east for a vertical one); m.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Direction
from groundstation.survey.fusion.tangents import tangent_jacobian
from groundstation.survey.path.curvature_tendency import CurvatureTendency
from groundstation.survey.path.normal_mixture import CONFIDENCE, NOWHERE, NormalMixture
from groundstation.survey.path.path_ahead import PathAhead
from groundstation.survey.wall.column_deviation import ColumnDesign, Deviation, point_deviation
from groundstation.survey.well.trajectory_rows import TrajectoryPoint

Array = npt.NDArray[np.float64]
STEEPEST = 0.05  # cosine between hole and axis, below which the hole does not come to the target's depth
CONE_POINTS = 8  # below the last station
REACHED = 0.1  # m, of the way to the end, within which a hole is at its depth


@dataclass(frozen=True, slots=True)
class ConePoint:
    """Where the hole is foreseen at one depth: the mean, and what is about it in 95 of 100 holes."""

    mean: Deviation
    half_width: float  # m, of the deviation
    radius: float  # m, of the circle about the mean


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class ProjectedEnd:
    """The end of a hole as it is foreseen.

    ``ends`` holds mean and covariance of all that is foreseen there, ``measured`` the part of that covariance which
    is of the surveys. ``is_reached`` is whether the last station is there already, ``comes_there`` whether the hole
    comes to the depth of its end at all.
    """

    ends: Deviation
    foreseen: NormalMixture
    measured: Array  # (2, 2) m^2
    is_reached: bool = False
    comes_there: bool = True
    way: WayAhead | None = None

    @property
    def limit(self) -> float:
        """Limit (m) at the end."""
        return self.ends.limit

    @property
    def surveyed_std(self) -> float:
        """Standard deviation (m) of the end that is of the surveys alone, in the worst direction."""
        return math.sqrt(max(float(np.linalg.eigvalsh(self.measured)[-1]), 0.0))

    @cached_property
    def centred(self) -> float:
        """Chance that it would end within, if what is expected of its way off the axis were taken away."""
        return self.foreseen.chance_within(self.limit, self.ends.offset) if self.comes_there else 0.0

    @cached_property
    def within(self) -> float:
        """Chance that it ends within its limit, if nothing is steered."""
        return self.chance_within(self.limit)

    @cached_property
    def half_width(self) -> float:
        """Half width (m) of the deviation's interval of 95 %."""
        return self.foreseen.half_width_of(CONFIDENCE)

    def chance_within(self, radius: float) -> float:
        """Chance that it ends within a distance (m) of the axis."""
        return self.foreseen.chance_within(radius) if self.comes_there else 0.0

    def distance_of(self, chance: float) -> float:
        """Distance (m) from the axis within which it ends by a chance; sought once, a verdict asks again and again."""
        if not self.comes_there:
            return math.inf
        if chance not in self._distances:
            self._distances[chance] = self.foreseen.radius_of(chance, NOWHERE)
        return self._distances[chance]

    @cached_property
    def _distances(self) -> dict[float, float]:
        """Distances (m) that were asked for, by their chance."""
        return {}

    @cached_property
    def cone(self) -> list[ConePoint]:
        """Points of the cone from the last station to the end; none where nothing is ahead."""
        if self.way is None:
            return []
        return [self.way.cone_point(k / CONE_POINTS) for k in range(1, CONE_POINTS + 1)]


@dataclass(frozen=True, slots=True)
class WayAhead:
    """From the last station straight on to the plane of the target, and what the path is about that line."""

    md: float  # m, of the station
    rest: float  # m, from there to the plane
    offset: Array  # (3,) m, of the station from the end of the design
    tangent: Array  # (3,)
    onto_plane: Array  # (2, 3): an error in space, as it is seen on planes across the design axis
    path: PathAhead
    design: ColumnDesign

    def foreseen(self, part: float) -> NormalMixture:
        """Mixture on the plane at a part of the way."""
        straight = self.design.end.across @ (self.offset + part * self.rest * self.tangent)
        return self.path.offsets(part * self.rest).through(self.onto_plane @ self.path.tendency.axes.T, straight)

    def deviation(self, part: float, mixture: NormalMixture) -> Deviation:
        """Mean and covariance of that mixture as a deviation."""
        along = self.design.length + (1.0 - part) * float(self.offset @ self.design.end.tangent)
        md = self.md + part * self.rest
        return Deviation(md, along, mixture.mean, mixture.cov, self.design.tolerance.at(along))

    def cone_point(self, part: float) -> ConePoint:
        """One point of the cone."""
        mixture = self.foreseen(part)
        return ConePoint(
            self.deviation(part, mixture),
            mixture.half_width_of(CONFIDENCE),
            mixture.radius_of(CONFIDENCE, mixture.mean),
        )


def project_to_target(
    point: TrajectoryPoint, direction: Direction, tendency: CurvatureTendency, design: ColumnDesign
) -> ProjectedEnd:
    """Where a hole ends that goes on from a point as it tends to.

    Parameters
    ----------
    point, direction : the last station; what of its direction others share turns the hole as a whole
    tendency : what the hole's directions say of its curvature, at that station
    design : axis, length and tolerance
    """
    end = design.end
    offset, axis = point.position - end.point, end.tangent
    along = float(point.tangent @ axis)
    rest = -float(offset @ axis) / along if along >= STEEPEST else -1.0
    if rest <= 0.0:
        here = point_deviation(point, design)
        now = NormalMixture(np.ones(1), here.offset[None], here.cov[None])
        return ProjectedEnd(here, now, here.cov, is_reached=along >= STEEPEST, comes_there=along >= STEEPEST)
    # an error along the axis changes how far there is to go: what counts is its trace on the target's plane
    onto_plane = end.across @ (np.eye(3) - np.outer(point.tangent, axis) / along)
    across = tendency.axes @ tangent_jacobian(point.tangent)
    shared = across @ (direction.total_cov - direction.cov) @ across.T
    path = PathAhead(tendency, tendency.axes @ point.cov @ tendency.axes.T, shared)
    way = WayAhead(point.md, rest, offset, point.tangent, onto_plane, path, design)
    foreseen = way.foreseen(1.0)
    turned = way.onto_plane @ tendency.axes.T
    measured = turned @ path.measured(rest) @ turned.T
    return ProjectedEnd(way.deviation(1.0, foreseen), foreseen, measured, is_reached=rest <= REACHED, way=way)
