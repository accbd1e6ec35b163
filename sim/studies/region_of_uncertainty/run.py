"""Regions of uncertainty of wellbore 1 for five instruments, beside the printed tables.

How the printed columns were accumulated is not stated and no single convention of the error model gives their first
rows, so nothing is tuned: the ratio is shown as it is. Also filtered against unfiltered: a constant azimuth error of
0.25 deg in place of the gyro's terms (thesis figures 4.24-4.27).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.instruments import load_tool
from groundstation.survey.well.analysis import analyse_survey, magnetic_error, with_azimuth_error
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.methods import Method
from sim.studies.pool import Step
from sim.studies.published import AXES, printed_regions, wellbore_1

FILTERED_AZIMUTH_DEG = 0.25
Array = npt.NDArray[np.float64]


def count_steps() -> int:
    """Steps of the study: one."""
    return 1


def run_study(step: Step) -> dict[str, Any]:
    """Table with one case for every instrument, station and axis, cm at the printed number of standard deviations."""
    printed = printed_regions()
    multiples = {row.instrument: row.multiple for row in printed}
    ours = {name: half_widths_cm(name, multiple) for name, multiple in multiples.items()}
    cases = [
        {
            "case": f"{row.instrument} station {row.station} {axis}",
            "instrument": row.instrument,
            "station": row.station,
            "axis": axis,
            "published": row.cm[k],
            "ours": float(ours[row.instrument][row.station, k]),
            "ratio": float(ours[row.instrument][row.station, k] / row.cm[k]),
            "unit": f"cm at {row.multiple:g} sigma",
        }
        for row in printed
        for k, axis in enumerate(AXES)
    ]
    step()
    return {
        "experiment": "region-of-uncertainty",
        "cases": cases,
        "filtered": lateral_half_widths(multiples),
        "magnetic": magnetic_azimuth_errors(),
    }


def half_widths_cm(instrument: str, multiple: float, azimuth_error_deg: float | None = None) -> Array:
    """Half-widths (n, 3) in cm of every station."""
    tool = load_tool(instrument)
    if azimuth_error_deg is not None:
        tool = with_azimuth_error(tool, math.radians(azimuth_error_deg))
    found = analyse_survey(wellbore_1(), Method.BALANCED_TANGENTIAL, tool, Site())
    variances = np.diagonal(found.uncertainty.cov, axis1=1, axis2=2)
    return np.asarray(100.0 * multiple * np.sqrt(variances))


def lateral_half_widths(multiples: dict[str, float]) -> list[dict[str, Any]]:
    """Lateral half-width of every station with the gyro's terms and with the filter's azimuth."""
    rows: list[dict[str, Any]] = []
    for name, multiple in multiples.items():
        if "GD" not in [term.name for term in load_tool(name).terms]:
            continue
        raw, held = (half_widths_cm(name, multiple, x) for x in (None, FILTERED_AZIMUTH_DEG))
        rows.extend(
            {
                "instrument": name,
                "station": k,
                "unfiltered_cm": math.hypot(raw[k, 0], raw[k, 1]),
                "filtered_cm": math.hypot(held[k, 0], held[k, 1]),
            }
            for k in range(1, len(raw))
        )
    return rows


def magnetic_azimuth_errors() -> list[dict[str, Any]]:
    """Azimuth error of a magnetic survey at every station beside that of the filter (thesis Fig. 4.23), deg."""
    record = wellbore_1()
    errors = np.degrees(magnetic_error(record.inclination, record.azimuth))
    return [
        {"station": k, "magnetic_deg": float(errors[k]), "filtered_deg": FILTERED_AZIMUTH_DEG}
        for k in range(1, len(errors))
    ]
