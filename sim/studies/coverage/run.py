"""Coverage: how often the claimed ellipse holds the true position, with the rig's own numbers.

Every well is drilled anew: tubes pass the stations one after the other, with mounts, joints and accelerometer biases
drawn as in a rig's scenario, and with the yaw errors and variances that our filter itself produced at rest in simulated
strings (`epochs`), drawn by hop. The readings go through the ground station's own mathematics: resolve, shared errors,
recursive Bayes, trajectory. Source of the geometry: thesis Table 4.1 and Table 4.26.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from statistics import NormalDist
from typing import Any

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.fusion import StationFusion
from groundstation.survey.fusion.resolve import resolve_direction
from groundstation.survey.fusion.shared import SharedErrors
from groundstation.survey.well.ellipsoid import coverage_radius
from groundstation.survey.well.methods import Method, station_tangents
from groundstation.survey.well.trajectory import Trajectory
from sim.studies.epochs import resting_string, run_seed
from sim.studies.pool import RunAll, Step, over_cores
from sim.studies.published import wellbore_1
from sim.studies.scenarios import CALIBRATED
from sim.world.borehole import Borehole
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario_file import AccelerometerSection, JointSection

Array = npt.NDArray[np.float64]
TUBES = 10
SPACING = 2.0  # m
SAMPLES = 32
CONFIDENCES = (0.5, 0.6827, 0.8, 0.9, 0.95, 0.99)
JUDGED = 0.95
WELLS_A_JOB = 50
FIRST_STRING = 50_000  # seed, apart from those of the wells


@dataclass(frozen=True, slots=True)
class YawPool:
    """Yaw errors (rad) and variances (rad^2) of the filter at rest, (hops, draws)."""

    error: Array
    var: Array


def yaw_pool(strings: int, run_all: RunAll) -> YawPool:
    """Run the real filter in ``strings`` simulated strings and collect its errors at rest."""
    runs = run_all(run_seed, [(resting_string(TUBES), FIRST_STRING + seed) for seed in range(strings)])
    error, var = (np.concatenate([getattr(r, name)[~r.turning] for r in runs]).T for name in ("error", "var"))
    return YawPool(error, var)


class Rig:
    """One string of one well and its errors."""

    def __init__(self, seed: int) -> None:
        self.random = random_stream(seed, RandomStream.WELLS)
        joints, accelerometer = JointSection(), AccelerometerSection(**CALIBRATED)
        self.joint_std = math.radians(joints.reading_std_deg)
        self.mount_std = math.radians(joints.mount_std_deg)
        self.gravity = accelerometer.gravity_mps2
        tilt = math.radians(1.0) * self.gravity
        self.bias_std = accelerometer.bias_std_deg * tilt
        self.noise_std = accelerometer.noise_deg * tilt / math.sqrt(SAMPLES)
        draw = self.random.standard_normal
        self.drive, self.lower = self.joint_std * draw(TUBES + 1), self.joint_std * draw(TUBES + 1)
        self.mounts = self.mount_std * draw(TUBES + 1)
        self.biases = self.bias_std * draw((TUBES + 1, 3))
        self.yaws = self.random.uniform(-math.pi, math.pi, TUBES + 1)

    def systematic(self, tube: int, top: int) -> float:
        """Constant yaw error (rad) of a tube while another is the top one."""
        return float(self.drive[top] + self.lower[tube + 1 : top + 1].sum() - self.mounts[tube])

    def force(self, tangent: Array, tube: int) -> Array:
        """Mean specific force (3,) of a stop, errors and all."""
        c, s = math.cos(self.yaws[tube]), math.sin(self.yaws[tube])
        up = np.array([c * tangent[0] + s * tangent[1], c * tangent[1] - s * tangent[0], -tangent[2]])
        return np.asarray(self.gravity * up + self.biases[tube] + self.noise_std * self.random.standard_normal(3))


def drill_well(seed: int, pool: YawPool) -> tuple[Array, Array, Array]:
    """Positions claimed (n, 3), their covariances (n, 3, 3) and the true ones (n, 3) of one well."""
    rig = Rig(seed)
    record = wellbore_1()
    turned = record.azimuth + float(rig.random.uniform(0.0, math.tau))
    hole = Borehole(record.md, record.inclination, turned)
    true = station_tangents(record.inclination, turned)
    shared = SharedErrors()
    stations = [StationFusion() for _ in range(TUBES + 1)]
    force_cov = rig.noise_std**2 * np.eye(3)
    for stop in range(1, TUBES + 1):
        for tube in range(1, stop + 1):
            station, hop = stop - tube + 1, stop - tube + 1
            draw = int(rig.random.integers(pool.error.shape[1]))
            yaw = float(rig.yaws[tube]) + rig.systematic(tube, stop) + float(pool.error[hop - 1, draw])
            resolved = resolve_direction(rig.force(true[station], tube), force_cov, yaw, float(pool.var[hop - 1, draw]))
            above = range(tube + 1, stop + 1)
            systematic_var = hop * rig.joint_std**2 + rig.mount_std**2
            stations[station].add_reading(
                shared.direction_of(resolved, tube, above, systematic_var, rig.mount_std**2, rig.bias_std)
            )
    trajectory = Trajectory(Method.BALANCED_TANGENTIAL)
    for k in range(1, TUBES + 1):
        trajectory.append(SPACING * k, stations[k].fused())
    points = trajectory.points[1:]
    truth = np.array([hole.position(point.md) for point in points])
    return np.array([p.position for p in points]), np.array([p.cov for p in points]), truth


def normalised_distances(job: tuple[range, YawPool]) -> Array:
    """Normalised distances (wells, stations, 2) from claimed to true position, in the plane and in space."""
    seeds, pool = job
    out = np.empty((len(seeds), TUBES, 2))
    for row, seed in enumerate(seeds):
        claimed, cov, truth = drill_well(seed, pool)
        error = claimed - truth
        for k in range(TUBES):
            plane, c = error[k, :2], cov[k]
            out[row, k, 0] = math.sqrt(float(plane @ np.linalg.solve(c[:2, :2], plane)))
            out[row, k, 1] = math.sqrt(float(error[k] @ np.linalg.pinv(c, rcond=1e-12) @ error[k]))
    return out


def count_steps(wells: int, strings: int) -> int:
    """Strings, then parcels of wells."""
    return strings + -(-wells // WELLS_A_JOB)


def run_study(wells: int, strings: int, step: Step) -> dict[str, Any]:
    """Observed share of true positions inside the claimed ellipses, with binomial 95 % intervals."""
    with over_cores(strings, step) as run_all:
        pool = yaw_pool(strings, run_all)
        jobs = [(range(k, min(k + WELLS_A_JOB, wells)), pool) for k in range(0, wells, WELLS_A_JOB)]
        found = np.concatenate(run_all(normalised_distances, jobs))
    cases = [_case("plan ellipse, toe", found[:, -1, 0], confidence) for confidence in CONFIDENCES]
    cases += [_case(f"plan ellipse, station {k + 1}", found[:, k, 0], JUDGED) for k in range(TUBES - 1)]
    return {"experiment": "coverage", "wells": wells, "strings": strings, "cases": cases}


def _case(name: str, distance: Array, confidence: float) -> dict[str, Any]:
    inside = float(np.mean(distance <= coverage_radius(confidence, 2)))
    half = NormalDist().inv_cdf(0.975) * math.sqrt(max(inside * (1.0 - inside), 0.0) / len(distance))
    return {
        "case": f"{name}, {100.0 * confidence:g} %",
        "published": 100.0 * confidence,
        "ours": 100.0 * inside,
        "half_interval": 100.0 * half,
        "unit": "% of wells inside",
    }
