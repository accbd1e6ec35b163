"""How far tubes lie askew in a hole and how it bends, learnt from step to step of its adjustment until they settle."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.curvature_size import learnt_curvature
from groundstation.survey.adjustment.looks import StartingPoint
from groundstation.survey.adjustment.play import PLAY_KNOWN_AS, faster_play, learnt_play

Array = npt.NDArray[np.float64]
ITERATIONS = 12  # in which play and bends are learnt; they are left as they stand then
NEAR = 3.0  # standard deviations, of a step from which on the play is not that of unknowns still on their way
PLAY_SETTLED = 0.02  # of its variance
LEGS_SETTLED = 0.2  # of the logarithm of the variance of each leg
PART = 0.75  # of the way that variances of legs go at once
TURNED_BACK = 0.5  # of that, whenever they turn back by more than half of what they were to go


class Swing:
    """Variances on their way to others, by their logarithms; most of the way, for a whole step goes too far."""

    def __init__(self) -> None:
        self._part, self._last = PART, np.zeros(1)

    def part_of_way(self, before: Array, after: Array) -> Array:
        """Variances to go on with; a part of the way that gets less whenever they turn back by nearly as much."""
        change = np.log(after / before)
        if np.sum(change * self._last) < -0.5 * np.sum(self._last**2):
            self._part *= TURNED_BACK
        self._last = change
        return np.asarray(before * (after / before) ** self._part)


class VarianceLearning:
    """What is learnt of play and bends while the unknowns of a hole are on their way.

    Parameters
    ----------
    is_done : they are known, and stay as they are

    Attributes
    ----------
    is_done : whether they have settled, or there were steps enough
    """

    def __init__(self, *, is_done: bool) -> None:
        self.is_done = self._is_bent = is_done
        self._tried: list[tuple[float, float]] = []
        self._swing = Swing()

    def go_on(self, found: Adjusted, again: int, step: float) -> StartingPoint:
        """Where to go on: the unknowns as they stand, with play and bends as these tell them unless they are learnt.

        Parameters
        ----------
        again : number of the step from 0, the first of which was not along the sphere and tells no bend
        step : its largest, in standard deviations
        """
        now = found.now
        if self.is_done:
            return now
        bends = learnt_curvature(found) if again and not self._is_bent else None
        play = learnt_play(found, found.string.play_std**2, PLAY_KNOWN_AS)
        if bends is not None:
            self._is_bent = bool(np.all(np.abs(np.log(bends[1] / now.leg_vars)) <= LEGS_SETTLED))
        is_near, is_played = step < NEAR, abs(play - now.play_var) <= PLAY_SETTLED * now.play_var
        self.is_done = again >= ITERATIONS or (is_near and is_played and self._is_bent)
        if self.is_done:
            return now
        self._tried = [*self._tried, (now.play_var, play)] if is_near else []
        now = replace(now, play_var=faster_play(self._tried) if self._tried else play)
        return now if bends is None or self._is_bent else self._bent_on(now, *bends)

    def _bent_on(self, now: StartingPoint, whole: float, legs: Array) -> StartingPoint:
        """Further on the way to variances of the hole and its legs."""
        between = self._swing.part_of_way(np.append(now.leg_vars, now.curvature_var), np.append(legs, whole))
        return replace(now, curvature_var=float(between[-1]), leg_vars=between[:-1])
