"""Whom to listen to, where several neighbours are heard: the nearest that speaks."""

from __future__ import annotations

import math
from collections.abc import Callable

SILENT_AFTER = 2.5  # s; shorter than a link's silence, so that the next one is heard before the link is taken for gone
SETTLE = 2.0  # s of listening before the first is chosen, so that the nearest has spoken


class Nearest:
    """Choice among those heard at one end.

    Parameters
    ----------
    distance : how far a process is, smaller is nearer; infinite for one that is never listened to
    """

    def __init__(self, distance: Callable[[int], float]) -> None:
        self._distance = distance
        self._heard: dict[int, float] = {}  # when each was heard last
        self._since = math.inf

    def is_chosen(self, sender: int, now: float) -> bool:
        """Return whether to listen to a frame of ``sender`` that arrived at ``now`` (s, own clock)."""
        self._heard = {who: at for who, at in self._heard.items() if now - at <= SILENT_AFTER}
        if math.isinf(self._distance(sender)):
            return False
        if not self._heard:
            self._since = now
        self._heard[sender] = now
        return now - self._since >= SETTLE and sender == min(self._heard, key=self._distance)
