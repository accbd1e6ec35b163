"""Marks and joints of a string: the angles between its tubes, what the crew reads of them, and what turned unseen."""

from __future__ import annotations

import math
from functools import cached_property

import numpy as np
import numpy.typing as npt

from node.firmware.tube_settings import UNTOLD, MakeUpAngle, PassedTube
from sim.world.motion import Motion
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario import Scenario

Array = npt.NDArray[np.float64]


def wrap_angle(angle: float) -> float:
    """Angle (rad) in (-pi, pi]."""
    return math.pi - (math.pi - angle) % (2.0 * math.pi)


class Marks:
    """What the joints of a string are and what is read of them.

    Parameters
    ----------
    scenario : validated
    seed : of every draw
    motion : the schedule, which says when a tube is made up
    """

    def __init__(self, scenario: Scenario, seed: int, motion: Motion) -> None:
        self._tubes, self._rig = scenario.tubes, scenario.file.rig
        self._section, self._rough = scenario.file.joints, scenario.file.rough
        self._told, self._wrong = scenario.file.setup, scenario.file.told
        self._seed = seed
        self.made_up = motion.make_ups if self._rig.tubes_at_start else motion.make_ups[1:]

    def read(self, tube: int) -> PassedTube:
        """What the crew reads from the scribe marks of a tube."""
        if "joints" in self._told.untold:
            return PassedTube(UNTOLD, UNTOLD)
        std = math.radians(self._section.reading_std_deg)
        drive, lower = self._joint_angles
        drive_error, lower_error = self._joint_errors
        drive_misread, lower_misread = self._wrong.misread(tube)
        misread = self._misread(tube) + drive_misread
        return PassedTube(
            MakeUpAngle(wrap_angle(drive[tube] - self._turned_before(tube) + drive_error[tube] + misread), std),
            MakeUpAngle(wrap_angle(lower[tube] + lower_error[tube] + lower_misread), std),
        )

    def errors(self, tube: int) -> Array:
        """What the marks from the head to a tube are wrong by while each from that tube on is the top one, (n,) rad."""
        drive_error, lower_error = self._joint_errors
        above = np.concatenate([np.zeros(1), np.cumsum(lower_error[tube + 1 :])])
        return np.asarray(drive_error[tube:] + above - self.mounts[tube])

    def frame_angle(self, tube: int) -> float:
        """Angle (rad) from the head to the IMU's frame of a tube.

        Joints below the head are rigid: a tube keeps for ever the angle it had while it was the top one.
        """
        return self._joint_angles[0][tube] + self.mounts[tube]

    def unseen(self, tube: int, t: Array) -> Array:
        """What a tube has slipped (rad) by rig times (n,) since its own make-up, at the make-ups of those above."""
        first = max(tube - max(self._rig.tubes_at_start, 1), 0)
        sums = np.concatenate([np.zeros(first + 1), np.cumsum(self._slips[first:])])
        return np.asarray(sums[np.searchsorted(self.made_up, t, side="right")])

    @cached_property
    def mounts(self) -> list[float]:
        """By how much the IMU of each tube is off its mark about the axis, rad."""
        std = math.radians(self._section.mount_std_deg)
        errors: list[float] = (
            std * random_stream(self._seed, RandomStream.MOUNTS, 0).standard_normal(self._tubes + 1)
        ).tolist()
        return errors

    @cached_property
    def free_turns(self) -> Array:
        """What the head turns, free of the string, before each make-up, rad."""
        size = math.radians(self._section.head_turn_deg)
        return np.asarray(size * random_stream(self._seed, RandomStream.SLIPS, 1).uniform(0.5, 1.5, len(self.made_up)))

    @cached_property
    def _slips(self) -> Array:
        """What the string below turns unseen at each make-up, rad."""
        std = math.radians(self._section.unseen_std_deg)
        return np.asarray(std * random_stream(self._seed, RandomStream.SLIPS, 0).standard_normal(len(self.made_up)))

    def _misread(self, tube: int) -> float:
        """Blunder (rad) in the mark between the head and a tube: of the first that is added, or that is there."""
        rough, first = self._rough, min(max(self._rig.tubes_at_start, 1) + 1, self._rig.tubes)
        return math.radians(rough.string.wrong_mark_deg) if rough is not None and tube == first else 0.0

    def _turned_before(self, tube: int) -> float:
        """What the head has turned free of the string when a tube is made up to it, rad."""
        made_up = tube - max(self._rig.tubes_at_start, 1)
        return float(np.sum(self.free_turns[: max(made_up, 0)]))

    @cached_property
    def _joint_angles(self) -> tuple[list[float], list[float]]:
        """True angles by tube (index 0 unused): drive head to tube while it is on top, tube to the one below.

        The string stands while a tube is added, so the new pair of joints adds up to the old one.
        """
        random = random_stream(self._seed, RandomStream.JOINTS, 0)
        drive, lower = [0.0], [0.0]
        for tube in range(1, self._tubes + 1):
            angle = float(random.uniform(-math.pi, math.pi))
            made_up = tube - max(self._rig.tubes_at_start, 1)
            slip = float(self._slips[made_up - 1]) if made_up > 0 else 0.0
            lower.append(angle if tube > 1 else 0.0)
            drive.append(drive[tube - 1] - angle + slip if tube > 1 else angle)
        return drive, lower

    @cached_property
    def _joint_errors(self) -> tuple[list[float], list[float]]:
        random = random_stream(self._seed, RandomStream.JOINTS, 1)
        std = math.radians(self._section.reading_std_deg)
        draws = std * random.standard_normal((self._tubes + 1, 2))
        draws[:2, 1] = 0.0  # the lowest tube has no joint below
        return draws[:, 0].tolist(), draws[:, 1].tolist()
