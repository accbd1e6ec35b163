"""WITSML 2.1: a trajectory with the covariance of every station. Source: Energistics WITSML 2.1, Trajectory."""

from __future__ import annotations

import uuid
from xml.etree.ElementTree import Element, SubElement, register_namespace, tostring

from groundstation.errors import SurveyError
from groundstation.survey.exports.export_hole import ExportHole, ExportSite

W = "{http://www.energistics.org/energyml/data/witsmlv2}"
E = "{http://www.energistics.org/energyml/data/commonv2}"
NORTHS = {"true": "true north", "grid": "grid north", "magnetic": "magnetic north"}
VARIANCES = (
    ("VarianceNN", 0, 0), ("VarianceNE", 0, 1), ("VarianceNVert", 0, 2), ("VarianceEE", 1, 1), ("VarianceEVert", 1, 2),
    ("VarianceVertVert", 2, 2),
)  # fmt: skip
TITLE, DESCRIPTION = 256, 2000  # letters, the longest that the schema allows
MORE = " ... (more warnings in borechain survey)"
OWN = uuid.UUID("6f0f2f43-3d57-5f5e-9d0e-6a2f5d3a8c11")  # of names of ours


def witsml_bytes(site: ExportSite) -> bytes:
    """Trajectory of a hole.

    Raises
    ------
    SurveyError
        When there are several: a document has one.
    """
    if len(site.holes) != 1:
        raise SurveyError(f"witsml: expected one hole, got {len(site.holes)}; name it by --hole")
    register_namespace("witsml", W[1:-1])
    register_namespace("eml", E[1:-1])
    (hole,) = site.holes
    time = f"{site.day}T00:00:00Z"
    root = Element(f"{W}Trajectory", {"schemaVersion": "2.1", "uuid": _key("trajectory", site, hole.name)})
    citation = SubElement(root, f"{E}Citation")
    for name, text in (("Title", hole.name), ("Originator", "borechain"), ("Creation", time), ("Format", "borechain")):
        SubElement(citation, f"{E}{name}").text = text[:TITLE]
    if site.remarks:
        SubElement(citation, f"{E}Description").text = _short("; ".join(site.remarks))
    SubElement(root, f"{E}ActiveStatus").text = "inactive"
    index = SubElement(root, f"{E}Index")
    SubElement(index, f"{E}IndexKind").text = "measured depth"
    _reference(SubElement(index, f"{E}IndexPropertyKind"), "eml23.PropertyKind", site, "measured depth")
    SubElement(index, f"{E}Uom").text = "m"
    SubElement(index, f"{E}Direction").text = "increasing"
    for k in range(len(hole.md)):  # the order of the schema: stations, their hole, their north
        _station(root, hole, k, time)
    _reference(SubElement(root, f"{W}Wellbore"), "witsml21.Wellbore", site, hole.name)
    if hole.north in NORTHS:
        SubElement(root, f"{W}AziRef").text = NORTHS[hole.north]
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + bytes(tostring(root, encoding="utf-8")) + b"\n"


def _key(kind: str, site: ExportSite, name: str) -> str:
    """Identifier, the same for the same thing of the same site."""
    return str(uuid.uuid5(OWN, "/".join((kind, site.project, site.name, name))))


def _short(text: str) -> str:
    """Text within the length that the schema allows a description; what is left out is said."""
    return text if len(text) <= DESCRIPTION else f"{text[: DESCRIPTION - len(MORE)]}{MORE}"


def _reference(parent: Element, kind: str, site: ExportSite, title: str) -> None:
    SubElement(parent, f"{E}Uuid").text = _key(kind, site, title)
    SubElement(parent, f"{E}QualifiedType").text = kind
    SubElement(parent, f"{E}Title").text = title


def _station(root: Element, hole: ExportHole, k: int, time: str) -> None:
    station = SubElement(root, f"{W}TrajectoryStation", {"uid": f"s{k}"})
    SubElement(station, f"{E}Creation").text = time
    SubElement(station, f"{E}LastUpdate").text = time
    depth = SubElement(station, f"{E}Md")
    SubElement(depth, f"{E}MeasuredDepth", {"uom": "m"}).text = repr(float(hole.md[k]))
    SubElement(station, f"{W}TypeTrajStation").text = "MD INCL and AZI"
    SubElement(station, f"{W}TypeSurveyTool").text = "magnetic MWD" if hole.magnetic else "gyroscopic MWD"
    for name, value, unit in (
        ("Incl", hole.inclination_deg[k], "dega"), ("Azi", hole.azimuth_deg[k], "dega"),
        ("DispNs", hole.local[k, 0], "m"), ("DispEw", hole.local[k, 1], "m"),
    ):  # fmt: skip
        SubElement(station, f"{W}{name}", {"uom": unit}).text = repr(float(value))
    if hole.covs is None:
        return
    matrix = SubElement(station, f"{W}MatrixCov")
    for name, a, b in VARIANCES:
        SubElement(matrix, f"{W}{name}", {"uom": "m2"}).text = repr(float(hole.covs[k, a, b]))
    for name in ("BiasN", "BiasE", "BiasVert"):
        SubElement(matrix, f"{W}{name}", {"uom": "m"}).text = "0.0"
    SubElement(matrix, f"{W}Sigma").text = "1.0"
