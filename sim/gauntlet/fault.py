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


class FaultyKeys(Protocol):
    """Interface of the keys of a sealed rig to their faults."""

    def let_end(self, name: str, left: float) -> None:
        """Let a certificate end in ``left`` days."""

    def renew(self, name: str) -> None:
        """Renew a certificate that ends."""

    def let_in(self, name: str) -> None:
        """Let in one more person, where it is not known."""

    def shut_out(self, name: str) -> None:
        """Revoke a person that was let in."""

    def misgive(self, address: int) -> None:
        """Give a process keys of a generation that no other has."""

    def give_back(self, address: int) -> None:
        """Give a process its own keys again."""


class Faulty(Protocol):
    """Interface of a rig to its faults."""

    world: FaultyWorld
    channel: FaultyChannel

    @property
    def keys(self) -> FaultyKeys:
        """Keys of a rig that is sealed."""

    @property
    def now(self) -> float:
        """Rig time (s) of the truth."""

    def cut(self, address: int) -> None:
        """Cut the power of a process."""

    def start(self, address: int, tube: int | None = None) -> None:
        """Power a process on if it was cut; another ``tube`` in this place has a blank disk and its own settings."""

    def freeze(self, address: int) -> None:
        """Freeze a process: it gets no events, and frames wait for it."""

    def thaw(self, address: int) -> None:
        """Thaw a process: it gets what waits."""

    def disk(self, address: int) -> FaultyDisk:
        """Return the disk of a process."""

    def inject(self, address: int, side: Side, frame: bytes) -> None:
        """Inject a frame at an end of a process."""

    def send_depth(self, payload: bytes) -> None:
        """Publish bytes on the key of the depth."""

    def order(self, name: str, parameters: dict[str, str]) -> bool:
        """Have the crew order something; returns whether the ground station may have obeyed."""


Act = Callable[[Faulty], None]


@dataclass(frozen=True, slots=True)
class Step:
    """Something done at a rig time (s) of the truth."""

    at: float
    act: Act


Draw = Callable[[np.random.Generator, float, float], list[Step]]


@dataclass(frozen=True, slots=True)
class FaultKind:
    """One kind: its effect in words, its steps between two rig times (s), and the time (s) until all is well again.

    Well is what the crew is told of all that was lost, and what can be repaired is.
    """

    name: str
    meaning: str
    draw: Draw
    recovery: float = 24.0


def draw_interval(
    random: np.random.Generator, begin: float, end: float, shortest: float, longest: float
) -> tuple[float, float]:
    """Draw begin and end (s) of an interval of a length between two limits (s) that is over by ``end``."""
    at = float(random.uniform(begin, end - SHORTEST))
    return at, min(at + float(random.uniform(shortest, longest)), end)


def lasting_fault(shortest: float, longest: float, begin_act: Act, end_act: Act) -> Draw:
    """Draw of a fault with one act at its begin and one that takes it back."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        on, off = draw_interval(random, begin, end, shortest, longest)
        return [Step(on, begin_act), Step(off, end_act)]

    return draw


def momentary_fault(act: Callable[[Faulty, np.random.Generator], None]) -> Draw:
    """Draw of a fault of one act, with draws of its own."""

    def draw(random: np.random.Generator, begin: float, end: float) -> list[Step]:
        at = float(random.uniform(begin, end))
        drawn = own_stream(random)
        return [Step(at, lambda rig: act(rig, drawn))]

    return draw


def own_stream(random: np.random.Generator) -> np.random.Generator:
    """Return an independent stream, seeded by one draw."""
    return np.random.Generator(np.random.Philox(int(random.integers(2**62))))


def drawn_tube(random: np.random.Generator) -> int:
    """Draw one of the tubes."""
    return int(random.choice(TUBES))
