"""Angles as floats and as binary angles (2^32 is one turn, wraps by itself and never loses resolution)."""

from __future__ import annotations

import math
from typing import Final

from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import as_number
from node.kernels.arithmetic.quantity import angle_quantity as of_angle

HALF_TURN: Final = of_angle(math.pi)
WHOLE_TURN: Final = of_angle(2.0 * math.pi)


@kernel
def wrap_angle(angle: float) -> float:
    """Angle (rad) in (-pi, pi]."""
    return HALF_TURN - (HALF_TURN - angle) % WHOLE_TURN


@kernel
def wrap_positive(angle: float) -> float:
    """Angle (rad) in [0, 2 pi)."""
    wrapped = angle % WHOLE_TURN
    return as_number(wrapped) if wrapped < WHOLE_TURN else 0


@kernel
def to_binary(angle: float) -> int:
    """Binary angle, 0 .. 2^32 - 1, nearest to ``angle`` (rad)."""
    return math.floor(angle / (2.0 * math.pi) * 4294967296.0 + 0.5) & 0xFFFFFFFF


@kernel
def from_binary(binary: int) -> float:
    """Angle (rad) in [0, 2 pi) of a binary angle."""
    return float(binary) * (2.0 * math.pi / 4294967296.0)


@kernel
def advance_binary(binary: int, increment: float) -> int:
    """Binary angle turned by ``increment`` (rad), rounded to the nearest count."""
    return (int(binary) + math.floor(increment / (2.0 * math.pi) * 4294967296.0 + 0.5)) & 0xFFFFFFFF
