"""Functions of angles in both arithmetics, beside ``operations``: for floats those of ``math``."""

from __future__ import annotations

import math
from typing import Final

from node.kernels.arithmetic.formats import ANGLE_Q, TURNS_Q, VECTOR_Q
from node.kernels.arithmetic.integers import multiply_q31, root_of, rounded_shift
from node.kernels.arithmetic.operations import by_type, vector_length
from node.kernels.arithmetic.trigonometry import polar_coordinates, radians_to_counts, sine_cosine

UNITY: Final = 1 << VECTOR_Q
TURN_ANGLE: Final = round(math.tau * 2.0 ** (ANGLE_Q - TURNS_Q + 12))
ANGLE_TURNS: Final = round(2.0**31 / math.tau)


def _spin(angle: int) -> tuple[int, int]:
    sine, cosine = sine_cosine(radians_to_counts(angle, ANGLE_Q))
    return cosine, sine


@by_type(_spin)
def spin_of(angle: float) -> tuple[float, float]:
    """Cosine and sine of an angle."""
    return math.cos(angle), math.sin(angle)


def _arcsine(sine: int) -> int:
    held = max(min(sine, UNITY), -UNITY)
    return polar_coordinates(root_of(UNITY * UNITY - held * held), held << 12)[0]


@by_type(_arcsine)
def arcsine(sine: float) -> float:
    """The angle of a sine; what is beyond 1 counts as 1."""
    return math.asin(min(max(sine, -1.0), 1.0))


@by_type(lambda y, x: polar_coordinates(x, y)[0])
def arctangent(y: float, x: float) -> float:
    """The angle of the point (x, y)."""
    return math.atan2(y, x)


@by_type(lambda x, y: vector_length(x, y, 0))
def planar_length(x: float, y: float) -> float:
    """Distance of the point (x, y) from the middle; integers: as ``vector_length``."""
    return math.hypot(x, y)


@by_type(lambda turns: rounded_shift(min(turns, 1 << 31) * TURN_ANGLE, 12))
def angle_of_turns(turns: float) -> float:
    """The angle of so many turns."""
    return turns * math.tau


@by_type(lambda angle: rounded_shift(multiply_q31(angle, ANGLE_TURNS), ANGLE_Q - TURNS_Q))
def turns_of(angle: float) -> float:
    """How many turns an angle is."""
    return angle / math.tau
