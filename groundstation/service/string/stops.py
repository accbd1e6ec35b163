"""Where the string stopped to be surveyed, and which tubes have not answered. No I/O.

A stop is a stand of the bit that began with the end of drilling and lasted long enough for a survey; a stand
of unheard beginning is one if a tube took a survey in it. Every tube in the hole owes one; a tube whose node is still
above the collar does not.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np

from groundstation.service.string.tally import Tally
from telemetry.messages import EPOCH_UNKNOWN, Stand

SHORTEST = 30.0  # s that a stand must last for its survey to be owed
AROUND = 2.0  # s by which the times of a survey and of a stand may differ
IN_THE_HOLE = 0.01  # m below the collar from which a node owes a survey
SETTLED = 5.0  # s into an epoch of rig time in which those are heard who hung at a stop of an earlier one
STOPS_KEPT = 1000
SURVEYS_KEPT = 200_000


@dataclass(slots=True)
class Stop:
    """One stop: its stand, which tubes hung in the hole, and whether it was judged."""

    stand: Stand
    tubes: tuple[int, ...]
    judged: bool = False
    missing: set[int] = field(default_factory=set)
    later: list[Stand] = field(default_factory=list)  # in which it went on, in later epochs of rig time

    @property
    def lasted(self) -> float:
        """Duration as far as it is known, s."""
        return sum(stand.ended_at - stand.begun_at for stand in (self.stand, *self.later))

    def has(self, epoch: int, at: float) -> bool:
        """Whether a survey was taken during the stop.

        Where it went on in a later epoch, the earlier one had no other end: what is of it and later is of the stop,
        also where no depth was heard till then.
        """
        return any(epoch == own and begin <= at <= end for own, begin, end in self.spans)

    @property
    def spans(self) -> Iterator[tuple[int, float, float]]:
        """Epoch and times (s) between which ``has`` holds."""
        *ended, last = self.stand, *self.later
        for stand in ended:
            yield stand.epoch, stand.begun_at - AROUND, math.inf
        yield last.epoch, last.begun_at - AROUND, last.ended_at + AROUND

    def covers(self, stand: Stand) -> bool:
        """Whether a stand is a part of the stop."""
        return any(_stand_covers(whole, stand) for whole in (self.stand, *self.later))

    def age(self, epoch: int, rig_now: float) -> float:
        """Seconds from its begin to ``rig_now`` (s) of an epoch, fewer where rig time began anew; infinite after it."""
        newest = (self.stand, *self.later)[-1]
        if newest.epoch != epoch:
            return math.inf
        return self.lasted + rig_now - newest.ended_at


class Taken:
    """Surveys by epoch, time (s) and tube in the order of their coming, the newest half of ``SURVEYS_KEPT`` at least.

    They are numbers side by side, 20 bytes a survey: only stops that are not judged yet ask for them.
    """

    def __init__(self) -> None:
        self._epochs, self._at, self._tubes = array("q"), array("d"), array("I")

    def add_survey(self, epoch: int, at: float, tube: int) -> None:
        """A survey has come."""
        self._epochs.append(epoch)
        self._at.append(at)
        self._tubes.append(tube)
        if len(self._at) > SURVEYS_KEPT:
            oldest = slice(SURVEYS_KEPT // 2)
            del self._epochs[oldest], self._at[oldest], self._tubes[oldest]

    def tubes_of(self, stop: Stop) -> set[int]:
        """Tubes of which a survey was taken during a stop."""
        epochs, at, tubes = np.array(self._epochs), np.array(self._at), np.array(self._tubes)
        found = np.zeros(len(at), bool)
        for epoch, begin, end in stop.spans:
            found |= (epochs == epoch) & (begin <= at) & (at <= end)
        return set(tubes[found].tolist())


class Stops:
    """Stops in the order in which they were found.

    Parameters
    ----------
    tally : which tubes hang in the string
    due : s after which the survey of a stop is overdue
    """

    def __init__(self, tally: Tally, due: float) -> None:
        self._tally = tally
        self._due = due
        self._stops: list[Stop] = []
        self._owed: list[Stop] = []  # those that a survey is missing of
        self._taken = Taken()
        self._epoch, self._epoch_since = EPOCH_UNKNOWN, math.nan  # s of rig time, first judged at

    def __iter__(self) -> Iterator[Stop]:
        return iter(self._stops)

    def on_survey(self, epoch: int, at: float, tube: int) -> None:
        """A survey has come, wherever it belongs."""
        self._taken.add_survey(epoch, at, tube)
        for stop in self._owed:
            if tube in stop.missing and stop.has(epoch, at):
                stop.missing.discard(tube)
                self._owed = [one for one in self._owed if one.missing]

    def know(self, stand: Stand) -> bool:
        """Whether a stand is that of a stop, or more of it."""
        return any(_is_same_stop(stop.stand, stand) for stop in self._stops)

    def is_too_short(self, stand: Stand) -> bool:
        """Whether a stand is that of a stop, or a part of it, in which no survey was owed."""
        return any(stop.covers(stand) and stop.lasted < SHORTEST for stop in self._stops)

    def was_surveyed(self, stand: Stand) -> bool:
        """Whether a survey has come that was taken during a stand."""
        return bool(self._taken.tubes_of(Stop(stand, ())))

    def on_stand(self, stand: Stand) -> None:
        """A stand has begun, or lasted longer; the tubes are those that are known to hang while it lasts.

        A source of the depth tells its last stands with every reading, also the parts of a stop that goes on.
        """
        known = next((s for s in reversed(self._stops) if _is_same_stop(s.stand, stand) or s.covers(stand)), None)
        if known is not None:
            own = known.stand
            if stand.epoch == own.epoch and (stand.begun_at < own.begun_at or own.ended_at < stand.ended_at):
                known.stand = stand
            self._add_tubes(known)
            return
        self._stops.append(Stop(stand, tuple(self._tally.tubes_below(IN_THE_HOLE, stand.md))))
        del self._stops[:-STOPS_KEPT]

    def on_later_stand(self, before: Stand, stand: Stand) -> None:
        """The stop that ``before`` belongs to goes on in ``stand``, of a later epoch."""
        known = next((stop for stop in reversed(self._stops) if stop.covers(before)), None)
        if known is not None:
            known.later = [one for one in known.later if one.epoch != stand.epoch] + [stand]
            self._add_tubes(known)

    def judge(self, epoch: int, rig_now: float) -> None:
        """Find what is overdue at ``rig_now`` (s); nothing is while no tube is known that could owe it."""
        if epoch != self._epoch or math.isnan(self._epoch_since):
            self._epoch, self._epoch_since = epoch, rig_now
        is_settled = rig_now >= self._epoch_since + SETTLED
        for stop in self._stops if self._tally.tubes else ():
            age = stop.age(epoch, rig_now)
            if stop.judged or stop.lasted < SHORTEST or age < self._due or (age == math.inf and not is_settled):
                continue
            stop.judged = True
            stop.tubes = stop.tubes or tuple(self._tally.tubes_below(IN_THE_HOLE, stop.stand.md))
            stop.missing = set(stop.tubes) - self._taken.tubes_of(stop)
            self._owed += [stop] if stop.missing else []
        del self._owed[:-STOPS_KEPT]

    def _add_tubes(self, stop: Stop) -> None:
        """A tube that is heard while the bit stands hung there before."""
        if not stop.judged:
            stop.tubes = tuple(dict.fromkeys((*stop.tubes, *self._tally.tubes_below(IN_THE_HOLE, stop.stand.md))))


def is_in_stand(stand: Stand, epoch: int, at: float) -> bool:
    """Whether a survey was taken during a stand."""
    return epoch == stand.epoch and stand.begun_at - AROUND <= at <= stand.ended_at + AROUND


def _stand_covers(whole: Stand, stand: Stand) -> bool:
    is_within = whole.begun_at <= stand.begun_at and stand.ended_at <= whole.ended_at
    return (whole.epoch, whole.md) == (stand.epoch, stand.md) and is_within


def _is_same_stop(one: Stand, other: Stand) -> bool:
    """Whether a stand is the one of a stop that lasts longer: not one at its depth that the bit came back to."""
    touches = one.begun_at <= other.ended_at and other.begun_at <= one.ended_at
    return (one.epoch, one.md) == (other.epoch, other.md) and touches and one.ended_at <= other.ended_at
