"""Biases of accelerometers from the surveys of a string, stop by stop: how well they are known, and what that is worth.

Tubes pass the stations of a straight hole one after the other and stop at any tool face; the firmware of every node
follows the encoder. After every stop the ground station's regression is asked for the biases; the surveys of the next
stop are read again as the nodes would have had them under the blocks proposed then.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.force_biases import ForceBias, Look, look_of, solve_biases
from groundstation.survey.fusion.resolve import angle_stds, direction_angles, resolve_direction
from groundstation.survey.fusion.shared import SharedErrors
from node.kernels.arithmetic.angles import wrap_angle
from sim.string.direct_string import DirectString
from sim.string.result import StringSurvey
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.scenarios import Tables
from sim.world.scenario import scenario_of
from sim.world.world import World

Array = npt.NDArray[np.float64]
STOPS = 6
LENGTH = 2.0  # m, of a tube
BIAS = 9.81e-3  # m/s^2, each axis of every tube: 1 mg
GRAVITY_STD = 2e-3  # m/s^2, of the site's gravity as an operator knows it
AXES = 3
GRAVITY = 9.81  # m/s^2
INCLINATIONS_DEG = (2.0, 20.0)


@dataclass(frozen=True, slots=True)
class BiasRun:
    """Results of one seed, stop by stop."""

    measured: list[Array]  # rad, azimuth errors as they were read
    corrected: list[Array]  # rad, of the tubes that would have had a block by then
    corrected_std: list[Array]
    bias_error: list[Array]  # (tubes, 3) m/s^2, after the stop
    bias_std: list[Array]
    bias_nees: list[float]  # of all three axes, mean over the tubes


def straight_hole_scenario(inclination_deg: float) -> Tables:
    """A straight hole, drilled by a driller who stops anywhere."""
    return {
        "rig": {"tubes": STOPS, "tubes_at_start": 0, "tube_length_m": LENGTH},
        "path": {"straight": {"inclination_deg": inclination_deg}},
        "schedule": {"add_s": 60.0, "stop_s": 40.0, "finish_s": 5.0},
        "rotation": {"turns": 5.0},
        "accelerometer": {"bias_std_deg": 0.0},
        "drift": {"accelerometer_bias_std_mps2": BIAS},
        "encoder": {"phase": "random"},
        "medium": {"link": "off"},
        "rough": {"samples_hz": 50.0, "drive": {"stop_spread_deg": 360.0}},
    }


def count_steps(seeds: int) -> int:
    """Runs of all seeds."""
    return seeds * len(INCLINATIONS_DEG)


def run_study(seeds: int, step: Step) -> dict[str, Any]:
    """A row for each stop; ``step`` is called after each run."""
    rows = []
    with over_cores(seeds, step) as run_all:
        for inclination in INCLINATIONS_DEG:
            runs = run_all(run_seed, seed_jobs(straight_hole_scenario(inclination), seeds))
            rows += [stop_row(inclination, stop, runs) for stop in range(STOPS)]
    return {"experiment": "force-bias", "seeds": seeds, "cases": rows}


def run_seed(job: tuple[Tables, int]) -> BiasRun:
    """One seed, for a pool of processes."""
    tables, seed = job
    world = World(scenario_of(dict(tables)), seed)
    return judge_biases(world, DirectString(world).drill().surveys)


def judge_biases(world: World, surveys: Sequence[StringSurvey]) -> BiasRun:
    """Biases stop by stop, each with what was known after the one before."""
    found = BiasRun([], [], [], [], [], [])
    looks = looks_of(world, surveys)
    known: dict[int, ForceBias] = {}
    for stop in range(1, STOPS + 1):
        now = [look for at, look in looks if at == stop]
        found.measured.append(np.array([azimuth_error(world, look, np.zeros(AXES)) for look in now]))
        had = [(look, known[look.tube]) for look in now if look.tube in known]
        found.corrected.append(np.array([azimuth_error(world, look, block.bias) for look, block in had]))
        found.corrected_std.append(np.array([azimuth_std(look, block.cov) for look, block in had]))
        known = solve_biases([look for at, look in looks if at <= stop], BIAS, GRAVITY_STD)
        errors = np.array([one.bias - bias_of(world, tube) for tube, one in known.items()])
        covs = np.array([one.cov for one in known.values()])
        found.bias_error.append(errors)
        found.bias_std.append(np.sqrt(np.diagonal(covs, axis1=1, axis2=2)))
        found.bias_nees.append(float(np.mean(np.einsum("ni,nij,nj->n", errors, np.linalg.inv(covs), errors)) / AXES))
    return found


def bias_of(world: World, tube: int) -> Array:
    """Bias (3,) of a tube's accelerometer, m/s^2."""
    drift = world.sensors.drift(tube)
    return np.zeros(AXES) if drift is None else drift.bias


