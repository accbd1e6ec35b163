"""How a string of a rough world moves in one run: with the head, and ahead of it through its play.

The play is the same for all tubes of a string but another one in every run, so what it does to rates and to the circle
about the axis is worked out run by run. It moves in tenths of a second, so a grid of 4 ms does: within one the angle of
a head that starts at 35 deg/s^2 bends by 1e-4 deg.
"""

from __future__ import annotations

from typing import Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from sim.world.disturbance.frame_sums import frame_sums
from sim.world.disturbance.low_pass import low_passed
from sim.world.rough_motion import RoughMotion
from sim.world.rough_section import RoughSection
from sim.world.world import World

HERTZ: Final = 250.0  # at least, of the grid


class MovingString:
    """Head and string of a rough world.

    Parameters
    ----------
    world : of any seed; nothing of it that is drawn is used
    section : its table ``rough``
    frame : s, between two frames of a sensor

    Attributes
    ----------
    t : (n,) s, rig time of the samples
    """

    def __init__(self, world: World, section: RoughSection, frame: float) -> None:
        self._hertz = section.samples_hz / max(section.samples_hz // HERTZ, 1.0)
        self._section, self._frame = section, frame
        self._radius = world.scenario.file.accelerometer.radius_m
        coarse = section.model_copy(update={"samples_hz": self._hertz})
        self._motion = RoughMotion(coarse, world.motion.starting_at(0.0), world.begin, world.seed)
        self.t: Array = self._motion.t
        self._twist = self._motion.twist(section.string)

    def string(self, seed: int) -> Array:
        """Angle (n,) rad that the string has turned in the run of a seed."""
        return np.asarray(self._motion.through_play(self._section.string, seed) - self._twist)

    def sums(self, string: Array) -> Array:
        """Sums (rows, MOVED) of the frames of a run whose string has turned by these angles (n,), rad."""
        hertz, slack = self._hertz, string + self._twist - self._motion.head
        turning = np.gradient(string, 1.0 / hertz)
        circle = -self._radius * turning**2, self._radius * np.gradient(turning, 1.0 / hertz)
        felt = np.stack([*circle, np.gradient(slack, 1.0 / hertz), slack], axis=1)
        return frame_sums(low_passed(felt, self._section.sensor.low_pass_hz, hertz), hertz, self._frame)
