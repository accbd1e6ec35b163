"""What a rig measures of the depth of its bit: the position of the block, with what is wrong of it."""

from __future__ import annotations

from functools import cached_property

import numpy as np
import numpy.typing as npt

from sim.world.motion import Motion
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario import Scenario

Array = npt.NDArray[np.float64]


class DepthMeter:
    """The depth of one run as it is measured; errors as the table ``[told]`` of the scenario has them.

    Parameters
    ----------
    scenario : validated
    seed : of the run
    motion : of the bit
    begin : s, rig time of the start
    """

    def __init__(self, scenario: Scenario, seed: int, motion: Motion, begin: float) -> None:
        self._told, self._seed, self._motion = scenario.file.told, seed, motion
        self._stuck_at = None if self._told.depth_stuck_after_s is None else begin + self._told.depth_stuck_after_s

    def measure_depth(self, t: float) -> float:
        """Measured depth (m) of the bit at a rig time (s)."""
        followed = self._true_depth(t)
        if self._stuck_at is not None:
            followed -= self._missed_depth(t, self._stuck_at)
        depth = followed * (1.0 + self._told.depth_scale) + self._told.depth_offset_m
        return depth + self._error_at(t) if self._told.depth_std_m else depth

    def _true_depth(self, t: float) -> float:
        return float(self._motion.depth(np.array([t]))[0][0])

    def _missed_depth(self, t: float, at: float) -> float:
        """Depth (m) that a meter has missed which stood still from ``at`` (s, rig time) on; what it missed is gone."""
        lasts = self._told.depth_stuck_s
        until = t if lasts is None else min(t, at + lasts)
        return self._true_depth(until) - self._true_depth(at) if until > at else 0.0

    def _error_at(self, t: float) -> float:
        """Error (m) at a rig time: one at every stop, and evenly from one to the next while the bit advances."""
        return float(np.interp(t, *self._errors))

    @cached_property
    def _errors(self) -> tuple[Array, Array]:
        """Rig times (s) and errors (m) at the begin and the end of every turning."""
        drills = [phase for phase in self._motion.phases if phase.kind == "drill"]
        draws = random_stream(self._seed, RandomStream.DEPTH_ERRORS, 0).standard_normal(len(drills) + 1)
        times = np.array([(phase.start, phase.end) for phase in drills]).ravel()
        return times, self._told.depth_std_m * np.repeat(draws, 2)[1:-1]
