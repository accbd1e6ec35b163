"""Where a process hangs in the string: who is beside it, and how far the encoder is, as neighbours tell."""

from __future__ import annotations

import math
from collections import Counter
from functools import partial
from typing import NamedTuple

from telemetry.messages import BASE, ENCODER, HOPS_UNKNOWN, MAX_TUBE, Hello, NodeMode, Side
from telemetry.transport.nearest import Nearest


class Neighbour(NamedTuple):
    """Process at the other side of a joint."""

    tube: int
    boot_count: int
    hops: int
    mode: NodeMode
    link_quality: float
    last_heard: float


class StringPlace:
    """Place of a process in the string.

    Parameters
    ----------
    address : ``BASE``, ``ENCODER`` or the tube's number
    reach : tubes away that are heard; beyond 1 the nearest that speaks is the neighbour, with silent tubes between
    counters : of what cannot be

    Attributes
    ----------
    hops : to the encoder, those of silent tubes included; ``HOPS_UNKNOWN`` before a neighbour told it
    neighbours : by end, None where none is heard
    """

    def __init__(self, address: int, reach: int, counters: Counter[str]) -> None:
        self.neighbours: dict[Side, Neighbour | None] = dict.fromkeys(Side)
        self.hops = 0 if address == ENCODER else HOPS_UNKNOWN
        self._address, self._reach, self._counters = address, reach, counters
        self._is_told = address == ENCODER

    @property
    def told_hops(self) -> int:
        """Distance from the encoder as a neighbour told it since the start; a saved one may be of another string."""
        return self.hops if self._is_told else HOPS_UNKNOWN

    def nearest(self, side: Side) -> Nearest | None:
        """Choice among the neighbours heard at one end; None at a cable (base station to encoder) or at reach 1."""
        cable = self._address == BASE or (self._address == ENCODER and side is Side.UPPER)
        return None if self._reach == 1 or cable else Nearest(partial(self.distance, side))

    def distance(self, side: Side, other: int) -> float:
        """Tubes from here to ``other``, which speaks at one end; infinite for one that cannot be there.

        Tubes are numbered from the lowest up. Where the encoder is heard although tubes hang between, they are silent;
        how many there are is known from before.
        """
        if self._address == ENCODER:
            return float(MAX_TUBE + 1 - other) if 0 < other <= MAX_TUBE else math.inf
        if side is Side.UPPER and other == ENCODER:
            away = max(self.hops, 1) + 0.5  # a tube as near comes first: it was added between
        else:
            away = float(other - self._address if side is Side.UPPER else self._address - other)
        return away if 0.0 < away < self._reach + 1.0 else math.inf

    def skipped(self, upper: int | None) -> int:
        """Number of silent tubes between this one and ``upper``, heard at its upper end (None: no tube is heard)."""
        if self._reach == 1 or self._address in (BASE, ENCODER) or upper is None:
            return 0
        return int(min(self.distance(Side.UPPER, upper), self._reach)) - 1

    def meet(self, side: Side, hello: Hello, upper: int | None, quality: float, now: float) -> bool:
        """Take a neighbour's hello at ``now`` (s, own clock); returns whether it moves this process in the string.

        One that puts it farther from the encoder than any tube can be is counted.
        """
        self.neighbours[side] = Neighbour(hello.tube, hello.boot_count, hello.hops, hello.mode, quality, now)
        if side is not Side.UPPER or hello.hops == HOPS_UNKNOWN:
            return False
        hops = hello.hops + 1 + self.skipped(upper)
        if hops > MAX_TUBE:
            self._counters["impossible_hops"] += 1
            return False
        self._is_told = True
        moves, self.hops = hops != self.hops, hops
        return moves
