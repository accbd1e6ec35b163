"""How far a survey is trusted."""

from __future__ import annotations

from enum import IntEnum


class Trust(IntEnum):
    """Trust in a survey; the larger number is the stricter."""

    FULL = 0  # as its variances say
    UNKNOWN_YAW = 1  # fused with the variance of an unknown yaw, beside no survey that is trusted
    SET_ASIDE = 2  # kept and shown, never fused
    UNDATED = 3  # its time is not rig time, so it has no depth
