"""The joints of a rig under faults: each port may lose, delay and reorder frames by itself, and is overheard."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable

import numpy as np

from sim.rig.link_channel import LinkChannel
from sim.world.random_streams import RandomStream, random_stream
from telemetry.messages import Side
from telemetry.unwritten import Content

TAG = 8  # bytes at the end of a sealed frame
OVERHEARD = 64  # frames of a port that a hostile neighbour has recorded
Port = tuple[int, Side]


class FaultyChannel(LinkChannel):
    """A channel whose faults can be changed at any time.

    Attributes
    ----------
    port_loss : probability of a frame that leaves a port, beside that of all
    port_delay : s by which what leaves a port is late
    reordering : s within which frames come in any order
    flipped : probability that one bit of the last bytes of a frame, the tag of a sealed one, is changed
    burst : probability that a frame begins a burst, in which the next 20 are lost
    overheard : the newest frames of each port
    listeners : are called with sender, side and bytes of every frame
    """

    def __init__(self, seed: int, latency: float, jitter: float, loss: float, duplicate: float) -> None:
        super().__init__(seed, latency, jitter, loss, duplicate)
        self.port_loss: dict[Port, float] = {}
        self.port_delay: dict[Port, float] = {}
        self.reordering = 0.0
        self.burst = 0.0
        self.flipped = 0.0
        self._flips: dict[Port, np.random.Generator] = {}
        self.overheard: dict[Port, deque[bytes]] = {}
        self.listeners: list[Callable[[int, Side, bytes], None]] = []
        self._seed_of_faults = seed
        self._draws: dict[Port, np.random.Generator] = {}
        self._left_of_burst: dict[Port, int] = {}

    def deliveries(self, sender: int, side: Side, frame: Content) -> list[tuple[float, Content]]:
        """Delay (s) and copy, for each copy of the next frame leaving this port; none when it is lost."""
        port = (sender, side)
        overheard = self.overheard.get(port)
        if overheard is None:
            overheard = self.overheard[port] = deque(maxlen=OVERHEARD)
        overheard.append(bytes(frame))
        for listener in self.listeners:
            listener(sender, side, bytes(frame))
        found = super().deliveries(sender, side, self._flipped(port, frame) if self.flipped else frame)
        if not (self.port_loss or self.port_delay or self.reordering or self.burst):
            return found
        fate, wait, begins = self._draw(port)
        if self._is_in_burst(port, begins) or fate < self.port_loss.get(port, 0.0):
            self.lost += 1
            return []
        late = self.port_delay.get(port, 0.0) + wait * self.reordering
        return [(delay + late, arriving) for delay, arriving in found]

    def _flipped(self, port: Port, frame: Content) -> Content:
        """A frame with one bit of its last bytes changed, or as it is."""
        random = self._flips.get(port)
        if random is None:
            random = self._flips[port] = random_stream(
                self._seed_of_faults, RandomStream.GAUNTLET, 7, port[0], int(port[1])
            )
        fate, place = float(random.random()), int(random.integers(8 * TAG))
        whole = bytearray(bytes(frame))
        if fate >= self.flipped or len(whole) < TAG:
            return frame
        whole[-1 - place // 8] ^= 1 << place % 8
        return bytes(whole)

    def _draw(self, port: Port) -> tuple[float, float, float]:
        random = self._draws.get(port)
        if random is None:
            random = self._draws[port] = random_stream(
                self._seed_of_faults, RandomStream.GAUNTLET, 2, port[0], int(port[1])
            )
        fate, wait, begins = random.random(3).tolist()
        return fate, wait, begins

    def _is_in_burst(self, port: Port, begins: float) -> bool:
        left = self._left_of_burst.get(port, 0)
        if left == 0 and begins < self.burst:
            left = 20
        self._left_of_burst[port] = max(left - 1, 0)
        return left > 0
