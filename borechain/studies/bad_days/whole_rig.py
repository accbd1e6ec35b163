"""A rig of five tubes on a bad day: stations beyond three sigmas, after the ground station's adjustment, untold.

The rig is one of the study ``set-up``, whose set-up errs as it is stated, drilled on a day of the field. A station is
told of where the ground station's answer holds a doubt, an alarm or a cause, but for those that any rig has: as it
starts and ends, and of the clocks, which say nothing of a direction.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from borechain.studies.bad_days.shares import interval_of
from borechain.studies.blunders.answer_given import AnswerGiven, answer_of
from borechain.studies.drawn_rigs import KnownSetUp, RigDraw, drawn_rigs, tables_of
from borechain.studies.heard_ground import IN_ONE, heard_ground
from borechain.studies.judged_hole import judge_hole_of
from sim.studies.field.cases import FEWEST, FINE_HZ, LARGEST
from sim.studies.field.drawn_constants import draw_constants, draw_some, merge_tables
from sim.studies.field.third_world import MILD
from sim.studies.scenarios import Tables
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
TUBES: Final = 5
BEYOND: Final = 11.829  # square of a direction's error, of two degrees of freedom, as seldom as three sigmas
NO_WORD: Final = frozenset({"clock"})  # alarms
AS_IN_FIELD: Final[Tables] = {
    "rig": {"tubes": TUBES},
    "rough": {"samples_hz": FINE_HZ},
    "encoder": {"phase": "random"},
    "gyroscope": {"increments": True},
}
USUAL: Final = KnownSetUp()
CALIBRATED: Final = replace(USUAL, bias_mg=0.035, tilt_deg=0.002, north_deg=0.01)


@dataclass(frozen=True, slots=True)
class RigCase:
    """A row: how well the rig is known, and its lean."""

    case: str
    known: KnownSetUp
    inclination_deg: float


RIGS: Final = (
    RigCase("a bad day, 2 deg of lean, known as in set-up", USUAL, 2.0),
    RigCase("a bad day, 30 deg, calibrated, north to 0.01 deg", CALIBRATED, 30.0),
)


@dataclass(frozen=True, slots=True)
class RigDay:
    """One rig: squares (stations,) of its directions' errors in what is stated of them, and the answer given."""

    squares: Array
    answer: AnswerGiven

    @property
    def is_told(self) -> bool:
        """Whether the crew is told that something is wrong, or not known."""
        return bool(self.answer.doubts or self.answer.causes or set(self.answer.alarms) - NO_WORD)


def rig_jobs(case: RigCase, rigs: int, first: int) -> list[tuple[RigCase, RigDraw]]:
    """Jobs of ``run_rig_day``: rigs from a first number on, in holes of all kinds in turn."""
    drawn = drawn_rigs(case.known, rigs, first)
    return [(case, replace(draw, inclination_deg=case.inclination_deg)) for draw in drawn]


def tables_of_day(draw: RigDraw) -> Tables:
    """Scenario of a rig on its day."""
    tables = merge_tables(tables_of(draw), AS_IN_FIELD)
    tables["told"] = {**tables["told"], "lengths_off_m": tables["told"]["lengths_off_m"][:TUBES]}
    for one in draw_some(MILD, FEWEST, LARGEST, draw.seed):
        tables = merge_tables(tables, one)
    return draw_constants(tables, draw.seed)


def run_rig_day(job: tuple[RigCase, RigDraw]) -> RigDay:
    """One rig, for a pool of processes."""
    _, draw = job
    world = World(scenario_of(dict(tables_of_day(draw))), draw.seed)
    with heard_ground(world, IN_ONE) as ground:
        return RigDay(judge_hole_of(world, ground.model.hole).direction_squares, answer_of(ground))


def rig_row(case: RigCase, days: Sequence[RigDay]) -> dict[str, Any]:
    """Row of one kind of rig; stations of one rig err alike, so they count as one in an interval."""
    beyond = np.concatenate([day.squares > BEYOND for day in days])
    untold = np.concatenate([(day.squares > BEYOND) & (not day.is_told) for day in days])
    row: dict[str, Any] = {"case": case.case, "rigs": len(days), "stations": len(beyond)}
    row |= {"beyond_percent": 100.0 * float(np.mean(beyond))}
    row |= interval_of("untold", float(np.mean(untold)), len(days))
    return row | {"told_percent": 100.0 * float(np.mean([day.is_told for day in days]))}
