"""What happens to frames between two joined tube ends: latency, jitter, loss, copies and damage, drawn per port."""

from __future__ import annotations

from sim.world.random_streams import RandomStream, random_stream
from telemetry.messages import Side
from telemetry.unwritten import Content

BLOCK = 1024
DAMAGE = 1  # of a port's streams: which bit is flipped; apart from the fates, so that damage shifts no other draw


class LinkChannel:
    """Copies of frames that arrive, each with its delay; every port has streams of its own.

    ``severed`` holds the ports that carry nothing for now; it and the probabilities may be changed at any time.

    Parameters
    ----------
    seed : of the rig; the draws of a port depend on it, the port and how many frames left the port, on nothing else
    latency, jitter : s, constant part and mean of the exponential part of one hop
    loss, duplicate, corrupt : probabilities of a frame, and of a copy
    """

    def __init__(
        self, seed: int, latency: float, jitter: float, loss: float, duplicate: float, corrupt: float = 0.0
    ) -> None:
        self._seed = seed
        self.latency = latency
        self._jitter = jitter
        self.loss = loss
        self.duplicate = duplicate
        self.corrupt = corrupt
        self._streams: dict[tuple[int, Side], PortStream] = {}
        self.severed: set[tuple[int, Side]] = set()
        self.lost = 0

    def deliveries(self, sender: int, side: Side, frame: Content) -> list[tuple[float, Content]]:
        """Delay (s) and copy, for each copy of the next frame leaving this port; none when it is lost."""
        drawn = self._streams.get((sender, side))
        if drawn is None:
            drawn = self._streams[sender, side] = PortStream(self._seed, RandomStream.LINK, sender, int(side))
        fate, wait, again = drawn.draw()
        if fate < self.loss or (self.severed and (sender, side) in self.severed):
            self.lost += 1
            return []
        first = self.latency + self._jitter * wait
        delays = [first]
        if fate > 1.0 - self.duplicate:
            delays.append(first + self.latency + self._jitter * again)
        if self.corrupt == 0.0:  # the usual case
            return [(delay, frame) for delay in delays]
        return [(delay, drawn.damage(bytes(frame), self.corrupt)) for delay in delays]


class PortStream:
    """Draws of one port, made in blocks."""

    def __init__(self, seed: int, purpose: RandomStream, *port: int) -> None:
        self._random = random_stream(seed, purpose, *port)
        self._damage = random_stream(seed, purpose, *port, DAMAGE)
        self._block: list[tuple[float, float, float]] = []

    def draw(self) -> tuple[float, float, float]:
        """Uniform fate and two unit exponentials."""
        if not self._block:
            fate = self._random.random(BLOCK)
            waits = self._random.standard_exponential((BLOCK, 2))
            self._block = list(zip(fate.tolist(), waits[:, 0].tolist(), waits[:, 1].tolist(), strict=True))
            self._block.reverse()
        return self._block.pop()

    def damage(self, frame: bytes, probability: float) -> bytes:
        """The frame, one bit of it flipped with a probability."""
        if probability == 0.0 or self._damage.random() >= probability:
            return frame
        damaged = bytearray(frame)
        damaged[int(self._damage.integers(len(damaged)))] ^= 1 << int(self._damage.integers(8))
        return bytes(damaged)
