"""A wall judged by what its file requires, whole or the part that one of its columns has to do with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.wall.wall_file import Wall
from groundstation.survey.wall.wall_joints import Detour
from groundstation.survey.wall.wall_plausibility import touching_findings
from groundstation.survey.wall.wall_verdict import DIAGONAL, Judgement, judge_columns


def judge_wall(wall: Wall, about: int | None = None) -> Judgement:
    """Judge a wall by what its file requires; of a grid only voids beside the column ``about``, if one is given."""
    return judge_columns(
        wall.columns,
        wall.pairs,
        wall.file.thickness,
        allowed=wall.file.allowed,
        grid_spacing=wall.grid_spacing,
        detours=wall.detours,
        asked=wall.asked,
        about=about,
        doubts=touching_findings(wall),
    )


def part_around(wall: Wall, own: int) -> tuple[Wall, int]:
    """The part of a wall that one column has to do with, in the planes of the whole, and its place there.

    That are the joints of the column with their ways by remedial columns, and of a grid all columns that may stand
    about a void beside it.

    Raises
    ------
    SurveyError
        When the column has no joint.
    """
    used = {detour.joint for detour in wall.detours if own in detour.pairs}
    joints = [j for j, pair in enumerate(wall.pairs.tolist()) if own in pair or j in used]
    if not joints:
        raise SurveyError(f"{wall.file.path}: column {wall.plans[own].design.name} has no neighbour")
    detours = [detour for detour in wall.detours if detour.joint in joints]
    members = {own, *wall.pairs[joints].ravel().tolist()}
    members |= {int(k) for detour in detours for k in detour.pairs.ravel()}
    if wall.grid_spacing is not None:
        away = np.linalg.norm(wall.columns.designs - wall.columns.designs[own], axis=1)
        members |= set(np.flatnonzero(away <= 2.0 * DIAGONAL * wall.grid_spacing).tolist())
    kept = sorted(members)
    new = {k: place for place, k in enumerate(kept)}
    part = replace(
        wall,
        plans=[wall.plans[k] for k in kept],
        holes=[wall.holes[k] for k in kept],
        drilled_on=[wall.drilled_on[k] for k in kept],
        warnings=(),  # those of the part are found where it is judged
        pairs=_renumbered(wall.pairs[joints], new),
        detours=[Detour(joints.index(detour.joint), _renumbered(detour.pairs, new)) for detour in detours],
    )
    return part, new[own]


def _renumbered(pairs: npt.NDArray[np.intp], new: dict[int, int]) -> npt.NDArray[np.intp]:
    return np.array([[new[k] for k in pair] for pair in pairs.tolist()], np.intp).reshape(-1, 2)
