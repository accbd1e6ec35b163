"""The site of a survey: as stated, or worked out of its place and day, and what stands of it in every answer.

Field, dip and declination are those of the World Magnetic Model, gravity that of the WGS84 ellipsoid with the free-air
correction, convergence and scale those of a national grid. What was stated counts before what was worked out.
"""

from __future__ import annotations

import datetime
import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError

if TYPE_CHECKING:
    from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures

MODELS = {2010: "WMM_2010", 2015: "WMM_2015v2", 2020: "WMM_2020", 2025: "WMM_2025"}  # by their first year
YEARS = 5  # of a model
POLE = 89.99  # deg, latitude beyond which true north means nothing
BLACKOUT = 2000.0  # nT, level field below which no compass works, by the model's own words
EARTH_RADIUS = 6_371_000.0  # m
FREE_AIR = 3.086e-6  # 1/s^2
MAGNETIC = {"field_nt": "BField", "dip_deg": "Dip", "declination_deg": "AzM"}  # variables of formulas


@dataclass(frozen=True, slots=True)
class SitePlace:
    """A place on the ellipsoid and a day."""

    latitude_deg: float
    longitude_deg: float
    height_m: float
    day: datetime.date | None

    @property
    def words(self) -> str:
        """Latitude, longitude and height."""
        return f"{self.latitude_deg:g},{self.longitude_deg:g},{self.height_m:g}"


@dataclass(frozen=True, slots=True)
class MagneticField:
    """Field of a model at a place and day."""

    field_nt: float
    dip_deg: float
    declination_deg: float
    model: str


def parse_place(text: str, day: str | None) -> SitePlace:
    """SitePlace of ``LAT,LON`` or ``LAT,LON,HEIGHT`` (deg, m) and day of ``2026-11-27``.

    Raises
    ------
    SurveyError
        Names the option.
    """
    parts = text.split(",")
    try:
        values = [float(part) for part in parts]
    except ValueError:
        values = []
    if len(values) not in (2, 3):
        raise SurveyError(f"--at: expected LAT,LON or LAT,LON,HEIGHT in deg and m, got {text!r}")
    latitude, longitude, height = (*values, 0.0)[:3]
    for name, value in (("latitude_deg", latitude), ("longitude_deg", longitude), ("height_m", height)):
        RANGES[name].check("--at", value)
    if abs(latitude) > POLE:
        raise SurveyError(f"--at: a site at the pole has no true north; expected a latitude within {POLE:g} deg")
    try:
        when = None if day is None else datetime.date.fromisoformat(day)
    except ValueError:
        raise SurveyError(f"--date: expected a day as 2026-11-27, got {day!r}") from None
    return SitePlace(latitude, longitude, height, when)


def magnetic_field(place: SitePlace) -> MagneticField:
    """Field of the World Magnetic Model.

    Raises
    ------
    SurveyError
        When there is no day, no model covers it, or the field is too steep for any compass.
    """
    if place.day is None:
        raise SurveyError("--at: expected --date beside it; the magnetic field changes with time")
    first = place.day.year - place.day.year % YEARS
    if first not in MODELS:
        last = max(MODELS) + YEARS - 1
        raise SurveyError(f"--date: expected a day of {min(MODELS)} to {last}, of the magnetic model, got {place.day}")
    return field_of_model(MODELS[first], place, decimal_year(place.day))


def field_of_model(model: str, place: SitePlace, year: float) -> MagneticField:
    """Field of one model at a decimal year; errors as ``magnetic_field``."""
    from pygeomag import GeoMag  # an extra

    east = (place.longitude_deg + 180.0) % 360.0 - 180.0
    found = GeoMag(coefficients_file=f"wmm/{model}.COF").calculate(
        glat=place.latitude_deg, glon=east, alt=place.height_m / 1000.0, time=year
    )
    if found.h < BLACKOUT:
        raise SurveyError(
            f"--at: the level field is {found.h:.0f} nT at {place.words}; a compass needs {BLACKOUT:g} nT"
        )
    return MagneticField(float(found.f), float(found.i), float(found.d), model.replace("_", "-"))


def decimal_year(day: datetime.date) -> float:
    """Year of a day with its fraction."""
    begin, end = datetime.date(day.year, 1, 1), datetime.date(day.year + 1, 1, 1)
    return day.year + (day - begin).days / (end - begin).days


def normal_gravity(latitude_deg: float, height_m: float) -> float:
    """Gravity (m/s^2) of WGS84 at a height. Source: Somigliana's formula, NIMA TR8350.2."""
    square = math.sin(math.radians(latitude_deg)) ** 2
    level = 9.7803253359 * (1.0 + 0.00193185265241 * square) / math.sqrt(1.0 - 0.00669437999013 * square)
    return level - FREE_AIR * height_m


def grid_factors(crs: str, place: SitePlace) -> tuple[float, float]:
    """Convergence (deg, azimuth of grid north from true north) and metres of the grid a metre on the ground.

    Raises
    ------
    SurveyError
        When the grid is not known, or its projection has no value there.
    """
    from pyproj import Proj  # an extra
    from pyproj.exceptions import ProjError

    try:
        found = Proj(crs).get_factors(place.longitude_deg, place.latitude_deg, errcheck=True)
    except ProjError:
        raise SurveyError(f"--grid-crs: expected a projected grid such as EPSG:25833, got {crs!r:.60}") from None
    if not math.isfinite(found.meridian_convergence) or not found.areal_scale > 0.0:
        raise SurveyError(f"--grid-crs: {crs} has no values at {place.words}")
    scale = math.sqrt(found.areal_scale) * EARTH_RADIUS / (EARTH_RADIUS + place.height_m)
    return float(found.meridian_convergence), scale


