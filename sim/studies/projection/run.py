"""Where holes end, foreseen from every depth: a thousand of seven kinds, scored against where they do end.

Holes are drilled with constants other than those of the prior (`drilled_holes.DrilledGround`), so the study judges what
a rig meets that is not the one that the prior was stated for. The share of ends inside the cone of 95 % is to be 93 to
97 % from every depth, and the continuous ranked probability score below those of going straight on and of bending on as
now.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from sim.studies.pool import Step, over_cores
from sim.studies.projection.drilled_holes import KINDS, DrilledGround, drill_holes
from sim.studies.projection.foreseen_ends import SPACING, STATIONS, Foreseen, foresee_ends

Array = npt.NDArray[np.float64]
HOLES_A_JOB = 25
GROUNDS = {
    "as judged": DrilledGround(),
    "half as crooked": DrilledGround(scale=0.5),
    "twice as crooked": DrilledGround(scale=2.0),
}
OTHERS_SHARE = 4  # of the holes, that each other ground has
INSIDE = (93.0, 97.0)  # %, to be reached
BINS = 10  # of the chances
STRETCHES = {"every depth": slice(None), "2 m": slice(0, 1), "4 m on": slice(1, None)}  # at 2 m the prior alone speaks
CM = 100.0
Job = tuple[str, int, int, int]  # ground, seed, numbers from and to before


def count_steps(holes: int, seed: int) -> int:
    """Jobs of some holes each."""
    return len(_jobs(holes, seed))


def run_study(holes: int, seed: int, step: Step) -> dict[str, Any]:
    """Tables of what was foreseen; ``step`` is called after every 25 holes.

    Parameters
    ----------
    holes : of all kinds together, on the ground that is judged; a quarter as many on one that is half as crooked and
        on one that is twice as crooked
    seed : of all of them

    Returns
    -------
    dict
        ``cases``: a row a depth; ``kinds``: the share inside by kind; ``grounds``: by ground; ``reliability``: chances
        that were stated from all stations, the first and those below, and how often it was so.
    """
    jobs = _jobs(holes, seed)
    with over_cores(len(jobs), step) as run_all:
        found = run_all(_foresee, jobs)
    by_ground: dict[str, list[Foreseen]] = {name: [] for name in GROUNDS}
    for (ground, *_), some in zip(jobs, found, strict=True):
        by_ground[ground] += some
    judged = by_ground["as judged"]
    return {
        "experiment": "projection",
        "holes": holes,
        "cases": [_depth_row(judged, k) for k in range(STATIONS)],
        "kinds": [_inside_row(name, judged[place :: len(KINDS)]) for place, name in enumerate(KINDS)],
        "grounds": [_inside_row(name, some) for name, some in by_ground.items()],
        "reliability": [row for part in STRETCHES for row in _reliability_rows(judged, part)],
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Whether the cone holds what it states from every depth, and beats the two simple guesses."""
    shares = [row["inside_percent"] for row in result["cases"]]
    low, high = INSIDE
    honest = "honest" if low <= min(shares) and max(shares) <= high else "not honest"
    beaten = [row["score_cm"] < min(row["score_straight_cm"], row["score_constant_cm"]) for row in result["cases"]]
    return [
        f"inside the cone of 95 %: {min(shares):.1f} to {max(shares):.1f} % (allowed {low:g}..{high:g}): {honest}",
        f"better than straight on and than the curvature of now: from {sum(beaten)} of {len(beaten)} depths",
    ]


def _jobs(holes: int, seed: int) -> list[Job]:
    numbers = {name: holes if name == "as judged" else max(holes // OTHERS_SHARE, len(KINDS)) for name in GROUNDS}
    return [
        (name, seed, first, min(first + HOLES_A_JOB, count))
        for name, count in numbers.items()
        for first in range(0, count, HOLES_A_JOB)
    ]


def _foresee(job: Job) -> list[Foreseen]:
    ground, seed, first, end = job
    numbers = range(first, end)
    holes = drill_holes(seed, numbers, GROUNDS[ground])
    return [foresee_ends(hole, seed, number) for hole, number in zip(holes, numbers, strict=True)]


def _depth_row(found: list[Foreseen], k: int) -> dict[str, Any]:
    """Row of one depth."""
    off = np.array([one.off[k] for one in found])
    return {
        "case": f"{SPACING * (k + 1):g} m",
        "depth_m": SPACING * (k + 1),
        "inside_percent": 100.0 * float(np.mean([one.inside[k] for one in found])),
        "radius_cm": CM * float(np.median([one.radius[k] for one in found])),
        "rms_cm": CM * float(np.sqrt(np.mean(off**2))),
        "score_cm": CM * float(np.mean([one.score[k] for one in found])),
        "score_straight_cm": CM * float(np.mean([one.straight[k] for one in found])),
        "score_constant_cm": CM * float(np.mean([one.constant[k] for one in found])),
        "deadline_percent": 100.0 * float(np.mean([one.reached[k] for one in found])),
    }


def _inside_row(name: str, found: list[Foreseen]) -> dict[str, Any]:
    """Share inside the cone, over all depths and at the best and worst of them."""
    shares = 100.0 * np.mean([one.inside for one in found], axis=0)
    return {
        "case": name,
        "holes": len(found),
        "inside_percent": float(shares.mean()),
        "least_percent": float(shares.min()),
        "most_percent": float(shares.max()),
    }


def _reliability_rows(found: list[Foreseen], stretch: str) -> list[dict[str, Any]]:
    """Chances of ending within a limit from some depths, in bins: what was stated, and how often it was so.

    A hole is asked from every depth and for every limit, and what it answers is not independent: ``holes`` are those
    that are behind a bin.
    """
    stated = np.array([one.chances[STRETCHES[stretch]] for one in found])
    came = np.array([np.broadcast_to(one.within, stated.shape[1:]) for one in found])
    places = np.minimum((stated * BINS).astype(int), BINS - 1)
    rows = []
    for place in range(BINS):
        those = places == place
        if those.any():
            rows.append({
                "case": f"{100 * place // BINS} to {100 * (place + 1) // BINS} %", "from": stretch,
                "holes": int(those.any(axis=(1, 2)).sum()), "stated_percent": 100.0 * float(stated[those].mean()),
                "observed_percent": 100.0 * float(came[those].mean()),
            })  # fmt: skip
    return rows
