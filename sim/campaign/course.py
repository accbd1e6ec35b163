"""What every run of a campaign has in common: the schedule, and the truth that does not depend on a seed.

The joints and the head's first angle turn a tube's frame about its axis by a constant angle. So what a perfect sensor
reads is worked out once, in the frame of a joint of 0, and turned for every run (``sim.campaign.drill``).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from sim.campaign.refusals import refuse_others
from sim.rig.direct_string import are_open, joined_of
from sim.world.motion import Motion
from sim.world.scenario import Scenario
from sim.world.truth import TubeTruth
from sim.world.world import World

Array = npt.NDArray[np.float64]
BEFORE_END = 10.0  # s, before the end of each turning and each rest: when a filter is judged
ANY_SEED = 1  # of a world whose schedule alone is read


class Course(NamedTuple):
    """The schedule as arrays over cycles and tubes, tube 1 first."""

    begin: float  # s, rig time
    ends: Array  # (cycles,) s, rig time
    powered: npt.NDArray[np.int64]  # (cycles,) tubes in the string
    joined: Array  # (cycles, tubes) 1 where a tube's upper joint is closed for all it knows
    heard: npt.NDArray[np.bool_]  # (cycles,) the joint below the head is closed
    shaken: Array  # (cycles,) 1 while the bit shakes the string
    head: Array  # (cycles,) rad, unwrapped, what the head has turned
    tops: npt.NDArray[np.int64]  # (cycles,) number of the tube that the head holds
    rate: Array  # (cycles, tubes, 3) rad/s, mean over the cycle
    force: Array  # (cycles, tubes, 3) m/s^2, likewise, without the circle about the axis
    circle: Array  # (cycles, 2) m/s^2, likewise, that circle, in the frame of the IMU
    epochs: npt.NDArray[np.int64]  # cycles at which every node is judged
    turning: npt.NDArray[np.bool_]  # (epochs,)
    locked: bool  # what the encoder measures arrives after the cycles that end with it, else before


def course_of(scenario: Scenario) -> Course:
    """The course of a scenario that a campaign can express.

    Raises
    ------
    ScenarioError
        Names the key that a campaign cannot express, and the command that can.
    """
    refuse_others(scenario)
    file, world = scenario.file, World(scenario, ANY_SEED)
    motion, ends, count = world.motion, world.ends, scenario.tubes
    adds = [phase for phase in world.phases if phase.kind == "add"]
    powered = file.rig.tubes_at_start + sum((phase.start <= ends).astype(np.int64) for phase in adds)
    powered = np.asarray(powered, np.int64) * np.ones(len(ends), np.int64)
    still = motion.starting_at(0.0)
    rate, force, circle = felt_by(scenario, still, ends) if file.rough is None else nothing_felt(count)
    shaken = (motion.drive(ends)[1] > 0.0) | (motion.drive(ends - PERIOD)[1] > 0.0)
    phases = [phase for phase in world.phases if phase.kind in ("drill", "stop")]
    return Course(
        begin=world.begin,
        ends=ends,
        powered=powered,
        joined=joined_of(world, powered, np.zeros(count)),
        heard=~are_open(world, ends),
        shaken=shaken.astype(float),
        head=still.drive(ends)[0],
        tops=motion.tops(ends).astype(np.int64),
        rate=rate,
        force=force,
        circle=circle,
        epochs=np.array([math.floor((p.end - BEFORE_END - world.begin) / PERIOD) for p in phases], np.int64),
        turning=np.array([p.kind == "drill" for p in phases]),
        locked=file.encoder.phase == "locked",
    )


def felt_by(scenario: Scenario, still: Motion, ends: Array) -> tuple[Array, Array, Array]:
    """Rates, forces and circle of a ``Course``, of the ``still`` head's motion."""
    a = scenario.file.accelerometer
    truths = [
        TubeTruth(scenario.hole, still, k * scenario.tube_length, 0.0, 0.0, a.gravity_mps2)
        for k in range(scenario.tubes)
    ]
    rates, forces = zip(*(truth.cycle_means(ends, PERIOD) for truth in truths), strict=True)
    around = TubeTruth(scenario.hole, still, 0.0, 0.0, a.radius_m, a.gravity_mps2)
    circle = around.cycle_means(ends, PERIOD)[1] - forces[0]
    return np.stack(rates, axis=1), np.stack(forces, axis=1), np.ascontiguousarray(circle[:, :2])


def nothing_felt(tubes: int) -> tuple[Array, Array, Array]:
    """Of a rough world, whose nodes feel what ``sim.campaign.field`` has."""
    return np.zeros((0, tubes, 3)), np.zeros((0, tubes, 3)), np.zeros((0, 2))
