"""One node on a bad day: share of its time, and of its surveys, that is wrong without a word."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from borechain.studies.bad_days.shares import interval_of
from sim.string.direct_string import DirectString
from sim.string.result import StringRun
from sim.studies.field.cases import DisturbanceCase
from sim.studies.field.run import DOUBTS, SIGMAS, drawn_setup, judge_azimuths, judge_lowest_tube
from sim.world.scenario import scenario_of
from sim.world.world import World

Mask = npt.NDArray[np.bool_]
MUCH: Final = 0.02  # of the time judged, that a day may leave untold


@dataclass(frozen=True, slots=True)
class NodeDay:
    """One seed: ``untold`` is the share of the cycles judged, and (surveys,) are those of yaw and azimuth beyond."""

    untold: float
    yaw_beyond: Mask
    azimuth_beyond: Mask


def run_day(job: tuple[DisturbanceCase, int]) -> NodeDay:
    """One seed of a row of the field, for a pool of processes."""
    case, seed = job
    world = World(scenario_of(drawn_setup(case, seed)), seed)
    run = DirectString(world, state_every=1).drill()
    judged = judge_lowest_tube(world, run)
    cycles = judged.turning | judged.resting
    lies = (judged.error**2 > SIGMAS**2 * judged.var) & ~judged.told
    return NodeDay(float(lies[cycles].mean()), *surveys_beyond(world, run, judged.told))


def surveys_beyond(world: World, run: StringRun, told: Mask) -> tuple[Mask, Mask]:
    """Surveys (surveys,) whose yaw, and azimuth, is off by more than three sigmas without a flag.

    Each as it was said last; one is told of where its own flags or those of the node, within ten cycles, say so.
    """
    said = {one.cycle: one for one in (*run.surveys, *run.revisions)}
    last = [said[cycle] for cycle in sorted(said)]
    untold = np.array([not (told[one.cycle] or one.measurement.flags & DOUBTS) for one in last], np.bool_)
    stated = np.array([one.measurement.yaw_var + one.measurement.systematic_var for one in last], np.float64)
    error = np.array([one.error for one in last], np.float64)
    azimuth_error, azimuth_std = judge_azimuths(world, [one.measurement for one in last])
    return (error**2 > SIGMAS**2 * stated) & untold, (np.abs(azimuth_error) > SIGMAS * azimuth_std) & untold


def day_row(name: str, days: Sequence[NodeDay]) -> dict[str, Any]:
    """Row of one kind of day; surveys of one seed err alike, so they count as one in an interval."""
    much = [day.untold > MUCH for day in days]
    row: dict[str, Any] = {"case": name, "seeds": len(days), "surveys": sum(len(day.yaw_beyond) for day in days)}
    row |= interval_of("much_untold", float(np.mean(much)), len(days))
    for key, beyond in (("yaw", [d.yaw_beyond for d in days]), ("azimuth", [d.azimuth_beyond for d in days])):
        row |= interval_of(f"{key}_beyond", float(np.mean(np.concatenate(beyond))), len(days))
    return row | {"untold_percent": 100.0 * float(np.mean([day.untold for day in days]))}
