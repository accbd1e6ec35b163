"""The published form in simulation, beside the thesis's value and ours, in the experiments of thesis 4.2.

Two rows a case. ``published filter``: the feed-forward kernel on the readings and aiding that our own filter has.
``published scheme``: with the published sensors as well, 1024 counts a turn without edge times, one gyroscope sample
a cycle, and aiding that is 10 ms old and dated by its arrival; a node hands its own yaw and variance down.
"""

from __future__ import annotations

from typing import Any

from node.firmware.kernel_choice import added_loop
from sim.string.plain_encoder import LINES
from sim.studies.lab import REST, LabRun, run_seed
from sim.studies.published_form.published_step import published_loop
from sim.studies.scenarios import Tables, change_sections
from sim.studies.trials import Trials, interval_row, rms_deg

KERNEL = "published"
DELAY_MS = 10.0
EXPERIMENTS = ("update-modes", "single-updates", "two-nodes")
FORMS = ("published filter", "published scheme")


def setup_of(setup: Tables, form: str) -> Tables:
    """A laboratory string with one of ``FORMS`` in place of ours."""
    filtered = change_sections(setup, node={"kernel": KERNEL, "scheme": "estimate"})
    if form == "published filter":
        return filtered
    return change_sections(
        filtered,
        medium={"delay_ms": DELAY_MS, "dated_by": "arrival"},
        encoder={"counts_per_turn": LINES, "edge_times": False},
        gyroscope={"instantaneous": True},
    )


def run_published(job: tuple[Tables, int]) -> LabRun:
    """One seed of one scenario, whose nodes may have the published form; for a pool of processes."""
    with added_loop(KERNEL, published_loop):
        return run_seed(job)


def rows_of(cases: list[tuple[str, Tables, int, float | str | None]], run_all: Trials) -> list[dict[str, Any]]:
    """Rows of yaw and azimuth of every form and case: its name, setup, hop and the thesis's azimuth rms (deg)."""
    rows: list[dict[str, Any]] = []
    for form in FORMS:
        last: Tables | None = None
        runs: list[LabRun] = []
        for name, setup, hop, published in cases:
            if setup is not last:
                last, runs = setup, run_all(setup_of(setup, form))
            yaw = rms_deg([r.error[REST, hop] for r in runs])
            azimuth = rms_deg([r.azimuth_error[hop : hop + 1] for r in runs])
            rows.append(interval_row(f"{name}, {form}", "yaw", yaw))
            rows.append(interval_row(f"{name}, {form}", "azimuth", azimuth, published=published))
    return rows
