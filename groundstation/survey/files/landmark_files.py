"""Files of Landmark: well plans (``.wbp``, through welleng), and exports of its data base (EDM), which are in feet."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable
from groundstation.survey.files.file_bytes import read_file
from groundstation.survey.files.xml_surveys import parse_xml

UNITS = {"meters": "m", "feet": "ft"}
STATIONS = ("CD_DEFINITIVE_SURVEY_STATION", "CD_SURVEY_STATION")
HEADERS = ("def_survey_header_id", "survey_header_id", "wellbore_id")


def read_wbp(path: Path) -> FieldTable:
    """Table of the plans of a ``.wbp`` file.

    Raises
    ------
    SurveyError
        When it is no such file.
    """
    read_file(path)  # refuses what is not there or too large
    from welleng.exchange import wbp  # an extra

    try:
        plans = wbp.load(str(path))  # type: ignore[no-untyped-call]
        rows = [row for number, plan in enumerate(plans, 1) for row in _plan_rows(str(plan.plan_name or number), plan)]
        units = {UNITS[str(plan.depth_unit)] for plan in plans}
    except Exception as error:  # the library raises whatever the lines of a damaged file raise
        raise SurveyError(f"{path}: not a .wbp file: {type(error).__name__}: {error!s:.80}") from error
    if len(units) != 1:
        raise SurveyError(f"{path}: its plans have depths in several units; expected one")
    lines = list(range(1, len(rows) + 1))
    return FieldTable("wbp, stations in order", ["hole", f"md ({units.pop()})", "inc (deg)", "azi (deg)"], rows, lines)


def _plan_rows(name: str, plan: Any) -> list[list[str]]:
    """Stations of a plan; where a turn point and a station stand at one depth, the latter counts."""
    at = {float(step.md): step for step in plan.steps}
    return [[name, *(repr(float(x)) for x in (md, step.inc, step.azi))] for md, step in sorted(at.items())]


def read_edm(path: Path, content: bytes) -> FieldTable:
    """Table of the definitive surveys of an export, or of its raw ones.

    Raises
    ------
    SurveyError
        When it holds none.
    """
    root = parse_xml(path, content)
    for name in STATIONS:
        found = [element for element in root.iter() if str(element.tag).rpartition("}")[2] == name]
        if found:
            rows = [[_hole(e.attrib), *(e.get(key, "") for key in ("md", "inclination", "azimuth"))] for e in found]
            header = ["hole", "md (ft)", "inc (deg)", "azi (deg)"]
            return FieldTable("EDM, stations in order", header, rows, list(range(1, len(rows) + 1)))
    raise SurveyError(f"{path}: EDM: expected {' or '.join(STATIONS)}")


def _hole(attributes: dict[str, str]) -> str:
    return next((attributes[key] for key in HEADERS if key in attributes), "")
