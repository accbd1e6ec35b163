"""What is asked of a clearance: two records, their instruments and radii, and the rule."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from groundstation.survey.path.stated_curvature import STATED_LENGTH
from groundstation.survey.requests.survey_request import SiteFigures


@dataclass(frozen=True, slots=True)
class ClearanceRequest:
    """Two holes, tables of stations from the collar, azimuths from true north; lengths in m."""

    reference: Path
    offset: Path
    instrument: str = "relay"  # of the reference hole, a name or a file
    offset_instrument: str | None = None  # the same by default
    same_instrument: bool = False  # one instrument surveyed both
    radius_m: float = 0.0
    offset_radius_m: float = 0.0
    offset_head: tuple[float, float, float] = (0.0, 0.0, 0.0)  # north, east, down from the reference hole's
    from_m: float | None = None  # of a sidetrack: measured depth down to which the two are one hole
    hole: str | None = None  # of a table of several, of the reference
    offset_hole: str | None = None
    k: float = 3.5  # of the rule
    sigma_ahead_m: float = 0.5
    margin_m: float = 0.3
    curvature_sigma_deg_per_m: float | None = None  # of the paths between stations; see ``answer_clearance``
    curvature_length_m: float = STATED_LENGTH  # over which it is forgotten
    site: SiteFigures = field(default_factory=SiteFigures)
