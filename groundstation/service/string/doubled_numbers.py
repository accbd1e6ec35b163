"""Two tubes that give themselves one number: found by their places in the string, and told apart by them. No I/O.

Each state names how far its tube is from the encoder. One tube changes that once, when another is added above it; two
of one number contradict each other with every state. Which of both a message is of is told by its place and its time.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass
from itertools import pairwise

from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, NodeFlag, NodeState, SurveyMeasurement

OTHER = 1000  # added to the number of the one of two that is not it, or not told to be
STATES_KEPT = 12  # of a number
WITHIN = 20.0  # s of rig time in which places are compared
CHANGES = 5  # of the place back and forth, which no adding of a tube makes
BEFORE = 1.0  # s before the first contradiction, from which on nothing is believed to be of one tube


@dataclass(frozen=True, slots=True)
class DoubledPlaces:
    """The two places (tubes from the encoder) of a number from a rig time (s) of an epoch on."""

    epoch: int
    at: float
    upper: int
    lower: int

    def is_same(self, other: DoubledPlaces) -> bool:
        """Whether both are the same places of one epoch."""
        return (self.epoch, self.upper, self.lower) == (other.epoch, other.upper, other.lower)


class NumberWatch:
    """Finds numbers that two tubes give themselves."""

    def __init__(self) -> None:
        self._states: dict[tuple[int, int], deque[tuple[float, int]]] = {}  # time and place, by tube and epoch

    def find_places(self, state: NodeState) -> DoubledPlaces | None:
        """The two places of a state's tube, where it has been heard from both in turn; None where it is one tube.

        States are put in the order of their times, so that none that comes late, or again, makes two of one.
        """
        if state.hops < 1 or state.epoch == EPOCH_UNKNOWN or NodeFlag.CLOCK_UNSYNCHRONISED in state.flags:
            return None
        kept = self._states.setdefault((state.tube, state.epoch), deque(maxlen=STATES_KEPT))
        if (state.at, state.hops) in kept:
            return None
        kept.append((state.at, state.hops))
        newest = max(at for at, _ in kept)
        heard = sorted(one for one in kept if one[0] > newest - WITHIN)
        turns = [(before, after) for before, after in pairwise(heard) if before[1] != after[1]]
        lately = turns[-CHANGES:]
        places = {place for turn in lately for _, place in turn}
        if len(lately) < CHANGES or len(places) != 2:
            return None
        return DoubledPlaces(state.epoch, lately[0][0][0] - BEFORE, min(places), max(places))


class DoubledNumbers:
    """Which numbers are doubled, since when and where, and which of both was told to be it.

    Attributes
    ----------
    places : by number, in the order in which they were found; empty as long as no number is doubled
    is_upper : by number, whether the upper of both was told to be the tube; not in it before that is told
    """

    def __init__(self) -> None:
        self.places: dict[int, list[DoubledPlaces]] = {}
        self.is_upper: dict[int, bool] = {}

    def begin_anew(self, places: Iterable[tuple[int, DoubledPlaces]], is_upper: dict[int, bool]) -> None:
        """Take what stands in the book of the setup; places in the order in which they were found."""
        self.places.clear()
        for tube, one in places:
            self.places.setdefault(tube, []).append(one)
        self.is_upper = dict(is_upper)

    def __bool__(self) -> bool:
        return bool(self.places)

    def __contains__(self, tube: int) -> bool:
        return tube % OTHER in self.places

    @property
    def untold(self) -> list[int]:
        """Numbers of which it was not told which of both is the tube."""
        return sorted(self.places.keys() - self.is_upper.keys())

    def newest(self, tube: int) -> DoubledPlaces:
        """Places of a doubled number as they were found last."""
        return self.places[tube][-1]

    def upper_of(self, tube: int) -> int:
        """Number by which the upper of both is known: its own where it was told to be the tube."""
        return tube if self.is_upper.get(tube, False) else OTHER + tube

    def key_of(self, tube: int, epoch: int, at: float, hops: int) -> int:
        """Number by which the sender of a message at a rig time (s) is known, so far from the encoder."""
        places = self._in_force(tube, epoch, at)
        if places is None:
            return tube
        is_upper = hops == places.upper
        return tube if is_upper == self.is_upper.get(tube, False) else OTHER + tube

    def state_apart(self, state: NodeState) -> NodeState:
        """A state under the number by which its tube is known."""
        key = self.key_of(state.tube, state.epoch, state.at, state.hops) if self.places else state.tube
        return state if key == state.tube else replace(state, tube=key)

    def survey_apart(self, m: SurveyMeasurement) -> SurveyMeasurement:
        """A measurement under the number by which its tube is known."""
        key = self.key_of(m.tube, m.epoch, m.station_at, m.hops)
        return m if key == m.tube else replace(m, tube=key)

    def is_held(self, m: SurveyMeasurement) -> bool:
        """Whether a measurement is not to be fused: it is of the other one, or which one is it was not told."""
        places = self._in_force(m.tube, m.epoch, m.station_at)
        return places is not None and (m.tube not in self.is_upper or self.survey_apart(m).tube != m.tube)

    def _in_force(self, tube: int, epoch: int, at: float) -> DoubledPlaces | None:
        """Places of a number at a time; those known last in an epoch of which none are known, None before the first."""
        known = self.places.get(tube)
        if not known:
            return None
        of_epoch = [one for one in known if one.epoch == epoch]
        if of_epoch or epoch == EPOCH_UNKNOWN:
            before = [one for one in of_epoch or known if one.at <= at or epoch == EPOCH_UNKNOWN]
            return before[-1] if before else None
        return known[-1] if epoch > known[0].epoch else None
