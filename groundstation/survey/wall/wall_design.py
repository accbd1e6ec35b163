"""Who is whose neighbour by the design of a wall, and designs that are refused: no drilling would make them tight.

Each refusal is one line with the columns, the distances and what would help. m.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_joint import largest_distance
from groundstation.survey.wall.tight_depths import TightRange, check_reach, tight_depths
from groundstation.survey.wall.wall_columns import BuiltWall
from groundstation.survey.wall.wall_joints import NEIGHBOURS, Detour, neighbours_in_grid, neighbours_in_line
from groundstation.survey.wall.wall_tables import Remedy

Pairs = npt.NDArray[np.intp]
SAME_PLACE = 1e-3  # m, within which two designs are one


def find_pairs(path: Path, layout: str, spacing: float | None, columns: Columns, remedies: Sequence[Remedy]) -> Pairs:
    """Neighbours (joints, 2) among the columns of the design; remedial ones stand beside them.

    Parameters
    ----------
    path : of the heads, for a refusal
    spacing : of a grid

    Raises
    ------
    SurveyError
        When there are none, or they leave a grid in parts.
    """
    designed = np.array([k for k, remedy in enumerate(remedies) if not remedy.asked], np.intp)
    if layout == "grid":
        found = neighbours_in_grid(columns.designs[designed], spacing or 0.0)
    else:
        found = neighbours_in_line(len(designed), closed=layout == "shaft")
    if not len(found):
        raise SurveyError(f"{path}: expected at least two columns next to each other, got {len(designed)}")
    if layout == "grid":
        _check_connected(path, columns.subset(designed), found, spacing or 0.0)
    return designed[found]


def _check_connected(path: Path, columns: Columns, pairs: Pairs, spacing: float) -> None:
    """Refuse a grid in parts that no joint connects: nothing would be asked of the ground between them."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    heads = columns.designs
    joined = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(heads), len(heads)))
    parts, part = connected_components(joined, directed=False)
    if parts == 1:
        return
    first, others = np.flatnonzero(part == 0), np.flatnonzero(part != 0)
    apart = np.linalg.norm(heads[others, None] - heads[first], axis=-1)
    other, one = np.unravel_index(int(np.argmin(apart)), apart.shape)
    raise SurveyError(
        f"{path}: the grid is in {parts} parts that no joint connects: columns {columns.names[first[one]]} and "
        f"{columns.names[others[other]]} are {np.min(apart):.3f} m apart, neighbours of spacing_m = {spacing:g} are "
        f"{NEIGHBOURS * spacing:.3f} m or less; expected one grid, or a wall file for each part"
    )


def find_detours(path: Path, names: Sequence[str], remedies: Sequence[Remedy], pairs: Pairs) -> list[Detour]:
    """Ways by remedial columns, which stand in for joints; errors as ``find_pairs``."""
    found = []
    index = {name: k for k, name in enumerate(names)}
    for extra, remedy in enumerate(remedies):
        for name in remedy.named:
            if name not in index:
                raise SurveyError(f"{path}: column {names[extra]}: column {name} is not among the heads")
        if remedy.between:
            a, b = (index[name] for name in remedy.between)
            joints = [j for j, pair in enumerate(pairs.tolist()) if set(pair) == {a, b}]
            if not joints:
                raise SurveyError(f"{path}: column {names[extra]}: {'/'.join(remedy.between)} is no joint of this wall")
            found.append(Detour(joints[0], np.array([[a, extra], [extra, b]], np.intp)))
        if remedy.replaces:
            gone = index[remedy.replaces]
            for j, (a, b) in enumerate(pairs.tolist()):
                if gone in (a, b):
                    pair = [extra, b] if a == gone else [a, extra]
                    found.append(Detour(j, np.array([pair], np.intp)))
    return found


def check_design(
    designs: Sequence[ColumnDesign],
    built: BuiltWall,
    pairs: Pairs,
    helped: set[int],
    required: float,
    tight: TightRange,
) -> None:
    """Refuse a wall none of whose joints could be thick enough, built as designed, or whose columns do not reach.

    Parameters
    ----------
    helped : joints that have a way by remedial columns, whose own designs need not reach
    required : thickness of a joint, m

    Raises
    ------
    SurveyError
        Names the columns and what would help.
    """
    columns = built.columns
    _check_apart(columns.subset(np.unique(pairs)))
    alone = pairs[[j for j in range(len(pairs)) if j not in helped]]
    check_reach(designs, built.frame, alone, tight_depths(designs, built.frame, alone, tight))
    a, b = pairs[:, 0], pairs[:, 1]
    apart = columns.planned[b] - columns.planned[a]
    distance = np.hypot(apart[..., 0], apart[..., 1])
    limit = largest_distance(float(np.max(columns.radii)), required)
    if float(np.min(distance)) > limit:
        raise SurveyError(
            f"the design cannot be met anywhere: its nearest columns are {np.min(distance):.3f} m apart, "
            f"a joint of {required:g} m needs {limit:.3f} m or less"
        )


def _check_apart(columns: Columns) -> None:
    """Refuse two columns of the design that are one: the second closes nothing. A remedial one may stand in for it."""
    shown: dict[bytes, str] = {}
    for name, planned in zip(columns.names, columns.planned, strict=True):
        other = shown.setdefault(np.round(planned / SAME_PLACE).tobytes(), name)
        if other != name:
            raise SurveyError(f"columns {other} and {name} are one by their design; expected them apart")
