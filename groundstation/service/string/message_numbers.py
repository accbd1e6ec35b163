"""Which numbers of a tube's messages have come: they are contiguous, so what is missing was lost."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field

from telemetry.application.series import SERIES_SHIFT

Range = tuple[int, int]  # first and last number
SERIES_KEPT = 64


@dataclass(slots=True)
class ReceivedSeries:
    """Numbers of one series of a tube, counted from the first after ``base``."""

    base: int
    complete: int = 0  # every number up to this one has come or was given up
    beyond: set[int] = field(default_factory=set)
    told: int = 0  # newest number that the tube has given out

    def add_number(self, number: int) -> None:
        """A message of this number is stored, or will never come."""
        if number > self.complete:
            self.beyond.add(number)
        while self.complete + 1 in self.beyond:
            self.complete += 1
            self.beyond.discard(self.complete)

    def missing(self) -> Iterator[Range]:
        """Ranges that have not come, in order."""
        if not self.beyond and self.told <= self.complete:
            return
        before = self.complete
        for number in (*sorted(self.beyond), max(self.told, self.complete) + 1):
            if number > before + 1:
                yield before + 1, number - 1
            before = max(before, number)


class MessageNumbers:
    """Numbers of every tube."""

    def __init__(self) -> None:
        self._series: dict[int, dict[int, ReceivedSeries]] = {}

    def add_number(self, tube: int, number: int) -> None:
        """A message is stored."""
        self._of(tube, number).add_number(number)

    def on_told(self, tube: int, newest: int) -> bool:
        """A tube names the newest number it gave out; True when it has begun to count anew."""
        if newest <= 0:
            return False
        known = self._series.get(tube, {})
        is_new = bool(known) and newest >> SERIES_SHIFT << SERIES_SHIFT not in known
        series = self._of(tube, newest)
        counts_anew = is_new or newest < max(series.complete, series.told)
        series.told = newest
        return counts_anew

    def gap(self, tube: int) -> Range | None:
        """The first range of a tube that has not come."""
        for series in self._series.get(tube, {}).values():
            for gap in series.missing():
                return gap
        return None

    def newest(self, tube: int) -> int:
        """The largest number that a tube is known to have given out, in any of its series."""
        known = self._series.get(tube, {}).values()
        return max((max(one.told, one.complete, *one.beyond, 0) for one in known), default=0)

    def give_up(self, tube: int, gap: Range) -> None:
        """The numbers of a range will never come."""
        series = self._of(tube, gap[0])
        before = [number for number in series.beyond if number <= gap[1]]
        if series.complete >= gap[0] - 1:
            series.complete = max(series.complete, gap[1])
            series.beyond.difference_update(before)
            series.add_number(series.complete)
        else:
            for number in range(gap[0], gap[1] + 1):
                series.add_number(number)

    @property
    def tubes(self) -> list[int]:
        """Tubes of which something is known."""
        return sorted(self._series)

    def _of(self, tube: int, number: int) -> ReceivedSeries:
        base = number >> SERIES_SHIFT << SERIES_SHIFT
        known = self._series.setdefault(tube, {})
        if base not in known:
            known[base] = ReceivedSeries(base, complete=base, told=0)
            while len(known) > SERIES_KEPT:
                del known[next(iter(known))]
        return known[base]
