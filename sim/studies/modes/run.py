"""Update modes, single updates, two nodes and fifty: error of yaw and azimuth at rest, thesis 4.2 beside ours.

Yaw: rms over the window of rest of every seed. Azimuth: that of the mean force and the mean yaw of the window. Joints
and mounts are exact and the accelerometer has noise only, as the figures to reach have it. While fifty
nodes turn, the scale factor is unknown until the first aiding; the figure from then on stands beside that of the whole.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from sim.studies.lab import LAB, ONCE_AIDED, REST, ROTATING, LabRun
from sim.studies.pool import Step
from sim.studies.published_form.published_forms import EXPERIMENTS, FORMS, rows_of, run_published
from sim.studies.scenarios import Tables, change_sections, complete_string, on_off
from sim.studies.trials import interval_row, over_seeds, rms_deg, yaw_error_trace

FIFTY_CLOCK_MS = 5.0  # each joint
FIFTY_LOSS = 1.0 - 0.7 ** (1.0 / 50.0)  # each hop, so that 30 % is lost on the way to hop 50


@dataclass(frozen=True, slots=True)
class ModeCase:
    """One line of thesis 4.2 at one hop; deg. ``published`` is an azimuth rms."""

    name: str
    setup: Tables
    published: float | str | None
    yaw: float
    azimuth: float | None
    hop: int = 0
    rotating: float | None = None


def _on_off(off: float, published: float, yaw: float, azimuth: float) -> ModeCase:
    return ModeCase(f"20 s on / {off:g} s off", change_sections(LAB, aiding=on_off(20.0, off)), published, yaw, azimuth)


def _single(hertz: float, published: float | str, yaw: float, azimuth: float) -> ModeCase:
    return ModeCase(
        f"single, {hertz:g} Hz", change_sections(LAB, aiding={"every_s": 1.0 / hertz}), published, yaw, azimuth
    )


TWO = change_sections(LAB, rig=complete_string(2))
FIFTY = change_sections(
    LAB,
    rig=complete_string(50),
    aiding=on_off(20.0, 30.0),
    clocks={"joint_std_ms": FIFTY_CLOCK_MS},
    medium={"loss": FIFTY_LOSS},
)
CASES = {
    "update-modes": (
        ModeCase("continuous 1.9 Hz", LAB, 0.029, 0.013, 0.035),
        _on_off(5.0, 0.250, 0.013, 0.035),
        _on_off(10.0, 0.384, 0.018, 0.038),
        _on_off(30.0, 0.351, 0.042, 0.050),
        _on_off(50.0, 1.0, 0.062, 0.068),
        _on_off(60.0, 0.565, 0.068, 0.070),
    ),
    "single-updates": (
        _single(1.0, "<0.25", 0.012, 0.033),
        _single(0.2, 0.521, 0.018, 0.036),
        _single(0.05, "~0.5", 0.042, 0.050),
        _single(0.0167, "irregular", 0.095, 0.095),
    ),
    "two-nodes": (
        ModeCase("node 1 of 2", TWO, 0.442, 0.015, 0.040),
        ModeCase("node 2 of 2", TWO, 0.761, 0.015, 0.040, hop=1),
    ),
    "fifty-nodes": (ModeCase("node 50 of 50", FIFTY, None, 0.03, None, hop=49, rotating=0.12),),
}


def count_steps(name: str, seeds: int) -> int:
    """Runs of one seed."""
    forms = len(FORMS) if name in EXPERIMENTS else 0
    return seeds * (1 + forms) * len(list(cases_by_setup(name)))


def cases_by_setup(name: str) -> Iterator[tuple[Tables, list[ModeCase]]]:
    """Every setup with its cases, which stand one after the other."""
    for _, cases in groupby(CASES[name], key=lambda case: id(case.setup)):
        found = list(cases)
        yield found[0].setup, found


def run_study(name: str, seeds: int, step: Step) -> dict[str, Any]:
    """Table and traces of one of ``CASES``; ``step`` is called after each seed.

    Returns
    -------
    dict
        ``cases``: rows; ``traces``: arrays of yaw errors by case, for figures.
    """
    cases: list[dict[str, Any]] = []
    traces: dict[str, Any] = {}
    with over_seeds(seeds, step, run_published) as run_all:
        for setup, of_setup in cases_by_setup(name):
            runs = run_all(setup)
            for case in of_setup:
                cases += mode_rows(case, runs)
                traces[case.name] = yaw_error_trace(runs, case.hop)
        if name in EXPERIMENTS:
            cases += rows_of([(case.name, case.setup, case.hop, case.published) for case in CASES[name]], run_all)
    return {"experiment": name, "seeds": seeds, "cases": cases, "traces": traces}


def mode_rows(case: ModeCase, runs: list[LabRun]) -> list[dict[str, Any]]:
    """Rows of one case."""
    name, hop = case.name, case.hop
    rows = [
        interval_row(name, "yaw", rms_deg([r.error[REST, hop] for r in runs]), to_reach=case.yaw),
        interval_row(name, "azimuth", rms_deg([r.azimuth_error[hop : hop + 1] for r in runs]), published=case.published,
            to_reach=case.azimuth),
    ]  # fmt: skip
    if case.rotating is not None:
        for words, when in (("rotating", ROTATING), ("rotating, once aided", ONCE_AIDED)):
            found = rms_deg([r.error[when, hop] for r in runs])
            rows.append(interval_row(name, f"yaw, {words}", found, to_reach=case.rotating))
    surveys = [r.survey_error[hop : hop + 1] for r in runs if np.isfinite(r.survey_error[hop])]
    if surveys:
        rows.append(interval_row(name, "azimuth, 32 points", rms_deg(surveys)))
    return rows
