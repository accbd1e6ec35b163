"""Ranges of the quantities that users state: beyond them a number is refused, by its name, its unit and its range."""

from __future__ import annotations

import math
from dataclasses import dataclass

from groundstation.errors import SurveyError


@dataclass(frozen=True, slots=True)
class QuantityRange:
    """A quantity: least and largest value in its unit."""

    words: str
    low: float
    high: float
    unit: str

    def check(self, where: str, value: float) -> float:
        """Return the value where it lies in the range.

        Raises
        ------
        SurveyError
            Beginning with ``where``: what was expected and what came.
        """
        if not math.isfinite(value) or not self.low <= value <= self.high:
            raise SurveyError(f"{where}: expected {self.expected}, got {value:g}")
        return value

    @property
    def expected(self) -> str:
        """The quantity with its range and its unit, in words."""
        return f"{self.words} of {self.low:g}..{self.high:g} {self.unit}"


RANGES = {
    "azimuth_deg": QuantityRange("an azimuth", -720.0, 720.0, "deg"),
    "inclination_deg": QuantityRange("an inclination", 0.0, 180.0, "deg"),
    "declination_deg": QuantityRange("a declination", -180.0, 180.0, "deg"),
    "convergence_deg": QuantityRange("a convergence", -180.0, 180.0, "deg"),
    "north_of_site_deg": QuantityRange("an azimuth of the site's north", -360.0, 360.0, "deg"),
    "section_azimuth_deg": QuantityRange("an azimuth", -720.0, 720.0, "deg"),
    "gravity": QuantityRange("a gravity", 9.0, 10.5, "m/s^2"),
    "field_nt": QuantityRange("a magnetic field", 15_000.0, 75_000.0, "nT"),
    "dip_deg": QuantityRange("a dip", -90.0, 90.0, "deg"),
    "latitude_deg": QuantityRange("a latitude", -90.0, 90.0, "deg"),
    "longitude_deg": QuantityRange("a longitude", -180.0, 360.0, "deg"),
    "height_m": QuantityRange("a height", -1000.0, 10_000.0, "m"),
    "coordinate": QuantityRange("a coordinate", -1e8, 1e8, "m"),  # of a national grid, its zone's number before it
    "distance": QuantityRange("a distance", -1e6, 1e6, "m"),  # on one site
    "depth": QuantityRange("a depth or a length", -1e5, 1e5, "m"),
    "depth_rate": QuantityRange("a speed of the bit", 1e-3, 5.0, "m/s"),  # a hoist without a load makes two
    "depth_gap": QuantityRange("a time between two depths", 0.1, 600.0, "s"),
    "survey_after": QuantityRange("a time of a stop", 5.0, 3600.0, "s"),
    "stale_after": QuantityRange("a time of silence", 1.0, 600.0, "s"),  # a state comes every second
    "station_tolerance": QuantityRange("a distance of two surveys at one station", 1e-3, 1.0, "m"),
}
