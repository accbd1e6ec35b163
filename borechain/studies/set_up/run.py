"""Whether what is said of a hole holds, over rigs whose set-up errs as it is stated.

Every rig is a string of ten tubes with the firmware of its nodes, drilled into a hole of one of seven kinds, and a
ground station that is told what its crew believes. Biases, mounts, joints, north, collar, lengths, depths and the
play of every tube at every stop are drawn from what is stated of them. Of every station north, east, vertical,
direction and ellipsoid are judged against their 95 % regions, and the stated directions against the best possible
estimate of the same looks (``best_possible``).

A second table has the same rigs with tubes known less or better, at tool faces of any kind and at always the same: what
a string of raw sensors learns of itself while it drills.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, drawn_rigs, rms_of, tables_of
from borechain.studies.heard_ground import IN_ONE, heard_ground
from borechain.studies.judged_hole import (
    AXES,
    INSIDE_1,
    INSIDE_2,
    INSIDE_3,
    JudgedHole,
    judge_hole_of,
)
from borechain.studies.set_up.best_possible import best_of_rig
from sim.studies.pool import RunAll, Step, over_cores
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
USUAL: Final = KnownSetUp()
LOW, HIGH = 93.0, 97.0  # %, inside the 95 % region
SHARPEST: Final = 1.2  # times the best possible, at most
KNOWLEDGE: Final = {
    "calibrated, 0.035 mg": replace(USUAL, bias_mg=0.035, tilt_deg=0.002),
    "1 mg": replace(USUAL, tilt_deg=0.002),
    "5 mg": replace(USUAL, bias_mg=5.0, tilt_deg=0.002),
    "mounts not aligned, 0.5 deg": replace(USUAL, bias_mg=0.035),
}
PLAYS_DEG: Final = (0.01, 0.05)
FACES: Final = {"any tool face": True, "same tool face": False}


@dataclass(frozen=True, slots=True)
class SetUpRun:
    """One rig: its hole beside the truth, and the best standard deviations of its directions."""

    judged: JudgedHole
    best_std: Array  # (s,) rad, root of the mean variance about two axes


@dataclass(frozen=True, slots=True)
class SketchCase:
    """A row of the second table."""

    case: str
    play_deg: float
    faces: str
    known: KnownSetUp


def sketch_cases() -> list[SketchCase]:
    """Rows of the second table."""
    return [
        SketchCase(name, play, faces, replace(known, play_deg=play))
        for play in PLAYS_DEG
        for faces in FACES
        for name, known in KNOWLEDGE.items()
    ]


def count_steps(seeds: int, rigs: int, first: int) -> int:
    """Rigs of both tables."""
    del first
    return seeds + rigs * len(sketch_cases())


def run_study(seeds: int, rigs: int, first: int, step: Step) -> dict[str, Any]:
    """Both tables; ``step`` is called after each rig.

    Parameters
    ----------
    seeds : rigs of the first table
    rigs : of each row of the second
    first : number from which the rigs of both are drawn

    Returns
    -------
    dict
        ``cases``: a row a station; ``sketch``: a row of the second table; ``traces``: what the figure shows.
    """
    with over_cores(max(seeds, rigs), step) as run_all:
        runs = run_all(run_rig, drawn_rigs(USUAL, seeds, first))
        sketch = [sketch_row(case, run_sketch(run_all, case, rigs, first)) for case in sketch_cases()]
    stations = min(len(run.judged.md) for run in runs)
    return {
        "experiment": "set-up",
        "seeds": seeds,
        "rigs": rigs,
        "first": first,
        "cases": [station_row(place, runs) for place in range(stations)],
        "sketch": sketch,
        "traces": {"squares": np.array([run.judged.ellipsoid_squares[:stations] for run in runs])},
    }


def run_sketch(run_all: RunAll, case: SketchCase, rigs: int, first: int) -> list[SetUpRun]:
    """Rigs of a row of the second table."""
    return run_all(run_rig, drawn_rigs(case.known, rigs, first, stops_anywhere=FACES[case.faces]))


def run_rig(draw: RigDraw) -> SetUpRun:
    """One rig, for a pool of processes."""
    world = World(scenario_of(dict(tables_of(draw))), draw.seed)
    with heard_ground(world, IN_ONE) as ground:
        hole = ground.model.hole
        return SetUpRun(judge_hole_of(world, hole), best_of_rig(world, hole, ground.config, draw.known))


def station_row(place: int, runs: Sequence[SetUpRun]) -> dict[str, Any]:
    """How often the regions of one station hold the truth, and how sharp they are."""
    axes = np.array([run.judged.axis_squares[place] for run in runs])
    direction = np.array([run.judged.direction_squares[place] for run in runs])
    ellipsoid = np.array([run.judged.ellipsoid_squares[place] for run in runs])
    stated = np.array([math.sqrt(0.5 * np.trace(run.judged.lean_cov[place])) for run in runs])
    best = np.array([run.best_std[place] for run in runs])
    row: dict[str, Any] = {"case": f"station {place + 1}", "md_m": float(np.mean([r.judged.md[place] for r in runs]))}
    row |= {name: share_inside(axes[:, axis], INSIDE_1) for axis, name in enumerate(AXES)}
    row |= {"direction": share_inside(direction, INSIDE_2), "ellipsoid": share_inside(ellipsoid, INSIDE_3)}
    row |= {"direction_nees": float(np.mean(direction)) / 2.0, "ellipsoid_nees": float(np.mean(ellipsoid)) / 3.0}
    return row | {
        "stated_deg": math.degrees(rms_of(stated)),
        "best_deg": math.degrees(rms_of(best)),
        "ratio": rms_of(stated / best),
    }


def share_inside(squares: Array, limit: float) -> float:
    """Share of squares inside their 95 % limit, %."""
    return 100.0 * float(np.mean(squares <= limit))


def sketch_row(case: SketchCase, runs: Sequence[SetUpRun]) -> dict[str, Any]:
    """Error of the toe across the hole and what is stated of it, mm; directions and their best possible, deg."""
    toe = np.array([run.judged.error[-1, :2] for run in runs])
    stated = np.array([np.diag(run.judged.cov[-1])[:2] for run in runs])
    lean = np.concatenate([run.judged.lean_error for run in runs])
    stated_deg = np.concatenate([np.sqrt(0.5 * np.trace(run.judged.lean_cov, axis1=1, axis2=2)) for run in runs])
    best = np.concatenate([run.best_std for run in runs])
    return {
        "case": case.case,
        "faces": case.faces,
        "play_deg": case.play_deg,
        "toe_mm": 1e3 * rms_of(toe),
        "toe_stated_mm": 1e3 * math.sqrt(float(np.mean(stated))),
        "direction_deg": math.degrees(rms_of(lean)),
        "direction_stated_deg": math.degrees(rms_of(stated_deg)),
        "direction_best_deg": math.degrees(rms_of(best)),
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Whether all regions hold what they are to hold, and how sharp they are."""
    lines = []
    for name in (*AXES, "direction", "ellipsoid"):
        least, most = (extreme(row[name] for row in result["cases"]) for extreme in (min, max))
        holds = "as they are to" if least >= LOW and most <= HIGH else f"expected {LOW:g} to {HIGH:g}"
        lines.append(f"{name}: 95 % regions hold the truth in {least:.1f} to {most:.1f} % at a station; {holds}")
    most = max(row["ratio"] for row in result["cases"])
    word = "holds" if most <= SHARPEST else "is missed"
    lines.append(f"directions: stated at most {most:.2f} times the best possible; {SHARPEST:g} {word}")
    return lines
