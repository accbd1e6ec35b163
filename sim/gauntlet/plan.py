"""Which faults a seed brings: each kind is switched on by itself, so every seed is another mixture."""

from __future__ import annotations

from collections.abc import Sequence

from sim.gauntlet.kinds import KIND_OF, KINDS, Step
from sim.world.streams import Stream, stream

TOGETHER = 3.0  # kinds switched on in a seed, on the average


def drawn_kinds(seed: int, allowed: Sequence[str]) -> tuple[str, ...]:
    """Names of the kinds that a seed switches on, at least one of those allowed."""
    share = min(TOGETHER / len(allowed), 1.0)
    switches = {kind.name: stream(seed, Stream.GAUNTLET, 0, n).random() for n, kind in enumerate(KINDS)}
    on = tuple(name for name in switches if name in allowed and switches[name] < share)
    return on or (min(allowed, key=lambda name: switches[name]),)


def steps_of(seed: int, kinds: Sequence[str], begin: float, end: float) -> list[Step]:
    """Steps of the faults of these kinds between two rig times (s), in order of time."""
    steps: list[Step] = []
    for number, kind in enumerate(KINDS):
        if kind.name in kinds:
            steps += KIND_OF[kind.name].draw(stream(seed, Stream.GAUNTLET, 1, number), begin, end)
    return sorted(steps, key=lambda step: step.at)
