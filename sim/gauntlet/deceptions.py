"""Faults that nothing on the rig contradicts but the other tubes: sensors, mounts, depth and what the crew believes.

Each lasts to the end of the run. What is expected of the answer stands in ``sim.gauntlet.expected_doubts``.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from sim.gauntlet.fault import TUBES, Act, Draw, Faulty, Step, drawn_tube
from sim.gauntlet.faulty_world import TUBE_LENGTH, Reading
from sim.world.truth import imu_frame

Array = npt.NDArray[np.float64]
MILLI_G = 9.80665e-3  # m/s^2
DOWN_FOR = 3.0  # s without power, in which a tube is given other settings
ACTION = {"north": {"action": "tell"}, "collar": {"action": "tell"}}


def deceive_from(name: str, act: Callable[[np.random.Generator], Act]) -> Draw:
    """Draw of a deception of this kind, ``act`` of the draws of its size."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        at = float(random.uniform(begin, end))
        begin_it = act(random)

        def deceive(rig: Faulty) -> None:
            rig.world.deceptions.add(name)
            begin_it(rig)

        return [Step(at, deceive)]

    return draw


def drawn_force(random: np.random.Generator, least: float, most: float) -> Array:
    """Draw a force (3,) m/s^2 of any direction and a size between two limits (mg)."""
    axis = random.standard_normal(3)
    return np.asarray(axis / np.linalg.norm(axis) * random.uniform(least, most) * MILLI_G)


def change_readings(tube: int, change: Callable[[Array, Array, float], tuple[Array, Array]]) -> Act:
    """Act after which rates and forces of a tube are what ``change`` makes of them and of the time (s) since."""

    def begin(rig: Faulty) -> None:
        since = rig.now

        def spoil(reading: Reading) -> Reading:
            rate, force = change(np.array(reading[:3]), np.array(reading[3:6]), rig.now - since)
            return [*rate.tolist(), *force.tolist(), *reading[6:]]

        rig.world.add_deceiver(tube, spoil)

    return begin


def force_step(random: np.random.Generator) -> Act:
    """An accelerometer steps by 5 to 50 mg."""
    tube, step = drawn_tube(random), drawn_force(random, 5.0, 50.0)
    return change_readings(tube, lambda rate, force, _: (rate, force + step))


def force_creep(random: np.random.Generator) -> Act:
    """An accelerometer creeps by 0.1 to 0.5 mg/s."""
    tube, creep = drawn_tube(random), drawn_force(random, 0.1, 0.5)
    return change_readings(tube, lambda rate, force, since: (rate, force + since * creep))


def mount_slips(random: np.random.Generator) -> Act:
    """The mount of a tube leans over by up to 3 deg and turns by up to 20."""
    tube, (pitch, roll) = drawn_tube(random), np.radians(random.uniform(-3.0, 3.0, 2)).tolist()
    turn = math.radians(float(random.uniform(-20.0, 20.0)))
    c, s = math.cos(turn), math.sin(turn)
    slip = imu_frame(pitch, roll) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])
    return change_readings(tube, lambda rate, force, _: (slip @ rate, slip @ force))


def axes_exchanged(random: np.random.Generator) -> Act:
    """The axes x and y of both sensors of a tube are exchanged."""
    swapped = [1, 0, 2]
    return change_readings(drawn_tube(random), lambda rate, force, _: (rate[swapped], force[swapped]))


def calibrations_exchanged(random: np.random.Generator) -> Act:
    """Two tubes have each other's calibration: of opposite signs, what the raw biases differ by."""
    left = drawn_force(random, 5.0, 60.0)
    acts = [
        change_readings(tube, lambda rate, force, _, by=sign * left: (rate, force + by))  # type: ignore[misc]
        for tube, sign in zip(TUBES, (1.0, -1.0), strict=True)
    ]

    def begin(rig: Faulty) -> None:
        for act in acts:
            act(rig)

    return begin


def hole_moves(random: np.random.Generator) -> Act:
    """All that the tubes stand in leans over by 0.2 to 2 deg."""
    heading, size = float(random.uniform(0.0, math.tau)), math.radians(float(random.uniform(0.2, 2.0)))
    lean = np.array([size * math.cos(heading), size * math.sin(heading)])
    return lambda rig: rig.world.lean_hole(lean)


def depth_scale(random: np.random.Generator) -> Act:
    """The measured depth counts 5 to 20 % too much or too little of what the bit advances."""
    scale = float(random.uniform(0.05, 0.2)) * (1.0 if random.random() < 0.5 else -1.0)
    return lambda rig: rig.world.scale_depth(scale, rig.now)


def depth_stuck(_: np.random.Generator) -> Act:
    """The measured depth follows the bit no more."""
    return lambda rig: rig.world.scale_depth(-1.0, rig.now)


def joint_misread(random: np.random.Generator, begin: float, end: float) -> list[Step]:
    """Steps in which the top tube is switched on again with a mark that was misread by 3 to 30 deg.

    Of its joint to the head all yaws are wrong, of that to the tube below those from there down.
    """
    off = float(np.radians(random.uniform(3.0, 30.0)))
    misread = (off, 0.0) if random.random() < 0.5 else (0.0, off)
    at, top = float(random.uniform(begin, end - DOWN_FOR)), max(TUBES)

    def cut(rig: Faulty) -> None:
        rig.world.deceptions.add("joint-misread")
        rig.world.misread[top] = misread
        rig.cut(top)

    return [Step(at, cut), Step(at + DOWN_FOR, lambda rig: rig.start(top))]


def tell_wrongly(name: str, parameters_of: Callable[[np.random.Generator], dict[str, float]]) -> Draw:
    """Draw of an order of the crew that tells what is not so; a ground station without power hears none."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        at, told = float(random.uniform(begin, end)), parameters_of(random)
        order = name.partition("-")[0]

        def tell(rig: Faulty) -> None:
            if rig.order(order, {key: f"{value:g}" for key, value in told.items()} | ACTION.get(order, {})):
                rig.world.deceptions.add(name)

        return [Step(at, tell)]

    return draw


def north_wrong(random: np.random.Generator) -> dict[str, float]:
    """North is told wrong by 5 to 120 deg."""
    return {"angle_deg": float(random.uniform(5.0, 120.0)), "sigma_deg": 0.5}


def collar_wrong(random: np.random.Generator) -> dict[str, float]:
    """The collar is told to lean by up to 10 deg, any way."""
    lean, azimuth = random.uniform([0.0, -180.0], [10.0, 180.0]).tolist()
    return {"inclination_deg": lean, "azimuth_deg": azimuth, "sigma_deg": 0.1}


def length_wrong(random: np.random.Generator) -> dict[str, float]:
    """The lower tube is told to be 0.1 to 0.5 m longer than it is."""
    return {"tube": 1, "length_m": TUBE_LENGTH + float(random.uniform(0.1, 0.5)), "sigma_m": 0.002}
