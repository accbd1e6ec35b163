"""Names of a logger's columns as quantity, axis and unit: ``gx_dps``, ``Accel X (g)``, ``timestamp_us``.

A name is split into words; the first ones say what is measured and along which axis, the last ones may say the unit.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Final

from telemetry.errors import RecordError

G: Final = 9.80665  # m/s^2
DEG: Final = math.pi / 180.0
TIME, RATE, FORCE, FIELD, TEMPERATURE = "time", "gyroscope", "accelerometer", "magnetometer", "temperature"
TRIAD: Final = "sensor"  # x, y, z of a sensor that the record does not name
COUNTS: Final = "counts"
UNITS: Final = {  # by quantity: what is written to its name and SI of one
    TIME: {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9},
    RATE: {"rad/s": 1.0, "deg/s": DEG, "mdeg/s": 1e-3 * DEG, "deg/h": DEG / 3600.0},
    FORCE: {"m/s2": 1.0, "g": G, "mg": 1e-3 * G},
    FIELD: {"T": 1.0, "uT": 1e-6, "nT": 1e-9, "G": 1e-4, "mG": 1e-7},
    TEMPERATURE: {"C": 1.0, "K": 1.0},
}
SPELLINGS: Final = {  # of units, letters and digits only, lower case, to how this program writes them
    TIME: {
        "s": "s", "sec": "s", "secs": "s", "seconds": "s", "ms": "ms", "msec": "ms", "millis": "ms",
        "us": "us", "usec": "us", "micros": "us", "ns": "ns", "nsec": "ns",
    },
    RATE: {
        "rads": "rad/s", "rad": "rad/s", "radps": "rad/s", "radsec": "rad/s", "dps": "deg/s", "degs": "deg/s",
        "degps": "deg/s", "degsec": "deg/s", "deg": "deg/s", "mdps": "mdeg/s", "mdegs": "mdeg/s",
        "dph": "deg/h", "degh": "deg/h",
    },
    FORCE: {"ms2": "m/s2", "mps2": "m/s2", "mss": "m/s2", "msec2": "m/s2", "g": "g", "mg": "mg"},
    FIELD: {
        "t": "T", "ut": "uT", "nt": "nT", "g": "G", "gs": "G", "gauss": "G", "mg": "mG", "mgauss": "mG",
    },
    TEMPERATURE: {"c": "C", "degc": "C", "celsius": "C", "k": "K", "kelvin": "K"},
}  # fmt: skip
RAW: Final = {"lsb", "raw", "counts", "count", "adc", "int16"}
STEMS: Final = {
    RATE: ("g", "w", "gyr", "gyro", "gyroscope", "omega", "rate", "angvel", "angularvelocity"),
    FORCE: ("a", "f", "acc", "accel", "accelerometer", "acceleration", "force", "linacc", "linearacceleration"),
    FIELD: ("m", "h", "mag", "magn", "magnetometer", "magneticfield"),
}
TIMES: Final = {"t", "time", "timestamp", "stamp", "hosttime", "clock"}
WARMTHS: Final = {"temperature", "temp", "imutemp", "imutemperature"}
SI_STEMS: Final = ("w", "f")  # of the node's own recordings, whose names say no unit: rad/s, m/s^2
SKIPPED: Final = "-"  # a column that is not used


@dataclass(frozen=True, slots=True)
class Column:
    """One column: its name as written, what it holds, the axis 0..2 (else 0), the unit, empty where none is told.

    ``odd`` is what stands where a unit would, and is none.
    """

    name: str
    quantity: str
    axis: int = 0
    unit: str = ""
    odd: str = ""


def column_of(name: str) -> Column | None:
    """What a name says; None where it says none of a sensor's quantities."""
    words = [word for word in re.split(r"[^a-z0-9/^²°µ]+", _separated(name).lower()) if word]
    words = [re.sub(r"[^a-z0-9]", "", word.replace("µ", "u").replace("²", "2").replace("°", "deg")) for word in words]
    words = [word for word in words if word]
    for used in range(len(words), 0, -1):
        found = _quantity("".join(words[:used]))
        if found is not None:
            quantity, axis, unit = found
            told = "".join(words[used:])
            known = known_unit(quantity, told) if told else unit
            return Column(name, quantity, axis, known, told if told and not known else "")
    return None


def unit_of(quantity: str, text: str, name: str) -> str:
    """Unit as this program writes it.

    Raises
    ------
    RecordError
        When the quantity has no such unit; the message lists those that it has.
    """
    if found := known_unit(quantity, text):
        return found
    known = ", ".join(UNITS.get(quantity, {}))
    raise RecordError(f"{name}: expected a unit of the {quantity}, {known} or counts, got {text!r}")


def known_unit(quantity: str, text: str) -> str:
    """Unit as this program writes it, empty where the quantity has none of that name."""
    plain = re.sub(r"[^a-z0-9]", "", text.lower().replace("µ", "u").replace("²", "2").replace("°", "deg"))
    if plain in RAW:
        return COUNTS
    if quantity == TRIAD:
        return text
    return SPELLINGS.get(quantity, {}).get(plain, "")


def _separated(name: str) -> str:
    """Put a space before a capital that follows a small letter: accX, GyroY."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", name)


def _quantity(word: str) -> tuple[str, int, str] | None:
    if word in TIMES:
        return TIME, 0, ""
    if word in WARMTHS:
        return TEMPERATURE, 0, "C"
    if word in {"x", "y", "z"}:
        return TRIAD, "xyz".index(word), ""
    if not word or word[-1] not in "xyz":
        return None
    for quantity, stems in STEMS.items():
        if word[:-1] in stems:
            unit = {RATE: "rad/s", FORCE: "m/s2"}.get(quantity, "") if word[:-1] in SI_STEMS else ""
            return quantity, "xyz".index(word[-1]), unit
    return None