@dataclass(frozen=True, slots=True)
class KnownSite:
    """A site with everything worked out that can be; ``sources`` says of every figure whose it is."""

    figures: SiteFigures
    frame: FrameRequest
    sources: dict[str, str]
    place: SitePlace | None = None

    def row(self) -> dict[str, Any]:
        """The object for JSON; a magnetic field that is not stated is null."""
        place, names = self.place, ("field_nt", "dip_deg", "declination_deg")
        stated = all(self.sources.get(name) != "default" for name in names)
        return {
            "latitude_deg": self.figures.latitude_deg,
            "longitude_deg": None if place is None else place.longitude_deg,
            "height_m": None if place is None else place.height_m,
            "date": None if place is None or place.day is None else place.day.isoformat(),
            "gravity_mps2": self.figures.gravity,
            **{name: getattr(self.figures, name) if stated else None for name in names},
            "convergence_deg": self.frame.convergence_deg,
            "grid_scale_factor": self.frame.grid_scale_factor,
            "grid_crs": self.figures.grid_crs,
            "sources": self.sources,
        }


def known_site(figures: SiteFigures, frame: FrameRequest, asked: set[str]) -> KnownSite:
    """Work out the site.

    Parameters
    ----------
    asked : names of ``MAGNETIC`` that an instrument needs

    Raises
    ------
    SurveyError
        When a magnetic instrument has no site, or what is stated contradicts itself.
    """
    if figures.at is None:
        for name in ("date", "grid_crs"):
            if getattr(figures, name) is not None:
                raise SurveyError(f"--{name.replace('_', '-')}: expected --at beside it")
    place = None if figures.at is None else parse_place(figures.at, figures.date)
    found, sources = _stated(figures)
    if place is not None:
        worked = {"latitude_deg": place.latitude_deg, "gravity": normal_gravity(place.latitude_deg, place.height_m)}
        told = dict.fromkeys(worked, f"{place.words}, WGS84")
        if place.day is not None or asked:
            field = magnetic_field(place)
            worked |= {name: getattr(field, name) for name in MAGNETIC}
            told |= dict.fromkeys(MAGNETIC, f"{field.model} on {place.day}")
        new: dict[str, Any] = {name: value for name, value in worked.items() if sources[name] == "default"}
        found, sources = replace(found, **new), sources | {name: told[name] for name in new}
    missing = sorted(name for name in asked if sources[name] == "default")
    if missing:
        words = " and ".join(f"--{name.replace('_', '-')}" for name in missing)
        raise SurveyError(
            f"a magnetic instrument needs its site: expected --at LAT,LON[,HEIGHT] and --date, or {words}"
        )
    if sources["declination_deg"] != "default" and frame.declination_deg is None:
        frame = replace(frame, declination_deg=found.declination_deg)
    if place is not None and found.grid_crs is not None:
        convergence, scale = grid_factors(found.grid_crs, place)
        if frame.convergence_deg is None:
            frame, sources = replace(frame, convergence_deg=convergence), sources | {"convergence_deg": found.grid_crs}
        if frame.grid_scale_factor == 1.0 and frame.origin is not None:
            frame = replace(frame, grid_scale_factor=scale)
            sources = sources | {"grid_scale_factor": f"{found.grid_crs} at {place.height_m:g} m"}
    return KnownSite(found, frame, sources, place)


def _stated(figures: SiteFigures) -> tuple[SiteFigures, dict[str, str]]:
    """Figures with defaults for those that are not stated, and whose each is."""
    defaults = {
        "gravity": 9.81, "field_nt": 50_000.0, "dip_deg": 70.0, "declination_deg": 0.0, "latitude_deg": 52.0,
    }  # fmt: skip
    sources = {name: "default" if getattr(figures, name) is None else "stated" for name in defaults}
    new: dict[str, Any] = {name: value for name, value in defaults.items() if sources[name] == "default"}
    return replace(figures, **new), sources


def site_words(row: dict[str, Any]) -> str:
    """The site in one line, with what each figure comes from."""
    sources = row["sources"]
    parts = [f"gravity {row['gravity_mps2']:.5f} m/s^2 ({sources['gravity']})"]
    parts.append(f"latitude {row['latitude_deg']:g} deg ({sources['latitude_deg']})")
    if row["field_nt"] is None:
        parts.append("no magnetic field stated")
    else:
        parts.append(
            f"field {row['field_nt']:.1f} nT, dip {row['dip_deg']:.3f} deg, declination "
            f"{row['declination_deg']:.3f} deg ({sources['field_nt']})"
        )
    if row["convergence_deg"] is not None:
        whose = sources.get("convergence_deg", "stated")
        parts.append(f"convergence {row['convergence_deg']:.4f} deg, scale {row['grid_scale_factor']:.8f} ({whose})")
    return "site: " + "; ".join(parts)
