"""What a hop does to an aiding: an error of rig time across the joint, and a loss; drawn before or cycle by cycle.

A node dates its own cycles by its own crystal; what is wrong is when it takes an aiding to be valid.
"""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD, Array
from sim.kernel import kernel
from sim.world.disturbance.wander import gauss_markov
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario_file import ScenarioFile
from sim.world.world import World

HOP: Final = np.dtype(
    [
        ("clock", "f8"),  # s, constant error of rig time across the joint as many hops below the head as its index
        ("wander", "f8"),  # s, of this cycle
        ("error", "f8"),  # s, of rig time below that joint in this cycle, with those of the joints above
        ("loses", "i8"),  # whether an aiding is lost there in this cycle
    ],
    align=True,
)
HOP_NOISE: Final = np.dtype(
    [
        ("clock", "f8"),  # s, wander of rig time across each joint, standard deviation
        ("clock_phi", "f8"),  # what is left of it after a cycle
        ("clock_fresh", "f8"),  # share of it that is new in a cycle
        ("loss", "f8"),  # of an aiding on one hop, probability
    ],
    align=True,
)


def record_hops(world: World) -> tuple[Array, npt.NDArray[np.bool_]]:
    """Error of rig time below each joint (cycles, hops) s, and whether an aiding is lost there (cycles, hops)."""
    file, shape = world.scenario.file, (world.cycles, world.scenario.tubes)
    clocks, random = file.clocks, random_stream(world.seed, RandomStream.AIDING_CLOCKS)
    constant = 1e-3 * clocks.joint_std_ms * random.standard_normal(shape[1])
    std = np.full(3, 1e-3 * clocks.wander_std_ms)
    wander = [gauss_markov(random, shape[0], std, clocks.wander_tau_s, PERIOD)[:, 0] for _ in range(shape[1])]
    losses = random_stream(world.seed, RandomStream.AIDING_LOSS).random(shape) < file.medium.loss
    return np.cumsum(constant + np.stack(wander, axis=1), axis=1), np.asarray(losses)


def draw_hops(world: World) -> Array:
    """Hops of a world before the first cycle, (tubes,) of dtype ``HOP``; what changes is drawn cycle by cycle."""
    hops = np.zeros(world.scenario.tubes, HOP)
    drawn = random_stream(world.seed, RandomStream.AIDING_CLOCKS).standard_normal(len(hops))
    hops["clock"] = 1e-3 * world.scenario.file.clocks.joint_std_ms * drawn
    return hops


def hop_noise_of(file: ScenarioFile) -> Array:
    """What is drawn of every hop in every cycle, (1,) of dtype ``HOP_NOISE``."""
    noise = np.zeros(1, HOP_NOISE)
    noise["clock"] = 1e-3 * file.clocks.wander_std_ms
    noise["clock_phi"] = phi = math.exp(-PERIOD / file.clocks.wander_tau_s)
    noise["clock_fresh"] = math.sqrt(1.0 - phi**2)
    noise["loss"] = file.medium.loss
    return noise


@kernel
def cross_hop(noise: Any, hops: Array, place: int, is_first: bool, normal: float, uniform: float) -> None:
    """Take a hop on by a cycle: its clock, and whether it loses an aiding.

    Parameters
    ----------
    noise : of dtype ``HOP_NOISE``
    hops : (tubes,) of dtype ``HOP``, taken on down to ``place``
    is_first : what wanders begins anew
    normal, uniform : numbers drawn for the hop and cycle
    """
    hop = hops[place]
    left, fresh = (0.0, 1.0) if is_first else (noise.clock_phi, noise.clock_fresh)
    above = hops[place - 1].error if place > 0 else 0.0
    hop.wander = left * hop.wander + fresh * noise.clock * normal
    hop.error = hop.clock + hop.wander + above
    hop.loses = 1 if uniform < noise.loss else 0
