"""What is told of the columns of a wall: their designs, how they were surveyed, and what is assumed of all of them.

Frame: north, east, down of the site; m and rad.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning
from groundstation.survey.tools.instruments import SurveyTool
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.tight_depths import TightRange
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.methods import Method
from groundstation.survey.well.reference_frames import turn_north

Array = npt.NDArray[np.float64]


class ColumnStatus(Enum):
    """Status of a column on the site."""

    UNSTATED = ""  # as far as it was surveyed
    PLANNED = "planned"  # to be drilled
    DRILLED = "drilled"  # to its design length, or to the depth stated
    NOT_DRILLED = "not-drilled"  # given up


@dataclass(frozen=True, slots=True)
class ColumnPlan:
    """Plan of one column: its design, the tool that surveyed it, the depth drilled."""

    design: ColumnDesign
    tool: SurveyTool
    serial: str = ""  # of the instrument; columns of one instrument share its systematic errors
    status: ColumnStatus = ColumnStatus.UNSTATED
    drilled: float | None = None  # m, measured depth of its end
    head_std: float = 0.0  # m, north and east, of setting out
    calibration: str = ""  # certificate of the instrument


@dataclass(frozen=True, slots=True)
class ColumnSurvey:
    """Stations (n,) of one column from its head on; none where it was not surveyed.

    Azimuths count from the wall's north. ``record`` holds what else an instrument knows of every station, by the name
    of its variable: the sigma of its yaw, of its forces. ``covs`` (n, 3, 3), m^2, is how well each station is known
    against the head, where that was told with the survey: then no model of an instrument is asked.
    """

    md: Array
    inclination: Array
    azimuth: Array
    record: dict[str, Array] = field(default_factory=dict)
    covs: Array | None = None
    warnings: tuple[EntryWarning, ...] = ()  # of values that are missing
    times: tuple[str, str] | None = None  # of the first and the last survey, as the table tells them

    def turned(self, angle: float) -> ColumnSurvey:
        """Return the survey counted from another north, from which its own has the azimuth ``angle`` (rad)."""
        turn = turn_north(-angle)
        covs = None if self.covs is None else turn @ self.covs @ turn.T
        return replace(self, azimuth=self.azimuth + angle, covs=covs)


@dataclass(frozen=True, slots=True)
class Layer:
    """Radius of finished columns from a depth on."""

    top: float
    radius: float | None  # m; None: that of the design
    radius_cv: float  # standard deviation over radius


@dataclass(frozen=True, slots=True)
class Assumptions:
    """Assumptions for the whole wall."""

    method: Method = Method.MINIMUM_CURVATURE
    site: Site = field(default_factory=Site)
    north: float = 0.0  # rad, azimuth from true north of the north that designs and stations count from
    wander: float = 0.01  # m/m, one standard deviation of where an unsurveyed length goes
    step: float = 0.5  # m between planes
    layers: tuple[Layer, ...] = (Layer(-math.inf, None, 0.0),)
    radius_correlation: float = 1.0  # of two columns in one layer
    tight: TightRange = field(default_factory=TightRange)  # the planes lie in it
