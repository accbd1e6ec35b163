"""The published form in simulation, beside the thesis's value and ours, in the experiments of thesis 4.2.

Two rows a case. ``published filter``: the feed-forward kernel on the readings and aiding that our own filter has.
``published scheme``: with the published sensors as well, 1024 counts a turn without edge times, one gyroscope sample
a cycle, and aiding that is 10 ms old and dated by its arrival; a node hands its own yaw and variance down.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from node.kernels.layout import Scheme
from sim.rig.plain_encoder import LINES
from sim.studies.node_lab import REST, LabRun, LabSetup
from sim.studies.trials import Trials, rms_deg, row

DELAY = 10e-3  # s
EXPERIMENTS = ("update-modes", "single-updates", "two-nodes")
FORMS = ("published filter", "published scheme")


def setup_of(setup: LabSetup, form: str) -> LabSetup:
    """A laboratory string with one of ``FORMS`` in place of ours."""
    filtered = replace(setup, kernel="published", scheme=Scheme.ESTIMATE)
    if form == "published filter":
        return filtered
    return replace(filtered, delay=DELAY, dated_by_arrival=True, counts_per_turn=LINES, instantaneous=True)


def rows_of(cases: list[tuple[str, LabSetup, int, float | str | None]], run_all: Trials) -> list[dict[str, Any]]:
    """Rows of yaw and azimuth of every form and case: its name, setup, hop and the thesis's azimuth rms (deg)."""
    rows: list[dict[str, Any]] = []
    for form in FORMS:
        done: dict[LabSetup, list[LabRun]] = {}
        for name, setup, hop, published in cases:
            if setup not in done:
                done[setup] = run_all(setup_of(setup, form))
            yaw = rms_deg([r.error[REST, hop] for r in done[setup]])
            azimuth = rms_deg([r.azimuth_error[hop : hop + 1] for r in done[setup]])
            rows.append(row(f"{name}, {form}", "yaw", yaw))
            rows.append(row(f"{name}, {form}", "azimuth", azimuth, published=published))
    return rows
