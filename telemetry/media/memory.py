"""A joint inside one process, with its troubles as plain fields and its time from outside. For tests of protocols."""

from __future__ import annotations

import heapq
import random
from dataclasses import dataclass, field


@dataclass(slots=True)
class MemoryPort:
    """One end; ``other`` is the opposite one. Probabilities are of each frame sent from this end."""

    seed: int = 0
    latency: float = 0.003  # s
    jitter: float = 0.0  # s, mean
    loss: float = 0.0
    duplicate: float = 0.0
    corrupt: float = 0.0
    is_open: bool = False  # an open joint carries nothing
    other: MemoryPort | None = None
    sent: int = 0
    _arriving: list[tuple[float, int, bytes]] = field(default_factory=list)
    _random: random.Random = field(default_factory=random.Random)
    _order: int = 0

    def __post_init__(self) -> None:
        """Seed the troubles."""
        self._random.seed(self.seed)

    def send(self, frame: bytes, now: float) -> None:
        """Put a frame on the wire: it arrives later, twice, damaged or not at all."""
        self.sent += 1
        if self.other is None or self.is_open or self.other.is_open or self._random.random() < self.loss:
            return
        for _ in range(2 if self._random.random() < self.duplicate else 1):
            delay = self.latency + (self._random.expovariate(1.0 / self.jitter) if self.jitter else 0.0)
            arrived = self._damage(frame) if self._random.random() < self.corrupt else frame
            self.other._arriving_push(now + delay, arrived)

    def receive(self, now: float) -> list[bytes]:
        """Frames that have arrived by ``now``."""
        frames = []
        while self._arriving and self._arriving[0][0] <= now:
            frames.append(heapq.heappop(self._arriving)[2])
        return frames

    def next_arrival(self) -> float | None:
        """When the next frame arrives."""
        return self._arriving[0][0] if self._arriving else None

    def _arriving_push(self, at: float, frame: bytes) -> None:
        self._order += 1
        heapq.heappush(self._arriving, (at, self._order, frame))

    def _damage(self, frame: bytes) -> bytes:
        damaged = bytearray(frame)
        damaged[self._random.randrange(len(damaged))] ^= 1 << self._random.randrange(8)
        return bytes(damaged)


def joint(seed: int = 0, **troubles: float) -> tuple[MemoryPort, MemoryPort]:
    """Two ends joined, with the same troubles in both directions."""
    upper, lower = MemoryPort(2 * seed, **troubles), MemoryPort(2 * seed + 1, **troubles)  # type: ignore[arg-type]
    upper.other, lower.other = lower, upper
    return upper, lower
