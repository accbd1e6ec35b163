"""The joints of the hole that is being drilled with its neighbours, judged as the whole wall is judged.

The neighbours stand in a wall file with their surveys; the hole of this ground station is taken from its stations, with
their own covariances, and from the depth of the bit. What is not drilled yet is missing, so a joint closes from the top
down. What is judged is the part of the wall around the hole, in the planes of the whole wall and by the same function:
the file with these stations in it gives the same.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import TOE
from groundstation.survey.wall.column_plans import ColumnPlan, ColumnStatus, ColumnSurvey
from groundstation.survey.wall.judged_wall import judge_wall, part_around
from groundstation.survey.wall.wall_columns import build_wall
from groundstation.survey.wall.wall_file import Wall, read_wall
from groundstation.survey.wall.wall_plausibility import wall_warnings
from groundstation.survey.wall.wall_verdict import Judgement

NO_SURVEY = ColumnSurvey(*np.zeros((3, 0)))


@dataclass(frozen=True, slots=True)
class Neighbourhood:
    """The hole and its neighbours as judged: the wall they are, which of its columns is the hole, and what was found.

    Or why they cannot be judged.
    """

    wall: Wall
    own: int
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
        self._wall, self._own = part_around(whole, names.index(hole))
        self._known: tuple[bytes, float | None] | None = None
        self._judged = Neighbourhood(self._wall, self._own, None, "nothing has been judged yet")

    def judged(self, survey: ColumnSurvey, bit: float | None) -> Neighbourhood:
        """The joints with this survey of the hole from its collar on and the bit (m) there; anew where one changed.

        The survey counts from the north that the stations of the wall's file count from.
        """
        arrays = (survey.md, survey.inclination, survey.azimuth, *(() if survey.covs is None else (survey.covs,)))
        known = (b"".join(array.tobytes() for array in arrays), bit)
        if known != self._known:
            self._known = known
            self._judged = self._judge(survey, bit or 0.0)
        return self._judged

    def plane_of(self, bit: float | None) -> int:
        """Number that grows where a bit (m) has passed one more plane, and where it has come to the toe."""
        md, design, built = bit or 0.0, self._wall.plans[self._own].design, self._wall.built
        depth = float(design.points_at(np.array([md]))[0] @ built.frame[2])
        return int(np.searchsorted(built.columns.depths, depth + TOE, "right")) + (md >= design.length - TOE)

    def _judge(self, survey: ColumnSurvey, bit: float) -> Neighbourhood:
        file, own = self._wall.file, self._own
        plans, holes = list(self._wall.plans), list(self._wall.holes)
        plans[own] = own_plan(plans[own], survey, bit)
        holes[own] = survey.turned(file.stations_turn) if len(survey.md) > 1 else NO_SURVEY
        try:
            built = build_wall(plans, holes, file.assumed, self._wall.built)
            warnings = wall_warnings(plans, holes, self._wall.pairs)
            wall = replace(self._wall, plans=plans, holes=holes, built=built, warnings=warnings)
            return Neighbourhood(wall, own, judge_wall(wall, own))
        except SurveyError as error:
            return Neighbourhood(self._wall, own, None, str(error))


def own_plan(plan: ColumnPlan, survey: ColumnSurvey, bit: float) -> ColumnPlan:
    """The column as far as it is drilled now."""
    end = max(bit, float(survey.md.max(initial=0.0)))
    if end <= 0.0:
        return replace(plan, status=ColumnStatus.PLANNED, drilled=None)
    return replace(plan, status=ColumnStatus.UNSTATED, drilled=end)
