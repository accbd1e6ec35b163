"""XML of the industry: WITSML trajectories 1.4.1.1 and 2.1, and DIGGS soundings; entities are refused.

Source: Energistics WITSML; DIGGS 2.6 and 3.0.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

from groundstation.errors import SurveyError
from groundstation.survey.files.field_table import FieldTable

SERIES_1 = "http://www.witsml.org/schemas/1series"
SERIES_2 = "http://www.energistics.org/energyml/data/witsmlv2"
DIGGS = ("http://diggsml.org/schemas/2.6", "http://diggsml.org/schemas/3", "http://diggsml.org/schema-dev")
HEADER = ("hole", "md", "incl", "azi")
NORTHS = {"true north": "true", "grid north": "grid", "magnetic north": "magnetic"}


def read_xml(path: Path, content: bytes) -> list[FieldTable]:
    """Table of trajectories, or tables of all results of a document of DIGGS.

    Raises
    ------
    SurveyError
        When the text is not XML, has entities, or is of a format or version that is not known.
    """
    root = parse_xml(path, content)
    space, name = _parts(root)
    if space == SERIES_1 and name == "trajectorys":
        holes = [x for x in root if _parts(x)[1] == "trajectory"]
        return [_witsml(path, holes, "1.4.1.1", root.get("version", ""))]
    if space == SERIES_2 and name == "Trajectory":
        return [_witsml(path, [root], "2.1", root.get("schemaVersion", ""))]
    if space.startswith(DIGGS):
        from groundstation.survey.files.diggs_files import read_diggs

        return read_diggs(path, root)
    raise SurveyError(
        f"{path}: {name} of {space or 'no namespace'}: "
        "expected a WITSML trajectory, 1.4.1.1 or 2.1, or DIGGS 2.6 or 3.0"
    )


def parse_xml(path: Path, content: bytes) -> Element:
    """Root of a document without entities or a document type.

    Raises
    ------
    SurveyError
        When it is not XML, or has them.
    """
    from defusedxml.common import DefusedXmlException  # an extra
    from defusedxml.ElementTree import fromstring

    try:
        root: Element = fromstring(content, forbid_dtd=True)
    except ParseError as error:
        raise SurveyError(f"{path}: not XML: {error}") from None
    except DefusedXmlException as error:
        raise SurveyError(f"{path}: expected XML without a document type or entities, got {error}") from None
    except (ValueError, LookupError) as error:
        raise SurveyError(f"{path}: not XML: {error}") from None
    return root


def _witsml(path: Path, holes: list[Element], known: str, version: str) -> FieldTable:
    if version != known:
        raise SurveyError(f"{path}: WITSML {version or 'without a version'}: expected version {known}")
    rows: list[list[str]] = []
    units: dict[str, str] = {}
    norths = set()
    names = _names(holes)
    for hole, named in zip(holes, names, strict=True):
        norths.add(NORTHS.get(_text(hole, "aziref"), ""))
        for station in (x for x in hole if _parts(x)[1].lower() == "trajectorystation"):
            rows.append([named, *(_measure(path, station, quantity, units) for quantity in HEADER[1:])])
    header = ["hole", *(f"{name} ({units[name]})" if units.get(name) else name for name in HEADER[1:])]
    if len(norths) > 1:
        raise SurveyError(f"{path}: its trajectories count from several norths; expected one")
    north = "".join(norths)
    said = {"north": north} if north else {}
    lines = list(range(1, len(rows) + 1))
    return FieldTable(f"WITSML {known}, stations in order", header, rows, lines, said=said)


def _names(holes: list[Element]) -> list[str]:
    """Names of trajectories, that of the hole where each has one of its own: two of one hole are two surveys of it."""
    wells = [hole.get("nameWellbore") or _text(hole, "nameWellbore") for hole in holes]
    own = [_text(hole, "name") or hole.get("uid", "") for hole in holes]
    if len(holes) == 1:
        title = next((_text(part, "Title") for part in holes[0] if _parts(part)[1] == "Citation"), "")
        return [wells[0] or title or own[0]]
    return [
        well if well and wells.count(well) == 1 else " / ".join(filter(None, (well, name))) or str(number)
        for number, (well, name) in enumerate(zip(wells, own, strict=True), 1)
    ]


def _measure(path: Path, station: Element, quantity: str, units: dict[str, str]) -> str:
    """Text of a measure; its unit is to be that of all stations before."""
    found = _child(station, quantity)
    if found is not None and len(found):  # version 2 has depths inside
        found = _child(found, "MeasuredDepth")
    if found is None or not (found.text or "").strip():
        return ""
    unit = found.get("uom", "")
    if units.setdefault(quantity, unit) != unit:
        raise SurveyError(f"{path}: {quantity} in {units[quantity]} and in {unit}; expected one unit")
    return (found.text or "").strip()


def _parts(element: Element) -> tuple[str, str]:
    space, _, name = str(element.tag).rpartition("}")
    return space.lstrip("{"), name


def _child(element: Element, name: str) -> Any:
    return next((x for x in element if _parts(x)[1].lower() == name.lower()), None)


def _text(element: Element, name: str) -> str:
    found = _child(element, name)
    return "" if found is None else (found.text or "").strip()
