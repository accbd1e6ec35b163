"""What a fault is, what it may touch, and how its times are drawn.

A fault is drawn from a stream of its own, named by the seed and its kind, so a kind that is left out changes no other.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sim.gauntlet.faulty_channel import FaultyChannel
from sim.gauntlet.faulty_disk import FaultyDisk
from sim.gauntlet.faulty_world import FaultyWorld
from telemetry.messages import BASE, ENCODER, Side

TUBES = (1, 2)
EVERYBODY = (BASE, ENCODER, *TUBES)
SHORTEST = 1.0  # s


class Faulty(Protocol):
    """What a fault may touch."""

    world: FaultyWorld
    channel: FaultyChannel

    @property
    def now(self) -> float:
        """Rig time (s) of the truth."""

    def cut(self, address: int) -> None:
        """Power off."""

    def start(self, address: int, tube: int | None = None) -> None:
        """Power on, where it was cut; another ``tube`` in this place has a blank disk and its own settings."""

    def freeze(self, address: int) -> None:
        """A process gets no events; frames wait for it."""

    def thaw(self, address: int) -> None:
        """It gets what waits."""

    def disk(self, address: int) -> FaultyDisk:
        """What a process keeps."""

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        """A frame from nowhere at an end of a process."""

    def send_depth(self, payload: bytes) -> None:
        """Bytes on the key of the depth."""


Act = Callable[[Faulty], None]


@dataclass(frozen=True, slots=True)
class Step:
    """Something done at a rig time (s) of the truth."""

    at: float
    act: Act


Draw = Callable[[np.random.Generator, float, float], list[Step]]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind: what happens in words, its steps between two rig times (s), and within what time (s) all is well again.

    Well is what the crew is told of all that was lost, and what can be repaired is.
    """

    name: str
    meaning: str
    draw: Draw
    recovery: float = 24.0


def draw_interval(
    random: np.random.Generator, begin: float, end: float, shortest: float, longest: float
) -> tuple[float, float]:
    """Begin and end (s) of something that lasts so long and is over by ``end``."""
    at = float(random.uniform(begin, end - SHORTEST))
    return at, min(at + float(random.uniform(shortest, longest)), end)


def lasting_fault(shortest: float, longest: float, begin_act: Act, end_act: Act) -> Draw:
    """One act, and another that takes it back."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        on, off = draw_interval(random, begin, end, shortest, longest)
        return [Step(on, begin_act), Step(off, end_act)]

    return draw


def momentary_fault(act: Callable[[Faulty, np.random.Generator], None]) -> Draw:
    """One act, with draws of its own."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        at = float(random.uniform(begin, end))
        drawn = own_stream(random)
        return [Step(at, lambda rig: act(rig, drawn))]

    return draw


def own_stream(random: np.random.Generator) -> np.random.Generator:
    """A stream that goes on by itself, whatever else is drawn."""
    return np.random.Generator(np.random.Philox(int(random.integers(2**62))))


def drawn_tube(random: np.random.Generator) -> int:
    """One of the tubes."""
    return int(random.choice(TUBES))
