"""The integer kernel against the float64 kernel on the same inputs, over as many cycles as a season of drilling.

One node turns and rests; its aiding comes late, stays out for half a minute to half an hour, and comes both at rest
and while turning. Cycles are lost and joints opened now and then. Both kernels get the same numbers, and at the end
of every cycle their yaw, sigma and status are compared. A short string with either is then judged for consistency.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from node.firmware.tube_settings import Kernel
from node.kernels.arithmetic.angles import wrap_positive
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.record.filter_record import Err, Scheme, default_config, new_state
from node.kernels.step.fixed_node import FixedNode
from node.kernels.string.relay import offer_aiding
from sim.studies.epochs import resting_string, run_seed
from sim.studies.pool import Step, over_cores, seed_jobs
from sim.studies.relay.run import hop_rows

NEES_HOPS = 5
BLOCK = 400  # cycles of one turning and one rest
TURNING, RAMP = 230, 6  # cycles, of a block and of the speeding up in it
SPIN = 71.0 * DEG
GRAVITY = 9.81
AIDING_VAR = (0.003 * DEG) ** 2
LIMITS = {"yaw_deg": 0.03, "sigma": 0.02}


@dataclass(frozen=True, slots=True)
class Input:
    """Inputs of both kernels in one cycle; SI and radians."""

    start: float
    end: float
    rate: tuple[float, float, float]
    force: tuple[float, float, float]
    joined: int
    aiding: tuple[float, float, int] | None  # yaw, time of validity, sequence
    turning: bool


@dataclass(frozen=True, slots=True)
class Comparison:
    """Differences, fixed less float64, at the end of every cycle."""

    yaw_deg: np.ndarray[Any, np.dtype[np.float64]]
    sigma: np.ndarray[Any, np.dtype[np.float64]]  # ratio less 1
    turning: np.ndarray[Any, np.dtype[np.bool_]]
    aided: np.ndarray[Any, np.dtype[np.bool_]]
    status_differs: int
    overflows: int


def spin_share(k: int) -> float:
    """Share of the full spin in cycle ``k`` of a block: up, level, down, rest."""
    if k >= TURNING:
        return 0.0
    return min(1.0, (k + 0.5) / RAMP, (TURNING - k - 0.5) / RAMP)


def draw_inputs(cycles: int, seed: int) -> Iterator[Input]:
    """Readings and aiding of one node, drawn once for both kernels."""
    random = np.random.Generator(np.random.Philox(seed))
    config = default_config()[0]
    phi = math.exp(-PERIOD / float(config["bias_tau"][0]))
    bias, constant = np.zeros(3), random.normal(0.0, 0.02 * DEG, 3)
    drive = config["bias_std"] * math.sqrt(1.0 - phi * phi)
    white = config["gyro_noise"] / math.sqrt(PERIOD)
    lean, scale = 2.0 * DEG, 1e-3
    yaw, now, out_until, sequence = 1.0, 1000.0, 0.0, 0
    for cycle in range(cycles):
        k = cycle % BLOCK if cycle >= 2 * BLOCK else BLOCK - 1  # first it stands, to learn its bias
        if k == 0:
            lean = float(random.uniform(0.5, 60.0)) * DEG if cycle % (25 * BLOCK) == 0 else lean
        if cycle % 50_000 == 49_999:
            now += 3.0 * PERIOD  # lost cycles, while the string stands
        spin = SPIN * spin_share(k)
        bias = phi * bias + drive * random.standard_normal(3)
        rate = np.array([0.0, 0.0, spin * (1.0 + scale)]) + constant + bias + white * random.standard_normal(3)
        middle = yaw + 0.5 * spin * PERIOD
        down = np.array([-math.sin(lean) * math.cos(middle), math.sin(lean) * math.sin(middle), math.cos(lean)])
        force = -GRAVITY * down + float(config["force_std"]) * random.standard_normal(3)
        yaw = float(wrap_positive(yaw + spin * PERIOD))
        end = now + PERIOD
        if now > out_until and random.random() < 1.0 / 600.0:
            out_until = now + float(random.choice([30.0, 60.0, 300.0, 1800.0], p=[0.4, 0.4, 0.15, 0.05]))
        sequence += int(spin > 0.0 or k == TURNING)
        aiding = None
        if now >= out_until:
            age = float(random.uniform(0.0, 0.1)) if spin > 0.0 else 0.0
            noise = math.sqrt(AIDING_VAR) * float(random.standard_normal())
            aiding = (float(wrap_positive(yaw - spin * age + noise)), end - age, sequence)
        joined = 0 if k > BLOCK - 40 and cycle % (7 * BLOCK) > 6 * BLOCK else 1
        yield Input(now, end, tuple(rate.tolist()), tuple(force.tolist()), joined, aiding, spin > 0.0)
        now = end


def compare_kernels(cycles: int, seed: int, step: Step = lambda: None) -> Comparison:
    """Run both kernels side by side; ``step`` is called every thousand cycles."""
    config, reference = default_config()[0], new_state(default_config())[0]
    shadow, fixed = new_state(default_config())[0], FixedNode()
    yaw, sigma = np.zeros(cycles), np.zeros(cycles)
    turning, aided = np.zeros(cycles, np.bool_), np.zeros(cycles, np.bool_)
    differs, psi = 0, int(Err.YAW)
    rate, force = np.zeros(3), np.zeros(3)
    for k, given in enumerate(draw_inputs(cycles, seed)):
        rate[:], force[:] = given.rate, given.force
        status = run_cycle(reference, config, rate, force, given.start, given.end, given.joined)
        differs += status != fixed.run_cycle(shadow, config, rate, force, given.start, given.end, given.joined)
        yaw[k] = (int(shadow["now_yaw"]) - int(reference["now_yaw"]) + 2**31) % 2**32 - 2**31
        sigma[k] = math.sqrt(shadow["now_P"][psi, psi] / reference["now_P"][psi, psi]) - 1.0
        turning[k], aided[k] = given.turning, given.aiding is not None
        if given.aiding is not None:
            z, at, sequence = given.aiding
            offer_aiding(reference, config, z, AIDING_VAR, 1e-6, 0.3, at, sequence, 0)
            fixed.offer_aiding(shadow, config, z, AIDING_VAR, 1e-6, 0.3, at, sequence, 0)
        if k % 1000 == 999:
            step()
    return Comparison(yaw * (360.0 / 2**32), sigma, turning, aided, differs, fixed.overflows)


def rows_of(found: Comparison) -> list[dict[str, Any]]:
    """One row for each kind of cycle: the largest and the rms difference of yaw, the largest of sigma."""
    kinds = {
        "turning, aided": found.turning & found.aided,
        "turning, outage": found.turning & ~found.aided,
        "rest, aided": ~found.turning & found.aided,
        "rest, outage": ~found.turning & ~found.aided,
    }
    rows = []
    for kind, chosen in kinds.items():
        if chosen.any():
            yaw, sigma = found.yaw_deg[chosen], found.sigma[chosen]
            rows.append(
                {
                    "case": kind,
                    "cycles": int(chosen.sum()),
                    "yaw_max_deg": float(np.abs(yaw).max()),
                    "yaw_rms_deg": float(np.sqrt(np.mean(yaw**2))),
                    "sigma_max": float(np.abs(sigma).max()),
                }
            )
    return rows


def nees_by_kernel(hops: int, seeds: int, step: Step) -> list[dict[str, Any]]:
    """NEES of a short string with either kernel, one row a hop and kernel."""
    rows: list[dict[str, Any]] = []
    kernels: tuple[Kernel, ...] = ("float64", "fixed")
    with over_cores(seeds, step) as run_all:
        for kernel in kernels:
            runs = run_all(run_seed, seed_jobs(resting_string(hops, kernel=kernel), seeds))
            rows.extend({"kernel": kernel, **row} for row in hop_rows(Scheme.FORWARD, runs))
    return rows


def count_steps(cycles: int, seeds: int, seed: int) -> int:
    """Thousands of cycles, then runs of one seed by either kernel."""
    del seed
    return cycles // 1000 + 2 * seeds


def run_study(cycles: int, seeds: int, seed: int, step: Step) -> dict[str, Any]:
    """Table of the differences and of the consistency of both kernels.

    Returns
    -------
    dict
        ``cases``: one row for each kind of cycle, with the overflows and differences of status of the whole run;
        ``nees``: one row a hop and kernel; ``within``, whether the limits hold.
    """
    found = compare_kernels(cycles, seed, step)
    within = bool(
        np.abs(found.yaw_deg).max() <= LIMITS["yaw_deg"]
        and np.abs(found.sigma).max() <= LIMITS["sigma"]
        and found.overflows == 0
    )
    return {
        "experiment": "fixed-point",
        "cycles": cycles,
        "seed": seed,
        "cases": [
            {**row, "overflows": found.overflows, "status_differs": found.status_differs} for row in rows_of(found)
        ],
        "within": within,
        "nees": nees_by_kernel(NEES_HOPS, seeds, step),
    }


def verdict_lines(result: dict[str, Any]) -> list[str]:
    """Lines on whether the limits hold."""
    asked = f"yaw within {LIMITS['yaw_deg']:g} deg, sigma within {LIMITS['sigma']:.0%}, no overflow"
    return [f"{asked}: {'yes' if result['within'] else 'no'}"]
