"""What a node makes of a field's world: honesty, flags, false faults and surveys, disturbance by disturbance.

A cycle is told of while the node carries a flag, and in the ten before one: so long a doubt may take. NEES is over the
cycles that are not told of; ``unflagged`` is the share of all cycles in which the yaw is off by more than three of the
sigmas stated and that are not told of. Faults of sensors are false wherever the world has none.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import angle_stds, direction_angles, known_direction, resolve_direction
from groundstation.survey.fusion.transport import carry_directions
from node.kernels.arithmetic.angles import wrap_angle
from sim.string.direct_string import DirectString
from sim.string.result import StringRun
from sim.studies.field.cases import ALL, BLOCKS, CASES, FEWEST, LARGEST, DisturbanceCase
from sim.studies.field.drawn_constants import draw_constants, draw_some, merge_tables
from sim.studies.field.field_rows import EVERY
from sim.studies.field.third_world import THIRD
from sim.studies.pool import Step, over_cores
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import NodeFlag, SurveyMeasurement

Array = npt.NDArray[np.float64]
Mask = npt.NDArray[np.bool_]
RUN_IN = 20.0  # s of turning, and of the first rest, before the yaw is judged
SETTLE = 5.0  # s of a rest likewise
WITHIN = 10  # cycles in which a doubt must have been told
SIGMAS = 3.0
DOUBTS = (
    NodeFlag.YAW_UNTRUSTED
    | NodeFlag.INNOVATION_REJECTED
    | NodeFlag.RATE_EXCEEDED
    | NodeFlag.SENSOR_FAULT
    | NodeFlag.BIAS_UNKNOWN
)
FAULTS = ("gyro_saturated", "gyro_stuck", "gyro_step", "gyro_scale", "force_saturated", "force_stuck", "bad_sample")
AZIMUTH = ("azimuth_error", "azimuth_std")
NEES, UNFLAGGED, FALSE = 1.5, 0.01, 0.02  # to reach
SHARP, BLUNT = 3.0, 10.0  # median of sigma over the rms of the error, to reach, with a state for it and without


@dataclass(frozen=True, slots=True)
class DisturbanceRun:
    """One seed: (cycles,) of the lowest tube."""

    error: Array  # rad, with all constant errors
    var: Array  # rad^2, likewise
    told: Mask
    turning: Mask  # cycles that are judged as turning
    resting: Mask
    faults: dict[str, int]
    surveys: int
    azimuth_error: Array  # (surveys,) rad, as the ground station has it
    azimuth_std: Array  # (surveys,) rad, as it states it


def count_steps(disturbance: str, seeds: int) -> int:
    """Runs of all seeds."""
    return seeds * len(chosen_cases(disturbance))


def chosen_cases(disturbance: str) -> list[DisturbanceCase]:
    """The row of one disturbance, or all."""
    return [case for case in EVERY if disturbance in (ALL, case.key)]


def drawn_setup(case: DisturbanceCase, seed: int) -> dict[str, Any]:
    """Scenario of a row, its constants drawn by one seed."""
    setup: Mapping[str, Any] = case.setup
    for one in draw_some(case.mild, FEWEST, LARGEST, seed) if case.mild else ():
        setup = merge_tables(setup, one)
    return draw_constants(setup, seed)


def drawn_jobs(case: DisturbanceCase, seeds: Iterable[int]) -> list[tuple[DisturbanceCase, int]]:
    """Jobs of ``run_seed``."""
    return [(case, seed) for seed in seeds]


def run_study(disturbance: str, seeds: int, step: Step) -> dict[str, Any]:
    """One row a disturbance; ``step`` is called after each run."""
    rows = {}
    with over_cores(seeds, step) as run_all:
        for case in chosen_cases(disturbance):
            rows[case.key] = disturbance_row(case, run_all(run_seed, drawn_jobs(case, range(1, seeds + 1))))
    cases, third = ([rows[case.key] for case in some if case.key in rows] for some in (CASES, THIRD))
    return {"experiment": "field", "seeds": seeds, "cases": cases, "third": third}


def run_seed(job: tuple[DisturbanceCase, int]) -> DisturbanceRun:
    """One seed of one disturbance, for a pool of processes."""
    case, seed = job
    world = World(scenario_of(drawn_setup(case, seed)), seed)
    run_in = 0.0 if case.judges_ramps else RUN_IN
    return judge_lowest_tube(world, DirectString(world, state_every=1).drill(), run_in)


def judge_lowest_tube(world: World, run: StringRun, run_in: float = RUN_IN) -> DisturbanceRun:
    """The lowest tube against the truth, from ``run_in`` s of turning on."""
    states = {cycle: state for cycle, state in run.states if state.tube == 1}
    flagged = np.array([bool(states[k].flags & DOUBTS) if k in states else True for k in range(world.cycles)])
    told = np.array([bool(np.any(flagged[k : k + WITHIN + 1])) for k in range(world.cycles)])
    faults = dict.fromkeys(FAULTS, 0)
    for _, event in run.events:
        if event.code in faults and event.tube == 1:
            faults[event.code] += 1
    surveys = [survey.measurement for survey in run.surveys if survey.tube == 1]
    azimuth_error, azimuth_std = judge_azimuths(world, surveys)
    error, var = run.total_error[:, 0], run.total_var[:, 0]
    turning, resting = judged_cycles(world, run_in)
    return DisturbanceRun(error, var, told, turning, resting, faults, len(surveys), azimuth_error, azimuth_std)


def judge_azimuths(world: World, surveys: Sequence[SurveyMeasurement]) -> tuple[Array, Array]:
    """Errors and standard deviations (surveys,), rad, of the azimuths of a ground station that knows its string."""
    hole = world.scenario.hole
    found = []
    for one in surveys:
        force, cov = np.array(one.imus[0].force), np.array(one.imus[0].force_cov)
        found.append(resolve_direction(force, cov, one.yaw, one.yaw_var + one.systematic_var).direction)
    rough = world.scenario.file.rough
    if rough is not None and rough.string.transport == "parallel" and found:
        found = [
            carried.direction
            for carried in carry_directions(known_direction(*hole.direction(0.0)), found, range(len(found) + 1))
        ]
    true = [hole.direction(world.bit_depth(one.station_at))[1] for one in surveys]
    azimuths = [direction_angles(one.lean, one.down)[1] for one in found]
    stds = [angle_stds(one.lean, one.down, one.total_cov)[1] for one in found]
    return np.array([wrap_angle(a - b) for a, b in zip(azimuths, true, strict=True)]), np.array(stds)


def judged_cycles(world: World, run_in: float = RUN_IN) -> tuple[Mask, Mask]:
    """Cycles in which the string turns or rests, its first seconds of either left out."""
    turning, resting = np.zeros((2, world.cycles), np.bool_)
    for phase in world.phases:
        if phase.kind == "drill":
            turning |= (world.ends > phase.start + run_in) & (world.ends <= phase.end)
        elif phase.kind == "stop":
            resting |= (world.ends > phase.start + SETTLE) & (world.ends <= phase.end)
    return turning, resting


def disturbance_row(case: DisturbanceCase, runs: Sequence[DisturbanceRun]) -> dict[str, Any]:
    """Figures of one disturbance."""
    nees_turning, nees_rest = unflagged_nees(runs, "turning"), unflagged_nees(runs, "resting")
    lies = [(r.error**2 > SIGMAS**2 * r.var) & ~r.told for r in runs]
    unflagged = float(np.mean([np.mean(lie[r.turning | r.resting]) for lie, r in zip(lies, runs, strict=True)]))
    faults = {code: float(np.mean([r.faults[code] for r in runs])) for code in FAULTS if code not in case.true_faults}
    surveys = float(np.mean([r.surveys for r in runs])) / BLOCKS
    others = sum(count for code, count in faults.items() if code not in ("gyro_step", "gyro_scale"))
    azimuth_error, azimuth_std = (np.concatenate([getattr(r, name) for r in runs]) for name in AZIMUTH)
    azimuth_nees = float(np.mean(azimuth_error**2 / azimuth_std**2)) if surveys else math.nan
    judged_nees, lying = [nees_turning, nees_rest], unflagged
    if case.by_ground:
        judged_nees, lying = [azimuth_nees], float(np.mean(np.abs(azimuth_error) > SIGMAS * azimuth_std))
    worst = max(value for value in (*judged_nees, 0.0) if math.isfinite(value))
    false = max(faults["gyro_step"], faults["gyro_scale"], others)
    sharpness = {when: sigma_over_error(runs, when) for when in ("turning", "resting")}
    bluntest = max((value for value in (*sharpness.values(), 0.0) if math.isfinite(value)), default=0.0)
    is_sharp = case.by_ground or bluntest <= (SHARP if case.has_state else BLUNT)
    return {
        "case": case.name,
        "yaw_rms_turning_deg": rms_deg(runs, "turning"),
        "yaw_rms_rest_deg": rms_deg(runs, "resting"),
        "nees_turning": nees_turning,
        "nees_rest": nees_rest,
        "unflagged_percent": 100.0 * unflagged,
        "told_percent": 100.0 * float(np.mean([r.told[r.turning | r.resting].mean() for r in runs])),
        "gyro_step": faults["gyro_step"],
        "gyro_scale": faults["gyro_scale"],
        "other_faults": others,
        "surveys_percent": 100.0 * surveys,
        "azimuth_rms_deg": math.degrees(math.sqrt(float(np.mean(azimuth_error**2)))) if surveys else math.nan,
        "azimuth_nees": azimuth_nees,
        "sharpness_turning": sharpness["turning"],
        "sharpness_rest": sharpness["resting"],
        "sharp": is_sharp,
        "reached": worst <= NEES and lying <= UNFLAGGED and false <= FALSE and surveys >= 1.0,
        "unseen": case.unseen,
        "by_ground": case.by_ground,
    }


def rms_deg(runs: Sequence[DisturbanceRun], when: str) -> float:
    """Root mean square of the yaw's error, deg; no more than half a turn."""
    squares = [r.error[getattr(r, when)] ** 2 for r in runs]
    return math.degrees(math.sqrt(float(np.nanmean(np.concatenate(squares)))))


