"""How far a hole leaves the arcs between stations whose directions are known, since its curvature wanders.

A survey draws an arc from direction to direction. For a curvature as in ``curvature_process``, at rest in its
distribution, the place at a share f of a leg of length L leaves the arc, each way across the hole, by

    m(f) = x(f L) - f^2 L / 2 theta(L),        at the lower station m(1) = integral of (L/2 - u) kappa(u) du,

a moment that no direction at the ends shows. It is against what the curvature was at the upper station (b), and what it
is at the lower one is against it (a), so that legs next to each other undo a part of each other:

    Var E_K = Var E_(K-1) + v_K + 2 b_K c_K,        c_(K+1) = exp(-L_K / l) c_K + a_K,

with the variance v of a leg's own moment. Of legs much shorter than the correlation length l, v is
sigma^2 L^5 / (60 l), and a hole many l long gathers one sixth of it a leg.

The direction at the collar is in no look. Where the stations tell it better than the crew, it is carried up to the
collar by the curvature, so what it errs by is the same curvature that the first leg leaves its arc by: a hole that
begins more to the north than was thought then leaves the arc to the south. Of a hole whose curvature is known at the
first station and wanders from there up, the two together come to 0.6 L^5 / 12 and not to 1.1 L^5 / 12. What is known
there of the curvature is the bend of the second leg, so it goes with what that leaves its arc by too, and less with
each leg below.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Final, NamedTuple

import numpy as np
import numpy.typing as npt

from groundstation.survey.path.curvature_process import CURVATURE, DIRECTION, OFFSET, process_step

Array = npt.NDArray[np.float64]
SAME = 6  # decimals of a length (m), to which a leg is as another


class ArcMoment(NamedTuple):
    """What the curvature does to a place of a leg against its arc, for a curvature of variance 1."""

    variance: float  # v, m^4
    with_start: float  # b, m^2: covariance with the curvature at the upper station
    with_end: float  # a, m^2: with that at the lower station
    kept: float  # of a curvature over the leg


@dataclass(frozen=True, slots=True)
class LegWander:
    """Curvature of the path: its standard deviation (rad/m), and the length (m) over which it is forgotten."""

    std: float
    length: float

    def moment(self, leg: float, share: float = 1.0) -> ArcMoment:
        """What the place at a share of a leg (m) does against the arc."""
        return arc_moment(round(leg, SAME), round(share, SAME), self.length)

    def moments(self, legs: Array) -> Array:
        """Moments (n, 4) at the ends of legs (n,), m."""
        rounded = legs.round(SAME).tolist()
        if len(rounded) == 1:
            return np.array([arc_moment(*rounded, 1.0, self.length)])
        known: dict[float, ArcMoment] = {}
        for leg in rounded:
            if leg not in known:
                known[leg] = arc_moment(leg, 1.0, self.length)
        return np.array([*map(known.__getitem__, rounded)])

    def grown(self, memory: float, moment: ArcMoment) -> float:
        """Variance (m^2) that a leg adds to what those above have gathered; ``memory`` is their c.

        Where the leg undoes more than it adds nothing is taken off: the planes of two legs are not quite the same.
        """
        return self.std**2 * max(moment.variance + 2.0 * moment.with_start * memory, 0.0)


class CollarTie(NamedTuple):
    """How what is not known of the direction at the collar goes with a leg, each way across the hole.

    Covariances of that direction with the curvature at the upper end (rad^2/m), and with direction and curvature at the
    lower end as they depart from what the upper one leads to (rad^2 and rad^2/m).
    """

    with_curvature: float
    with_bend: float
    with_change: float

    def moment_covariance(self, leg: float, share: float, correlation_length: float) -> float:
        """Covariance (rad m) of the direction at the collar with the moment at a share of its leg (m)."""
        gains = moment_gains(round(leg, SAME), round(share, SAME), correlation_length)
        return float(np.dot(gains, self))


UNTIED: Final[tuple[CollarTie, ...]] = ()  # a direction at the collar that is known by itself
STEADY: Final = LegWander(0.0, 1.0)  # a path that does what its arcs do


@lru_cache(maxsize=4096)
def arc_moment(leg: float, share: float, correlation_length: float) -> ArcMoment:
    """Moment at a share of a leg (m)."""
    to_place, noise = process_step(share * leg, correlation_length)
    whole, whole_noise = process_step(leg, correlation_length)
    rest, _ = process_step((1.0 - share) * leg, correlation_length)
    there, end = (
        step[:, CURVATURE, None] * step[None, :, CURVATURE] + added
        for step, added in ((to_place, noise), (whole, whole_noise))
    )
    by_turn = 0.5 * share * share * leg
    offset_and_turn = there[OFFSET, DIRECTION] + rest[DIRECTION, CURVATURE] * there[OFFSET, CURVATURE]
    variance = there[OFFSET, OFFSET] - 2.0 * by_turn * offset_and_turn + by_turn**2 * end[DIRECTION, DIRECTION]
    with_start = to_place[OFFSET, CURVATURE] - by_turn * whole[DIRECTION, CURVATURE]
    with_end = rest[CURVATURE, CURVATURE] * there[OFFSET, CURVATURE] - by_turn * end[DIRECTION, CURVATURE]
    kept = float(whole[CURVATURE, CURVATURE])
    return ArcMoment(max(float(variance), 0.0), float(with_start), float(with_end), kept)


@lru_cache(maxsize=64)  # only the first legs are asked for
def moment_gains(leg: float, share: float, correlation_length: float) -> Array:
    """Moment (3,) at a share of a leg (m), as its ends tell it: for one unit of each of what `CollarTie` names."""
    to_place, noise = process_step(share * leg, correlation_length)
    whole, whole_noise = process_step(leg, correlation_length)
    rest, _ = process_step((1.0 - share) * leg, correlation_length)
    by_turn, ends = 0.5 * share * share * leg, (DIRECTION, CURVATURE)
    with_ends = (rest @ noise)[ends, OFFSET] - by_turn * whole_noise[ends, DIRECTION]
    by_ends = np.linalg.solve(whole_noise[np.ix_(ends, ends)], with_ends)
    by_start = to_place[OFFSET, CURVATURE] - by_turn * whole[DIRECTION, CURVATURE]
    return np.array([by_start, *by_ends])
