"""Delay of the aiding: yaw error while rotating and at rest, with the time of validity and with that of arrival.

Source: thesis eq. 3.29. Without compensation the node takes an aiding as valid when it arrives; the published form has
no time-stamp state. The third form has that state and a clock that says it may be wrong by the delay, up to the 50 ms
that a node believes. Clocks are perfect here. At rest is from 20 s after the stop. The figures beside ours are those
of a study of the published scheme.
"""

from __future__ import annotations

from typing import Any

from sim.studies.lab import LAB, ROTATING, SETTLED
from sim.studies.pool import Step
from sim.studies.scenarios import change_sections
from sim.studies.trials import interval_row, over_seeds, rms_deg

DELAYS_MS = (0.0, 10.0, 30.0, 100.0)
PLAIN = change_sections(LAB, medium={"latency_ms": 0.0}, clocks={"joint_std_ms": 0.0, "wander_std_ms": 0.0})
ARRIVAL = {"dated_by": "arrival"}
FOUND = "dated by arrival, with time-stamp state"
FORMS = {
    "compensated": PLAIN,
    "dated by arrival": change_sections(PLAIN, medium=ARRIVAL, node={"tuning": {"stamp_std": 0.0}}),
    FOUND: change_sections(PLAIN, medium=ARRIVAL),
}
TO_REACH_DEG = 0.04  # compensated, rotating
STUDIED_DEG = {("dated by arrival", 10.0): 0.7, ("dated by arrival", 100.0): 7.2}


def count_steps(seeds: int) -> int:
    """Runs of one seed."""
    return seeds * len(DELAYS_MS) * len(FORMS)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """Rows of every form and delay."""
    cases = []
    with over_seeds(seeds, step) as run_all:
        for form, setup in FORMS.items():
            for delay in DELAYS_MS:
                stated = max(delay, 1.0) if form == FOUND else None
                runs = run_all(change_sections(setup, medium={"delay_ms": delay}, clocks={"stated_std_ms": stated}))
                turning, rest = (rms_deg([r.error[window, 0] for r in runs]) for window in (ROTATING, SETTLED))
                name, reach = f"{form}, {delay:g} ms", TO_REACH_DEG if form == "compensated" else None
                studied = STUDIED_DEG.get((form, delay))
                rows = [
                    interval_row(name, "yaw, rotating", turning, published=studied, to_reach=reach),
                    interval_row(name, "yaw, at rest", rest),
                ]
                cases += [{**r, "form": form, "delay_ms": delay} for r in rows]
    return {"experiment": "delay", "seeds": seeds, "cases": cases}
