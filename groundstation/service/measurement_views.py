"""What the keys of the measurements hold: degrees, metres and seconds, the unit in every name.

A hole has ten thousand surveys, and nobody is answered while somebody is shown all of them: their rows are read column
by column, and no survey becomes an object on the way.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.service.clusters import NO_NUMBER, Table, forces_of
from groundstation.service.model import RigModel
from groundstation.service.streams import span
from groundstation.service.views import Parameters, Range, View, flag_names, streamed
from groundstation.survey.resolve import Quality, angle_stds_of_all, angles
from groundstation.survey.trust import Trust
from telemetry.messages import NodeFlag

DEGREES = 180.0 / math.pi  # in a radian


def measurements(k: RigModel, p: Parameters) -> View:
    """Every cluster; ``station`` and ``tube`` select, ``since`` and ``limit`` give them as they came."""
    newest = k.seen["measurements"]
    since, limit = span(newest, p) if streamed(p) else (0, None)
    found = list(_selected(k, p, since))
    if streamed(p):
        found.sort()
    found = found[:limit]
    rows = [k.stations[n - 1].clusters.row(place) for _, n, place in found]
    return {"newest": newest, "measurements": measurement_rows(k.hole.surveys, rows, [n for _, n, _ in found])}


def _selected(k: RigModel, p: Parameters, since: int) -> Iterator[tuple[int, int, int]]:
    """Number, station and place of the clusters after the number ``since`` that the parameters select."""
    by_station = Range.parse("station", p["station"]) if "station" in p else None
    by_tube = Range.parse("tube", p["tube"]) if "tube" in p else None
    for n, s in enumerate(k.stations, 1):
        if by_station is None or by_station.holds(n):
            numbers, tubes = s.clusters.column("number"), s.clusters.column("tube")
            for place in np.flatnonzero(numbers > since).tolist():
                if by_tube is None or by_tube.holds(int(tubes[place])):
                    yield int(numbers[place]), n, place


def station_measurements(k: RigModel, n: int) -> View:
    """Every cluster of one station."""
    clusters = k.stations[n - 1].clusters
    rows = [clusters.row(place) for place in range(len(clusters))]
    return {"station": n, "measurements": measurement_rows(k.hole.surveys, rows, [n] * len(rows))}


def measurement_rows(surveys: Table, rows: Sequence[int], stations: Sequence[int]) -> list[View]:
    """Surveys in some rows of the table, each resolved and with the number of its station."""
    if not rows:
        return []
    table = surveys.rows[rows]
    downs = table["down"].tolist()
    pointing = np.array([angles(*way) for way in zip(table["lean"], downs, strict=True)])
    stds = np.array(angle_stds_of_all(table["lean"], downs, surveys.covs(rows)))
    columns = {
        "seq": table["number"],
        "station": np.array(stations),
        "md_m": [round(md, 6) for md in table["md"].tolist()],
        "tube": table["tube"],
        "sequence": table["sequence"],
        "replaces": [None if number == NO_NUMBER else number for number in table["replaces"].tolist()],
        "station_at_s": table["at"],
        "hops": table["hops"],
        "inclination_deg": DEGREES * pointing[:, 0],
        "azimuth_deg": DEGREES * pointing[:, 1],
        "sigma_inclination_deg": DEGREES * stds[:, 0],
        "sigma_azimuth_deg": DEGREES * stds[:, 1],
        "yaw_deg": DEGREES * table["yaw"],
        "sigma_yaw_deg": DEGREES * np.sqrt(table["yaw_var"]),
        "sigma_systematic_deg": DEGREES * np.sqrt(table["systematic_var"]),
        "forces_mps2": [forces_of(surveys.forces[row]) for row in rows],
        "samples": table["samples"],
        "settle_s": table["settle_time"],
        "flags": [_flag_names(flags) for flags in table["flags"].tolist()],
        "trust": [_trust_name(trust) for trust in table["trust"].tolist()],
        "quality": [_quality_names(quality) for quality in table["quality"].tolist()],
    }
    values = (column.tolist() if isinstance(column, np.ndarray) else column for column in columns.values())
    return [dict(zip(columns, row, strict=True)) for row in zip(*values, strict=True)]


@functools.cache
def _flag_names(flags: int) -> list[str]:
    return flag_names(NodeFlag(flags))


@functools.cache
def _trust_name(trust: int) -> str:
    return Trust(trust).name.lower()


@functools.cache
def _quality_names(quality: int) -> list[str]:
    name = Quality(quality).name
    return name.lower().split("|") if quality and name else []
