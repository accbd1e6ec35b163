"""The search for what is wrong with a hole, beside the answers: it takes longer than a question may wait.

Until it ends the hole is adjusted with what was found before, and it is said that something does not fit. What it ends
with is what a search at once would have come to, so in the end it is the same however long it took.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import numpy.typing as npt

from groundstation.service.hole.examined_hole import ExaminedHole
from groundstation.survey.adjustment.blunders import Examination, examine_hole, examine_known
from groundstation.survey.adjustment.looks import Looks, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.screen import is_suspicious

Array = npt.NDArray[np.float64]


class Running(Protocol):
    """Something that is being done beside everything else, such as a thread."""

    def is_alive(self) -> bool:
        """Whether it is not done yet."""

    def join(self) -> None:
        """Wait until it is done."""


RunApart = Callable[[Callable[[], None]], Running]


@dataclass(frozen=True, slots=True)
class LookedAt:
    """Looks in the order of time, what is known of their tubes and path before, and how the string was run."""

    looks: Looks
    string: StringPrior
    path: PathPrior
    run: RunOfStops
    tubes: tuple[str, ...]  # numbers of the tubes by their places
    start: StartingPoint | None = None

    def examine(self) -> ExaminedHole:
        """Adjust the hole and look for what is wrong at once."""
        found = examine_hole(self.looks, self.string, self.path, self.run, start=self.start)
        return ExaminedHole(found, self.run, self.tubes, len(self.looks))


@dataclass(slots=True)
class Search:
    """One search: what is looked at, the number of its newest survey, and what came of it."""

    number: int
    seen: LookedAt
    found: Examination | None = None  # None while it runs, and where the equations have no solution
    is_unexplained: bool = False  # whether something seems to be wrong and nothing explains it
    running: Running = field(init=False)

    def begin(self, run_apart: RunApart) -> None:
        """Start it."""
        self.running = run_apart(self._run)

    def _run(self) -> None:
        seen = self.seen
        try:
            found = examine_hole(seen.looks, seen.string, seen.path, seen.run, start=seen.start)
            self.is_unexplained = is_suspicious(found.explained, seen.run)
            self.found = found
        except (np.linalg.LinAlgError, ArithmeticError):
            self.found = None


class BlunderSearch:
    """Searches one after the other, of the newest surveys; its callers are on one thread.

    Parameters
    ----------
    run_apart : does something beside everything else
    """

    def __init__(self, run_apart: RunApart) -> None:
        self._run_apart = run_apart
        self._running: Search | None = None
        self._waiting: Search | None = None
        self._last: Search | None = None  # that has ended

    def examine(self, number: int, seen: LookedAt) -> ExaminedHole:
        """Adjust a hole with what is known to be wrong by now; if more seems to be, that is looked for.

        Parameters
        ----------
        number : of the newest survey
        """
        last = self._last if self._last is not None and goes_on(self._last.seen, seen) else None
        before = None if last is None else last.found
        found, more = examine_known(seen.looks, seen.string, seen.path, seen.run, before, seen.start)
        is_known = bool(found.blunders or found.suspicion)
        if not (is_known or more):
            return ExaminedHole(found, seen.run, seen.tubes, len(seen.looks))
        self._seek(Search(number, seen))
        surveys = 0 if last is None else len(last.seen.looks)
        is_new = more and not (last is not None and last.is_unexplained)
        return ExaminedHole(found, seen.run, seen.tubes, surveys, is_new)

    def _seek(self, search: Search) -> None:
        if self._running is None:
            self._running = search
            search.begin(self._run_apart)
        elif self._running.number != search.number:
            self._waiting = search

    def take_found(self) -> tuple[int, ExaminedHole] | None:
        """What the search that has ended since the last call came to, with its number; None where none has."""
        done = self._running
        if done is None or done.running.is_alive():
            return None
        self._running, waiting, self._waiting = None, self._waiting, None
        if waiting is not None:
            self._seek(waiting)
        if done.found is None:
            return None
        self._last = done
        return done.number, ExaminedHole(done.found, done.seen.run, done.seen.tubes, len(done.seen.looks))

    def wait(self) -> bool:
        """Wait until the search that runs has ended; whether one ran."""
        if self._running is None:
            return False
        self._running.running.join()
        return True


def goes_on(before: LookedAt, now: LookedAt) -> bool:
    """Whether stations, stops and tubes of before have the same places now: later ones have only been added."""
    pairs = ((before.run.station_md, now.run.station_md), (before.run.time, now.run.time))
    same = all(len(one) <= len(other) and np.array_equal(one, other[: len(one)]) for one, other in pairs)
    return same and before.tubes == now.tubes[: len(before.tubes)]
