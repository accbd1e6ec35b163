"""Norths, what depths count from, and what a survey is tied to.

Azimuths count from one of four norths: that of the site's own axes, true, grid or magnetic north. Error models are
evaluated against true north; a whole answer (azimuths, positions, covariances, closure, section) is then turned into
one north. Angles in rad, lengths in m; north, east, down.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.well.depth_reference import DepthReference

Array = npt.NDArray[np.float64]
NORTHS = ("site", "true", "grid", "magnetic")
SAME_ANGLE = math.radians(0.01)  # between a tie-on and the first station at its depth
SAME_DEPTH = 1e-6  # m
GRID_SCALES = (0.9, 1.1)  # beyond these it is no scale factor of a grid


@dataclass(frozen=True, slots=True)
class Norths:
    """Azimuth of each north from true north, clockwise."""

    site: float = 0.0
    convergence: float = 0.0  # of grid north
    declination: float = 0.0  # of magnetic north

    def of(self, name: str) -> float:
        """Azimuth of a north by its name.

        Raises
        ------
        SurveyError
            Names the four.
        """
        angles = {"site": self.site, "true": 0.0, "grid": self.convergence, "magnetic": self.declination}
        if name not in angles:
            raise SurveyError(f"north: expected one of {', '.join(NORTHS)}, got {name!r}")
        return angles[name]


def turn_north(angle: float) -> Array:
    """Matrix (3, 3) from axes of one north to those of another, whose azimuth from the first is ``angle`` (rad)."""
    c, s = math.cos(angle), math.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


@dataclass(frozen=True, slots=True)
class SiteGrid:
    """Coordinates of the site. They count from one north, whichever north positions are told in."""

    origin: tuple[float, float, float]  # m, northing, easting and height where positions and depths are zero
    north: str = "site"  # that the coordinates count from
    turn: float = 0.0  # azimuth of that north from the north of positions
    scale: float = 1.0  # metres of the grid a metre on the ground

    def __post_init__(self) -> None:
        """Refuse a scale that no grid has.

        Raises
        ------
        SurveyError
            Names what was expected.
        """
        check_grid_scale(self.scale)

    def of_places(self, places: Array) -> Array:
        """Northing, easting and height (..., 3) of positions (..., 3) north, east, down."""
        turned = places @ turn_north(self.turn).T
        return np.asarray(np.array(self.origin) + turned * np.array([self.scale, self.scale, -1.0]))


def check_grid_scale(scale: float) -> None:
    """Refuse a scale factor that no grid has.

    Raises
    ------
    SurveyError
        Names the range.
    """
    if not GRID_SCALES[0] <= scale <= GRID_SCALES[1]:
        raise SurveyError(
            f"grid scale factor: expected metres of the grid a metre on the ground, {GRID_SCALES[0]:g}.."
            f"{GRID_SCALES[1]:g}, got {scale:g}"
        )


def north_of_coordinates(north: str) -> str:
    """North that site coordinates count from, of positions told in ``north``: the site's own axes, or the grid."""
    return "site" if north == "site" else "grid"


@dataclass(frozen=True, slots=True)
class ReferenceFrame:
    """North and depth reference of a record and those of the answer, the datum of heights and the site's grid."""

    record: str = "site"
    answer: str = "site"
    norths: Norths = field(default_factory=Norths)
    depths: DepthReference = field(default_factory=DepthReference)  # measured and true vertical ones
    height_datum: str = ""  # of site coordinates, "" where not stated
    grid: SiteGrid | None = None  # of site coordinates, if any

    def to_true(self, azimuth: Array) -> Array:
        """Azimuths of the record, from true north."""
        return np.asarray(azimuth + self.norths.of(self.record))

    @property
    def turn(self) -> Array:
        """Matrix (3, 3) from true north, east, down to the answer's."""
        return turn_north(self.norths.of(self.answer))

    def turned(self, places: Array) -> Array:
        """Positions (n, 3) from true north with the record's depths, as the answer has them."""
        found = places if self.norths.of(self.answer) == 0.0 else places @ self.turn.T
        return found - np.array([0.0, 0.0, self.depths.height]) if self.depths.height else found

    def azimuth(self, true: Array) -> Array:
        """Azimuths from true north, in the answer's, [0, 2 pi)."""
        return np.asarray(np.mod(true - self.norths.of(self.answer), math.tau))


@dataclass(frozen=True, slots=True)
class TieOn:
    """First station of a survey that does not begin at its collar; north and depths as in the record."""

    md: float
    inclination: float
    azimuth: float
    position: Array  # (3,)
    cov: Array = field(default_factory=lambda: np.zeros((3, 3)))

    def check(self, md: float, inclination: float, azimuth: float) -> None:
        """Refuse a first station that the tie-on contradicts.

        Raises
        ------
        SurveyError
            When it lies above the tie-on, or at it with another direction.
        """
        if md < self.md - SAME_DEPTH:
            raise SurveyError(
                f"tie-on: at {self.md:g} m, below the first station at {md:g} m; expected it at or above that"
            )
        if md <= self.md + SAME_DEPTH:
            turn = abs(math.remainder(azimuth - self.azimuth, math.tau)) * math.sin(inclination)
            if abs(inclination - self.inclination) > SAME_ANGLE or turn > SAME_ANGLE:
                mine, first = (
                    f"{math.degrees(i):g} and {math.degrees(a):g} deg"
                    for i, a in ((self.inclination, self.azimuth), (inclination, azimuth))
                )
                raise SurveyError(
                    f"tie-on: inclination and azimuth of {mine} at {md:g} m contradict the first station, {first}"
                )
