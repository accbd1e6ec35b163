"""Names and units that columns of surveys have in the field, and what they mean.

A header may hold a name, its unit and the north of an azimuth, in brackets or not: ``MD (ft)``, ``md_ft``, ``AZIM_TN``.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

NAMES = {
    "md": ("md", "measured depth", "meas depth", "depth", "md depth", "dept", "bohrlänge", "teufe", "along hole depth",
           "ahd", "ahdepth", "survey depth", "profondeur", "profundidad", "profondità"),
    "inclination": ("inc", "incl", "inclination", "dev", "devi", "deviation", "drift", "neigung", "tilt",
                    "inclinaison", "inclinazione", "inclinación"),
    "dip": ("dip", "plunge", "einfallen", "buzamiento"),
    "azimuth": ("azi", "az", "azim", "azimuth", "azimut", "bearing", "azimuth angle", "hazi", "azimutale"),
}  # fmt: skip
QUANTITIES = {name: quantity for quantity, names in NAMES.items() for name in names}
UNITS = {
    "m": "m", "meter": "m", "meters": "m", "metre": "m", "metres": "m", "cm": "cm", "mm": "mm", "ft": "ft",
    "feet": "ft", "foot": "ft", "f": "ft", "usft": "usft", "ftus": "usft", "us-ft": "usft", "deg": "deg", "dega": "deg",
    "degree": "deg", "degrees": "deg", "°": "deg", "rad": "rad", "radians": "rad", "gon": "gon", "gons": "gon",
    "grads": "gon",
}  # fmt: skip  # a "grad" is a gon in English and a degree in German: it is asked for
TO_SI = {
    "m": 1.0, "cm": 0.01, "mm": 0.001, "ft": 0.3048, "usft": 1200.0 / 3937.0,
    "deg": 1.0, "rad": math.degrees(1.0), "gon": 0.9,
}  # fmt: skip  # angles to deg, as records have them
ANGLES = ("deg", "rad", "gon")
ALLOWED = {"md": ("m", "ft", "usft", "cm", "mm"), "inclination": ANGLES, "dip": ANGLES, "azimuth": ANGLES}
ASSUMED = {"md": "m", "inclination": "deg", "dip": "deg", "azimuth": "deg"}
NORTHS = {
    "tn": "true", "true": "true", "gn": "grid", "grid": "grid", "mn": "magnetic", "mag": "magnetic",
    "magnetic": "magnetic", "site": "site", "north": "",
}  # fmt: skip
BRACKETS = re.compile(r"[(\[]([^)\]]*)[)\]]")


@dataclass(frozen=True, slots=True)
class NamedColumn:
    """A column whose meaning is known; ``unknown`` is its unit where that is not known."""

    quantity: str
    place: int
    unit: str
    stated: bool
    north: str = ""
    unknown: str = ""


def named_columns(cells: list[str]) -> list[NamedColumn]:
    """Columns of a header whose names are known, in its order."""
    found = (_named(cell, place) for place, cell in enumerate(cells))
    return [column for column in found if column is not None]


def _named(cell: str, place: int) -> NamedColumn | None:
    words = _words(cell)
    unit = next((UNITS[word] for word in words[1:] if word in UNITS), "")
    north = next((NORTHS[word] for word in words if NORTHS.get(word)), "")
    kept = [word for k, word in enumerate(words) if word not in NORTHS and (k == 0 or word not in UNITS)]
    quantity, unknown = QUANTITIES.get(" ".join(kept)), ""
    if quantity is None:
        bare = [word for word in _words(BRACKETS.sub(" ", cell)) if word not in NORTHS]
        quantity = QUANTITIES.get(" ".join(bare))
        bracketed = [text.strip() for text in BRACKETS.findall(cell)]
        unknown = bracketed[0] if quantity is not None and bracketed else ""
        quantity = quantity if unknown else None
    if quantity is None or (north and quantity != "azimuth"):
        return None
    return NamedColumn(quantity, place, unit or ASSUMED[quantity], bool(unit), north, unknown)


def unknown_unit(cells: list[str]) -> NamedColumn | None:
    """The first column that has a name of ours and a unit that is not known, where a quantity is missing by it."""
    have = {column.quantity for column in named_columns(cells)}
    for place, cell in enumerate(cells):
        words = _words(cell)
        for count in range(len(words) - 1, 0, -1):
            quantity = QUANTITIES.get(" ".join(words[:count]))
            if quantity is not None and quantity not in have:
                return NamedColumn(quantity, place, "", False, unknown=" ".join(words[count:]))
    return None


def _words(cell: str) -> list[str]:
    return re.sub(r"[()\[\]_.,/:]+", " ", cell.strip().lower()).split()


def is_survey_header(cells: list[str]) -> bool:
    """Whether a header names depth, a lean and an azimuth."""
    found = {column.quantity for column in named_columns(cells)}
    return {"md", "azimuth"} <= found and bool(found & {"inclination", "dip"})
