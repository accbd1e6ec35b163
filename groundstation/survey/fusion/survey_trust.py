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
from enum import IntEnum
from functools import cache, reduce
from operator import or_

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Resolved
from telemetry.messages import NodeFlag

Array = npt.NDArray[np.float64]
UNKNOWN_YAW_VAR = math.pi**2 / 3.0  # rad^2, uniform on the circle
ALONG, ACROSS = 1.5, UNKNOWN_YAW_VAR  # of the squared lean


class Trust(IntEnum):
    """Trust in a survey; the larger number is the stricter."""

    FULL = 0  # as its variances say
    UNKNOWN_YAW = 1  # fused with the variance of an unknown yaw, beside no survey that is trusted
    SET_ASIDE = 2  # kept and shown, never fused
    UNDATED = 3  # its time is not rig time, so it has no depth


EFFECTS: dict[NodeFlag, Trust] = {
    NodeFlag.YAW_UNTRUSTED: Trust.UNKNOWN_YAW,
    NodeFlag.AIDING_OLD: Trust.FULL,  # the filter's variance has grown with the time since
    NodeFlag.INNOVATION_REJECTED: Trust.UNKNOWN_YAW,  # the yaw or its aiding is wrong, unknown which
    NodeFlag.RATE_EXCEEDED: Trust.UNKNOWN_YAW,
    NodeFlag.RESTORED: Trust.FULL,  # an aiding has confirmed the saved yaw since
    NodeFlag.CLOCK_UNSYNCHRONISED: Trust.UNDATED,
    NodeFlag.BIAS_UNKNOWN: Trust.UNKNOWN_YAW,
    NodeFlag.NOT_SAVED: Trust.FULL,  # of the node's disk, not of its yaw
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
    """Return the stop with the covariance of a lean of unknown azimuth."""
    return _spread(resolved, ALONG, ACROSS)


def with_uncertain_yaw(resolved: Resolved, yaw_var: float) -> Resolved:
    """Return the stop with the covariance that its yaw variance (rad^2) adds beyond the linear term."""
    a = math.expm1(-yaw_var / 2.0)
    return _spread(resolved, a * a * (3.0 + 2.0 * a + a * a / 2.0), 0.0)  # without a difference of what is nearly equal


def _spread(resolved: Resolved, along: float, across: float) -> Resolved:
    """Add these parts of the squared lean to the covariance along it and across."""
    d, lean, side = resolved.direction, np.asarray(resolved.direction.lean), resolved.by_yaw
    cov = d.cov + along * np.outer(lean, lean) + across * np.outer(side, side)
    return Resolved(type(d)(d.lean, d.down, cov, d.shared), resolved.by_force, resolved.by_yaw)
