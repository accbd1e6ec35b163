"""GeoJSON: every hole as a line of longitude, latitude and height, with its verdict. Source: RFC 7946."""

from __future__ import annotations

import json
from typing import Any

from groundstation.errors import SurveyError
from groundstation.survey.exports.export_hole import ExportHole, ExportSite


def geojson_bytes(site: ExportSite) -> bytes:
    """Features of all holes.

    Raises
    ------
    SurveyError
        When the coordinates are of no national grid: the format has longitudes and latitudes alone.
    """
    if not site.crs:
        raise SurveyError("geojson: expected --grid-crs and --origin; the format has longitudes and latitudes alone")
    from pyproj import Transformer  # an extra

    to_degrees = Transformer.from_crs(site.crs, "EPSG:4326", always_xy=True)
    features = [_feature(hole, to_degrees) for hole in site.holes]
    collection = {"type": "FeatureCollection", "features": features}
    return (json.dumps(collection, allow_nan=False) + "\n").encode()


def _feature(hole: ExportHole, to_degrees: Any) -> dict[str, Any]:
    longitude, latitude = to_degrees.transform(hole.axis[:, 0], hole.axis[:, 1])
    places = [
        list(place) for place in zip(longitude.tolist(), latitude.tolist(), hole.axis[:, 2].tolist(), strict=True)
    ]
    toe = hole.axis[-1].tolist()
    properties = {
        "name": hole.name, "verdict": hole.verdict or None, "radius_m": hole.radius, "length_m": float(hole.md[-1]),
        "toe_easting_m": toe[0], "toe_northing_m": toe[1], "toe_height_m": toe[2],
    }  # fmt: skip
    return {"type": "Feature", "geometry": {"type": "LineString", "coordinates": places}, "properties": properties}
