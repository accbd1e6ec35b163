"""Published figures that experiments stand beside ours: read from the package's own data files."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from importlib import resources
from pathlib import Path

from groundstation.survey.files.survey_records import DisplacementRule, read_record
from groundstation.survey.well.well_record import SurveyRecord

AXES = ("north", "east", "tvd")


def data_file(name: str) -> Path:
    """A file of ``sim/studies/data``."""
    return Path(str(resources.files("sim.studies") / "data" / name))


def wellbore_1(rule: DisplacementRule = DisplacementRule.EXACT) -> SurveyRecord:
    """Field record of thesis Table 4.1."""
    return read_record(data_file("wellbore_1.csv"), rule)


@dataclass(frozen=True, slots=True)
class PrintedRegion:
    """One printed row: half-widths in cm at ``multiple`` standard deviations."""

    instrument: str
    multiple: float
    station: int
    cm: tuple[float, float, float]  # north (b), east (a), tvd


def printed_regions() -> list[PrintedRegion]:
    """Rows of thesis Tables 4.5, 4.8, 4.11, 4.14 and 4.17."""
    with data_file("printed_uncertainty.csv").open(newline="") as file:
        rows = csv.DictReader(line for line in file if not line.startswith("#"))
        return [
            PrintedRegion(
                row["instrument"].replace("_", "-"),
                float(row["sigma_multiple"]),
                int(row["station"]),
                (float(row["b_cm"]), float(row["a_cm"]), float(row["tvd_cm"])),
            )
            for row in rows
        ]
