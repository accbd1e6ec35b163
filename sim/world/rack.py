"""A rack that holds every tube at preset attitudes before the first is drilled in, for a calibration in the field.

The tubes lie side by side, each by its marks, their telemetry joined as in the string. At pitch p and roll r the
direction of gravity in a tube's frame is (sin p, cos p sin r, cos p cos r): at the home position it hangs. Between two
attitudes it turns about one fixed axis by a cycloid, u - sin(2 pi u) / (2 pi): rates and forces stay closed forms.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from sim.world.scenario_file import CalibrationSection
from sim.world.truth import GAUSS_W, GAUSS_X

if TYPE_CHECKING:
    from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
ANNOUNCE = 4.0  # s after the tubes came to rest, when the operator tells the attitude
BEGIN_BEFORE = 5.0  # s before the first attitude is told, when he asks for a calibration
CONFIRM_AFTER = 5.0  # s after the question for the result


@dataclass(frozen=True, slots=True)
class Cue:
    """What the operator does at a rig time: ``begin``, ``attitude``, ``solve`` or ``confirm``; ``number`` from 1."""

    at: float
    action: str
    number: int = 0

    @property
    def name(self) -> str:
        """The same for no other cue of a rack."""
        return f"{self.action} {self.number}" if self.number else self.action


class Rack:
    """Schedule and truth of the rack.

    Parameters
    ----------
    section : of the scenario
    begin : s, rig time at which the tubes lie at the first attitude
    """

    def __init__(self, section: CalibrationSection, begin: float) -> None:
        self.section = section
        self.begin = begin
        count, turn, hold = len(section.attitudes_deg), section.move_s, section.hold_s
        self.arrivals: Array = np.array([begin + section.lead_s + (turn + hold) * k for k in range(count)])
        self.rest_from = float(self.arrivals[-1]) + hold
        self.end = self.rest_from + section.apply_s

    def cues(self) -> list[Cue]:
        """What the operator does, in order of time."""
        told = [Cue(float(at) + ANNOUNCE, "attitude", number) for number, at in enumerate(self.arrivals, 1)]
        begin = Cue(told[0].at - BEGIN_BEFORE, "begin")
        return [begin, *told, Cue(self.rest_from, "solve"), Cue(self.rest_from + CONFIRM_AFTER, "confirm")]

    def truth(self, random: np.random.Generator, mount: float, gravity: float) -> RackTruth:
        """Perfect sensor of one tube, its IMU turned by ``mount`` (rad) about the axis against the tube's marks."""
        from scipy.spatial.transform import Rotation  # two thirds of a second that only a scenario with a rack pays

        presets = np.radians(np.array(self.section.attitudes_deg))
        error = math.radians(self.section.attitude_std_deg) * random.standard_normal((len(presets), 3))
        # pitch counts up where gravity moves to +x, against the right-hand rule about y
        held = Rotation.from_euler("ZYX", np.column_stack([0.0 * presets[:, 0], -presets[:, 0], presets[:, 1]]))
        held = held * Rotation.from_rotvec(error) * Rotation.from_rotvec([0.0, 0.0, mount])
        return RackTruth(held, self.arrivals, self.section.move_s, gravity)


class RackTruth:
    """Perfect readings of one tube's IMU in the rack.

    Parameters
    ----------
    held : n rotations, ned_from_body at each attitude
    arrivals : (n,) rig time (s) at which each is reached
    turning : s, of each change
    gravity : m/s^2
    """

    def __init__(self, held: Rotation, arrivals: Array, turning: float, gravity: float) -> None:
        self._held = held
        self._arrivals = arrivals
        self._turning = turning
        self._gravity = gravity
        self._turns = (held[:-1].inv() * held[1:]).as_rotvec()  # (n - 1, 3) rad, body axes

    def attitude(self, t: Array) -> Rotation:
        """ned_from_body at rig times (n,)."""
        from scipy.spatial.transform import Rotation

        place = np.clip(np.searchsorted(self._arrivals, t, side="right") - 1, 0, len(self._arrivals) - 1)
        leg = np.minimum(place, len(self._turns) - 1)
        share = np.take_along_axis(self._shares(t), leg[:, np.newaxis], axis=1)
        return self._held[leg] * Rotation.from_rotvec(share * self._turns[leg])

    def force(self, t: Array) -> Array:
        """Specific force (n, 3, m/s^2): gravity alone, the IMU hardly moves from its place."""
        return np.asarray(self.attitude(t).inv().apply([0.0, 0.0, -self._gravity]))

    def cycle_means(self, ends: Array, period: float) -> tuple[Array, Array]:
        """Mean rate and specific force (n, 3) over the cycles that end at ``ends`` (n,); the increments are exact."""
        rate = (self._shares(ends) - self._shares(ends - period)) @ self._turns / period
        half = 0.5 * period
        nodes = (ends[:, None] - half + half * GAUSS_X[None, :]).ravel()
        force = np.einsum("ngk,g->nk", self.force(nodes).reshape(len(ends), -1, 3), 0.5 * GAUSS_W)
        return np.asarray(rate), force

    def _shares(self, t: Array) -> Array:
        """Done part (n, n - 1) of each change."""
        u = np.clip((t[:, None] - (self._arrivals[1:] - self._turning)) / self._turning, 0.0, 1.0)
        return np.asarray(u - np.sin(2.0 * math.pi * u) / (2.0 * math.pi))