def azimuth_error(world: World, look: Look, bias: Array) -> float:
    """Error (rad) of the azimuth of a survey of a straight hole that is read with a bias (3,) taken off."""
    lean = look.lean - look.by_force @ bias
    return wrap_angle(direction_angles(lean, 1.0)[1] - world.scenario.hole.direction(0.0)[1])


def azimuth_std(look: Look, bias_cov: Array) -> float:
    """Standard deviation (rad) of that azimuth; the bias is known with a covariance (3, 3)."""
    cov = look.cov + look.columns @ look.columns.T + look.by_force @ bias_cov @ look.by_force.T
    return angle_stds(look.lean, 1.0, cov)[1]


def looks_of(world: World, surveys: Sequence[StringSurvey]) -> list[tuple[int, Look]]:
    """Every survey below the collar as a look, with the number of its stop."""
    file = world.scenario.file
    shared = SharedErrors()
    mount_var = math.radians(file.joints.mount_std_deg) ** 2
    found = []
    for survey in surveys:
        m = survey.measurement
        stop = round(world.bit_depth(m.station_at) / LENGTH)
        station = stop - m.tube + 1
        if station < 1:
            continue
        force, cov = np.array(m.imus[0].force), np.array(m.imus[0].force_cov)
        resolved = resolve_direction(force, cov, m.yaw, m.yaw_var)
        causes = shared.causes_of(resolved, m.tube, range(m.tube + 1, stop + 1), m.systematic_var, mount_var, 0.0)
        var = float(np.trace(cov)) / AXES
        found.append((stop, look_of(station, m.tube, resolved.direction, causes, force, var, m.yaw, GRAVITY)))
    return found


def stop_row(inclination_deg: float, stop: int, runs: Sequence[BiasRun]) -> dict[str, Any]:
    """Figures of one stop, from 0."""
    measured, corrected, stds = (
        np.concatenate([getattr(r, name)[stop] for r in runs]) for name in ("measured", "corrected", "corrected_std")
    )
    errors, bias_stds = (np.concatenate([getattr(r, name)[stop] for r in runs]) for name in ("bias_error", "bias_std"))
    return {
        "case": f"{inclination_deg:g} deg, stop {stop + 1}",
        "azimuth_measured_deg": rms_deg(measured),
        "azimuth_corrected_deg": rms_deg(corrected),
        "azimuth_nees": float(np.mean(corrected**2 / stds**2)) if len(corrected) else math.nan,
        "bias_xy_mg": milli_g(errors[:, :2]),
        "stated_xy_mg": milli_g(bias_stds[:, :2]),
        "bias_z_mg": milli_g(errors[:, 2]),
        "stated_z_mg": milli_g(bias_stds[:, 2]),
        "bias_nees": float(np.mean([r.bias_nees[stop] for r in runs])),
    }


def rms_deg(values: Array) -> float:
    """Root mean square in deg of values in rad; NaN of none."""
    return math.degrees(math.sqrt(float(np.mean(values**2)))) if len(values) else math.nan


def milli_g(values: Array) -> float:
    """Root mean square in thousandths of g of values in m/s^2."""
    return 1e3 * math.sqrt(float(np.mean(values**2))) / GRAVITY


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Lines on the part of the first stop's error that is left after five stops."""
    lines = []
    for first, last in zip(result["cases"][::STOPS], result["cases"][STOPS - 1 :: STOPS], strict=True):
        part = last["azimuth_corrected_deg"] / first["azimuth_measured_deg"]
        lines.append(
            f"{first['case'].split(',')[0]}: azimuth {last['azimuth_corrected_deg']:.3g} deg under the blocks proposed "
            f"after {STOPS - 1} stops, {first['azimuth_measured_deg']:.3g} at the first: {part:.2f} of it; "
            f"NEES {last['azimuth_nees']:.2f}"
        )
    return lines
