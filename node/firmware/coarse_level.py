"""First levelling of a node that does not know how it leans: gravity's direction straight from the accelerometer.

The filter's levelling is linear about its present guess. From upright it finds a horizontal tube 8 degrees wrong and an
inverted one never, so a guess that is far off is replaced before the filter refines it.
"""

from __future__ import annotations

import math

from node.kernels.layout import DEG, Array, Err

UNKNOWN_VAR = 0.25  # rad^2 of tilt, above which nothing is known that a reading could spoil
SLOWEST = 6.0 * DEG  # rad/s, up to which a mean over a cycle is that of one attitude
GRAVITY_ERROR = 0.05  # of gravity, at rest
FAR_OFF = 0.1  # rad, beyond which the linear levelling is not left to itself


def level_coarsely(state: Array, config: Array, rate: Array, force: Array) -> None:
    """Take the direction of a slow node's specific force (3, m/s^2) if its tilt is unknown; ``rate`` in rad/s."""
    if min(state["P"][Err.TILT_X, Err.TILT_X], state["P"][Err.TILT_Y, Err.TILT_Y]) < UNKNOWN_VAR:
        return
    gravity, weight = float(config["gravity"]), math.sqrt(float(force @ force))
    if abs(weight - gravity) > GRAVITY_ERROR * gravity or max(map(abs, rate)) > SLOWEST:
        return
    if -float(force @ state["down"]) < weight * math.cos(FAR_OFF):
        state["down"] = -force / weight
