"""What the keys of the measurements hold: degrees, metres and seconds, the unit in every name.

A hole has ten thousand surveys, and nobody is answered while somebody is shown all of them: their rows are read column
by column, and no survey becomes an object on the way.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Iterator, Sequence

import numpy as np

from groundstation.service.clusters import Table, forces_of
from groundstation.service.model import RigModel
from groundstation.service.streams import span
from groundstation.service.views import Parameters, Range, View, flag_names, streamed
from groundstation.survey.resolve import Quality, angle_stds_of_all, angles
from groundstation.survey.trust import Trust
from telemetry.messages import NodeFlag


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
    plain = (table[name].tolist() for name in PLAIN)
    pointing = [angles(*way) for way in zip(table["lean"], table["down"].tolist(), strict=True)]
    stds = angle_stds_of_all(table["lean"], table["down"].tolist(), surveys.covs(rows))
    forces = [forces_of(surveys.forces[row]) for row in rows]
    return [_row(*one) for one in zip(*plain, stations, pointing, stds, forces, strict=True)]


PLAIN = (
    "number", "md", "tube", "sequence", "at", "hops", "yaw", "yaw_var", "systematic_var", "samples", "settle_time",
    "flags", "trust", "quality",
)  # fmt: skip


def _row(
    number: int, md: float, tube: int, sequence: int, at: float, hops: int, yaw: float, yaw_var: float,
    systematic_var: float, samples: int, settle_time: float, flags: int, trust: int, quality: int, station: int,
    pointing: tuple[float, float], stds: tuple[float, float], forces: list[list[float]],
) -> View:  # fmt: skip
    return {
        "seq": number,
        "station": station,
        "md_m": round(md, 6),
        "tube": tube,
        "sequence": sequence,
        "station_at_s": at,
        "hops": hops,
        "inclination_deg": math.degrees(pointing[0]),
        "azimuth_deg": math.degrees(pointing[1]),
        "sigma_inclination_deg": math.degrees(stds[0]),
        "sigma_azimuth_deg": math.degrees(stds[1]),
        "yaw_deg": math.degrees(yaw),
        "sigma_yaw_deg": math.degrees(math.sqrt(yaw_var)),
        "sigma_systematic_deg": math.degrees(math.sqrt(systematic_var)),
        "forces_mps2": forces,
        "samples": samples,
        "settle_s": settle_time,
        "flags": list(_flag_names(flags)),
        "trust": _trust_name(trust),
        "quality": list(_quality_names(quality)),
    }


@functools.cache
def _flag_names(flags: int) -> tuple[str, ...]:
    return tuple(flag_names(NodeFlag(flags)))


@functools.cache
def _trust_name(trust: int) -> str:
    return Trust(trust).name.lower()


@functools.cache
def _quality_names(quality: int) -> tuple[str, ...]:
    name = Quality(quality).name
    return tuple(name.lower().split("|")) if quality and name else ()
