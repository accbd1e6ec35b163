"""What happens to frames between tubes that speak by radio: loss and delay follow from the margin of the moment."""

from __future__ import annotations

import math
from collections.abc import Sequence

from sim.rig.link_channel import PortStream
from sim.world.radio import RadioLinks
from sim.world.random_streams import RandomStream
from telemetry.messages import Side


class RadioChannel:
    """Copies of frames that arrive by radio, each with its delay; every pair of ports has streams of its own.

    A radio repeats a packet by itself until it is heard or its attempts are used up, so a small margin costs time
    first and frames later.

    Parameters
    ----------
    links : margins
    seed : of the rig; the draws of a pair depend on it, the pair and how many frames passed, on nothing else
    latency, jitter : s, constant part and mean of the exponential part of one hop
    duplicate, corrupt : probabilities of a frame that arrives, and of a copy
    """

    def __init__(
        self, links: RadioLinks, seed: int, latency: float, jitter: float, duplicate: float, corrupt: float
    ) -> None:
        self._links, self._seed = links, seed
        self._latency, self._jitter = latency, jitter
        self._duplicate, self._corrupt = duplicate, corrupt
        self._attempts, self._attempt = links.section.attempts, links.section.attempt_ms * 1e-3
        self._streams: dict[tuple[int, Side, int], PortStream] = {}
        self.lost = 0

    @property
    def reach(self) -> int:
        """Tubes away at which a frame is heard."""
        return self._links.reach

    def deliveries(
        self, sender: int, side: Side, hearer: int, joints: Sequence[int], at: float, frame: bytes
    ) -> list[tuple[float, bytes, float]]:
        """Delay (s), bytes and margin (dB) of each copy of a frame sent at rig time ``at``; none when it is lost."""
        pair = sender, side, hearer
        drawn = self._streams.get(pair)
        if drawn is None:
            drawn = self._streams[pair] = PortStream(self._seed, RandomStream.RADIO, sender, int(side), hearer)
        fate, wait, again = drawn.draw()
        heard_with = self._links.margin(joints, at)
        failed = failed_attempts(fate, self._links.error_rate(heard_with))
        if failed >= self._attempts:
            self.lost += 1
            return []
        first = self._latency + self._jitter * wait + self._attempt * failed
        delays = [first]
        if fate > 1.0 - self._duplicate:
            delays.append(first + self._latency + self._jitter * again)
        return [(delay, drawn.damage(frame, self._corrupt), heard_with) for delay in delays]


def failed_attempts(fate: float, error_rate: float) -> float:
    """Attempts that fail before the first that does not, of a uniform ``fate``: ``P(k or more) = error_rate^k``."""
    if error_rate <= 0.0 or fate >= error_rate:
        return 0
    return math.inf if fate <= 0.0 or error_rate >= 1.0 else math.floor(math.log(fate) / math.log(error_rate))
