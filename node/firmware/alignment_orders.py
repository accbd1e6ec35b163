"""Orders of an alignment, and what is said of the one in use; ``node.kernels.sensors.aligner`` follows the turns."""

from __future__ import annotations

import math
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.sensors.aligner import begin_alignment
from node.kernels.sensors.alignment import CIRCLE, EXTREMES, to_tube
from telemetry.messages import Value

METHODS: Final = {"circle": CIRCLE, "extremes": EXTREMES}
NAMES_OF_METHODS: Final = {number: name for name, number in METHODS.items()}
FEWEST, MOST = 1.0, 20.0  # turns


def order_alignment(node: Any, method: object, turns: object) -> str:
    """Begin an alignment with the next cycle of ``node`` (record of dtype ``NODE``); returns why not, or nothing."""
    if not isinstance(method, str) or method not in METHODS:
        return f"method: expected {', '.join(METHODS)}, got {method!r:.40}"
    if isinstance(turns, bool) or not isinstance(turns, int | float) or not FEWEST <= turns <= MOST:
        return f"turns: expected {FEWEST:g}..{MOST:g}, got {turns!r:.40}"
    if node["aligner"]["method"]:
        return "an alignment is under way"
    begin_alignment(node, METHODS[method], float(turns))
    return ""


def alignment_in_use(mount: Any, imus: int) -> dict[str, Value]:
    """The alignment in use, for a reply: method, and of each IMU pitch, roll and their standard errors (rad)."""
    if int(mount["method"]) not in NAMES_OF_METHODS:
        return {"method": "none"}
    angles = [angles_of(axis) for axis in mount["axis"][:imus]]
    stds = mount["std"][:imus]
    return {
        "method": NAMES_OF_METHODS[int(mount["method"])],
        "pitch": tuple(float(pitch) for pitch, _ in angles),
        "pitch_std": tuple(float(pitch) for pitch, _ in stds),
        "roll": tuple(float(roll) for _, roll in angles),
        "roll_std": tuple(float(roll) for _, roll in stds),
    }


def tube_rotation(axis: Array) -> Array:
    """Matrix (3, 3) of ``to_tube``; the axis need not be of unit length."""
    unit, columns = axis / np.linalg.norm(axis), np.eye(3)
    for column in columns:
        to_tube(unit, column)
    return np.asarray(columns.T)


def angles_of(axis: Array) -> tuple[float, float]:
    """Pitch and roll (rad) of the tube's axis in an IMU's frame: (sin p, cos p sin r, cos p cos r)."""
    x, y, z = axis.tolist()
    return math.asin(min(max(x, -1.0), 1.0)), math.atan2(y, z)
