"""What a node's flags do to its survey before it is fused: one line a flag, the strictest of those set decides.

A survey whose yaw is unknown still knows how far the tube leans, but not to which side. Were its yaw uniform on the
circle, its lean would be off from the one measured by l (cos e - 1) along it and l sin e across it. The second moments
of these are 3/2 l^2 and 1/2 l^2; across, the variance of an unknown yaw, pi^2/3 l^2, is larger and is used.

A yaw that is known is between the two: its lean lies on a part of a circle, not on the straight line that a variance
across it describes. Of a normal e with the variance v the second moment along is
l^2 (3/2 - 2 exp(-v/2) + exp(-2 v)/2), which begins as 3/4 v^2 l^2. In a flat hole even half a degree of yaw counts: the
force knows the length of a lean by the cosine of the inclination better than that of an upright tube.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import cache, reduce
from operator import or_

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Resolved
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import NodeFlag

Array = npt.NDArray[np.float64]
UNKNOWN_YAW_VAR = math.pi**2 / 3.0  # rad^2, uniform on the circle, as nodes say it (``telemetry.messages``)
ALONG, ACROSS = 1.5, UNKNOWN_YAW_VAR  # of the squared lean


EFFECTS: dict[NodeFlag, Trust] = {
    NodeFlag.YAW_UNTRUSTED: Trust.UNKNOWN_YAW,
    NodeFlag.AIDING_OLD: Trust.FULL,  # the filter's variance has grown with the time since
    NodeFlag.INNOVATION_REJECTED: Trust.UNKNOWN_YAW,  # the yaw or its aiding is wrong, unknown which
    NodeFlag.RATE_EXCEEDED: Trust.UNKNOWN_YAW,
    NodeFlag.RESTORED: Trust.FULL,  # an aiding has confirmed the saved yaw since
    NodeFlag.CLOCK_UNSYNCHRONISED: Trust.UNDATED,
    NodeFlag.BIAS_UNKNOWN: Trust.UNKNOWN_YAW,
    NodeFlag.NOT_SAVED: Trust.FULL,  # of the node's disk, not of its yaw
    NodeFlag.DRIVE_UNTOLD: Trust.FULL,  # the variance is that of any yaw, until the ground station is told the angle
    NodeFlag.LOWER_UNTOLD: Trust.FULL,  # of the tubes below
    NodeFlag.SENSOR_FAULT: Trust.SET_ASIDE,  # the force may be one that stands for a faulty sensor's
}
TOGETHER: dict[NodeFlag, Trust] = {
    # a saved yaw that no aiding has confirmed: the string may have been turned while the power was off
    NodeFlag.RESTORED | NodeFlag.AIDING_OLD: Trust.UNKNOWN_YAW,
}
STRANGE = Trust.SET_ASIDE  # of a flag that this version does not know


@cache
def trust_of(flags: NodeFlag) -> Trust:
    """Trust in a survey with these flags."""
    strange = int(flags) & ~int(reduce(or_, EFFECTS))
    effects = [effect for flag, effect in (EFFECTS | TOGETHER).items() if flag & flags == flag]
    return max([Trust.FULL, *effects, *([STRANGE] if strange else [])])


def with_unknown_yaw(resolved: Resolved) -> Resolved:
    """The same stop with the covariance of a lean whose azimuth is not known."""
    return spread_yaws(resolved, ALONG, ACROSS)


def with_uncertain_yaw(resolved: Resolved, yaw_var: float) -> Resolved:
    """The same stop where the whole variance of its yaw (rad^2) may take its lean off the straight line."""
    return spread_yaws(resolved, uncertain_along(yaw_var), 0.0)


def with_yaws_of(resolved: Resolved, yaw_vars: Sequence[float], trusts: Sequence[int]) -> Resolved:
    """Many stops (n), each with a yaw that is uncertain by its variance (rad^2), or by its trust is not known."""
    along, across = np.empty(len(trusts)), np.zeros(len(trusts))
    for k, (yaw_var, trust) in enumerate(zip(yaw_vars, trusts, strict=True)):
        if trust == Trust.UNKNOWN_YAW:
            along[k], across[k] = ALONG, ACROSS
        else:
            along[k] = uncertain_along(yaw_var)
    return spread_yaws(resolved, along[:, None, None], across[:, None, None])


def uncertain_along(yaw_var: float) -> float:
    """Part of the squared lean along it that a variance of its yaw (rad^2) makes, without a difference of equals."""
    a = math.expm1(-yaw_var / 2.0)
    return a * a * (3.0 + 2.0 * a + a * a / 2.0)


def spread_yaws(resolved: Resolved, along: Array | float, across: Array | float) -> Resolved:
    """Add these parts of the squared lean to the covariance along it and across."""
    lean, side = resolved.lean, resolved.by_yaw
    cov = (
        resolved.cov
        + along * (lean[..., :, None] * lean[..., None, :])
        + across * (side[..., :, None] * side[..., None, :])
    )
    return replace(resolved, cov=cov)
