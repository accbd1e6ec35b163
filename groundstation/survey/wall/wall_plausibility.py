"""Plausibility of a wall: what of its designs and surveys hardly can be, and which of that touches its verdict.

A column that leans by 85 deg, a station at 10 000 m in a wall of 10 m, a radius of 60 m: each would make joints tight
that were never drilled. So what a warning touches is not proven, whatever is computed of it.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from groundstation.entry.entry_warning import EntryWarning
from groundstation.entry.station_plausibility import (
    departing_holes,
    design_warnings,
    radius_warnings,
    station_warnings,
)
from groundstation.survey.wall.column_plans import ColumnPlan, ColumnSurvey
from groundstation.survey.wall.wall_verdict import Finding, FindingKind
from groundstation.survey.well.methods import station_tangents

if TYPE_CHECKING:
    from groundstation.survey.wall.wall_file import Wall

MOST_LEAN = math.radians(10.0)  # of a hole from its design; a column is out of any tolerance at a fifth of it
ROUNDED = 1e-9  # of its cosine
MOST_DEPTH = 1.5  # times the design length ...
MORE_DEPTH = 5.0  # ... and m, that a hole may be surveyed or drilled to
MOST_OVERLAP = 2.0  # radius over the spacing of neighbours


def wall_warnings(
    plans: Sequence[ColumnPlan], holes: Sequence[ColumnSurvey], pairs: npt.NDArray[np.intp]
) -> tuple[EntryWarning, ...]:
    """Warnings of all columns; pairs (joints, 2) of neighbours."""
    found: list[EntryWarning] = []
    odd = _odd_holes(plans, holes)
    for k, (plan, hole) in enumerate(zip(plans, holes, strict=True)):
        found += hole.warnings
        found += radius_warnings(plan.design.radius, plan.design.name)
        found += _depths(plan, hole)
        if (course := plan.design.plan) is not None:
            found += design_warnings(course.md, course.tangents, plan.design.name)
        if k in odd:
            found += station_warnings(hole.md, hole.inclination, hole.azimuth, plan.design.name)
            found += _leans(plan, hole)
    return (*found, *_overlaps(plans, pairs))


def _odd_holes(plans: Sequence[ColumnPlan], holes: Sequence[ColumnSurvey]) -> set[int]:
    """Holes of whose stations there may be a warning; all are looked at together, for there may be thousands."""
    hole = np.repeat(np.arange(len(holes)), [len(one.md) for one in holes])
    if not len(hole):
        return set()
    md, inclination, azimuth = (
        np.concatenate([getattr(one, name) for one in holes]) for name in ("md", "inclination", "azimuth")
    )
    axes = np.array([plan.design.axis for plan in plans])[hole]
    leaning = np.sum(station_tangents(inclination, azimuth) * axes, axis=1) < math.cos(MOST_LEAN) + ROUNDED
    planned = {k for k, plan in enumerate(plans) if plan.design.plan is not None and len(holes[k].md)}
    return {*hole[leaning].tolist(), *departing_holes(md, inclination, azimuth, hole), *planned}


def _depths(plan: ColumnPlan, hole: ColumnSurvey) -> list[EntryWarning]:
    """A column that goes far beyond its design."""
    name, length = plan.design.name, plan.design.length
    ends = {"surveyed": float(hole.md[-1]) if len(hole.md) else 0.0, "drilled": plan.drilled or 0.0}
    return [
        EntryWarning("depth", name, f"column {name}: {word} to {end:g} m; it is designed to {length:g} m")
        for word, end in ends.items()
        if end > MOST_DEPTH * length + MORE_DEPTH
    ]


def _leans(plan: ColumnPlan, hole: ColumnSurvey) -> list[EntryWarning]:
    """Stations that lean far from their design."""
    design, name = plan.design, plan.design.name
    tangents = station_tangents(hole.inclination, hole.azimuth)
    axes = np.broadcast_to(design.axis, tangents.shape)
    if design.plan is not None:
        axes = design.plan.points_at(np.minimum(hole.md, design.plan.length)).tangents
    apart = np.arccos(np.clip(np.sum(tangents * axes, axis=1), -1.0, 1.0))
    far = np.flatnonzero(apart > MOST_LEAN)
    if not len(far):
        return []
    most = int(far[np.argmax(apart[far])])
    text = (
        f"column {name}: it leans by {math.degrees(apart[most]):.1f} deg from its design at {hole.md[most]:g} m; "
        f"expected at most {math.degrees(MOST_LEAN):g} deg"
    )
    top = float(hole.md[max(int(far[0]) - 1, 0)])
    return [EntryWarning("lean", name, text, top, float(hole.md[far[-1]]))]


def _overlaps(plans: Sequence[ColumnPlan], pairs: npt.NDArray[np.intp]) -> list[EntryWarning]:
    """Radii that are larger than the spacing by far."""
    found = []
    for a, b in pairs.tolist():
        one, other = plans[a].design, plans[b].design
        apart, radius = math.dist(one.head, other.head), max(one.radius, other.radius)
        if radius > MOST_OVERLAP * apart:
            name = f"{one.name}-{other.name}"
            text = f"joint {name}: radii of up to {radius:g} m at a spacing of {apart:g} m"
            found.append(EntryWarning("radius", name, text))
    return found


def touching_findings(wall: Wall) -> list[Finding]:
    """Findings of the warnings that touch the verdict: all but those that begin below where anything is to be tight."""
    top, bottom = float(np.min(wall.tight_depths)), float(np.max(wall.tight_depths))
    return [
        Finding(FindingKind.IMPLAUSIBLE, w.what, _known(w.top, top), _known(w.bottom, bottom), w.text)
        for w in wall.warnings
        if _touches(wall, w)
    ]


def _touches(wall: Wall, warning: EntryWarning) -> bool:
    """Whether a warning begins above where the last joint of its column is to be tight.

    What is wrong at a depth moves the hole from there on.
    """
    names = [plan.design.name for plan in wall.plans]
    if warning.what not in names or warning.top is None:
        return True
    k = names.index(warning.what)
    design, normal = wall.plans[k].design, wall.built.frame[2]
    mine = wall.tight_depths[np.any(wall.pairs == k, axis=1)]
    if not len(mine):  # a remedial column
        return True
    return float(normal @ np.array(design.head) + normal @ design.axis * warning.top) <= float(np.max(mine[:, 1]))


def _known(value: float | None, other: float) -> float:
    return other if value is None else value
