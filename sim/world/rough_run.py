"""One run in the field: motion, encoder, truth and sensors that the table ``[rough]`` of its scenario asks for."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cached_property

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole
from sim.world.imu_errors import ImuErrors
from sim.world.motion import Motion
from sim.world.rough_disc import RoughDisc
from sim.world.rough_imu import RoughImu, shaken_angle
from sim.world.rough_motion import RoughMotion
from sim.world.rough_section import RoughSection
from sim.world.rough_truth import RoughTruth, transported
from sim.world.truth import TubeTruth, Twist

Array = npt.NDArray[np.float64]
EARTH = 7.292115e-5  # rad/s. Source: WGS 84, NGA.STND.0036


class RoughRun:
    """What the table makes of one run.

    Parameters
    ----------
    section : of the scenario
    motion : the schedule
    begin : s, rig time of the start
    seed : of the run
    line_errors : (counts,) rad, of the places of the encoder's lines
    """

    def __init__(self, section: RoughSection, motion: Motion, begin: float, seed: int, line_errors: Array) -> None:
        self._section, self._schedule = section, motion
        self._begin, self._seed, self._line_errors = begin, seed, line_errors
        self.moved = RoughMotion(section, motion, begin, seed)

    @cached_property
    def disc(self) -> RoughDisc:
        """The encoder."""
        section, moved = self._section.encoder, self.moved
        return RoughDisc(section, moved.t, moved.head, self._begin, self._line_errors, self._seed)

    def truth(
        self,
        tube: int,
        hole: Borehole,
        below: float,
        twist: Twist | None,
        joint_angle: float,
        radius: float,
        gravity: float,
        unseen: Callable[[Array], Array] | None,
    ) -> RoughTruth:
        """Perfect sensor of a tube; what it is given is as ``TubeTruth`` takes it."""
        section, moved = self._section, self.moved
        angle = moved.string - moved.twist(section.string)
        angle = angle + shaken_angle(section.vibration, self._seed, tube, moved.t, moved.driven)
        if twist is not None:
            angle = angle - twist(moved.t)[0]
        if section.string.transport == "parallel":
            reached = np.maximum(self._schedule.depth(moved.t)[0] - below, 0.0)
            angle = angle + transported(hole, reached)
        return RoughTruth(moved.t, angle, hole, self._schedule, below, joint_angle, radius, gravity, None, unseen)

    def perfect(self, truth: TubeTruth, frame: Array) -> tuple[Array, Array]:
        """Rates and forces (n, 3) on the grid in the frame of an IMU (3, 3), rad/s and m/s^2."""
        rate, force = truth.rate_and_force(self.moved.t)
        if self._section.latitude_deg is not None:
            rate = rate + earth_rate(self._section.latitude_deg, truth.attitude(self.moved.t))
        return rate @ frame.T, force @ frame.T

    def imu(self, errors: ImuErrors, tube: int, imu: int) -> RoughImu:
        """One IMU of a tube."""
        return RoughImu(self._section, errors, self._seed, tube, imu, self.moved.t, self.moved.driven)


def earth_rate(latitude_deg: float, attitude: Array) -> Array:
    """Rate (n, 3, rad/s) by which the earth turns a body of these attitudes, R_ned_from_body (n, 3, 3)."""
    latitude = math.radians(latitude_deg)
    return np.asarray(EARTH * np.array([math.cos(latitude), 0.0, -math.sin(latitude)]) @ attitude)
