"""The hole of a running rig as it is exported, from the answers that every client is given: trajectory and column."""

from __future__ import annotations

import datetime
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.exports.export_hole import ExportHole, ExportSite
from groundstation.survey.exports.export_request import ENU
from groundstation.survey.well.reference_frames import SiteGrid

REMARK = "from a running rig; azimuths and coordinates count from the site's north"


@dataclass(frozen=True, slots=True)
class LivePlace:
    """Where the collar of a running rig stands: northing, easting, height (m), and the code of their grid."""

    origin: tuple[float, float, float] | None = None
    grid_crs: str = ""

    def __post_init__(self) -> None:
        """Refuse a grid without the collar's coordinates on it, and coordinates that are no numbers.

        Raises
        ------
        SurveyError
        """
        if self.origin is None and self.grid_crs:
            raise SurveyError("--grid-crs: expected --origin NORTHING EASTING HEIGHT of the collar beside it")
        for value in self.origin or ():
            RANGES["coordinate"].check("--origin", value)

    def axis_of(self, local: Any) -> Any:
        """Easting, northing and height (n, 3) of positions (n, 3) north, east, down of the collar."""
        if self.origin is None:
            return local @ ENU.T
        return SiteGrid(self.origin).of_places(local)[:, [1, 0, 2]]


def place_of_text(origin: str, grid_crs: str) -> LivePlace:
    """Place of ``NORTHING,EASTING,HEIGHT``, empty of none.

    Raises
    ------
    SurveyError
    """
    if not origin:
        return LivePlace(None, grid_crs)
    try:
        northing, easting, height = map(float, origin.split(","))
    except ValueError:
        raise SurveyError(f"--origin: expected NORTHING,EASTING,HEIGHT in m, got {origin!r:.60}") from None
    return LivePlace((northing, easting, height), grid_crs)


def site_of_live(
    name: str, trajectory: Mapping[str, Any], column: Mapping[str, Any], place: LivePlace, day: datetime.date
) -> ExportSite:
    """The hole as its ground station answers it.

    Parameters
    ----------
    trajectory, column : answers of those names

    Raises
    ------
    SurveyError
        When the hole has no station below its collar yet.
    """
    rows = trajectory["points"]
    if len(rows) < 2:
        raise SurveyError(f"{name}: no station below the collar yet; nothing is to be exported")
    columns = {key: np.array([row[key] for row in rows]) for key in rows[0]}
    local = np.column_stack([columns["north_m"], columns["east_m"], columns["tvd_m"]])
    hole = ExportHole(
        name, columns["md_m"], columns["inclination_deg"], columns["azimuth_deg"] % 360.0, local, place.axis_of(local),
        columns["covariance_m2"], column["design"]["radius_m"], north="site", deviation=_deviation(column),
    )  # fmt: skip
    return ExportSite(name, (hole,), crs=place.grid_crs, remarks=(REMARK,), day=day.isoformat())


def _deviation(column: Mapping[str, Any]) -> Any:
    """Deviation (2,) of the deepest station from the design axis, m."""
    last = column["stations"][-1]
    return 0.01 * np.array([last["north_cm"], last["east_cm"]])
