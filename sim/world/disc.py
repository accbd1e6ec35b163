"""The encoder's disc: how many of its lines have passed, and when the last ones did. No line is quite in its place."""

from __future__ import annotations

import math

import numpy as np

from node.firmware.edge_interpolation import EDGES
from sim.world.motion import Motion


class Disc:
    """Lines of an incremental encoder, decoded in quadrature, on the drive head.

    Parameters
    ----------
    motion : of the drive head
    counts_per_turn : edges of both tracks
    edge_std : rad, error of a line's place, constant for every line
    random : stream of the places
    """

    def __init__(self, motion: Motion, counts_per_turn: int, edge_std: float, random: np.random.Generator) -> None:
        self._motion = motion
        self._quantum = math.tau / counts_per_turn
        limit = 0.4 * self._quantum  # lines do not change places
        self._errors = np.clip(edge_std * random.standard_normal(counts_per_turn), -limit, limit)

    def sample(self, t: float) -> tuple[int, float, tuple[float, ...]]:
        """Count at rig time ``t`` (s), the rig time (s) of its last edge and those of the edges before, newest first.

        Edges that the head never passed have the time of the start.
        """
        angle = float(self._motion.drive(np.array([t]))[0][0])
        count = math.floor(angle / self._quantum + 0.5)
        if self._place(count) > angle:
            count -= 1
        last, *earlier = (self._motion.time_of_angle(self._place(count - k)) for k in range(EDGES))
        return count, min(last, t), tuple(earlier)

    def _place(self, count: int) -> float:
        """Angle (rad) at which the edge that makes ``count`` passes."""
        return count * self._quantum + float(self._errors[count % len(self._errors)])
