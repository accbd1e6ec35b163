"""The contract of a medium: one end of a joint takes frames to send and hands over frames that came.

A medium knows nothing of what frames mean, and may lose, repeat, delay and reorder them. zenoh is one
(``zenoh_bus.ZenohPort``); CAN becomes another by offering the same two calls.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Protocol


class Port(Protocol):
    """One end of a joint on some bus."""

    def send(self, frame: bytes) -> None:
        """Put a frame on the wire.

        Raises
        ------
        MediumError
            When the bus is lost.
        """

    def listen(self, deliver: Callable[[bytes], None]) -> None:
        """Call ``deliver`` for every frame that arrives, possibly on a foreign thread."""
