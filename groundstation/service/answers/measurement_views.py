"""Views of the measurements: degrees, metres and seconds, the unit in every name.

A hole has ten thousand surveys, and no other question is answered while all of them are shown: their rows are read
column by column, and no survey becomes an object on the way.
"""

from __future__ import annotations

import functools
import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from groundstation.service.answers.answer_texts import text_with_rows
from groundstation.service.answers.answer_views import member_view_of, view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.row_texts import Numbers
from groundstation.service.answers.selector_range import SelectorRange
from groundstation.service.answers.shapes.answer_fields import filled_columns
from groundstation.service.answers.shapes.hole_shapes import (
    MeasurementRow,
    MeasurementsAnswer,
    StationMeasurementsAnswer,
)
from groundstation.service.answers.streamed_rows import Parameters, is_streamed, window_limits
from groundstation.service.answers.string_views import flag_names
from groundstation.service.hole.resolved_stops import NO_NUMBER, ResolvedStops, forces_of
from groundstation.survey.fusion.resolve import Quality, angle_stds_of_all, direction_angles
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import NodeFlag

DEGREES = 180.0 / math.pi  # in a radian


def answer_measurements_text(k: RigModel, p: Parameters) -> bytes:
    """JSON of ``answer_measurements``.

    A row shows something else once it is revised, or a station comes above its own.
    """
    surveys, newest = k.hole.stops, k.hole.newest
    rows, stations = _selected(k, p)

    def render(places: Numbers) -> list[MeasurementRow]:
        return measurement_rows(surveys, rows[places].tolist(), stations[places].tolist())

    texts = k.texts.measurements.texts_of(rows, np.stack([surveys.column("number")[rows], stations], axis=1), render)
    return text_with_rows(MeasurementsAnswer(newest, []), texts)


@view_of(MeasurementsAnswer, answer_measurements_text)
def answer_measurements(k: RigModel, p: Parameters) -> MeasurementsAnswer:
    """Every cluster; ``station`` and ``tube`` select, ``since`` and ``limit`` give them as they came."""
    surveys, newest = k.hole.stops, k.hole.newest
    rows, stations = _selected(k, p)
    return MeasurementsAnswer(newest, measurement_rows(surveys, rows.tolist(), stations.tolist()))


@member_view_of(StationMeasurementsAnswer, lambda k: range(1, len(k.hole.stations) + 1))
def answer_station_measurements(k: RigModel, n: int) -> StationMeasurementsAnswer:
    """Every cluster of one station."""
    surveys, rows = k.hole.stops, k.hole.stations[n - 1].stops.rows.tolist()
    return StationMeasurementsAnswer(n, measurement_rows(surveys, rows, [n] * len(rows)))


def _selected(k: RigModel, p: Parameters) -> tuple[Numbers, Numbers]:
    """Rows (n,) of the table that the parameters select, and the numbers of their stations."""
    known, table, newest = k.hole.stations, k.hole.stops, k.hole.newest
    since, limit = window_limits(newest, p) if is_streamed(p) else (0, None)
    chosen: Sequence[int] = range(1, len(known) + 1)
    if "station" in p:
        by_station = SelectorRange.parse("station", p["station"])
        chosen = [n for n in chosen if by_station.holds(n)]
    own = [known[n - 1].stops.rows for n in chosen]
    rows = np.fromiter(itertools.chain.from_iterable(own), np.int64)
    stations = np.repeat(np.array(chosen, np.int64), [len(one) for one in own])
    keeps = table.column("number")[rows] > since
    if "tube" in p:
        by_tube = SelectorRange.parse("tube", p["tube"])
        keeps &= np.fromiter(map(by_tube.holds, table.column("tube")[rows].tolist()), np.bool_, len(rows))
    rows, stations = rows[keeps], stations[keeps]
    if is_streamed(p):
        order = np.argsort(table.column("number")[rows], kind="stable")[:limit]
        rows, stations = rows[order], stations[order]
    return rows, stations


def measurement_rows(surveys: ResolvedStops, rows: Sequence[int], stations: Sequence[int]) -> list[MeasurementRow]:
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
    return filled_columns(MeasurementRow, {name: plain_column(column) for name, column in columns.items()})


def plain_column(column: Any) -> list[Any]:
    """Values of a column as Python's own."""
    return list(column.tolist() if isinstance(column, np.ndarray) else column)


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
