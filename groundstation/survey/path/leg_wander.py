"""How far a hole leaves the arc between two stations whose directions are known, since its curvature wanders.

A survey draws an arc. For a curvature as in ``curvature_process``, at rest in its distribution, the offset x(u) at a
length u of a leg L with the known direction theta(L) at its end leaves that arc by x(u) - u^2 theta(L) / (2 L). At the
lower station that is the antisymmetric moment of the curvature over the leg, which no direction at its ends shows and
which legs next to each other hardly share: it is taken as independent from leg to leg. For legs much shorter than the
correlation length l its variance is sigma^2 L^5 / (60 l).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from groundstation.survey.path.curvature_process import CURVATURE, DIRECTION, OFFSET, process_step

SAME = 6  # decimals of a length (m), to which a leg is as another


@dataclass(frozen=True, slots=True)
class LegWander:
    """Curvature of the path: its standard deviation (rad/m), and the length (m) over which it is forgotten."""

    std: float
    length: float

    def variance(self, leg: float, share: float = 1.0) -> float:
        """Variance (m^2), each way across the hole, of the place at a share of a leg (m) against the arc."""
        if self.std == 0.0:
            return 0.0
        return self.std**2 * arc_variance(round(leg, SAME), round(share, SAME), self.length)


@lru_cache(maxsize=4096)
def arc_variance(leg: float, share: float, correlation_length: float) -> float:
    """The same for a curvature of variance 1."""
    if not leg > 0.0 or not share > 0.0:
        return 0.0
    at, whole = _state_variances(share * leg, correlation_length), _state_variances(leg, correlation_length)
    rest, _ = process_step((1.0 - share) * leg, correlation_length)
    both = at[OFFSET][DIRECTION] + rest[DIRECTION, CURVATURE] * at[OFFSET][CURVATURE]
    by_turn = 0.5 * share * share * leg
    found = at[OFFSET][OFFSET] - 2.0 * by_turn * both + by_turn * by_turn * whole[DIRECTION][DIRECTION]
    return float(max(found, 0.0))


def _state_variances(length: float, correlation_length: float) -> list[list[float]]:
    """Covariance (3, 3) of offset, direction and curvature after a length (m) from a known place and direction."""
    step, noise = process_step(length, correlation_length)
    by_curvature = step[:, CURVATURE]
    found: list[list[float]] = (by_curvature[:, None] * by_curvature[None, :] + noise).tolist()
    return found
