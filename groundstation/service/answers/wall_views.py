"""View of the wall: the hole that is drilled, its neighbours, and the joints between them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.service.answers.answer_texts import finite_or_none
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.wall_shapes import (
    ClosingColumn,
    WallAnswer,
    WallHole,
    WallJoint,
    WallNeighbourhood,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.hole.live_wall import LiveWall, Neighbourhood
from groundstation.survey.fusion.resolve import direction_angles
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_columns import ColumnSurvey
from groundstation.survey.wall.wall_joints import worst_depths
from groundstation.survey.wall.wall_verdict import Judgement, joint_name


@view_of(WallAnswer)
def answer_wall(k: RigModel, _p: Parameters) -> WallAnswer:
    """The joints of now; without a wall file nothing but that."""
    live = k.wall
    if live is None:
        return WallAnswer(None)
    return WallAnswer(wall_neighbourhood(live, live.judged(survey_of(k), k.string.bit)))


def survey_of(k: RigModel) -> ColumnSurvey:
    """The hole as surveyed, from its collar down, with the covariances of its own positions."""
    drawn = k.hole.trajectory
    angles = [direction_angles(tangent[:2], float(tangent[2])) for tangent in drawn.tangents]
    inclination, azimuth = np.array(angles).T
    return ColumnSurvey(drawn.md.copy(), inclination, azimuth, covs=drawn.covs.copy())


def wall_neighbourhood(live: LiveWall, found: Neighbourhood) -> WallNeighbourhood:
    """Holes, joints and what is proposed."""
    file, judged = found.wall.file, found.judgement
    return WallNeighbourhood(
        name=file.name,
        hole=live.hole,
        required_thickness_m=file.thickness,
        allowed_probability=file.allowed,
        verdict=None if judged is None else judged.verdict.value.replace(" ", "_"),
        problem=found.problem or None,
        findings=[] if judged is None else [finding.text for finding in judged.findings],
        holes=[wall_hole(found, n) for n in holes_shown(found)],
        joints=[] if judged is None else [wall_joint(found, judged, n) for n in range(len(judged.joints.pairs))],
        extra_columns=[] if judged is None else closing_columns(found, judged),
    )


def holes_shown(found: Neighbourhood) -> list[int]:
    """The hole itself, and those that it has joints with."""
    beside = {found.own, *found.wall.pairs.ravel().tolist()}
    return sorted(beside, key=lambda n: (n != found.own, n))


def wall_hole(found: Neighbourhood, n: int) -> WallHole:
    """One hole: where it stands and how far it has come."""
    plan, built = found.wall.plans[n], found.wall.built
    north, east, _ = plan.design.head
    is_built = found.judgement is not None
    return WallHole(
        hole=plan.design.name,
        north_m=north,
        east_m=east,
        length_m=plan.design.length,
        drilled_to_m=finite_or_none(float(built.ends[n])) if is_built else None,
        surveyed_to_m=finite_or_none(float(built.surveyed[n])) if is_built else None,
    )


def wall_joint(found: Neighbourhood, judged: Judgement, n: int) -> WallJoint:
    """One joint: where it most probably is too thin, and where it is thinnest."""
    joints, columns = judged.joints, found.wall.columns
    doubtful = int(worst_depths(joints)[n])
    thickness = np.where(np.isfinite(joints.thickness[n]), joints.thickness[n], np.inf)
    thinnest = int(np.argmin(thickness))
    states = [state for state in joints.states[n].tolist() if state != ColumnState.OUTSIDE]
    closed = states.count(ColumnState.SURVEYED) / len(states) if states else 0.0
    return WallJoint(
        joint=joint_name(columns, joints.pairs[n]),
        state=ColumnState(max(states, default=ColumnState.OUTSIDE)).name.lower(),
        surveyed_percent=round(100.0 * closed),
        probability=float(joints.probability[n, doubtful]),
        depth_m=float(columns.depths[doubtful]),
        probability_where_surveyed=probability_where(joints.probability[n], joints.states[n] == ColumnState.SURVEYED),
        thickness_m=None if math.isinf(thickness[thinnest]) else round(float(thickness[thinnest]), 4),
        thinnest_at_m=float(columns.depths[thinnest]),
    )


def probability_where(probability: Any, where: Any) -> float | None:
    """The largest probability among some depths; None where there are none."""
    return float(np.max(probability[where])) if np.any(where) else None


def closing_columns(found: Neighbourhood, judged: Judgement) -> list[ClosingColumn]:
    """Columns that would close what is open."""
    places = [(np.array([e.north, e.east, e.from_depth]) @ found.wall.built.frame).tolist() for _, e in judged.extras]
    return [
        ClosingColumn(
            joint=joint_name(found.wall.columns, judged.joints.pairs[joint]),
            north_m=round(north, 3),
            east_m=round(east, 3),
            from_m=extra.from_depth,
            to_m=extra.to_depth,
            closes=extra.closes,
        )
        for (joint, extra), (north, east, _) in zip(judged.extras, places, strict=True)
    ]
