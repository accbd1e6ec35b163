"""DIGGS: depths, inclinations and azimuths as properties of sets of results along holes.

Source: DIGGS 2.6 and 3.0; the properties are those of its dictionary.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from xml.etree.ElementTree import Element

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable

PROPERTIES = {"inclination": "inclination", "azimuth": "azimuth", "bearing": "azimuth"}
LINK = "{http://www.w3.org/1999/xlink}href"
KEY = "{http://www.opengis.net/gml/3.2}id"


def read_diggs(path: Path, root: Element) -> list[FieldTable]:
    """Tables of all results that hold inclination and azimuth, each by the name of its hole.

    Raises
    ------
    SurveyError
        When there are none, or their parts do not fit.
    """
    found, names = [], _hole_names(root)
    tests = _all(root, "Test") or [root]
    for number, test in enumerate(tests, 1):
        for result in _all(test, "TestResult"):
            properties = [(_word(p, "propertyClass"), _word(p, "uom")) for p in _all(result, "Property")]
            columns = [PROPERTIES.get(name.lower(), "") for name, _ in properties]
            if {"inclination", "azimuth"} <= set(columns):
                units = [unit for _, unit in properties]
                found.append(_table(path, result, columns, units, _name(test, names) or str(number)))
    if not found:
        raise SurveyError(f"{path}: DIGGS: expected results with the properties inclination and azimuth along a hole")
    return _told_apart(found)


def _hole_names(root: Element) -> dict[str, str]:
    """Names of what results may refer to, by their keys."""
    return {element.get(KEY, ""): _own_name(element) for element in root.iter() if element.get(KEY)}


def _name(test: Element, names: dict[str, str]) -> str:
    """Name of the hole of a test, else of the test."""
    for reference in _all(test, "samplingFeatureRef"):
        key = reference.get(LINK, "").removeprefix("#")
        return names.get(key) or key
    return _own_name(test)


def _own_name(element: Element) -> str:
    return next((child.text or "" for child in element if str(child.tag).rpartition("}")[2] == "name"), "").strip()


def _told_apart(tables: list[FieldTable]) -> list[FieldTable]:
    """Tables whose names differ: a hole that was surveyed twice has a number after its name."""
    names = [table.name for table in tables]
    if len(set(names)) == len(names):
        return tables
    return [replace(table, name=f"{table.name} ({number})") for number, table in enumerate(tables, 1)]


def _table(path: Path, result: Element, names: list[str], units: list[str], hole: str) -> FieldTable:
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
    return FieldTable("DIGGS, results along a hole", header, cells, list(range(1, len(rows) + 1)), name=hole)


def _all(element: Element, name: str) -> list[Element]:
    return [x for x in element.iter() if str(x.tag).rpartition("}")[2] == name]


def _word(element: Element, name: str) -> str:
    found = _all(element, name)
    return (found[0].text or "").strip() if found else ""
