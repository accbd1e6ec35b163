"""What may be wrong with a look, a tube or a string beside what was foreseen."""

from __future__ import annotations

from enum import StrEnum, auto


class BlunderKind(StrEnum):
    """What may be wrong."""

    BIAS_STEPPED = auto()
    BIAS_CREEPS = auto()
    BIAS_WRONG = auto()
    TILT_SLIPPED = auto()
    TILT_WRONG = auto()
    MOUNT_TURNED = auto()
    MOUNT_MISREAD = auto()
    JOINT_SLIPPED = auto()
    JOINT_MISREAD = auto()
    ENCODER_SLIPPED = auto()
    ENCODER_DRIFTS = auto()
    HOLE_MOVED = auto()
    DEPTH_WRONG_ONCE = auto()
    DEPTH_WRONG_FROM = auto()
    AXES_EXCHANGED = auto()
    TUBES_EXCHANGED = auto()
    LOOK_WRONG = auto()
    COLLAR_WRONG = auto()
