"""Motion of head and string in the field, on a fine grid of rig time: ripple, stick-slip, stops, play, untold twist.

Upon the schedule's angle of the head comes what the drive adds to it; the string follows the head through its play and
lags it by its twist. Between the samples of the grid an angle is linear.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from sim.world.motion import Motion, SchedulePhase
from sim.world.random_streams import RandomStream, random_stream
from sim.world.rough_section import RoughDriveSection, RoughSection, RoughStringSection
from sim.world.torsion import smooth_step

Array = npt.NDArray[np.float64]
MARGIN = 1.0  # s of the grid before the start and after the end
BACK_AFTER, BACK_WITHIN = 2.0, 3.0  # s, after a stop and of the turn back
WIND = 2.0  # s, in which a string that is driven winds up


class RoughMotion:
    """Angles of one run.

    Parameters
    ----------
    section : the scenario's
    motion : the schedule
    begin : s, rig time of the start
    seed : of the run

    Attributes
    ----------
    t : (n,) s, rig time of the samples
    head : (n,) rad, unwrapped, of the drive head
    string : (n,) rad, of the string below the play, without the twist
    driven : (n,) 1 while the schedule turns the head, else 0
    """

    def __init__(self, section: RoughSection, motion: Motion, begin: float, seed: int) -> None:
        count = math.ceil((motion.end - begin + 2.0 * MARGIN) * section.samples_hz) + 1
        self.t: Array = begin - MARGIN + np.arange(count) / section.samples_hz
        self._drills = tuple(phase for phase in motion.phases if phase.kind == "drill")
        base, rate, _ = motion.drive(self.t)
        self.driven = (rate > 0.0).astype(np.float64)
        self.head = base + self._added(section.drive, motion, base, rate)
        if section.drive.stop_spread_deg > 0.0:
            self.head += self._turned_further(section.drive, motion, base, seed)
        self.string = self.through_play(section.string, seed)

    def twist(self, section: RoughStringSection) -> Array:
        """Angle (n,) rad by which the string lags the head for its twist."""
        lag = np.zeros_like(self.t)
        for k, drill in enumerate(self._drills):
            wound = smooth_step(self.t - drill.start, WIND)[0]
            if section.unwind_s > 0.0:
                gone = smooth_step(self.t - drill.end - section.hold_s, section.unwind_s)[0]
                lag += wound * (1.0 - gone)
            elif k == 0:
                lag += wound
        return np.asarray(math.radians(section.twist_deg) * np.minimum(lag, 1.0))

    def _added(self, section: RoughDriveSection, motion: Motion, base: Array, rate: Array) -> Array:
        """What the drive adds to the schedule's angle (n,), rad."""
        added = np.zeros_like(self.t)
        for drill in self._drills:
            inside = (self.t >= drill.start) & (self.t <= drill.end)
            added[inside] += swing_angle(section, rate[inside], self.t[inside] - drill.start)
            end = float(motion.drive(np.array([drill.end]))[0][0])
            added -= missed_by_dead_stop(section, motion, drill, base, end)
            back = smooth_step(self.t - drill.end - BACK_AFTER, BACK_WITHIN)[0]
            added -= math.radians(section.turns_back_deg) * back
        return added

    def _turned_further(self, section: RoughDriveSection, motion: Motion, base: Array, seed: int) -> Array:
        """Angle (n,) rad by which the head turns beyond the schedule's, evenly with that: a driller stops anywhere."""
        parts = random_stream(seed, RandomStream.ROUGH_STOP_ANGLES).random(len(self._drills))
        further = np.zeros_like(base)
        for part, drill in zip(parts.tolist(), self._drills, strict=True):
            begin, end = motion.drive(np.array([drill.start, drill.end]))[0]
            further += part * np.clip((base - begin) / (end - begin), 0.0, 1.0)
        return np.asarray(math.radians(section.stop_spread_deg) * further)

    def through_play(self, section: RoughStringSection, seed: int) -> Array:
        """Angle (n,) rad of the string: the head drives it at one flank; after a stop it runs on and waits there."""
        play = math.radians(section.backlash_deg)
        if play == 0.0:
            return self.head
        string = self.head.copy()
        parts = random_stream(seed, RandomStream.ROUGH_STOPS).random(len(self._drills))
        for k, drill in enumerate(self._drills):
            last = self._drills[k + 1].end if k + 1 < len(self._drills) else math.inf
            after = (self.t > drill.end) & (self.t <= last)
            stopped = np.interp(drill.end, self.t, self.head)
            held = stopped + play * parts[k] * smooth_step(self.t[after] - drill.end, section.run_on_s)[0]
            string[after] = np.minimum(np.maximum(self.head[after], held), self.head[after] + play)
        return string


def swing_angle(section: RoughDriveSection, rate: Array, u: Array) -> Array:
    """Angle (n,) that ripple and stick-slip add at a mean ``rate`` (n,) rad/s, ``u`` (n,) s after the drive's start.

    Ripple: w (1 + r sin x). Stick-slip: w (8/3) sin^4(x/2) = w (1 - 4/3 cos x + 1/3 cos 2x), which stands for a
    third of every swing and turns at 2.7 times the mean in between; x = 2 pi u / T. Either is the integral at a
    steady mean, and gone where that is zero.
    """
    x, y = math.tau * u / section.ripple_s, math.tau * u / section.stick_slip_s
    ripple = section.ripple * section.ripple_s / math.tau * (1.0 - np.cos(x))
    slip = section.stick_slip * section.stick_slip_s / math.tau * (-4.0 / 3.0 * np.sin(y) + np.sin(2.0 * y) / 6.0)
    return np.asarray(rate * (ripple + slip))


def missed_by_dead_stop(
    section: RoughDriveSection, motion: Motion, drill: SchedulePhase, base: Array, end: float
) -> Array:
    """Angle (n,) rad that a head does not turn which stops dead at ``dead_stop_dps`` instead of easing out."""
    if section.dead_stop_dps == 0.0:
        return np.zeros_like(base)
    t = np.linspace(drill.start, drill.end, 20_001)
    angle, rate, _ = motion.drive(t)
    slow = np.flatnonzero(rate > math.radians(section.dead_stop_dps))
    left = end - float(angle[slow[-1]]) if len(slow) else 0.0
    return np.asarray(np.clip(base - (end - left), 0.0, left))
