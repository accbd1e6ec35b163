"""Which faults a seed brings: each kind is switched on by itself, so every seed is another mixture."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim.gauntlet.fault import Step
from sim.gauntlet.fault_kinds import KINDS
from sim.world.random_streams import RandomStream, random_stream

GOLDEN = 0.618  # of all combinations, from one seed's to the next, so that neighbours differ
TOGETHER = 3.0  # kinds switched on in a seed, on the average


def drawn_kinds(seed: int, allowed: Sequence[str]) -> tuple[str, ...]:
    """Draw the names of the kinds that a seed switches on, at least one of those allowed."""
    share = min(TOGETHER / len(allowed), 1.0)
    switches = dict(
        zip(
            (kind.name for kind in KINDS), random_stream(seed, RandomStream.GAUNTLET, 0).random(len(KINDS)), strict=True
        )
    )
    on = tuple(name for name in switches if name in allowed and switches[name] < share)
    return on or (min(allowed, key=lambda name: switches[name]),)


def combined_kinds(seed: int, allowed: Sequence[str], together: int) -> tuple[str, ...]:
    """The kinds of one combination of ``together``; as many seeds in a row as there are combinations bring each."""
    count = math.comb(len(allowed), together)
    stride = next(one for one in range(round(GOLDEN * count), 2 * count + 2) if math.gcd(one, count) == 1)
    left, kinds, first = seed * stride % count, list[str](), 0
    for still in range(together, 0, -1):
        while left >= (following := math.comb(len(allowed) - first - 1, still - 1)):
            left, first = left - following, first + 1
        kinds.append(allowed[first])
        first += 1
    return tuple(kinds)


def steps_of(
    seed: int, kinds: Sequence[str], begin: float, end: float, *, recovers: bool = True
) -> list[tuple[str, Step]]:
    """Steps of the faults of these kinds, in order of time, each with the name of its kind.

    No fault begins before ``begin`` (s, rig time), and each is over so long before ``end`` that all can be well again;
    without ``recovers`` it is only over by then.
    """
    steps = [
        (kind.name, step)
        for number, kind in enumerate(KINDS)
        if kind.name in kinds
        for step in kind.draw(
            random_stream(seed, RandomStream.GAUNTLET, 1, number), begin, end - kind.recovery if recovers else end
        )
    ]
    return sorted(steps, key=lambda one: one[1].at)
