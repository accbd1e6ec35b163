"""The string as the ground station knows it: which tube hangs below which, and how deep each of them is."""

from __future__ import annotations

from bisect import bisect_right


class Tally:
    """Tubes from top to bottom, found from the hop counts they report.

    A tube that was never seen is put where its hop count says; once every tube has reported a different count, the
    counts decide. A tube that falls silent keeps its place: it still hangs there.

    Parameters
    ----------
    tube_length : m, of every tube
    """

    def __init__(self, tube_length: float) -> None:
        self._tube_length = tube_length
        self._hops: dict[int, int] = {}
        self.tubes: list[int] = []

    def on_hops(self, tube: int, hops: int) -> None:
        """Handle the hop count that a tube reports, 1 at the top."""
        if hops < 1:
            return
        self._hops[tube] = hops
        if tube not in self.tubes:
            self.tubes.insert(min(hops - 1, len(self.tubes)), tube)
        counts = sorted(self._hops.values())
        if counts == list(range(1, len(counts) + 1)):
            self.tubes.sort(key=lambda known: self._hops[known])

    def restore(self, tubes: list[int]) -> None:
        """Restore the order known before a restart, top first; it holds until reports complete another."""
        self.tubes = list(tubes)
        self._hops = {tube: place for place, tube in enumerate(tubes, 1)}

    def above(self, tube: int, hops: int) -> list[int] | None:
        """Tubes above one when it was ``hops`` from the encoder, lowest first; None where the order does not fit."""
        if tube not in self.tubes:
            return None
        over = self.tubes[: self.tubes.index(tube)][::-1]
        return over[: hops - 1] if 1 <= hops <= len(over) + 1 else None

    def length_below(self, tube: int) -> float | None:
        """Length (m) of string below a tube's node, which sits at the tube's lower end; None for an unknown tube."""
        if tube not in self.tubes:
            return None
        return (len(self.tubes) - 1 - self.tubes.index(tube)) * self._tube_length


class DepthLog:
    """Depth of the bit over rig time, kept where it changes."""

    LIMIT = 100_000

    def __init__(self) -> None:
        self._at: list[float] = []
        self._md: list[float] = []

    def append_reading(self, at: float, md: float) -> bool:
        """Add a reading; True when the bit has come to rest at a new depth."""
        if self._at and at <= self._at[-1]:
            return False
        came_to_stand = len(self._md) >= 2 and md == self._md[-1] != self._md[-2]
        if len(self._md) >= 2 and md == self._md[-1] == self._md[-2]:
            self._at[-1] = at
            return False
        self._at.append(at)
        self._md.append(md)
        if len(self._at) > self.LIMIT:
            del self._at[: self.LIMIT // 2], self._md[: self.LIMIT // 2]
        return came_to_stand

    def restore(self, at: float, md: float) -> None:
        """Restore a stored depth, at rest from ``at`` on."""
        self._at.append(at)
        self._md.append(md)

    def at(self, time: float) -> float | None:
        """Depth (m) at rig time ``time`` (s); None before the first reading."""
        k = bisect_right(self._at, time)
        return self._md[k - 1] if k else None

    @property
    def latest(self) -> float | None:
        """Newest depth, m."""
        return self._md[-1] if self._md else None
