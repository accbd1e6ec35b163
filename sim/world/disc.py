"""The encoder's disc: how many of its lines have passed, and when the last ones did. No line is quite in its place."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from node.firmware.edge_interpolation import EDGES
from sim.world.motion import Motion

Array = npt.NDArray[np.float64]


class Disc:
    """Lines of an incremental encoder, decoded in quadrature, on the drive head.

    Parameters
    ----------
    motion : of the drive head
    counts_per_turn : edges of both tracks
    edge_std : rad, error of a line's place, constant for every line
    random : stream of the places
    turned_at, turned_by : (k,) s and rad >= 0, jumps of the head while it is free of the string
    zero : rad, angle of the head at which its count is 0

    Attributes
    ----------
    errors : (counts_per_turn,) rad, of each line's place
    """

    def __init__(
        self,
        motion: Motion,
        counts_per_turn: int,
        edge_std: float,
        random: np.random.Generator,
        turned_at: Sequence[float] = (),
        turned_by: Sequence[float] = (),
        *,
        zero: float = 0.0,
    ) -> None:
        self._motion, self._zero = motion, zero
        self._times: dict[int, float] = {}  # s, of the last edges, by their count
        self._jumps = tuple(zip(turned_at, turned_by, strict=True))
        self._quantum = math.tau / counts_per_turn
        limit = 0.4 * self._quantum  # lines do not change places
        self.errors: Array = np.clip(edge_std * random.standard_normal(counts_per_turn), -limit, limit)

    @property
    def is_freed(self) -> bool:
        """Whether the head turns by itself at times."""
        return bool(self._jumps)

    def angles(self, t: Array) -> Array:
        """Of the head (n,) rad, unwrapped, at rig times ``t`` (n,) s, its free turns included."""
        angle = self._motion.drive(t)[0]
        for at, by in self._jumps:
            angle = angle + by * (at <= t)
        return angle

    def sample(self, t: float, angle: float | None = None) -> tuple[int, float, tuple[float, ...]]:
        """Count with the head at ``angle`` at rig time ``t`` (s), the rig time of its last edge and of those before.

        Newest first. Edges that the head never passed have the time of the start. The angle is worked out if absent.
        """
        if angle is None:
            angle = float(self.angles(np.array([t]))[0])
        count = math.floor((angle - self._zero) / self._quantum + 0.5)
        if self._place(count) > angle:
            count -= 1
        wanted = range(count, count - EDGES, -1)
        # at rest they are those of before; more are not kept, for the head never turns back
        known = self._times
        self._times = {edge: known[edge] if edge in known else self._time_of(self._place(edge)) for edge in wanted}
        last, *earlier = self._times.values()
        return count, min(last, t), tuple(earlier)

    def counts(self, t: Array) -> npt.NDArray[np.int64]:
        """Counts (n,) at rig times ``t`` (n,) s."""
        angle = self.angles(t)
        counts = np.floor((angle - self._zero) / self._quantum + 0.5).astype(np.int64)
        return counts - (self._places(counts) > angle)

    def times_of(self, counts: npt.NDArray[np.int64]) -> Array:
        """Rig times (n,) s at which the edges that make ``counts`` (n,) passed, of a head that was never free."""
        return self._motion.times_of_angles(self._places(counts))

    def _places(self, counts: npt.NDArray[np.int64]) -> Array:
        return np.asarray(counts * self._quantum + self.errors[counts % len(self.errors)] + self._zero)

    def _time_of(self, angle: float) -> float:
        """When the head was at ``angle`` first: inside a jump at its time, else when the string got so far."""
        free = 0.0
        for at, by in self._jumps:
            string = float(self._motion.drive(np.array([at]))[0][0])
            if angle <= string + free:
                break
            if angle <= string + free + by:
                return at
            free += by
        return self._motion.time_of_angle(angle - free)

    def _place(self, count: int) -> float:
        """Angle (rad) at which the edge that makes ``count`` passes."""
        return count * self._quantum + float(self.errors[count % len(self.errors)]) + self._zero
