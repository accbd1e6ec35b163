"""Is the column where it should be? Deviation from the design axis, tolerance. Where it will end: `projected_end`.

A design axis is a straight line from its head, or a plan of arcs and lines. The deviation of a point is its offset from
the nearest point of the axis, in the plane across it there.
For near-vertical columns inclination matters far more than azimuth; ``Dominant`` says which of the two does here.
Source: EN 12716 for the preset of that name; thesis chapter 1 for 0.27 deg. Frame: north, east, down; m and rad.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from operator import attrgetter
from typing import Self

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.bearings import planes_across
from groundstation.survey.fusion.resolve import Direction, direction_angles
from groundstation.survey.fusion.sphere_direction import stds_of_directions
from groundstation.survey.well.trajectory_rows import TrajectoryPoint
from groundstation.survey.well.well_plan import WellPlan

Array = npt.NDArray[np.float64]
NORMAL_95 = 1.959963984540054  # standard deviations, either side
ROUNDED = 1e-12  # of a ratio
LEVELS = (0.5, 0.8, 1.0)  # of the tolerance, at which an alarm is due


@dataclass(frozen=True, slots=True)
class Tolerance:
    """Allowed deviation: ``start`` (m) at the head and ``growth`` (m/m) along the axis."""

    name: str
    start: float
    growth: float

    def at(self, along: float) -> float:
        """Limit (m) at a length along the axis."""
        return self.start + self.growth * along


PRESETS = {
    "en-12716": Tolerance("en-12716", 0.05, 0.02),
    "5-cm": Tolerance("5-cm", 0.05, 0.0),
    "0.27-deg": Tolerance("0.27-deg", 0.0, math.tan(math.radians(0.27))),
}


NUMBER = r"(\d+(?:\.\d+)?)"
METRES = {"mm": 1e-3, "cm": 1e-2, "m": 1.0}
# parts of a tolerance: what it adds at the head (m) and a metre of length (m/m)
PARTS: list[tuple[str, Callable[[tuple[str, ...]], tuple[float, float]]]] = [
    (rf"{NUMBER} ?(mm|cm|m) at {NUMBER} ?m", lambda g: (0.0, float(g[0]) * METRES[g[1]] / float(g[2]))),
    (rf"{NUMBER} ?(mm|cm|m)", lambda g: (float(g[0]) * METRES[g[1]], 0.0)),
    (rf"1 ?: ?{NUMBER}", lambda g: (0.0, 1.0 / float(g[0]))),
    (rf"{NUMBER} ?%", lambda g: (0.0, float(g[0]) / 100.0)),
    (rf"{NUMBER} ?deg", lambda g: (0.0, math.tan(math.radians(float(g[0]))))),
]


def parse_tolerance(name: str) -> Tolerance:
    """Preset by its name, or a sum of parts: ``50 mm + 1:200``, ``75 mm at 20 m``, ``1.5 %``, ``0.3 deg``.

    Raises
    ------
    SurveyError
        Names the presets and the forms.
    """
    if name in PRESETS:
        return PRESETS[name]
    start = growth = 0.0
    for part in name.split("+"):
        for pattern, values in PARTS:
            match = re.fullmatch(pattern, part.strip())
            if match is not None and all(float(text) > 0.0 for text in match.groups() if text not in METRES):
                more = values(match.groups())
                start, growth = start + more[0], growth + more[1]
                break
        else:
            raise SurveyError(
                "tolerance, by its name or as a sum like '50 mm + 1:200', '75 mm at 20 m', '1.5 %' or '0.3 deg': "
                f"expected one of {', '.join(PRESETS)}, got {name!r}"
            )
    return Tolerance(name, start, growth)


@dataclass(frozen=True, slots=True)
class DesignEnd:
    """Where a design ends: the plane across it there is what a hole is projected to."""

    point: Array  # (3,) m, in the frame of the trajectory
    tangent: Array  # (3,) unit vector on from there
    across: Array  # (2, 3) unit vectors in the plane; north and east for a vertical end
    limit: float  # m


@dataclass(frozen=True)  # with a dictionary, for what is worked out once
class ColumnDesign:
    """Axis of a column and what it is to become."""

    name: str = "column"
    head: tuple[float, float, float] = (0.0, 0.0, 0.0)  # m, in the frame of the trajectory
    inclination: float = 0.0
    azimuth: float = 0.0
    length: float = 30.0  # m along the axis
    radius: float = 0.6  # m, of the finished column
    tolerance: Tolerance = PRESETS["en-12716"]
    plan: WellPlan | None = None  # from the head, in place of the straight line; see ``of_plan``

    @classmethod
    def of_plan(
        cls, name: str, plan: WellPlan, head: tuple[float, float, float], radius: float, tolerance: Tolerance
    ) -> Self:
        """Design of a plan: it begins in the plan's first direction and is as long as the plan."""
        first = plan.tangents[0]
        return cls(name, head, *direction_angles(first[:2], float(first[2])), plan.length, radius, tolerance, plan)

    @cached_property
    def axis(self) -> Array:
        """Unit vector (3,) down the axis, of a plan at its head."""
        s = math.sin(self.inclination)
        return np.array([s * math.cos(self.azimuth), s * math.sin(self.azimuth), math.cos(self.inclination)])

    @cached_property
    def across(self) -> Array:
        """Two unit vectors (2, 3) across the axis; for a vertical one they are north and east."""
        c = math.cos(self.inclination)
        a = np.array([c * math.cos(self.azimuth), c * math.sin(self.azimuth), -math.sin(self.inclination)])
        b = np.array([-math.sin(self.azimuth), math.cos(self.azimuth), 0.0])
        turn = np.array(
            [[math.cos(self.azimuth), -math.sin(self.azimuth)], [math.sin(self.azimuth), math.cos(self.azimuth)]]
        )
        return np.asarray(turn @ np.stack([a, b]))

    def points_at(self, along: Array) -> Array:
        """Points (n, 3) at lengths (n,) along the axis, m."""
        head = np.array(self.head)
        return head + (along[:, None] * self.axis if self.plan is None else self.plan.points_at(along).points)

    def across_at(self, along: Array) -> Array:
        """Two unit vectors (n, 2, 3) across the axis at lengths (n,) along it, m: as in ``Deviations.offset``."""
        if self.plan is None:
            return np.broadcast_to(self.across, (len(along), 2, 3))
        return planes_across(self.plan.points_at(along).tangents)

    @cached_property
    def chord(self) -> Array:
        """Unit vector (3,) from head to toe."""
        if self.plan is None:
            return self.axis
        way = self.plan.positions[-1]
        return np.asarray(way / np.linalg.norm(way))

    @cached_property
    def end(self) -> DesignEnd:
        """Target of the column."""
        limit = self.tolerance.at(self.length)
        if self.plan is None:
            return DesignEnd(np.array(self.head) + self.length * self.axis, self.axis, self.across, limit)
        tangent = self.plan.tangents[-1]
        return DesignEnd(np.array(self.head) + self.plan.positions[-1], tangent, planes_across(tangent), limit)


