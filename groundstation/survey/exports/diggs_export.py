"""DIGGS 3.0: every hole as a borehole whose centre line is its axis as built, its toe's deviation in words."""

from __future__ import annotations

import re
from xml.etree.ElementTree import Element, SubElement, register_namespace, tostring

from groundstation.survey.exports.export_hole import ExportHole, ExportSite

D = "{http://diggsml.org/schemas/3}"
GML = "{http://www.opengis.net/gml/3.2}"
LINK = "{http://www.w3.org/1999/xlink}"
LOCAL = "urn:borechain:local"  # coordinates of the site alone


def diggs_bytes(site: ExportSite) -> bytes:
    """Document of all holes; coordinates easting, northing, height."""
    for prefix, space in (("", D), ("gml", GML), ("xlink", LINK)):
        register_namespace(prefix, space[1:-1])
    root = Element(f"{D}Diggs", {f"{GML}id": "document"})
    about = SubElement(SubElement(root, f"{D}documentInformation"), f"{D}DocumentInformation", {f"{GML}id": "about"})
    SubElement(about, f"{D}creationDate").text = site.day
    project = SubElement(SubElement(root, f"{D}project"), f"{D}Project", {f"{GML}id": "project"})
    SubElement(project, f"{GML}name").text = site.project or site.name
    name = f"http://www.opengis.net/def/crs/EPSG/0/{site.crs.rpartition(':')[2]}" if site.crs else LOCAL
    for number, hole in enumerate(site.holes, 1):
        _borehole(root, hole, f"hole-{number}", name)
    return b'<?xml version="1.0" encoding="UTF-8"?>\n' + bytes(tostring(root, encoding="utf-8")) + b"\n"


def _borehole(root: Element, hole: ExportHole, key: str, crs: str) -> None:
    part = SubElement(SubElement(root, f"{D}samplingFeature"), f"{D}Borehole", {f"{GML}id": key})
    SubElement(part, f"{GML}description").text = _words(hole)
    SubElement(part, f"{GML}name").text = hole.name
    SubElement(part, f"{D}investigationTarget").text = "Natural Ground"
    SubElement(part, f"{D}projectRef", {f"{LINK}href": "#project"})
    space = {"srsName": crs, "srsDimension": "3"}
    point = SubElement(
        SubElement(part, f"{D}referencePoint"), f"{D}PointLocation", {f"{GML}id": f"{key}-head", **space}
    )
    SubElement(point, f"{GML}pos").text = _numbers(hole.axis[:1].ravel().tolist())
    line = SubElement(SubElement(part, f"{D}centerLine"), f"{D}LinearExtent", {f"{GML}id": f"{key}-axis", **space})
    SubElement(line, f"{GML}posList").text = _numbers(hole.axis.ravel().tolist())
    SubElement(part, f"{D}totalMeasuredDepth", {"uom": "m"}).text = repr(float(hole.md[-1]))


def _words(hole: ExportHole) -> str:
    parts = [f"verdict: {hole.verdict}"] if hole.verdict else []
    if hole.radius is not None:
        parts.append(f"radius {hole.radius:g} m")
    if hole.deviation is not None:
        north, east = hole.deviation.tolist()
        parts.append(f"tipDeviationNorth {north:.4f} m, tipDeviationEast {east:.4f} m")
    return re.sub(r"\s+", " ", "; ".join(parts) or "as built")


def _numbers(values: list[float]) -> str:
    return " ".join(repr(float(value)) for value in values)
