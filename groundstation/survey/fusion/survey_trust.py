"""What a node's flags do to its survey before it is fused: one line a flag, the strictest of those set decides.

A survey whose yaw is unknown still knows how far the tube leans, but not to which side: it is fused with the variance
of a yaw that may be any. What that makes of positions is in ``sphere_direction``.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cache, reduce
from operator import or_

import numpy as np
import numpy.typing as npt

from groundstation.survey.fusion.resolve import Resolved
from groundstation.survey.fusion.sphere_direction import UNKNOWN_YAW_VAR
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import NodeFlag

Array = npt.NDArray[np.float64]


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


def with_trusts(resolved: Resolved, trusts: Sequence[int]) -> Resolved:
    """Many stops (n), the yaws of some of which are not known by their trust."""
    return with_yaws_of(resolved, UNKNOWN_YAW_VAR * (np.array(trusts) == Trust.UNKNOWN_YAW))


def with_yaws_of(resolved: Resolved, yaw_vars: Array | float) -> Resolved:
    """Stops whose yaws are not known by these variances more, rad^2."""
    turned, more = resolved.by_yaw[..., :, None] * resolved.by_yaw[..., None, :], np.asarray(yaw_vars)
    return replace(resolved, cov=resolved.cov + more[..., None, None] * turned, yaw_var=resolved.yaw_var + more)