@dataclass(frozen=True, slots=True)
class Deviation:
    """Deviation of a column from its design at one point."""

    md: float
    along: float  # m along the design axis
    offset: Array  # (2,) m across the axis; north and east for a vertical one
    cov: Array  # (2, 2) m^2
    limit: float  # m

    @property
    def size(self) -> float:
        """Distance (m) from the axis."""
        return math.hypot(self.offset[0], self.offset[1])

    @property
    def std(self) -> float:
        """Standard deviation (m) of the distance, along the offset (of the worst direction without one)."""
        size = self.size
        if size < 1e-9:
            return math.sqrt(max(float(np.linalg.eigvalsh(self.cov)[-1]), 0.0))
        unit = self.offset / size
        return math.sqrt(max(float(unit @ self.cov @ unit), 0.0))

    @property
    def half_width(self) -> float:
        """Half width (m) of the interval that holds the distance with 95 %."""
        return NORMAL_95 * self.std

    @property
    def ratio(self) -> float:
        """Share of the tolerance that is used up."""
        return used_share(self.size, self.limit)

    @property
    def level(self) -> float:
        """Highest alarm level reached, 0 for none."""
        ratio = self.ratio
        return max((level for level in LEVELS if ratio >= level), default=0.0)


def used_share(size: float, limit: float) -> float:
    """Share of a tolerance of ``limit`` (m) that a deviation of ``size`` (m) uses up."""
    return size / limit if limit > 0.0 else (math.inf if size > 0.0 else 0.0)


