"""The string as the ground station knows it: which tube hangs below which, and how deep each of them is."""

from __future__ import annotations

import math
from collections.abc import Collection

FITS = 0.5  # of a tube's length by which depth and tally may differ


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

    def place_of(self, tube: int) -> int | None:
        """Hop count that a tube has reported last; None of one that has reported none."""
        return self._hops.get(tube)

    def remove(self, tube: int) -> None:
        """A tube of the string was taken out of it."""
        self.tubes.remove(tube)
        self._hops.pop(tube, None)

    def exchange(self, one: int, other: int) -> None:
        """Have two tubes of the string change names."""
        names = {one: other, other: one}
        self.tubes = [names.get(tube, tube) for tube in self.tubes]
        self._hops = {names.get(tube, tube): hops for tube, hops in self._hops.items()}

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

    def below(self, tube: int) -> list[int]:
        """Tubes between a tube's node and the bit, from the bit up; none of an unknown tube."""
        return self.tubes[: self.tubes.index(tube) : -1] if tube in self.tubes else []

    @property
    def deepest(self) -> float:
        """What the string and one tube more reach (m); infinite before any tube has reported."""
        return (len(self.tubes) + 1) * self._tube_length if self.tubes else math.inf

    def misfit(self, md: float, heard: Collection[int]) -> str:
        """Why a depth of the bit does not fit the tubes, or nothing; ``heard`` are those that speak."""
        reach = len(self.tubes) * self._tube_length
        if self.tubes and md > reach + FITS * self._tube_length:
            return f"the bit is at {md:.2f} m, {len(self.tubes)} tubes reach {reach:.2f} m"
        hanging = len([tube for tube in self.tubes if tube in heard]) - 1
        if hanging > 0 and md < (hanging - FITS) * self._tube_length:
            return f"the bit is at {md:.2f} m, {hanging + 1} tubes speak, {hanging} of them below the collar"
        return ""

    def reaches(self, md: float, hops: int, below: float) -> bool:
        """Whether the bit can be so deep (m) under a tube so many hops down with ``below`` (m) of string below it."""
        return hops < 1 or md <= (hops + FITS) * self._tube_length + below

    def tubes_below(self, md: float, bit: float) -> list[int]:
        """Tubes from the top down whose nodes are deeper than ``md`` (m) while the bit is at ``bit`` (m)."""
        found = []
        for place, tube in enumerate(self.tubes, 1):
            below = (len(self.tubes) - place) * self._tube_length
            if bit - below > md:
                found.append(tube)
        return found

    def length_below(self, tube: int) -> float | None:
        """Length (m) of string below a tube's node, which sits at the tube's lower end; None for an unknown tube."""
        if tube not in self.tubes:
            return None
        return (len(self.tubes) - 1 - self.tubes.index(tube)) * self._tube_length
