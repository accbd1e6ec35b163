"""A gyroscope whose bias wanders: first-order Gauss-Markov."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from sim.kernel import kernel, shared_body
from sim.world.disturbance.lanes import Lane
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile


def gauss_markov(random: np.random.Generator, count: int, std: Array, tau: float, step: float) -> Array:
    """First-order Gauss-Markov process (count, 3), stationary from the start, discretised exactly.

    b_k+1 = phi b_k + std sqrt(1 - phi^2) w,  phi = exp(-step / tau).
    """
    phi = math.exp(-step / tau)
    draws = random.standard_normal((count, 3))
    draws[1:] *= math.sqrt(1.0 - phi * phi)
    follow_markov(draws, phi)
    return draws * std


@kernel
def follow_markov(draws: Array, phi: float) -> None:
    """Add to every row of ``draws`` (n, m) its part ``phi`` of the row before, in place."""
    for k in range(1, draws.shape[0]):
        for j in range(draws.shape[1]):
            draws[k, j] += phi * draws[k - 1, j]


def wandering_bias(imu: OneImu, count: int, period: float) -> Array:
    """Bias (count, 3) rad/s of samples that are ``period`` (s) apart."""
    std = np.radians(np.array([imu.noise * x for x in imu.file.gyroscope.bias_std_dps]))
    return gauss_markov(imu.random(RandomStream.GYRO), count, std, imu.file.gyroscope.bias_tau_s, period)


def wander_off(samples: ImuSamples, imu: OneImu, _: None) -> None:
    """Add what wanders."""
    samples.rate = samples.rate + wandering_bias(imu, len(samples.t), samples.period)


def set_wander(shared: Any, file: ScenarioFile) -> None:
    """Size, and what is left and new of it after a cycle."""
    shared["wander"] = np.radians(np.array(file.gyroscope.bias_std_dps))
    shared["wander_phi"] = phi = math.exp(-PERIOD / file.gyroscope.bias_tau_s)
    shared["wander_fresh"] = math.sqrt(1.0 - phi**2)


@shared_body
def wander_on(shared: Any, tube: Any, now: Any, drawn: Array, at: int, row: Array) -> None:
    """Take what wanders on by a cycle, and add it."""
    left, fresh = (0.0, 1.0) if now.is_first else (shared.wander_phi, shared.wander_fresh)
    for i in range(3):
        tube.wandered[i] = left * tube.wandered[i] + fresh * shared.wander[i] * drawn[at + i]
        row[i] += tube.wandered[i]


WANDER = Disturbance(
    "wander",
    ("gyroscope.bias_std_dps", "gyroscope.bias_tau_s"),
    ActsOn.SAMPLES,
    wander_off,
    compiled=Compiled(
        shared=(("wander", "f8", (3,)), ("wander_phi", "f8"), ("wander_fresh", "f8")),  # rad/s, and shares
        tube=(("wandered", "f8", (3,)),),  # rad/s, in this cycle
        set_shared=set_wander,
        lane=Lane.WANDER,
        read=wander_on,
    ),
)
