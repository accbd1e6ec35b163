"""The angle at which each joint was made up, as the yaws of its two tubes tell it at rest: it does not change.

The encoder's measurement goes down the string from tube to tube. A tube that changes it on its way, because it lies or
slipped in its thread, turns the yaws of all tubes below and of none above: the yaws part at that joint.
The same happens where one tube takes a measurement of an encoder that has slipped and its neighbour does not.

What all tubes have in common (the encoder, twist of the whole string) is in both yaws and cancels; so do the constant
errors of marks and mounts, as an angle is compared with itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from groundstation.survey.bearings import wrap_angle

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
    """A joint stands at another angle than the known one, by ``by`` (rad, in [-pi, pi))."""

    pair: Pair
    by: float


@dataclass(frozen=True, slots=True)
class JointAngle:
    """Angle (rad) at which a joint was known first, and its variance (rad^2)."""

    angle: float
    var: float


Pair = tuple[int, int]  # upper and lower tube


class JointAngles:
    """Angles of every joint.

    Attributes
    ----------
    known : joints by upper and lower tube, enough to go on with after a restart
    """

    def __init__(self) -> None:
        self.known: dict[Pair, JointAngle] = {}
        self._resting: dict[int, RestingYaw] = {}
        self._differing: dict[Pair, int] = {}  # readings in a row that differ from what is known
        self._departed: set[Pair] = set()
        self._string: tuple[int, ...] = ()
        self._above: dict[int, int] = {}  # tube above each but the topmost

    def on_motion(self, tube: int) -> None:
        """A tube moves, or does not know its yaw."""
        self._resting.pop(tube, None)

    def on_yaw(self, string: Sequence[int], yaw: RestingYaw) -> JointChange | None:
        """Compare the newest yaw of a resting tube with that of the tube above it.

        A change is told once until it is accepted: an angle that returns may be that of two yaws, wrong alike.

        Parameters
        ----------
        string : tubes from the top down; what was known of two that are neighbours no more is forgotten
        yaw : later than the last one of its tube
        """
        self._resting[yaw.tube] = yaw
        if (hanging := tuple(string)) != self._string:
            self._string, self._above = hanging, {lower: upper for upper, lower in pairwise(hanging)}
            for pair in [(upper, lower) for upper, lower in self.known if self._above.get(lower) != upper]:
                self._forget(pair)
        above = self._resting.get(self._above[yaw.tube]) if yaw.tube in self._above else None
        if above is None or abs(above.at - yaw.at) > APART:
            return None
        return self._compare(
            (above.tube, yaw.tube), JointAngle(float(wrap_angle(yaw.yaw - above.yaw)), above.var + yaw.var)
        )

    def accept(self) -> list[Pair]:
        """Forget the angles of the joints that differ, whose next reading is the known one; returns these joints."""
        departed = sorted(self._departed)
        for pair in departed:
            self._forget(pair)
        return departed

    def _compare(self, pair: Pair, seen: JointAngle) -> JointChange | None:
        known = self.known.setdefault(pair, seen)
        by = float(wrap_angle(seen.angle - known.angle))
        departs = abs(by) > SIGMAS * math.sqrt(seen.var + known.var) + SLACK
        self._differing[pair] = self._differing.get(pair, 0) + 1 if departs else 0
        if self._differing[pair] < AGREEING or pair in self._departed:
            return None
        self._departed.add(pair)
        return JointChange(pair, by)

    def _forget(self, pair: Pair) -> None:
        self.known.pop(pair, None)
        self._differing.pop(pair, None)
        self._departed.discard(pair)