def sigma_over_error(runs: Sequence[DisturbanceRun], when: str) -> float:
    """Median of the sigmas stated over the root mean square of the errors; NaN where there are none of either."""
    std = np.concatenate([np.sqrt(r.var[getattr(r, when)]) for r in runs])
    error = np.concatenate([r.error[getattr(r, when)] for r in runs])
    known = np.isfinite(std) & np.isfinite(error)
    if not known.any():
        return math.nan
    return float(np.median(std[known]) / math.sqrt(float(np.mean(error[known] ** 2))))


def unflagged_nees(runs: Sequence[DisturbanceRun], when: str) -> float:
    """Mean of error^2 / variance over the unflagged cycles; NaN where all are flagged."""
    chosen = [getattr(r, when) & ~r.told for r in runs]
    found = np.concatenate([r.error[c] ** 2 / r.var[c] for r, c in zip(runs, chosen, strict=True)])
    return float(np.mean(found)) if len(found) else math.nan


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Line on how many rows are reached, and which are not."""
    rows = [*result["cases"], *result["third"]]
    missed = [r["case"] for r in rows if not r["reached"]]
    unseen = [r["case"] for r in rows if not r["reached"] and r["unseen"]]
    reached = len(rows) - len(missed)
    lines = [
        f"{reached} of {len(rows)} rows reach NEES {NEES:g}, {100.0 * UNFLAGGED:g} % unflagged, "
        f"{FALSE:g} false faults a run and every survey"
    ]
    lines += [f"not reached: {name}" for name in missed if name not in unseen]
    lines += [f"sigma beyond {SHARP:g} or {BLUNT:g} times the error: {r['case']}" for r in rows if not r["sharp"]]
    lines += [f"not for one node to see: {name}" for name in unseen]
    by_ground = [(r["case"], r["azimuth_nees"]) for r in rows if r["by_ground"]]
    return lines + [f"judged by its surveys at the ground station: {name}: NEES {nees:.2f}" for name, nees in by_ground]
