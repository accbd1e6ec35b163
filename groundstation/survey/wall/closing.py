"""How a wall, a shaft or a ring of freeze pipes closes in the order in which its columns were drilled.

A joint closes at a depth on the day on which the later of its two columns is there and the joint is as thick as
required, or on which the last leg of a way by remedial columns is; it stays open where none of that comes about.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from datetime import date

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import joint_thickness
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_joints import Detour, joint_asked

Array = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class ClosingDay:
    """State of the wall at the end of one day."""

    day: date
    drilled: list[str]  # columns of that day
    closed: float  # 0..1, share of all joints and depths
    open_joints: int  # joints that are open at some depth
    widest: tuple[int, int, float] | None  # joint, depth (indices) and spacing (m) where both its columns stand


def closing_by_day(
    columns: Columns,
    pairs: npt.NDArray[np.intp],
    required: float,
    days: Sequence[date | None],
    detours: Sequence[Detour] = (),
    asked: npt.NDArray[np.bool_] | None = None,
) -> list[ClosingDay]:
    """Return the state of the wall at the end of every day of drilling.

    Parameters
    ----------
    pairs : (joints, 2) columns that are to join
    required : thickness of a joint, m
    days : of every column; None of one that is not drilled yet
    asked : (joints, depths) where a joint is to be tight; where either of its designs is required if not given
    """
    order = np.array([math.inf if day is None else float(day.toordinal()) for day in days])
    distance, direct = _closing(columns, pairs, required, order)
    closing = direct.copy()
    for detour in detours:
        _, legs = _closing(columns, detour.pairs, required, order)
        closing[detour.joint] = np.minimum(closing[detour.joint], np.max(legs, axis=0))
    asked = joint_asked(columns, pairs) if asked is None else asked
    both = np.max(order[pairs], axis=1)
    found = []
    for day in sorted({day for day in days if day is not None}):
        now = float(day.toordinal())
        shut = closing <= now
        spacing = np.where(np.isfinite(distance) & asked & (both <= now)[:, None], distance, -np.inf)
        joint, depth = (int(k) for k in np.unravel_index(int(np.argmax(spacing)), spacing.shape))
        widest = (joint, depth, float(spacing[joint, depth])) if np.isfinite(spacing[joint, depth]) else None
        drilled = [name for name, that in zip(columns.names, days, strict=True) if that == day]
        closed = float(np.count_nonzero(shut & asked)) / max(int(np.count_nonzero(asked)), 1)
        found.append(ClosingDay(day, drilled, closed, int(np.count_nonzero(np.any(asked & ~shut, axis=1))), widest))
    return found


def _closing(columns: Columns, pairs: npt.NDArray[np.intp], required: float, order: Array) -> tuple[Array, Array]:
    """Distance (joints, depths) of both centres, m, and the day on which the joint exists (infinite: never)."""
    a, b = pairs[:, 0], pairs[:, 1]
    apart = columns.centres[b] - columns.centres[a]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    known = np.maximum(columns.states[a], columns.states[b]) <= ColumnState.UNSURVEYED
    with np.errstate(invalid="ignore"):
        good = known & (joint_thickness(distance, columns.radii[a], columns.radii[b]) >= required)
    return distance, np.where(good, np.max(order[pairs], axis=1)[:, None], np.inf)
