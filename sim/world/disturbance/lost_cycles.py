"""Cycles that no node runs: its processor was busy, and what the sensors read meanwhile is gone.

``sim.string.schedule`` has which cycles are run.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
from pydantic import Field

from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance
from sim.world.scenario_file import ScenarioFile
from sim.world.section import NotNegative, ScenarioSection


class LostCyclesSection(ScenarioSection):
    """When, and how many."""

    after_s: NotNegative = Field(0.0, description="after the start; those are lost that end from then on")
    cycles: int = Field(0, ge=0, le=100, description="in a row")


def are_run(file: ScenarioFile, ends: Array) -> npt.NDArray[np.bool_]:
    """Which of the cycles that end at ``ends`` (n,) s are run."""
    section = LOST_CYCLES.section_of(file)
    first = int(np.searchsorted(ends, file.schedule.begin_s + section.after_s))
    found = np.ones(len(ends), np.bool_)
    found[first : first + section.cycles] = False
    return found


LOST_CYCLES = Disturbance("lost-cycles", (), ActsOn.TAKING, compiled=Compiled(), section=LostCyclesSection)
