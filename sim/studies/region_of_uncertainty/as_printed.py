"""The accumulation behind the printed tables of wellbore 1, its two slips named, and two readings of one datasheet.

The errors of every station are taken as independent of those of all others, station k with a lever of the 2 m between
the middles of its legs, and the last of all with half of it. That is the first slip for what is constant in an
instrument, such as a bias. The second is the gyroscope's: its drift over the time since the collar, in degrees, is
taken for radians. Neither is in our error model. Depths are read with 1.05 cm at one standard deviation.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.files.survey_records import DisplacementRule
from groundstation.survey.tools.instruments import SurveyTool, load_tool
from sim.studies.published import wellbore_1

Array = npt.NDArray[np.float64]
LEVER = 2.0  # m
SECONDS_A_STATION = 100.0
GRAVITY = 9.81  # m/s^2
DEPTH_STD = 0.0105  # m, of the probe on its cable
TILT_TERMS = ("ABXY", "ASF")
DATASHEET_TILT_DEG = 0.02  # of the MPU-6500's zero, beside 0.5886 m/s^2, which is 3.4 deg
HEADLINE = 9.5  # filtered against unfiltered, as printed for it


def printed_half_widths_cm(instrument: str, multiple: float) -> Array:
    """Half-widths (n, 3) north, east, down in cm at every station by the accumulation of the print; first the collar.

    Parameters
    ----------
    instrument : name of its error model
    multiple : standard deviations
    """
    record, tool = wellbore_1(DisplacementRule.THESIS), load_tool(instrument)
    inclination, azimuth = record.inclination[1:], record.azimuth[1:]
    tilt = np.cos(inclination) * tilt_error(tool)
    turn = azimuth_error(tool, SECONDS_A_STATION * np.arange(1.0, len(record.md)))
    s, c = np.sin(inclination), np.cos(inclination)
    north = (c * np.cos(azimuth) * tilt) ** 2 + (s * np.sin(azimuth) * turn) ** 2
    east = (c * np.sin(azimuth) * tilt) ** 2 + (s * np.cos(azimuth) * turn) ** 2
    down = (s * tilt) ** 2
    steps = LEVER**2 * np.column_stack([north, east, down])
    steps[:, 2] += depth_std_of(tool) ** 2
    sums = np.cumsum(steps, axis=0)
    sums[-1] -= 0.75 * steps[-1]  # half the lever at the last of all
    return np.asarray(np.vstack([np.zeros(3), 100.0 * multiple * np.sqrt(sums)]))


def tilt_error(tool: SurveyTool) -> float:
    """Error (rad) of the inclination of a vertical hole, of the terms of a datasheet."""
    sizes = [term.value for term in tool.terms if term.name in TILT_TERMS and term.unit == "m/s2"]
    return math.hypot(*sizes) / GRAVITY


def azimuth_error(tool: SurveyTool, time: Array) -> Array:
    """Error of the azimuth at a time (s): the drift in degrees as if they were radians, the random walk in rad."""
    sizes = {term.name: term.value for term in tool.terms}  # deg/s, deg/sqrt(s)
    return np.asarray(np.hypot(sizes.get("GD", 0.0) * time, np.radians(sizes.get("GRW", 0.0)) * np.sqrt(time)))


def depth_std_of(tool: SurveyTool) -> float:
    """Standard deviation (m) of each depth: of a cable; of a string nothing was counted."""
    return DEPTH_STD if any(term.name == "DSF" for term in tool.terms) else 0.0


def with_tilt(tool: SurveyTool, tilt_deg: float) -> SurveyTool:
    """A tool whose accelerometers across the tube read wrong by a tilt, what the bias has across its lean too."""
    bias = GRAVITY * math.sin(math.radians(tilt_deg))
    terms = (replace(term, value=bias) if term.name.startswith("ABXY") else term for term in tool.terms)
    return tool.with_terms(tuple(terms))


def printed_cases(cases: list[dict[str, Any]], multiples: dict[str, float]) -> list[dict[str, Any]]:
    """Rows of the printed tables with what their own accumulation gives beside ours."""
    theirs = {name: printed_half_widths_cm(name, multiple) for name, multiple in multiples.items()}
    axes = ("north", "east", "tvd")
    rows = []
    for row in cases:
        found = float(theirs[row["instrument"]][row["station"], axes.index(row["axis"])])
        kept = {key: row[key] for key in ("instrument", "station", "axis", "published", "ours")}
        rows.append(kept | {"as_printed": found, "ratio": found / row["published"], "unit": row["unit"]})
    return rows
