"""Survey programmes and tie-ons as TOML files: which tool took which part, and where a survey begins.

A programme holds tables ``[[leg]]`` with ``from_m``, ``instrument`` and, if it ends before the next begins, ``to_m``;
instruments that are files lie beside it. A tie-on holds ``md_m``, ``inclination_deg``, ``azimuth_deg``, ``north_m``,
``east_m``, ``tvd_m`` and, if it is uncertain, ``sigma_m`` (north, east, TVD) or ``covariance_m2``.
"""

from __future__ import annotations

import math
import tomllib
from pathlib import Path
from typing import Any

import numpy as np

from groundstation.entry.null_values import is_null
from groundstation.entry.quantity_ranges import RANGES
from groundstation.errors import SurveyError
from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.analysis import Stretch
from groundstation.survey.well.reference_frames import TieOn
from telemetry.bounded_bytes import bounded_text
from telemetry.toml_tables import parse_toml_tables

PLACE = {  # what a tie-on says, and what each may be
    "md_m": "depth", "inclination_deg": "inclination_deg", "azimuth_deg": "azimuth_deg", "north_m": "coordinate",
    "east_m": "coordinate", "tvd_m": "depth",
}  # fmt: skip
SMALLEST = -1e-12  # of the largest variance, that rounding may leave


def read_programme(path: Path) -> list[Stretch]:
    """Parts of a survey and their tools.

    Raises
    ------
    SurveyError, ToolError
        Names file, leg and key.
    """
    data = _toml(path, "a survey programme")
    legs = data.get("leg")
    if set(data) != {"leg"} or not isinstance(legs, list) or not legs:
        raise SurveyError(f"{path}: expected tables [[leg]] with from_m, instrument and, where it ends, to_m")
    return [_leg(path, f"{path}: leg {k}", table) for k, table in enumerate(legs, 1)]


def _leg(path: Path, where: str, table: Any) -> Stretch:
    if not isinstance(table, dict) or not {"from_m", "instrument"} <= set(table) <= {"from_m", "to_m", "instrument"}:
        raise SurveyError(f"{where}: expected from_m, instrument and, where it ends, to_m, got {', '.join(table)}")
    top = _number(where, "from_m", table["from_m"])
    bottom = _number(where, "to_m", table["to_m"]) if "to_m" in table else None
    if bottom is not None and bottom <= top:
        raise SurveyError(f"{where}: expected to_m beyond {top:g} m, got {bottom:g} m")
    name = str(table["instrument"])
    beside = name.endswith((".toml", ".json"))
    return Stretch(load_tool(str(path.parent / name) if beside else name), top, bottom)


def read_tie_on(path: Path) -> TieOn:
    """Return the tie-on of a TOML file: the station at which a survey begins.

    Raises
    ------
    SurveyError
        Names file and key.
    """
    data = _toml(path, "a tie-on")
    for key in data:
        if key not in (*PLACE, "sigma_m", "covariance_m2"):
            raise SurveyError(f"{path}: {key}: unknown key; expected {', '.join(PLACE)}, sigma_m or covariance_m2")
    for key in PLACE:
        if key not in data:
            raise SurveyError(f"{path}: {key} is missing")
    values = {
        key: RANGES[what].check(f"{path}: {key}", _number(str(path), key, data[key])) for key, what in PLACE.items()
    }
    place = np.array([values["north_m"], values["east_m"], values["tvd_m"]])
    inclination, azimuth = (math.radians(values[key]) for key in ("inclination_deg", "azimuth_deg"))
    return TieOn(values["md_m"], inclination, azimuth, place, _covariance(path, data))


def _covariance(path: Path, data: dict[str, Any]) -> Any:
    if "sigma_m" in data and "covariance_m2" in data:
        raise SurveyError(f"{path}: expected sigma_m or covariance_m2, got both")
    try:
        cov = np.diag(np.array(data["sigma_m"], float) ** 2) if "sigma_m" in data else None
        cov = np.array(data.get("covariance_m2", np.zeros((3, 3))), float) if cov is None else cov
    except (TypeError, ValueError):
        cov = np.zeros(0)
    if cov.shape != (3, 3) or not np.all(np.isfinite(cov)) or not np.array_equal(cov, cov.T):
        raise SurveyError(f"{path}: expected three sigma_m, or a symmetric covariance_m2 of three rows of three")
    values = np.linalg.eigvalsh(cov)
    if values[0] < SMALLEST * max(values[-1], 1e-30):
        raise SurveyError(f"{path}: covariance_m2: expected no negative variance, got {values[0]:g} m^2 along an axis")
    return cov


def _toml(path: Path, what: str) -> dict[str, Any]:
    try:
        return parse_toml_tables(bounded_text(path))
    except (OSError, UnicodeDecodeError) as error:
        reason = getattr(error, "strerror", None) or "not a text file"
        raise SurveyError(f"{path}: {reason}; expected {what}") from error
    except tomllib.TOMLDecodeError as error:
        raise SurveyError(f"{path}: not TOML: {error}") from error


def _number(where: str, key: str, value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise SurveyError(f"{where}: {key}: expected a number, got {value!r:.60}")
    if is_null(float(value), angle=key.endswith("_deg")):
        raise SurveyError(f"{where}: {key}: expected a number, got {value:g}, which stands for no value")
    return float(value)
