"""Views of the column that is drilled and of its history: degrees, metres and seconds, the unit in every name."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.errors import SelectorError
from groundstation.service.answers.answer_table import LONGEST_NUMBER
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.answer_fields import filled_answers
from groundstation.service.answers.shapes.column_shapes import (
    ColumnAnswer,
    ColumnDeviation,
    DesignAxis,
    DominantAngle,
    HistoryAnswer,
    HistoryMoment,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.answers.thinning import FEWEST, largest_triangles
from groundstation.service.hole.history import History, Moment
from groundstation.survey.wall.column_deviation import ColumnDesign, Deviation, lateral_errors, used_share

POINTS, MOST_POINTS = 200, 1000  # of the history
SHOWN = 30  # numbers that a refusal names
CM = 100.0
COURSE = 50  # pieces in which a plan is shown


@view_of(ColumnAnswer)
def answer_column(k: RigModel, p: Parameters) -> ColumnAnswer:
    """Deviation from the design axis at every station, projected to the target, and which angle dominates.

    ``moment`` gives what was known at the end of an earlier stop.
    """
    hole = k.hole
    moment = _moment(hole.history, p["moment"]) if "moment" in p else None
    rows = list(hole.deviations) if moment is None else moment.rows
    end = hole.projection if moment is None else moment.projection
    return ColumnAnswer(
        design=design_axis(k.config.design),
        stations=[column_deviation(row) for row in rows],
        worst=column_deviation(max(rows, key=lambda row: row.ratio)),
        projection=None if end is None else column_deviation(end),
        dominant=None if moment is not None else _dominant(k),
    )


def design_axis(design: ColumnDesign) -> DesignAxis:
    """The design of the column."""
    pieces = 1 if design.plan is None else COURSE
    along = np.linspace(0.0, design.length, pieces + 1)
    return DesignAxis(
        inclination_deg=math.degrees(design.inclination),
        azimuth_deg=math.degrees(design.azimuth),
        target_m=design.length,
        radius_m=design.radius,
        tolerance=design.tolerance.name,
        course_m=np.column_stack([along, design.points_at(along)]).round(4).tolist(),
    )


@view_of(HistoryAnswer)
def answer_history(k: RigModel, p: Parameters) -> HistoryAnswer:
    """What was known at the end of every stop, thinned to ``points`` of them."""
    moments = k.hole.history.moments
    points = _points(p.get("points"))
    if len(moments) > points:
        used = np.array([moment.about.ratio for moment in moments])
        moments = [moments[place] for place in largest_triangles(np.arange(len(used), dtype=float), used, points)]
    return HistoryAnswer(filled_answers(HistoryMoment, map(moment_values, moments)))


def moment_values(moment: Moment) -> dict[str, Any]:
    """One moment of the history."""
    about = moment.about
    size = about.size
    return {
        "moment": moment.number,
        "at_s": moment.at,
        "md_m": round(moment.deepest, 6),
        "deviation_cm": CM * size,
        "limit_cm": CM * about.limit,
        "used_percent": 100.0 * used_share(size, about.limit),
    }


def _moment(history: History, text: str) -> Moment:
    found = history.find(int(text)) if text.isdecimal() and len(text) <= LONGEST_NUMBER else None
    if found is None:
        there_are = ", ".join(str(moment.number) for moment in history.moments[-SHOWN:]) or "none yet"
        raise SelectorError(f"parameter moment: expected one of the history, got {text!r:.40}; there are {there_are}")
    return found


def _points(text: str | None) -> int:
    if text is None:
        return POINTS
    if not text.isdecimal() or len(text) > LONGEST_NUMBER or not FEWEST <= int(text) <= MOST_POINTS:
        raise SelectorError(f"parameter points: expected a whole number {FEWEST}..{MOST_POINTS}, got {text!r:.40}")
    return int(text)


def _dominant(k: RigModel) -> DominantAngle | None:
    leaning = [station for station in k.hole.stations if station.md > 0.0]
    if not leaning:
        return None
    found = lateral_errors(k.hole.direction_of(leaning[-1]), k.hole.trajectory[-1].md)
    return DominantAngle(found.name, found.by_inclination, found.by_azimuth)


def column_deviation(d: Deviation) -> ColumnDeviation:
    """One deviation."""
    size, (north, east) = d.size, d.offset.tolist()
    return ColumnDeviation(
        md_m=round(d.md, 6),
        along_m=d.along,
        north_cm=CM * north,
        east_cm=CM * east,
        deviation_cm=CM * size,
        sigma_cm=CM * d.std,
        deviation_percent=100.0 * size / d.along if d.along > 0.0 else 0.0,
        direction_deg=math.degrees(math.atan2(east, north)) % 360.0,
        limit_cm=CM * d.limit,
        used_percent=100.0 * used_share(size, d.limit),
        level_percent=round(100.0 * d.level),
    )
