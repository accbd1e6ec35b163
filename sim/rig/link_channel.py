"""The medium between two joined tube ends: latency, jitter, loss and duplication, drawn per direction of a joint."""

from __future__ import annotations

from sim.world.streams import Stream, stream
from telemetry.messages import Side

BLOCK = 1024


class LinkChannel:
    """Delays of the copies of a frame that arrive, from streams of their own for each port.

    Parameters
    ----------
    seed : of the rig; the draws of a port depend on it, the port and how many frames left the port, on nothing else
    latency, jitter : s, constant part and mean of the exponential part of one hop
    loss, duplicate : probabilities of a frame
    """

    def __init__(self, seed: int, latency: float, jitter: float, loss: float, duplicate: float) -> None:
        self._seed = seed
        self.latency = latency
        self._jitter = jitter
        self._loss = loss
        self._duplicate = duplicate
        self._streams: dict[tuple[int, Side], PortStream] = {}
        self.lost = 0

    def deliveries(self, sender: int, side: Side) -> tuple[float, ...]:
        """Delay (s) of each copy of the next frame leaving this port; empty when it is lost."""
        stream = self._streams.get((sender, side))
        if stream is None:
            stream = self._streams[sender, side] = PortStream(self._seed, sender, side)
        fate, wait, again = stream.draw()
        if fate < self._loss:
            self.lost += 1
            return ()
        first = self.latency + self._jitter * wait
        if fate > 1.0 - self._duplicate:
            return first, first + self.latency + self._jitter * again
        return (first,)


class PortStream:
    """Draws of one port, made in blocks."""

    def __init__(self, seed: int, sender: int, side: Side) -> None:
        self._random = stream(seed, Stream.LINK, sender, int(side))
        self._block: list[tuple[float, float, float]] = []

    def draw(self) -> tuple[float, float, float]:
        """Uniform fate and two unit exponentials."""
        if not self._block:
            fate = self._random.random(BLOCK)
            waits = self._random.standard_exponential((BLOCK, 2))
            self._block = list(zip(fate.tolist(), waits[:, 0].tolist(), waits[:, 1].tolist(), strict=True))
            self._block.reverse()
        return self._block.pop()
