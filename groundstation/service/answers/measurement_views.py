"""What the keys of the measurements hold: degrees, metres and seconds, the unit in every name.

A hole has ten thousand surveys, and no other query is answered while all are shown: their rows are read column
by column, and no survey becomes an object on the way.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Sequence
from typing import Final

import numpy as np

from groundstation.service.answers.model import RigModel
from groundstation.service.answers.row_texts import Numbers
from groundstation.service.answers.streamed_rows import span
from groundstation.service.answers.views import Parameters, Range, View, flag_names, streamed
from groundstation.service.hole.resolved_stops import NO_NUMBER, Table, forces_of
from groundstation.survey.fusion.resolve import Quality, angle_stds_of_all, direction_angles
from groundstation.survey.fusion.survey_trust import Trust
from telemetry.messages import NodeFlag

DEGREES = 180.0 / math.pi  # in a radian
NO_ROWS: Final = np.empty(0, np.int64)


def measurements(k: RigModel, p: Parameters) -> View:
    """Every cluster; ``station`` and ``tube`` select, ``since`` and ``limit`` give them as they came."""
    rows, stations = _selected(k, p)
    return {
        "newest": k.seen["measurements"],
        "measurements": measurement_rows(k.hole.surveys, rows.tolist(), stations.tolist()),
    }


def measurements_text(k: RigModel, p: Parameters) -> bytes:
    """JSON of ``measurements``. A row shows something else once it is revised, or a station comes above its own."""
    surveys = k.hole.surveys
    rows, stations = _selected(k, p)

    def render(places: Numbers) -> list[View]:
        return measurement_rows(surveys, rows[places].tolist(), stations[places].tolist())

    texts = k.measurement_texts.texts_of(rows, np.stack([surveys.column("number")[rows], stations], axis=1), render)
    return b'{"newest":%d,"measurements":[%b]}' % (k.seen["measurements"], b",".join(texts))


def _selected(k: RigModel, p: Parameters) -> tuple[Numbers, Numbers]:
    """Rows (n,) of the table that the parameters select, and the numbers of their stations."""
    since, limit = span(k.seen["measurements"], p) if streamed(p) else (0, None)
    by_station = Range.parse("station", p["station"]) if "station" in p else None
    by_tube = Range.parse("tube", p["tube"]) if "tube" in p else None
    chosen = [(n, one) for n, one in enumerate(k.stations, 1) if by_station is None or by_station.holds(n)]
    rows = np.concatenate([NO_ROWS, *(one.clusters.table_rows for _, one in chosen)])
    stations = np.repeat([n for n, _ in chosen], [one.count for _, one in chosen]).astype(np.int64)
    table = k.hole.surveys
    keeps = table.column("number")[rows] > since
    if by_tube is not None:
        keeps &= np.fromiter(map(by_tube.holds, table.column("tube")[rows].tolist()), np.bool_, len(rows))
    rows, stations = rows[keeps], stations[keeps]
    if streamed(p):
        order = np.argsort(table.column("number")[rows], kind="stable")[:limit]
        rows, stations = rows[order], stations[order]
    return rows, stations


def station_measurements(k: RigModel, n: int) -> View:
    """Every cluster of one station."""
    rows = k.stations[n - 1].clusters.table_rows.tolist()
    return {"station": n, "measurements": measurement_rows(k.hole.surveys, rows, [n] * len(rows))}


def measurement_rows(surveys: Table, rows: Sequence[int], stations: Sequence[int]) -> list[View]:
    """Surveys in some rows of the table, each resolved and with the number of its station."""
    if not rows:
        return []
    table = surveys.rows[rows]
    downs = table["down"].tolist()
    pointing = np.array([direction_angles(*way) for way in zip(table["lean"], downs, strict=True)])
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
