"""The joints of the hole that is being drilled with its neighbours, judged as the whole wall is judged.

The neighbours stand in a wall file with their surveys; the hole of this ground station is taken from its stations and
from the depth of the bit. What is not drilled yet is missing, so a joint closes from the top down.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.wall.wall_columns import ColumnPlan, ColumnStatus, ColumnSurvey, build_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_verdict import Judgement, judge_columns

Station = tuple[float, float, float]  # measured depth (m), inclination, azimuth (rad)


@dataclass(frozen=True, slots=True)
class Neighbourhood:
    """The hole and its neighbours as judged: the wall they are, and what was found; or why they cannot be judged."""

    wall: Wall
    judgement: Judgement | None
    problem: str = ""


class LiveWall:
    """A wall of which one hole is being drilled.

    Parameters
    ----------
    path : wall file
    hole : name of the column that is drilled

    Attributes
    ----------
    inputs : name and SHA-256 of each file of the wall, as they were read

    Raises
    ------
    SurveyError
        When the wall cannot be read, or has no such column.
    """

    def __init__(self, path: Path, hole: str) -> None:
        whole = read_wall(path)
        names = [plan.design.name for plan in whole.plans]
        if hole not in names:
            raise SurveyError(f"{path}: column {hole!r:.40} is not among the heads; expected one of {', '.join(names)}")
        self.hole = hole
        self.inputs = whole.file.digests()
        own = names.index(hole)
        around = sorted({int(k) for pair in whole.pairs for k in pair if own in pair} - {own})
        if not around:
            raise SurveyError(f"{path}: column {hole} has no neighbour")
        self._members = [own, *around]
        pairs = np.array([[0, n] for n in range(1, len(self._members))], np.intp)
        self._wall = replace(
            whole,
            plans=[whole.plans[k] for k in self._members],
            holes=[whole.holes[k] for k in self._members],
            drilled_on=[whole.drilled_on[k] for k in self._members],
            pairs=pairs,
            detours=[],
        )
        self._known: tuple[tuple[Station, ...], int] | None = None
        self._judged = Neighbourhood(self._wall, None, "nothing has been judged yet")

    def judged(self, stations: Sequence[Station], bit: float | None) -> Neighbourhood:
        """The joints with these stations and the bit (m) there; judged anew where one of them has changed."""
        known = (tuple(stations), self.plane_of(bit))
        if known != self._known:
            self._known = known
            self._judged = self._judge(stations, bit or 0.0)
        return self._judged

    def plane_of(self, bit: float | None) -> int:
        """Number of the plane that a bit (m) has passed last."""
        return int((bit or 0.0) / self._wall.file.assumed.step)

    def _judge(self, stations: Sequence[Station], bit: float) -> Neighbourhood:
        file = self._wall.file
        plans = [own_plan(self._wall.plans[0], stations, bit), *self._wall.plans[1:]]
        holes = [hole_of(stations), *self._wall.holes[1:]]
        try:
            built = build_wall(plans, holes, file.assumed)
            wall = replace(self._wall, plans=plans, holes=holes, built=built)
            found = judge_columns(built.columns, wall.pairs, file.thickness, allowed=file.allowed)
        except SurveyError as error:
            return Neighbourhood(self._wall, None, str(error))
        return Neighbourhood(wall, found)


def own_plan(plan: ColumnPlan, stations: Sequence[Station], bit: float) -> ColumnPlan:
    """The column as far as it is drilled now."""
    end = max([bit, *(md for md, _, _ in stations)])
    if end <= 0.0:
        return replace(plan, status=ColumnStatus.PLANNED, drilled=None)
    return replace(plan, status=ColumnStatus.UNSTATED, drilled=end)


def hole_of(stations: Sequence[Station]) -> ColumnSurvey:
    """Stations below the head, which is vertical as the ground station's trajectory begins."""
    rows = np.array([(0.0, 0.0, 0.0), *(row for row in stations if row[0] > 0.0)])
    return ColumnSurvey(*rows.T) if len(rows) > 1 else ColumnSurvey(*np.zeros((3, 0)))
