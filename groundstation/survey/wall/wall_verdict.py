"""Verdict on a wall, a shaft or a grid: what is open, what is not known, and whether it may be called tight.

Nothing is tight by default: a stretch that was not drilled is an opening, one that was not surveyed is not proven, and
a wall whose joints are good one by one may still be doubtful as a whole.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import limit_distances
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.void_chance import VoidChance, void_chance
from groundstation.survey.wall.voids import Void, find_voids, triples_of
from groundstation.survey.wall.wall_joints import (
    Detour,
    ExtraColumn,
    Joints,
    crossed_joints,
    extra_column,
    judge_joints,
    with_detours,
)
from groundstation.survey.wall.wall_system import SystemProbability, system_probability

Array = npt.NDArray[np.float64]
DIAGONAL = 1.75  # spacings within which three columns may have a void between them


class WallVerdict(Enum):
    """Verdict that may be signed."""

    TIGHT = "tight"
    NOT_PROVEN = "not proven"  # nothing is open, but something is not known well enough
    NOT_TIGHT = "not tight"


class FindingKind(Enum):
    """Reason for which a wall is not tight, or not proven tight."""

    MISSING = "missing"  # no column where one is required
    UNSURVEYED = "unsurveyed"
    THIN = "thin"  # a joint thinner than required, as surveyed
    VOID = "void"
    CROSSING = "crossing"  # two neighbours have changed sides
    DOUBTFUL = "doubtful"  # thick enough as surveyed, too thin with more than the allowed probability
    SYSTEM = "system"  # every joint good, the whole doubtful
    IMPLAUSIBLE = "implausible"  # a number that is missing, or hardly can be
    DESIGN = "design"  # what is open there would be open as designed


OPEN = (FindingKind.MISSING, FindingKind.THIN, FindingKind.VOID, FindingKind.CROSSING)


@dataclass(frozen=True, slots=True)
class Finding:
    """One reason of the verdict, with its place."""

    kind: FindingKind
    what: str  # column, joint, or columns around a void
    top: float  # m
    bottom: float
    text: str
    probability: float | None = None

    def is_about(self, column: str) -> bool:
        """Whether it is about a column or what the column is part of; names may hold dashes themselves."""
        return f"-{column}-" in f"-{self.what}-"


@dataclass(frozen=True, slots=True)
class VoidFinding:
    """A void of the plane at one depth."""

    depth: float
    void: Void


@dataclass(frozen=True, slots=True)
class Judgement:
    """Verdict on a wall with all its findings."""

    verdict: WallVerdict
    findings: list[Finding]
    joints: Joints
    voids: list[VoidFinding]
    system: SystemProbability
    extras: list[tuple[int, ExtraColumn]]  # (joint, column) for every joint that is open
    void_chance: VoidChance | None = None  # of a grid


def judge_columns(
    columns: Columns,
    pairs: npt.NDArray[np.intp],
    required: float,
    *,
    allowed: float = 0.01,
    grid_spacing: float | None = None,
    detours: Sequence[Detour] = (),
    asked: npt.NDArray[np.bool_] | None = None,
    about: int | None = None,
    doubts: Sequence[Finding] = (),
) -> Judgement:
    """Judge all joints, the plane of a grid, and the whole.

    Parameters
    ----------
    required : thickness of a joint, m
    allowed : probability of anything too thin or open up to which the wall counts as tight
    grid_spacing : of a grid, m; its plane must be covered too
    detours : ways by remedial columns
    asked : (joints, depths) where a joint is to be tight; where either of its designs is required if not given
    about : the column that is looked at: of others only those that have a joint count as missing, and of a grid only
        voids beside it or where it is to be
    doubts : findings of what was read
    """
    found = with_detours(columns, judge_joints(columns, pairs, required, asked), detours, required)
    holes: list[VoidFinding] = []
    triples = chance = None
    if grid_spacing is not None:
        triples = triples_of(columns.designs, DIAGONAL * grid_spacing)
        holes = _voids(columns)
        if about is not None:
            triples = triples[_triples_beside(columns, triples, about, grid_spacing)]
            holes = [hole for hole in holes if _is_beside(columns, hole, about, grid_spacing)]
        chance = void_chance(columns, triples)
    whole = system_probability(columns, found, required, triples, detours)
    findings = [
        *_column_findings(columns, None if about is None else {about, *pairs.ravel().tolist()}),
        *_joint_findings(columns, found, required, allowed),
        *_design_findings(columns, found, required, allowed),
        *_void_findings(columns, holes),
        *_likely_voids(columns, holes, chance, allowed),
        *_crossing_findings(columns, pairs),
        *doubts,
    ]
    if whole.probability > allowed and not findings:
        text = f"every joint is good, yet anything is open or too thin with a probability of {whole.probability:.2g}"
        findings.append(Finding(FindingKind.SYSTEM, "wall", *_ends(columns.depths), text, whole.probability))
    proposals = [(j, extra_column(columns, found, j, required)) for j in range(len(pairs))]
    extras = [(j, extra) for j, extra in proposals if extra is not None]
    return Judgement(_verdict(findings), findings, found, holes, whole, extras, chance)


def _triples_beside(columns: Columns, triples: npt.NDArray[np.intp], about: int, reach: float) -> npt.NDArray[np.bool_]:
    """Which triples are a column with two others, or stand around where it is to be."""
    middle = columns.designs[triples].mean(axis=1) - columns.designs[about]
    return np.asarray(np.any(triples == about, axis=1) | (np.linalg.norm(middle, axis=1) <= reach))


def _is_beside(columns: Columns, hole: VoidFinding, about: int, reach: float) -> bool:
    """Whether a void is bounded by a column, or is where that one is to be: it may have gone elsewhere."""
    if about in hole.void.columns:
        return True
    depth = int(np.searchsorted(columns.depths, hole.depth))
    return bool(np.linalg.norm(columns.planned[about, depth] - hole.void.place) <= reach)


def _verdict(findings: list[Finding]) -> WallVerdict:
    if any(finding.kind in OPEN for finding in findings):
        return WallVerdict.NOT_TIGHT
    return WallVerdict.NOT_PROVEN if findings else WallVerdict.TIGHT


def _ends(depths: Array) -> tuple[float, float]:
    return float(depths[0]), float(depths[-1])


def true_runs(flags: npt.NDArray[np.bool_]) -> list[tuple[int, int]]:
    """First and last index of every run of true values (n,)."""
    edges = np.diff(np.concatenate([[0], flags.astype(np.int8), [0]]))
    return list(zip(np.flatnonzero(edges == 1).tolist(), (np.flatnonzero(edges == -1) - 1).tolist(), strict=True))


def _column_findings(columns: Columns, among: set[int] | None) -> list[Finding]:
    """Where columns are missing or not surveyed; ``among`` some of them, if not all."""
    found = []
    words = {
        ColumnState.MISSING: (FindingKind.MISSING, "is missing"),
        ColumnState.UNSURVEYED: (FindingKind.UNSURVEYED, "is not surveyed"),
    }
    for k in np.flatnonzero(np.isin(columns.states, [*words]).any(axis=1)).tolist():
        name = columns.names[k]
        for state, (kind, word) in words.items() if among is None or k in among else ():
            for first, last in true_runs(columns.states[k] == state):
                top, bottom = float(columns.depths[first]), float(columns.depths[last])
                found.append(Finding(kind, name, top, bottom, f"column {name} {word} from {top:g} to {bottom:g} m"))
    return found


def joint_name(columns: Columns, pair: npt.NDArray[np.intp]) -> str:
    """Names of its two columns."""
    return f"{columns.names[pair[0]]}-{columns.names[pair[1]]}"


def _joint_findings(columns: Columns, found: Joints, required: float, allowed: float) -> list[Finding]:
    out = []
    all_thin = found.thickness < required
    all_likely = np.isfinite(found.thickness) & ~all_thin & (found.probability > allowed)
    for j in np.flatnonzero((all_thin | all_likely).any(axis=1)).tolist():
        name, thick, chance = joint_name(columns, found.pairs[j]), found.thickness[j], found.probability[j]
        thin, likely = all_thin[j], all_likely[j]
        for first, last in true_runs(thin):
            top, bottom, least = (
                float(columns.depths[first]),
                float(columns.depths[last]),
                float(np.min(thick[first : last + 1])),
            )
            word = f"opens by {-least:.3f} m" if least < 0.0 else f"is {least:.3f} m thick"
            text = f"joint {name} {word} at the least from {top:g} to {bottom:g} m; required {required:g} m"
            out.append(Finding(FindingKind.THIN, name, top, bottom, text, float(np.max(chance[first : last + 1]))))
        if np.any(likely) and not np.any(thin):
            first, last = int(np.argmax(likely)), int(np.flatnonzero(likely)[-1])
            top, bottom, most = float(columns.depths[first]), float(columns.depths[last]), float(np.max(chance[likely]))
            text = f"joint {name} is too thin with a probability of {most:.2g} between {top:g} and {bottom:g} m"
            out.append(Finding(FindingKind.DOUBTFUL, name, top, bottom, text, most))
    return out


def _design_findings(columns: Columns, found: Joints, required: float, allowed: float) -> list[Finding]:
    """Where a joint is not good and could not be by its design: a column that does not reach, or axes too far apart."""
    out = []
    with np.errstate(invalid="ignore"):
        good = (found.thickness >= required) & (found.probability <= allowed)
    bad = ~good & (found.states != ColumnState.OUTSIDE)
    joints = np.flatnonzero(np.any(bad, axis=1))
    pairs, bad = found.pairs[joints], bad[joints]
    a, b = pairs[:, 0], pairs[:, 1]
    apart = np.linalg.norm(columns.planned[b] - columns.planned[a], axis=-1)
    limit = limit_distances(columns.radii[a], columns.radii[b], required)
    for j, pair in enumerate(pairs):
        name = joint_name(columns, pair)
        for k in pair.tolist():
            for first, last in true_runs(bad[j] & (columns.states[k] == ColumnState.OUTSIDE)):
                top, bottom = float(columns.depths[first]), float(columns.depths[last])
                text = (
                    f"joint {name} is open from {top:g} to {bottom:g} m: no column {columns.names[k]} is designed there"
                )
                out.append(Finding(FindingKind.MISSING, name, top, bottom, text))
        wide = bad[j] & (apart[j] > limit[j] + 1e-9)
        for first, last in true_runs(wide):
            top, bottom = float(columns.depths[first]), float(columns.depths[last])
            most = first + int(np.argmax((apart[j] - limit[j])[first : last + 1]))
            text = f"the design of joint {name} opens from {top:g} to {bottom:g} m: "
            if limit[j, most] > 0.0:
                text += (
                    f"its axes are up to {apart[j, most]:.3f} m apart, a joint of {required:g} m needs "
                    f"{limit[j, most]:.3f} m or less"
                )
            else:
                radius = float(np.min(columns.radii[pair, most]))
                text += f"a column of {radius:g} m radius makes no joint of {required:g} m"
            out.append(Finding(FindingKind.DESIGN, name, top, bottom, text))
    return out


def _voids(columns: Columns) -> list[VoidFinding]:
    """Voids among the columns that stand, at every depth."""
    return [
        VoidFinding(float(depth), void)
        for z, depth in enumerate(columns.depths)
        for void in find_voids(columns.centres[:, z], columns.radii[:, z])
    ]


def _void_findings(columns: Columns, holes: list[VoidFinding]) -> list[Finding]:
    """One finding for each set of columns around a void, over the depths of the void."""
    around: dict[tuple[int, ...], list[VoidFinding]] = {}
    for hole in holes:
        around.setdefault(hole.void.columns, []).append(hole)
    out = []
    for members, same in around.items():
        name = "-".join(columns.names[k] for k in members)
        largest = max(same, key=lambda hole: hole.void.area)
        top, bottom = min(h.depth for h in same), max(h.depth for h in same)
        text = (
            f"void between {name} from {top:g} to {bottom:g} m, at the most {1e4 * largest.void.area:.1f} cm2 "
            f"and a hole of {100.0 * largest.void.radius:.1f} cm radius at {largest.depth:g} m, "
            f"({largest.void.place[0]:.3f}, {largest.void.place[1]:.3f}) m"
        )
        out.append(Finding(FindingKind.VOID, name, top, bottom, text))
    return out


def _likely_voids(
    columns: Columns, holes: list[VoidFinding], chance: VoidChance | None, allowed: float
) -> list[Finding]:
    """Findings of voids that are not there as surveyed, yet more probable than allowed."""
    if chance is None:
        return []
    known = np.isin(columns.depths, [hole.depth for hole in holes]) | np.any(
        columns.states == ColumnState.MISSING, axis=0
    )
    out = []
    for first, last in true_runs((chance.probability > allowed) & ~known):
        worst = first + int(np.argmax(chance.probability[first : last + 1]))
        three = chance.columns[worst]
        if three is None:
            continue
        name, most = "-".join(columns.names[k] for k in three), float(chance.probability[worst])
        top, bottom = float(columns.depths[first]), float(columns.depths[last])
        text = (
            f"a void has a probability of {most:.2g} at {columns.depths[worst]:g} m, most of all between {name} at "
            f"({chance.places[worst][0]:.3f}, {chance.places[worst][1]:.3f}) m"
        )
        out.append(Finding(FindingKind.DOUBTFUL, name, top, bottom, text, most))
    return out


def _crossing_findings(columns: Columns, pairs: npt.NDArray[np.intp]) -> list[Finding]:
    out = []
    for joint, depth in crossed_joints(columns, pairs):
        name, at = joint_name(columns, pairs[joint]), float(columns.depths[depth])
        out.append(
            Finding(FindingKind.CROSSING, name, at, at, f"columns {name} cross: they have changed sides at {at:g} m")
        )
    return out
