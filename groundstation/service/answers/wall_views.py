"""What the key of the wall holds: the hole that is drilled, its neighbours, and the joints between them."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from groundstation.service.answers.model import RigModel
from groundstation.service.answers.views import finite
from groundstation.service.hole.live_wall import LiveWall, Neighbourhood
from groundstation.survey.fusion.resolve import direction_angles
from groundstation.survey.wall.as_built import ColumnState
from groundstation.survey.wall.wall_joints import worst_depths
from groundstation.survey.wall.wall_verdict import Judgement, joint_name

View = dict[str, Any]


def wall(k: RigModel, _p: dict[str, str]) -> View:
    """The joints of now; without a wall file nothing but that."""
    if k.wall is None:
        return {"wall": None}
    return {"wall": neighbourhood(k.wall, k.wall.judged(stations_of(k), k.string.bit))}


def stations_of(k: RigModel) -> list[tuple[float, float, float]]:
    """Measured depth (m), inclination and azimuth (rad) of the stations below the collar."""
    found = [(station.md, k.hole.direction_of(station)) for station in k.hole.stations if station.md > 0.0]
    return [(md, *direction_angles(direction.lean, direction.down)) for md, direction in found]


def neighbourhood(live: LiveWall, found: Neighbourhood) -> View:
    """Holes, joints and what is proposed."""
    file, judged = found.wall.file, found.judgement
    return {
        "name": file.name,
        "hole": live.hole,
        "required_thickness_m": file.thickness,
        "allowed_probability": file.allowed,
        "verdict": None if judged is None else judged.verdict.value.replace(" ", "_"),
        "problem": found.problem or None,
        "findings": [] if judged is None else [finding.text for finding in judged.findings],
        "holes": [hole_view(found, n) for n in range(len(found.wall.plans))],
        "joints": [] if judged is None else [joint_view(found, judged, n) for n in range(len(judged.joints.pairs))],
        "extra_columns": [] if judged is None else extras(found, judged),
    }


def hole_view(found: Neighbourhood, n: int) -> View:
    """One hole: where it stands and how far it has come."""
    plan, built = found.wall.plans[n], found.wall.built
    north, east, _ = plan.design.head
    is_built = found.judgement is not None
    return {
        "hole": plan.design.name,
        "north_m": north,
        "east_m": east,
        "length_m": plan.design.length,
        "drilled_to_m": finite(float(built.ends[n])) if is_built else None,
        "surveyed_to_m": finite(float(built.surveyed[n])) if is_built else None,
    }


def joint_view(found: Neighbourhood, judged: Judgement, n: int) -> View:
    """One joint: where it most probably is too thin, and where it is thinnest."""
    joints, columns = judged.joints, found.wall.columns
    doubtful = int(worst_depths(joints)[n])
    thickness = np.where(np.isfinite(joints.thickness[n]), joints.thickness[n], np.inf)
    thinnest = int(np.argmin(thickness))
    states = [state for state in joints.states[n].tolist() if state != ColumnState.OUTSIDE]
    closed = states.count(ColumnState.SURVEYED) / len(states) if states else 0.0
    return {
        "joint": joint_name(columns, joints.pairs[n]),
        "state": ColumnState(max(states, default=ColumnState.OUTSIDE)).name.lower(),
        "surveyed_percent": round(100.0 * closed),
        "probability": float(joints.probability[n, doubtful]),
        "depth_m": float(columns.depths[doubtful]),
        "probability_where_surveyed": probability_where(
            joints.probability[n], joints.states[n] == ColumnState.SURVEYED
        ),
        "thickness_m": None if math.isinf(thickness[thinnest]) else round(float(thickness[thinnest]), 4),
        "thinnest_at_m": float(columns.depths[thinnest]),
    }


def probability_where(probability: Any, where: Any) -> float | None:
    """The largest probability among some depths; None where there are none."""
    return float(np.max(probability[where])) if np.any(where) else None


def extras(found: Neighbourhood, judged: Judgement) -> list[View]:
    """Columns that would close what is open."""
    return [
        {
            "joint": joint_name(found.wall.columns, judged.joints.pairs[joint]),
            "north_m": round(extra.north, 3),
            "east_m": round(extra.east, 3),
            "from_m": extra.from_depth,
            "to_m": extra.to_depth,
            "closes": extra.closes,
        }
        for joint, extra in judged.extras
    ]
