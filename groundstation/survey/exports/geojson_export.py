"""GeoJSON: every hole as a line of longitude, latitude and height, with its verdict. Source: RFC 7946."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.exports.export_hole import Array, ExportHole, ExportSite

TIMES = 4  # each leaves a ten millionth of the difference


def geojson_bytes(site: ExportSite) -> bytes:
    """Features of all holes.

    Raises
    ------
    SurveyError
        When the coordinates are of no national grid, or none that is known, or lie outside it: the format has
        longitudes and latitudes alone.
    """
    if not site.crs:
        raise SurveyError("geojson: expected --grid-crs and --origin; the format has longitudes and latitudes alone")
    from pyproj import Transformer  # an extra
    from pyproj.exceptions import CRSError

    try:
        ways = (
            Transformer.from_crs(site.crs, "EPSG:4326", always_xy=True),
            Transformer.from_crs("EPSG:4326", site.crs, always_xy=True),
        )
    except CRSError:
        raise SurveyError(f"--grid-crs: expected a grid such as EPSG:25833, got {site.crs!r:.60}") from None
    features = [_feature(hole, *ways) for hole in site.holes]
    collection = {"type": "FeatureCollection", "features": features}
    return (json.dumps(collection, allow_nan=False) + "\n").encode()


def _to_degrees(places: Array, there: Any, back: Any) -> Array:
    """Longitudes and latitudes (2, n), deg, that are read back as eastings and northings (2, n), m.

    Where a datum is shifted by seven parameters, the way there and the way back differ by a millimetre: PROJ turns by
    small angles. So what is missing on the way back is added before the way there.
    """
    aim, found = places, places
    for _ in range(TIMES):
        found = np.array(there.transform(*aim))
        aim = aim + places - np.array(back.transform(*found))
    return found


def _feature(hole: ExportHole, there: Any, back: Any) -> dict[str, Any]:
    longitude, latitude = _to_degrees(hole.axis[:, :2].T, there, back)
    if not (np.isfinite(longitude).all() and np.isfinite(latitude).all()):
        east, north, _ = hole.axis[0].tolist()
        raise SurveyError(f"{hole.name}: easting {east:g} m and northing {north:g} m lie outside the grid")
    places = [
        list(place) for place in zip(longitude.tolist(), latitude.tolist(), hole.axis[:, 2].tolist(), strict=True)
    ]
    toe = hole.axis[-1].tolist()
    properties = {
        "name": hole.name, "verdict": hole.verdict or None, "radius_m": hole.radius, "length_m": float(hole.md[-1]),
        "toe_easting_m": toe[0], "toe_northing_m": toe[1], "toe_height_m": toe[2],
    }  # fmt: skip
    return {"type": "Feature", "geometry": {"type": "LineString", "coordinates": places}, "properties": properties}
