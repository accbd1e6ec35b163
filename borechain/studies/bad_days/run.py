"""What bad days leave untold: the time and the surveys of one node, and the stations of a rig after its adjustment."""

from __future__ import annotations

from typing import Any, Final

from borechain.studies.bad_days.one_node import MUCH, day_row, run_day
from borechain.studies.bad_days.whole_rig import RIGS, rig_jobs, rig_row, run_rig_day
from sim.studies.field.run import chosen_cases, drawn_jobs
from sim.studies.pool import Step, over_cores

DAY: Final = "bad-day"  # row of the field
MOST_DAYS, MOST_SURVEYS = 3.0, 1.0  # %, to reach


def count_steps(seeds: int, rigs: int, first: int) -> int:
    """Runs of one node, and rigs."""
    del first
    return seeds + rigs * len(RIGS)


def run_study(seeds: int, rigs: int, first: int, step: Step) -> dict[str, Any]:
    """Both tables, drawn from a first number on; ``step`` is called after each run.

    Returns
    -------
    dict
        ``cases``: the row of one node; ``rig_cases``: a row a kind of rig.
    """
    (case,) = chosen_cases(DAY)
    with over_cores(max(seeds, rigs), step) as run_all:
        days = run_all(run_day, drawn_jobs(case, range(first, first + seeds)))
        rig_cases = [rig_row(one, run_all(run_rig_day, rig_jobs(one, rigs, first))) for one in RIGS]
    return {
        "experiment": "bad-days",
        "seeds": seeds,
        "rigs": rigs,
        "first": first,
        "cases": [day_row(case.name, days)],
        "rig_cases": rig_cases,
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Whether bad days leave as little untold as they are to."""
    lines = [
        f"{row['case']}: {said_share(row, 'much_untold')} of seeds leave more than {100.0 * MUCH:g} % untold, "
        f"{word_on(row['much_untold_percent'], MOST_DAYS)}; {said_share(row, 'azimuth_beyond')} of surveys beyond "
        f"3 sigma untold, {word_on(row['azimuth_beyond_percent'], MOST_SURVEYS)}"
        for row in result["cases"]
    ]
    return lines + [
        f"{row['case']}: {said_share(row, 'untold')} of stations beyond 3 sigma untold, "
        f"{word_on(row['untold_percent'], MOST_SURVEYS)}"
        for row in result["rig_cases"]
    ]


def said_share(row: dict[str, Any], key: str) -> str:
    """A share with its interval, in words."""
    return f"{row[f'{key}_percent']:.1f} % ({row[f'{key}_low']:.1f} to {row[f'{key}_high']:.1f})"


def word_on(percent: float, most: float) -> str:
    """Whether a bound holds."""
    return f"at most {most:g} {'holds' if percent <= most else 'is missed'}"
