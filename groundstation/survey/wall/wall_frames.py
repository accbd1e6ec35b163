"""Norths, place and site coordinates of a wall file.

Designs and heads count from the wall's ``north``, and so does every answer. Stations may count from another one, such
as magnetic north, and are turned. Error models are evaluated from true north. Angles of the file in deg, all else SI.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import SurveyTool
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.reference_frames import NORTHS, SiteGrid, north_of_coordinates

MAGNETIC = {"field_nt": "BField", "dip_deg": "Dip", "declination_deg": "AzM"}  # variables of formulas
FRAMES = ("north", "stations_north")
PLACE = ("dip_deg", "latitude_deg")
ORIGIN = ("northing_m", "easting_m", "height_m")
NORTH_ANGLES = {"site": "north_of_site_deg", "grid": "convergence_deg", "magnetic": "declination_deg"}


def place_of(path: Path, values: dict[str, Any]) -> Site:
    """The place, for error models; what is stated lies in its range."""
    for key, name in (("gravity_mps2", "gravity"), ("field_nt", "field_nt"), ("dip_deg", "dip_deg")):
        if key in values:
            RANGES[name].check(f"{path}: {key}", values[key])
    usual = Site()
    radians = {key: math.radians(values[key]) for key in (*PLACE, "declination_deg") if key in values}
    return Site(
        values.get("gravity_mps2", 9.81),
        values.get("field_nt", usual.b_field),
        radians.get("dip_deg", usual.dip),
        radians.get("declination_deg", 0.0),
        radians.get("latitude_deg", usual.latitude),
    )


def check_magnetic_site(path: Path, values: dict[str, Any], tools: Iterable[SurveyTool]) -> None:
    """Refuse a magnetic instrument where the field of the site is not stated.

    Raises
    ------
    SurveyError
        Names the instrument and the keys.
    """
    for tool in tools:
        missing = [key for key, variable in MAGNETIC.items() if key not in values and tool.asks_for(variable)]
        if missing:
            raise SurveyError(
                f"{path}: {', '.join(missing)}: missing; the instrument {tool.name} is magnetic and needs its site"
            )


def norths_of(path: Path, values: dict[str, Any]) -> tuple[float, float]:
    """Azimuths (rad) from true north of the wall's north and of the north that its stations count from."""
    north, stations = values.get("north", "site"), values.get("stations_north", values.get("north", "site"))
    for key, name in zip(FRAMES, (north, stations), strict=True):
        if name not in NORTHS:
            raise SurveyError(f"{path}: {key}: expected one of {', '.join(NORTHS)}, got {name!r}")
    angles = {key: math.radians(values[key]) for key in NORTH_ANGLES.values() if key in values}
    if stations != north:
        for name in (north, stations):
            if name in NORTH_ANGLES and NORTH_ANGLES[name] not in angles:
                raise SurveyError(
                    f"{path}: {NORTH_ANGLES[name]} is missing: stations count from {stations} north, "
                    f"the wall from {north} north"
                )
    found = [angles.get(NORTH_ANGLES.get(name, ""), 0.0) for name in (north, stations)]
    return found[0], found[1]


def grid_of(path: Path, values: dict[str, Any], north: float) -> SiteGrid | None:
    """Site coordinates of the wall's zero, all three or none; they count from grid north, or from the site's own."""
    stated = [key for key in ORIGIN if key in values]
    if not stated:
        if "grid_scale_factor" in values:
            raise SurveyError(f"{path}: grid_scale_factor: expected {', '.join(ORIGIN)} beside it")
        return None
    if len(stated) < len(ORIGIN):
        raise SurveyError(f"{path}: expected {', '.join(ORIGIN)} together, got {', '.join(stated)}")
    counted = north_of_coordinates(values.get("north", "site"))
    if counted == "grid" and values["north"] != "grid" and "convergence_deg" not in values:
        raise SurveyError(f"{path}: convergence_deg is missing: site coordinates count from grid north")
    turn = math.radians(values.get("convergence_deg", 0.0)) - north if counted == "grid" else 0.0
    origin = (float(values["northing_m"]), float(values["easting_m"]), float(values["height_m"]))
    try:
        return SiteGrid(origin, counted, turn, values.get("grid_scale_factor", 1.0))
    except SurveyError as error:
        raise SurveyError(f"{path}: {error}") from None