@dataclass(frozen=True, slots=True)
class Deviations:
    """Deviations of points along a hole as columns of numbers; an index makes an object of one row."""

    md: Array  # (n,)
    along: Array  # (n,)
    offset: Array  # (n, 2)
    cov: Array  # (n, 2, 2)
    limit: Array  # (n,)

    def __len__(self) -> int:
        return len(self.md)

    def __getitem__(self, place: int) -> Deviation:
        md, along, limit = self.md.item(place), self.along.item(place), self.limit.item(place)
        return Deviation(md, along, self.offset[place], self.cov[place], limit)

    def __iter__(self) -> Iterator[Deviation]:
        rows = zip(self.md.tolist(), self.along.tolist(), self.offset, self.cov, self.limit.tolist(), strict=True)
        return (Deviation(*row) for row in rows)

    def worst(self, first: int = 0) -> Deviation | None:
        """Deviation with the largest share of its tolerance from index ``first`` on, first of equals; None if empty."""
        limit = self.limit[first:]
        size = np.hypot(self.offset[first:, 0], self.offset[first:, 1])
        infinite = np.where(size > 0.0, np.inf, 0.0)
        ratio = np.where(limit > 0.0, size / np.where(limit > 0.0, limit, 1.0), infinite)
        # of the few that come near it each says itself how large it is: two ways of rounding must not part them
        near = np.flatnonzero(ratio >= (1.0 - ROUNDED) * ratio.max(initial=0.0)).tolist()
        if len(near) <= 1:
            return self[first + near[0]] if near else None
        return max([self[first + place] for place in near], key=attrgetter("ratio"))


def axis_deviations(md: Array, positions: Array, covs: Array, design: ColumnDesign) -> Deviations:
    """Deviation of points at depths (n,), m, with positions (n, 3) and their covariances (n, 3, 3)."""
    offsets = positions - np.array(design.head)
    if design.plan is not None:
        return _plan_deviations(md, offsets, covs, design.plan, design.tolerance)
    # number by number: in a product of matrices the last bits of one point depend on how many others there are
    along = (offsets * design.axis).sum(axis=1)
    first, second = (offsets * design.across[0]).sum(axis=1), (offsets * design.across[1]).sum(axis=1)
    across = np.stack([first, second], axis=1)
    limit = design.tolerance.start + design.tolerance.growth * np.maximum(along, 0.0)
    return Deviations(md.copy(), along, across, design.across @ covs @ design.across.T, limit)


def _plan_deviations(md: Array, offsets: Array, covs: Array, plan: WellPlan, tolerance: Tolerance) -> Deviations:
    """The same from a plan, of points (n, 3) against its head."""
    nearest = plan.nearest(offsets)
    across = planes_across(nearest.tangents)
    apart = (across * (offsets - nearest.points)[:, None]).sum(axis=2)
    turned = across @ covs @ across.transpose(0, 2, 1)
    limit = tolerance.start + tolerance.growth * np.maximum(nearest.along, 0.0)
    return Deviations(md.copy(), nearest.along, apart, turned, limit)


def point_deviation(point: TrajectoryPoint, design: ColumnDesign) -> Deviation:
    """Deviation of one point."""
    return axis_deviations(np.array([point.md]), point.position[None], point.cov[None], design)[0]


@dataclass(frozen=True, slots=True)
class Dominant:
    """Lateral errors (m) of a column over its length, by the error of each angle."""

    by_inclination: float
    by_azimuth: float

    @property
    def name(self) -> str:
        """``inclination`` or ``azimuth``.

        A tilt errs alike along and across the lean, so its error is in both numbers: the azimuth dominates when what it
        adds to the tilt's is more than that.
        """
        return "azimuth" if self.by_azimuth > math.sqrt(2.0) * self.by_inclination else "inclination"


def lateral_errors(direction: Direction, length: float) -> Dominant:
    """Lateral errors L cos I sigma_I and L sin I sigma_A of a hole that leans all along like ``direction``."""
    inclination, _ = direction_angles(direction.lean, direction.down)
    ((std_i, std_a),) = stds_of_directions([direction])
    return Dominant(length * abs(math.cos(inclination)) * std_i, length * math.sin(inclination) * std_a)
