"""Which faults a seed brings: each kind is switched on by itself, so every seed is another mixture."""

from __future__ import annotations

from collections.abc import Sequence

from sim.gauntlet.fault import Step
from sim.gauntlet.fault_kinds import KINDS
from sim.world.random_streams import RandomStream, random_stream

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


def steps_of(seed: int, kinds: Sequence[str], begin: float, end: float) -> list[tuple[str, Step]]:
    """Steps of the faults of these kinds, in order of time, each with the name of its kind.

    No fault begins before ``begin`` (s, rig time), and each is over so long before ``end`` that all can be well again.
    """
    steps = [
        (kind.name, step)
        for number, kind in enumerate(KINDS)
        if kind.name in kinds
        for step in kind.draw(random_stream(seed, RandomStream.GAUNTLET, 1, number), begin, end - kind.recovery)
    ]
    return sorted(steps, key=lambda one: one[1].at)
