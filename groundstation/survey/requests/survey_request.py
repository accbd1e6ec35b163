"""What is asked of a survey: the record and how it is read, its frame, the place and the instrument."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from groundstation.entry.quantity_ranges import RANGES

if TYPE_CHECKING:
    from groundstation.survey.well.error_sources import Site

PROGRAMME_ALONE = "--programme: expected neither --azimuth-error-deg nor --export-tool beside it"


@dataclass(frozen=True, slots=True)
class SiteFigures:
    """The place as a user states it."""

    gravity: float | None = None  # m/s^2
    field_nt: float | None = None
    dip_deg: float | None = None
    declination_deg: float | None = None  # of magnetic from true north
    latitude_deg: float | None = None
    at: str | None = None  # latitude, longitude, height: what is not stated is worked out there
    date: str | None = None  # of the magnetic field
    grid_crs: str | None = None  # national grid, for convergence and scale

    def to_site(self) -> Site:
        """The place in SI and rad, of figures that ``known_site`` completed.

        Raises
        ------
        SurveyError
            Names the option that is beyond its range.
        """
        names = ("gravity", "field_nt", "dip_deg", "declination_deg", "latitude_deg")
        values = [RANGES[name].check(f"--{name.replace('_', '-')}", getattr(self, name)) for name in names]
        from groundstation.survey.well.error_sources import Site

        return Site(*values[:2], *map(math.radians, values[2:]))


@dataclass(frozen=True, slots=True)
class FrameRequest:
    """Norths, depth references and origin of a record and of its answer; an answer's that is None follows."""

    north: str = "site"
    answer_north: str | None = None
    north_of_site_deg: float | None = None
    convergence_deg: float | None = None
    declination_deg: float | None = None
    origin: tuple[float, float, float] | None = None  # m, northing, easting, height of the point of zero
    grid_scale_factor: float = 1.0  # metres of the grid a metre on the ground
    depth_reference: str = "collar"
    answer_depth_reference: str | None = None
    depth_reference_height_m: float | None = None  # of the former above the latter
    height_datum: str | None = None


@dataclass(frozen=True, slots=True)
class SurveyRequest:
    """A record, the method and the instrument, and what is to be answered, as ``borechain survey`` takes them."""

    file: Path
    method: str | None = None  # that of the record's form where None: ``default_method``
    instrument: str = "relay"  # a name, or a file
    parameter: Mapping[str, float] = field(default_factory=dict)  # constants of the error model by their names
    sigma: float = 1.0  # standard deviations of the answer
    azimuth_error_deg: float | None = None
    displacement_rule: str = "exact"
    from_collar: bool = False
    md_unit: str | None = None
    hole: str | None = None  # of a table of several
    decimal: str | None = None  # ``comma`` or ``point``, where a table may be read as either
    md: tuple[float, ...] = ()  # m, depths at which the position is asked too
    tie_on: Path | None = None
    programme: Path | None = None
    section_azimuth_deg: float = 0.0
    frame: FrameRequest = field(default_factory=FrameRequest)
    site: SiteFigures = field(default_factory=SiteFigures)
