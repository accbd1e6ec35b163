"""A joint inside one process, with its faults as plain fields and its time from outside."""

from __future__ import annotations

import heapq
import random
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

from telemetry.errors import MediumError
from telemetry.media.port import TubeEnd
from telemetry.media.queued_port import QueuedPort

Deliver = Callable[[bytes], object]


@dataclass
class MemoryPort(QueuedPort):
    """One end, see ``port.Port``; ``other`` is the opposite one. Probabilities are of each frame sent from this end.

    A frame without delay is delivered as it is sent; one with a delay when ``advance`` of the other end says so.
    """

    seed: int = 0
    latency: float = 0.0  # s
    jitter: float = 0.0  # s, mean
    loss: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    is_open: bool = False  # electrically: an open joint carries nothing
    other: MemoryPort | None = None
    now: float = 0.0  # s
    _deliver: Deliver | None = None
    _arriving: list[tuple[float, int, bytes]] = field(default_factory=list)
    _arrivals: int = 0
    _random: random.Random = field(init=False)

    def __post_init__(self) -> None:
        """Seed the faults."""
        super().__init__("in memory")
        self._random = random.Random(self.seed)

    def listen(self, deliver: Deliver) -> None:
        """Call ``deliver`` for every frame that arrives."""
        self._deliver = deliver

    def advance(self, now: float) -> None:
        """Advance to ``now`` (s) and deliver what has arrived by then."""
        self.now = now
        while self._arriving and self._arriving[0][0] <= now and self._deliver is not None:
            self._deliver(heapq.heappop(self._arriving)[2])

    def close(self) -> None:
        """Close this end."""
        self._closed, self._deliver = True, None

    def _is_heard(self) -> bool:
        other = self.other
        return other is not None and other._deliver is not None and not (self.is_open or other.is_open)

    def _drain(self) -> None:
        self._queue.drain(self._is_heard, self._transmit)

    def _transmit(self, payload: bytes) -> None:
        if self.other is None or self._random.random() < self.loss:
            return
        for _ in range(2 if self._random.random() < self.duplicate else 1):
            delay = self.latency + (self._random.expovariate(1.0 / self.jitter) if self.jitter else 0.0)
            arrived = self._damage(payload) if self._random.random() < self.corrupt else payload
            self.other._arrive(self.now + delay, arrived, at_once=delay == 0.0)

    def _arrive(self, at: float, payload: bytes, *, at_once: bool) -> None:
        if at_once and self._deliver is not None:
            self._deliver(payload)
            return
        self._arrivals += 1
        heapq.heappush(self._arriving, (at, self._arrivals, payload))

    def _damage(self, payload: bytes) -> bytes:
        damaged = bytearray(payload)
        if damaged:
            damaged[self._random.randrange(len(damaged))] ^= 1 << self._random.randrange(8)
        return bytes(damaged)


def joined_ports(seed: int = 0, latency: float = 0.003, **faults: float) -> tuple[MemoryPort, MemoryPort]:
    """Two ends joined, with the same faults in both directions; ``latency`` in s."""
    upper = MemoryPort(2 * seed, latency, **faults)  # type: ignore[arg-type]
    lower = MemoryPort(2 * seed + 1, latency, **faults)  # type: ignore[arg-type]
    upper.other, lower.other = lower, upper
    return upper, lower


class MemoryMedium:
    """Ends of one process's rigs, joined as soon as both are there."""

    def __init__(self) -> None:
        self._ports: dict[tuple[str, int, int], MemoryPort] = {}

    def open_port(self, end: TubeEnd) -> MemoryPort:
        """Port of one end."""
        standing = self._ports.get(end_identity(end))
        if standing is not None and not standing._closed:
            raise MediumError(f"port in memory: the {end.side.name.lower()} end of {end.address} is taken")
        port = self._ports[end_identity(end)] = MemoryPort()
        if end.neighbour is not None and (other := self._ports.get(end_identity(end.facing))) is not None:
            port.other, other.other = other, port
        return port


def end_identity(end: TubeEnd) -> tuple[str, int, int]:
    """Key of an end: rig, address and side."""
    return end.rig, end.address, int(end.side)


_nets: dict[str, MemoryMedium] = {}


@contextmanager
def open_medium(where: str) -> Iterator[MemoryMedium]:
    """The net of the name ``where`` in this process."""
    yield _nets.setdefault(where, MemoryMedium())
