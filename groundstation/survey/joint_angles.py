"""The angle at which each joint was made up, as the yaws of its two tubes tell it at rest: it does not change.

The encoder's measurement goes down the string from tube to tube. Whoever changes it on its way, a tube that lies or
one that slipped in its thread, turns the yaws of all tubes below and of none above: the yaws part at that joint.
The same happens where one tube takes a measurement of an encoder that has slipped and its neighbour does not.

What all tubes have in common (the encoder, twist of the whole string) is in both yaws and cancels; so do the constant
errors of marks and mounts, as an angle is compared with itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from groundstation.survey.methods import wrap

SIGMAS = 6.0
SLACK = math.radians(2.0)  # of the twist of one tube and of a joint that settles
AGREEING = 3  # readings in a row that say the same, until a change is believed
APART = 3.0  # s between the readings of two tubes


@dataclass(frozen=True, slots=True)
class RestingYaw:
    """Yaw (rad) of a tube at rest and its random variance (rad^2), at a time (s)."""

    tube: int
    at: float
    yaw: float
    var: float


@dataclass(frozen=True, slots=True)
class JointChange:
    """The joint below ``upper`` stands at another angle than before, by ``by`` (rad, in (-pi, pi])."""

    upper: int
    lower: int
    by: float


@dataclass(slots=True)
class Joint:
    """Angle (rad) and variance (rad^2) that were known first, and how often in a row another was seen since."""

    angle: float
    var: float
    departed: int = 0


class JointAngles:
    """Angles of every joint since the ground station's start."""

    def __init__(self) -> None:
        self._joints: dict[tuple[int, int], Joint] = {}
        self._resting: dict[int, RestingYaw] = {}

    def on_motion(self, tube: int) -> None:
        """A tube moves, or does not know its yaw."""
        self._resting.pop(tube, None)

    def on_yaw(self, string: Sequence[int], yaw: RestingYaw) -> JointChange | None:
        """Compare the newest yaw of a resting tube with that of the tube above it.

        A change is told once, from then on the new angle is the known one.

        Parameters
        ----------
        string : tubes from the top down; what was known of two that are neighbours no more is forgotten
        yaw : later than the last one of its tube
        """
        self._resting[yaw.tube] = yaw
        neighbours = list(pairwise(string))
        self._joints = {pair: joint for pair, joint in self._joints.items() if pair in neighbours}
        upper = next((upper for upper, lower in neighbours if lower == yaw.tube), None)
        above = None if upper is None else self._resting.get(upper)
        if above is None or abs(above.at - yaw.at) > APART:
            return None
        by = self._compare_joint((above.tube, yaw.tube), float(wrap(yaw.yaw - above.yaw)), above.var + yaw.var)
        return JointChange(above.tube, yaw.tube, by) if by else None

    def _compare_joint(self, pair: tuple[int, int], angle: float, var: float) -> float:
        """By how much (rad) a joint has changed, once that is sure; 0 while it is as it was."""
        known = self._joints.setdefault(pair, Joint(angle, var))
        by = float(wrap(angle - known.angle))
        if abs(by) <= SIGMAS * math.sqrt(var + known.var) + SLACK:
            known.departed = 0
            return 0.0
        known.departed += 1
        if known.departed < AGREEING:
            return 0.0
        self._joints[pair] = Joint(angle, var)
        return by
