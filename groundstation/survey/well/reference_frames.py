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


@dataclass(frozen=True, slots=True)
class ReferenceFrame:
    """North and depth reference of a record and those of the answer, and the datum of heights."""

    record: str = "site"
    answer: str = "site"
    norths: Norths = field(default_factory=Norths)
    depths: DepthReference = field(default_factory=DepthReference)  # measured and true vertical ones
    height_datum: str = ""  # of site coordinates, "" where not stated

    def to_true(self, azimuth: Array) -> Array:
        """Azimuths of the record, from true north."""
        return np.asarray(azimuth + self.norths.of(self.record))

    @property
    def turn(self) -> Array:
        """Matrix (3, 3) from true north, east, down to the answer's."""
        angle = self.norths.of(self.answer)
        c, s = math.cos(angle), math.sin(angle)
        return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])

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
