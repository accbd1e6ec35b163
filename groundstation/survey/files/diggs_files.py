"""DIGGS: depths, inclinations and azimuths as properties of a set of results along a hole.

Source: DIGGS 2.6 and 3.0; the properties are those of its dictionary.
"""

from __future__ import annotations

from pathlib import Path
from xml.etree.ElementTree import Element

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable

PROPERTIES = {"inclination": "inclination", "azimuth": "azimuth", "bearing": "azimuth"}


def read_diggs(path: Path, root: Element) -> FieldTable:
    """Table of the first results that hold inclination and azimuth.

    Raises
    ------
    SurveyError
        When there are none, or their parts do not fit.
    """
    for result in _all(root, "TestResult"):
        properties = [(_word(p, "propertyClass"), _word(p, "uom")) for p in _all(result, "Property")]
        names = [PROPERTIES.get(name.lower(), "") for name, _ in properties]
        if {"inclination", "azimuth"} <= set(names):
            return _table(path, result, names, [unit for _, unit in properties])
    raise SurveyError(f"{path}: DIGGS: expected results with the properties inclination and azimuth along a hole")


def _table(path: Path, result: Element, names: list[str], units: list[str]) -> FieldTable:
    positions = _all(result, "posList")
    values = _all(result, "dataValues")
    if not positions or not values:
        raise SurveyError(f"{path}: DIGGS: expected posList and dataValues beside inclination and azimuth")
    depths = (positions[0].text or "").split()
    unit = next((x.get("uomLabels") or x.get("uom") or "" for x in _all(result, "MultiPointLocation")), "")
    unit = positions[0].get("uomLabels") or unit
    mark, end = values[0].get("cs", ","), values[0].get("ts", " ")
    rows = [row.split(mark) for row in (values[0].text or "").strip().split(end if end.strip() else None)]
    if len(rows) != len(depths) or any(len(row) != len(names) for row in rows):
        raise SurveyError(f"{path}: DIGGS: expected {len(names)} values at each of {len(depths)} depths")
    columns = [f"{name} ({u})" if u else name for name, u in zip(names, units, strict=True)]
    header = [f"md ({unit})" if unit else "md", *columns]
    cells = [[depth, *(cell.strip() for cell in row)] for depth, row in zip(depths, rows, strict=True)]
    return FieldTable("DIGGS, results along a hole", header, cells, list(range(1, len(rows) + 1)))


def _all(element: Element, name: str) -> list[Element]:
    return [x for x in element.iter() if str(x.tag).rpartition("}")[2] == name]


def _word(element: Element, name: str) -> str:
    found = _all(element, name)
    return (found[0].text or "").strip() if found else ""
