"""Depths over which a joint is to be tight, and designs that cannot be.

A joint is asked for from the upper of its two heads to the lower of its two toes, unless the wall states from where to
where it is to be tight: a wall does not become tight by a column that was designed too short. Heads that lie level, of
columns that are raked along the wall, begin at different planes without any of them being missing; there it is asked
for where both are. Of columns that lie flatter than 60 deg from the vertical a level ground says nothing of where they
begin or end: those of a horizontal wall are level however short one of them is. Depths lie along the normal of the
planes: true vertical where the columns are. m.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import TOE
from groundstation.survey.wall.column_deviation import ColumnDesign

Array = npt.NDArray[np.float64]
Pairs = npt.NDArray[np.intp]
SAME_PLANE = 1e-6  # m
STEEP = 0.5  # cosine of 60 deg from the vertical, up to which a level ground cuts columns off


@dataclass(frozen=True, slots=True)
class TightRange:
    """Depths over which a wall is to be tight, as stated; None where the designs say."""

    top: float | None = None
    bottom: float | None = None

    def __post_init__(self) -> None:
        """Refuse a range that ends where it begins, or above.

        Raises
        ------
        SurveyError
            Names both ends.
        """
        if self.top is not None and self.bottom is not None and not self.top < self.bottom:
            raise SurveyError(f"tight_from_m: expected a depth above tight_to_m, {self.bottom:g} m, got {self.top:g} m")


def tight_depths(designs: Sequence[ColumnDesign], frame: Array, pairs: Pairs, stated: TightRange) -> Array:
    """First and last depth (joints, 2) at which each joint is to be tight; ``frame`` (3, 3) is that of the planes."""
    ends = _ends(designs, frame)
    tops, bottoms = ends[pairs, 0, 1], ends[pairs, 1, 1]  # (joints, both columns)
    steep = abs(float(frame[2, 2])) >= STEEP
    level = (np.ptp(ends[pairs, :, 0], axis=1) <= TOE) & steep  # (joints, head and toe): as deep below the site
    top = np.where(level[:, 0], tops.max(axis=1), tops.min(axis=1))
    bottom = np.where(level[:, 1], bottoms.min(axis=1), bottoms.max(axis=1))
    top = top if stated.top is None else np.full(len(pairs), stated.top)
    bottom = bottom if stated.bottom is None else np.full(len(pairs), stated.bottom)
    # a head or toe of the design that lies off by no more than a leg may go on is there
    top = np.where((tops.max(axis=1) > top) & (tops.max(axis=1) <= top + TOE), tops.max(axis=1), top)
    bottom = np.where(
        (bottoms.min(axis=1) < bottom) & (bottoms.min(axis=1) >= bottom - TOE), bottoms.min(axis=1), bottom
    )
    return np.stack([top, bottom], axis=1)


def _ends(designs: Sequence[ColumnDesign], frame: Array) -> Array:
    """Heads and toes (columns, 2, 2) as their depth below the site's zero and along the planes' normal."""
    heads = np.array([design.head for design in designs])
    toes = np.array([design.end.point for design in designs])
    both = np.stack([heads, toes], axis=1)
    return np.stack([both[..., 2], both @ frame[2]], axis=-1)


def asked_depths(depths: Array, ranges: Array) -> npt.NDArray[np.bool_]:
    """Whether a joint is asked for (joints, depths) by its range (joints, 2)."""
    return (depths >= ranges[:, :1] - SAME_PLANE) & (depths <= ranges[:, 1:] + SAME_PLANE)


def check_reach(designs: Sequence[ColumnDesign], frame: Array, pairs: Pairs, ranges: Array) -> None:
    """Refuse joints one of whose columns does not reach, by its design, where they are to be tight.

    Raises
    ------
    SurveyError
        Names the joint, its column, the depths, and what would help.
    """
    ends = _ends(designs, frame)[:, :, 1]
    heads, toes = ends[pairs, 0].max(axis=1), ends[pairs, 1].min(axis=1)
    top, bottom = ranges.T
    wrong = np.flatnonzero(~(top < bottom) | (heads > top + TOE) | (toes < bottom - TOE))
    if len(wrong):
        j = int(wrong[0])
        raise SurveyError(_short_of(designs, ends, pairs[j].tolist(), float(top[j]), float(bottom[j])))


def _short_of(designs: Sequence[ColumnDesign], ends: Array, pair: list[int], top: float, bottom: float) -> str:
    """What a joint that is to be tight from ``top`` to ``bottom`` lacks by the design of its two columns."""
    joint = "-".join(designs[k].name for k in pair)
    if not top < bottom:
        return (
            f"the design of joint {joint} has no depth in which it is to be tight: it begins at {top:g} m and ends at "
            f"{bottom:g} m"
        )
    where = f"joint {joint} is to be tight from {top:g} to {bottom:g} m, yet by its design column"
    low, short = max(pair, key=lambda k: ends[k, 0]), min(pair, key=lambda k: ends[k, 1])
    head, toe = float(ends[low, 0]), float(ends[short, 1])
    if head > top + TOE:
        return (
            f"{where} {designs[low].name} begins at {head:g} m: it opens at the top; expected a head at {top:g} m, "
            f"or tight_from_m = {head:g}"
        )
    return f"{where} {designs[short].name} ends at {toe:g} m; expected a toe at {bottom:g} m, or tight_to_m = {toe:g}"
