"""The encoder in the field: a disc that is not centred, a belt that slips, counts that jump, a head that turns back.

The edges of a whole run are found on the grid of the motion, between whose samples the angle is linear, in either
direction. What jumps is the counter and not the disc, so no edge belongs to it.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from node.firmware.edge_interpolation import EDGES
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_section import RoughEncoderSection

Array = npt.NDArray[np.float64]
Counts = npt.NDArray[np.int64]


class RoughDisc:
    """Lines of an incremental encoder on a head of any motion.

    Parameters
    ----------
    section : the scenario's
    t, head : (n,) s and rad, grid of rig time and angle of the head
    begin : s, of the run
    errors : (counts,) rad, of each line's place
    seed : of the run
    zero : rad, angle of the head at which its count is 0
    disturbed : what the disc shows (n,) rad, of what it would
    """

    def __init__(
        self,
        section: RoughEncoderSection,
        t: Array,
        head: Array,
        begin: float,
        errors: Array,
        seed: int,
        *,
        zero: float = 0.0,
        disturbed: Callable[[Array], Array] = np.asarray,
    ) -> None:
        self._section, self._begin, self._t = section, begin, t
        self._errors, self._quantum = errors, math.tau / len(errors)
        random = random_stream(seed, RandomStream.ROUGH_ENCODER)
        self._phase, self._outliers = float(random.uniform(0.0, math.tau)), seed
        self._head = head
        self.shown = disturbed(self._shown(head)) - zero
        self._counts = self._counts_at(self.shown)
        self._first = int(self._counts[0])
        self._edges, self._after, self._rising = self._find_edges()

    def sample(self, t: float) -> tuple[int, float, int, tuple[float, ...]]:
        """Count at rig time ``t`` (s), time of its last edge, 1 if it rose, times of earlier edges, newest first.

        Before the first edge the time is that of the start.
        """
        k = int(np.searchsorted(self._edges, t, side="right")) - 1
        off = self._offset(t)
        if k < 0:
            return self._counted(self._first + off), self._begin, 1, ()
        rising = int(self._rising[k])
        since = k
        while since > max(k - EDGES + 1, 0) and self._rising[since - 1] == rising:
            since -= 1
        earlier = self._edges[since:k][::-1].tolist()
        return self._counted(int(self._after[k]) + off), float(self._edges[k]), rising, tuple(earlier)

    def samples(self, t: Array) -> Array:
        """Counts at rig times ``t`` (n,) s, times of their last edges and 1 where these rose, (n, 3), see ``sample``.

        Neither readings that are off nor counts that jump are in it.
        """
        k = np.searchsorted(self._edges, t, side="right") - 1
        found = np.stack([self._after[k], self._edges[k], self._rising[k]], axis=1).astype(np.float64)
        found[k < 0] = self._first, self._begin, 1.0
        return found

    def _shown(self, head: Array) -> Array:
        """Angle of the disc (n,), rad, of that of the head."""
        section, turned = self._section, head - head[0]
        wobble = math.radians(section.eccentricity_deg) * np.sin(head + self._phase)
        slipped = section.belt_slip * turned
        if section.index:  # the pulse comes from the head itself: what slipped is put right once a turn
            slipped = section.belt_slip * (turned - math.tau * np.floor(turned / math.tau))
        shown = head + wobble - slipped
        return np.asarray(2.0 * head[0] - shown if section.reversed else shown)

    def _offset(self, t: float) -> int:
        """Counts by which the counter is wrong at ``t``: its jump, until an index puts it right, and an outlier."""
        section = self._section
        at, off = self._begin + section.jump_s, 0
        if section.jump_deg and t >= at:
            turns = np.floor(np.interp([at, t], self._t, self._head) / math.tau)
            off += 0 if section.index and turns[1] != turns[0] else self._in_counts(section.jump_deg)
        if section.outliers:
            # one stream a reading: no draw depends on which others were asked for
            random = random_stream(self._outliers, RandomStream.ROUGH_OUTLIERS, round((t - self._begin) * 1e6))
            if random.random() < section.outliers:
                off += self._in_counts(section.outlier_deg * float(random.standard_normal()))
        return off

    def _counted(self, count: int) -> int:
        """What the counter shows of a count."""
        bit = self._section.stuck_bit
        return count if bit < 0 else count | 1 << bit

    def _in_counts(self, degrees: float) -> int:
        return round(math.radians(degrees) / self._quantum)

    def _places(self, counts: Counts) -> Array:
        return np.asarray(counts * self._quantum + self._errors[counts % len(self._errors)])

    def _counts_at(self, angles: Array) -> Counts:
        counts = np.floor(angles / self._quantum + 0.5).astype(np.int64)
        return np.asarray(counts - (self._places(counts) > angles))

    def _find_edges(self) -> tuple[Array, Counts, npt.NDArray[np.bool_]]:
        """Times of all edges, counts after them, and whether they rose."""
        steps = np.diff(self._counts)
        at = np.flatnonzero(steps)
        many = np.abs(steps[at])
        k = np.repeat(at, many)
        nth = np.arange(len(k)) - np.repeat(np.cumsum(many) - many, many)  # of the edges within one step of the grid
        rising = steps[k] > 0
        after = self._counts[k] + np.where(rising, nth + 1, -nth - 1)
        place = self._places(np.where(rising, after, after + 1))
        from_angle, to_angle = self.shown[k], self.shown[k + 1]
        share = np.clip((place - from_angle) / (to_angle - from_angle), 0.0, 1.0)
        return self._t[k] + share * (self._t[k + 1] - self._t[k]), after, rising
