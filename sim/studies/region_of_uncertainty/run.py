"""Regions of uncertainty of wellbore 1 for five instruments, beside the printed tables.

Ours stays as the error model is. How the printed columns were accumulated is not stated; what comes nearest is beside
them (``as_printed``). Also filtered against unfiltered: a constant azimuth error of
0.25 deg in place of the gyro's terms (thesis figures 4.24-4.27).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.tools.instruments import SurveyTool, load_tool
from groundstation.survey.well.analysis import analyse_survey, magnetic_error, with_azimuth_error
from groundstation.survey.well.error_sources import Site
from groundstation.survey.well.methods import Method
from sim.studies.pool import Step
from sim.studies.published import AXES, printed_regions, wellbore_1
from sim.studies.region_of_uncertainty.as_printed import DATASHEET_TILT_DEG, HEADLINE, printed_cases, with_tilt

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
        "printed": printed_cases(cases, multiples),
        "readings": datasheet_readings(),
    }


def half_widths_cm(instrument: str, multiple: float, azimuth_error_deg: float | None = None) -> Array:
    """Half-widths (n, 3) in cm of every station."""
    return half_widths_of(load_tool(instrument), multiple, azimuth_error_deg)


def half_widths_of(tool: SurveyTool, multiple: float, azimuth_error_deg: float | None = None) -> Array:
    """Half-widths (n, 3) in cm of every station by a tool; with a held azimuth in place of its gyroscope's."""
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


def datasheet_readings() -> list[dict[str, Any]]:
    """What the filter is worth with the MPU-6500 at the toe, by either figure that its datasheet is printed with.

    0.02 deg and 0.5886 m/s^2 (60 mg, 3.4 deg) are impossible as a pair; the tool that is shipped has the latter.
    """
    shipped = load_tool("mpu6500")
    tilted = with_tilt(shipped, DATASHEET_TILT_DEG)
    mounts = [term.name for term in shipped.terms if term.name.startswith("MIS")]
    readings = (
        ("0.5886 m/s^2, as shipped", shipped),
        ("0.02 deg", tilted),
        ("0.02 deg, misalignment calibrated", tilted.without(*mounts)),
    )
    rows = []
    for name, tool in readings:
        toes = [half_widths_of(tool, 1.0, held)[-1] for held in (None, FILTERED_AZIMUTH_DEG)]
        raw, held = (math.hypot(toe[0], toe[1]) for toe in toes)
        rows.append(
            {"reading": name, "unfiltered_cm": raw, "filtered_cm": held, "ratio": raw / held, "published": HEADLINE}
        )
    return rows


def magnetic_azimuth_errors() -> list[dict[str, Any]]:
    """Azimuth error of a magnetic survey at every station beside that of the filter (thesis Fig. 4.23), deg.

    The printed formula has sin A with its sign, so it falls below 0.25 deg west of north, where its text says that
    the error is larger to the east and to the west: that has the size of sin A.
    """
    record = wellbore_1()
    errors = np.degrees(magnetic_error(record.inclination, record.azimuth))
    printed = 0.25 + 0.6 * np.sin(record.inclination) * np.sin(record.azimuth)
    return [
        {
            "station": k,
            "as_printed_deg": float(printed[k]),
            "magnetic_deg": float(errors[k]),
            "filtered_deg": FILTERED_AZIMUTH_DEG,
        }
        for k in range(1, len(errors))
    ]
