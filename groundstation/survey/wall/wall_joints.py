"""Joints of a wall or grid: thickness of each at every depth and its chance to be too thin; who is whose neighbour.

A joint is judged over the depths in which it is to be tight; by default where either of its designs is required. Where
one of its columns is missing there, or its design does not reach there, it is open.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import joint_thickness, limit_distances, probability_thin
from groundstation.survey.wall.column_state import ColumnState

Array = npt.NDArray[np.float64]
AT_ONCE = 64  # joints that are judged together
NEIGHBOURS = 1.2  # spacings of a grid within which two columns are neighbours


@dataclass(frozen=True, slots=True)
class Joints:
    """Joints between neighbours: (joints, depths); nan where nothing is required."""

    pairs: npt.NDArray[np.intp]  # (joints, 2)
    distance: Array  # nan also where a column is missing, as the thickness
    thickness: Array
    probability: Array  # of being thinner than required; 1 where a column is missing
    offset: Array  # (joints, depths, 2) of the second centre from where it should be against the first
    states: npt.NDArray[np.int8]  # the worse of the two columns


def judge_joints(
    columns: Columns, pairs: npt.NDArray[np.intp], required: float, asked: npt.NDArray[np.bool_] | None = None
) -> Joints:
    """Judge every joint at every depth.

    Parameters
    ----------
    required : thickness, m
    asked : (joints, depths) where a joint is to be tight; where either of its designs is required if not given
    """
    asked = joint_asked(columns, pairs) if asked is None else asked
    some = [slice(k, k + AT_ONCE) for k in range(0, max(len(pairs), 1), AT_ONCE)]
    parts = [_joints(columns, pairs[k], required, asked[k]) for k in some]
    return Joints(*(np.concatenate([getattr(part, name) for part in parts]) for name in Joints.__slots__))


def joint_asked(columns: Columns, pairs: npt.NDArray[np.intp]) -> npt.NDArray[np.bool_]:
    """Whether either of the two designs is required (joints, depths)."""
    return np.asarray(np.any(columns.states[pairs] != ColumnState.OUTSIDE, axis=1))


def joint_states(columns: Columns, pairs: npt.NDArray[np.intp], asked: npt.NDArray[np.bool_]) -> npt.NDArray[np.int8]:
    """State (joints, depths) of the worse of two columns; where its design does not reach one is missing."""
    states = np.max(columns.states[pairs], axis=1)
    states = np.where(states == ColumnState.OUTSIDE, np.int8(ColumnState.MISSING), states)
    return np.where(asked, states, np.int8(ColumnState.OUTSIDE))


def _joints(columns: Columns, pairs: npt.NDArray[np.intp], required: float, asked: npt.NDArray[np.bool_]) -> Joints:
    """Judge some pairs of columns at every depth."""
    a, b = pairs[:, 0], pairs[:, 1]
    apart = columns.centres[b] - columns.centres[a]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    states = joint_states(columns, pairs, asked)
    known = states <= ColumnState.UNSURVEYED
    probability = np.where(states == ColumnState.MISSING, 1.0, np.nan)
    radii, radius_cov = pair_radii(columns, pairs)
    probability[known] = probability_thin(
        apart[known], pair_covariance(columns, pairs)[known], radii[known], radius_cov[known], required
    )
    thick = np.where(known, joint_thickness(distance, columns.radii[a], columns.radii[b]), np.nan)
    offset = apart - (columns.planned[b] - columns.planned[a])
    return Joints(pairs, np.where(known, distance, np.nan), thick, probability, offset, states)


@dataclass(frozen=True, slots=True)
class Detour:
    """Joints (m, 2) that, all together, stand in for one: those with a remedial column."""

    joint: int
    pairs: npt.NDArray[np.intp]


def with_detours(columns: Columns, found: Joints, detours: Sequence[Detour], required: float) -> Joints:
    """Joints where each is as good as its better way: direct, or by a remedial column where that one stands."""
    out = replace(
        found, distance=found.distance.copy(), thickness=found.thickness.copy(), probability=found.probability.copy(),
        states=found.states.copy(),
    )  # fmt: skip
    for detour in detours:
        legs, j = judge_joints(columns, detour.pairs, required), detour.joint
        stands = np.all(legs.states <= ColumnState.UNSURVEYED, axis=0)
        chance = np.minimum(np.sum(np.where(stands, legs.probability, 1.0), axis=0), 1.0)
        better = stands & (chance < np.where(np.isfinite(out.probability[j]), out.probability[j], -1.0))
        weakest = np.argmin(np.where(np.isfinite(legs.thickness), legs.thickness, -np.inf), axis=0)
        each = np.arange(len(weakest))
        out.probability[j, better] = chance[better]
        for mine, theirs in ((out.thickness, legs.thickness), (out.distance, legs.distance), (out.states, legs.states)):
            mine[j, better] = theirs[weakest, each][better]
    return out


def pair_covariance(columns: Columns, pairs: npt.NDArray[np.intp]) -> Array:
    """Covariance (joints, depths, 2, 2) of the second centre against the first: what both share cancels."""
    a, b = pairs[:, 0], pairs[:, 1]
    cross = np.einsum("jzis,jzks->jzik", columns.shared.at(a), columns.shared.at(b))
    return np.asarray(columns.covs[a] + columns.covs[b] - cross - np.swapaxes(cross, -1, -2))


def pair_radii(columns: Columns, pairs: npt.NDArray[np.intp]) -> tuple[Array, Array]:
    """Radii (joints, depths, 2) and their covariance (joints, depths, 2, 2)."""
    a, b = pairs[:, 0], pairs[:, 1]
    std = np.stack([columns.radius_stds[a], columns.radius_stds[b]], axis=-1)
    rho = columns.radius_correlation
    correlation = np.array([[1.0, rho], [rho, 1.0]])
    return np.stack([columns.radii[a], columns.radii[b]], axis=-1), std[..., :, None] * std[..., None, :] * correlation


def worst_depths(found: Joints) -> npt.NDArray[np.intp]:
    """Depth (index) of every joint at which it most probably is too thin; of equals the thinnest, then the first."""
    probability = np.where(np.isfinite(found.probability), found.probability, -1.0)
    thin = np.where(np.isfinite(found.thickness), found.thickness, np.inf)
    thin = np.where(found.states == ColumnState.MISSING, -np.inf, thin)
    likeliest = probability >= np.max(probability, axis=1, keepdims=True) * (1.0 - 1e-9)
    return np.asarray(np.argmin(np.where(likeliest, thin, np.inf), axis=1), np.intp)


def worst_joint(found: Joints) -> tuple[int, int]:
    """Joint and depth (indices) that most probably is too thin; of equals the thinnest, one that is missing before all.

    Raises
    ------
    SurveyError
        When nothing is required of any joint at any depth.
    """
    if not np.any(np.isfinite(found.probability)):
        raise SurveyError("wall: expected two neighbours whose designs reach a common depth, got none")
    depths = worst_depths(found)
    each = np.arange(len(depths))
    probability = np.where(np.isfinite(found.probability), found.probability, -1.0)[each, depths]
    thin = np.where(np.isfinite(found.thickness), found.thickness, -np.inf)[each, depths]
    best = np.lexsort((thin, -probability))[0]
    return int(best), int(depths[best])


@dataclass(frozen=True, slots=True)
class ExtraColumn:
    """Place of one more column at an opening, and whether it would close it. Axes of the plane, m."""

    north: float
    east: float
    from_depth: float
    to_depth: float
    closes: bool


def extra_column(columns: Columns, found: Joints, joint: int, required: float) -> ExtraColumn | None:
    """A column along the planes' normal midway between two neighbours where their joint is too thin; None if nowhere.

    Where one of the two is missing, or its design does not reach, its axis is the place of the new column.
    """
    thin = np.flatnonzero((found.thickness[joint] < required) | (found.states[joint] == ColumnState.MISSING))
    if not len(thin):
        return None
    a, b = (int(k) for k in found.pairs[joint])
    gone = [k for k in (a, b) if np.any(columns.states[k, thin] >= ColumnState.MISSING)]
    if gone:
        north, east = columns.planned[gone[0], thin[0]]
        kept = [columns.centres[k, thin] for k in (a, b) if k not in gone]
    else:
        kept = [columns.centres[a, thin], columns.centres[b, thin]]
        middle = 0.5 * (kept[0] + kept[1])
        north, east = 0.5 * (middle.min(axis=0) + middle.max(axis=0))
    thinnest = np.asarray(np.min(columns.radii[[a, b]][:, thin]))
    limit = float(limit_distances(thinnest, thinnest, required))
    reach = max((float(np.max(np.hypot(way[:, 0] - north, way[:, 1] - east))) for way in kept), default=np.inf)
    depths = columns.depths[thin]
    return ExtraColumn(float(north), float(east), float(depths[0]), float(depths[-1]), limit > 0.0 and reach <= limit)


def neighbours_in_line(count: int, *, closed: bool) -> npt.NDArray[np.intp]:
    """Pairs (joints, 2) of a wall in its order; a closed one is a shaft."""
    pairs = np.stack([np.arange(count - 1), np.arange(1, count)], axis=1)
    return np.concatenate([pairs, [[count - 1, 0]]]) if closed and count > 2 else pairs


def neighbours_in_grid(heads: Array, spacing: float) -> npt.NDArray[np.intp]:
    """Pairs of columns whose heads are within ``NEIGHBOURS`` spacings of each other."""
    from scipy.spatial import cKDTree

    pairs = cKDTree(heads).query_pairs(NEIGHBOURS * spacing, output_type="ndarray")
    return np.asarray(pairs[np.lexsort((pairs[:, 1], pairs[:, 0]))], np.intp)


def crossed_joints(columns: Columns, pairs: npt.NDArray[np.intp]) -> list[tuple[int, int]]:
    """Joints whose columns have changed sides, and the depth (index) where they first do: (joint, depth)."""
    a, b = pairs[:, 0], pairs[:, 1]
    wanted = columns.planned[b] - columns.planned[a]
    along = np.einsum("jzi,jzi->jz", columns.centres[b] - columns.centres[a], wanted)
    crossed = np.where(np.isfinite(along), along, 1.0) < 0.0
    return [(int(j), int(np.argmax(crossed[j]))) for j in np.flatnonzero(crossed.any(axis=1))]
