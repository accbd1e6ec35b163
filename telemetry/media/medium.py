"""The contract of a medium: frames go out at one end of a joint and come in at the other, or do not.

A medium knows nothing of what frames mean. CAN becomes a second one by offering the same two calls.
"""

from __future__ import annotations

from typing import Protocol


class Port(Protocol):
    """One end of a joint."""

    def send(self, frame: bytes, now: float) -> None:
        """Put a frame on the wire at ``now`` (s)."""

    def receive(self, now: float) -> list[bytes]:
        """Frames that have arrived by ``now`` (s), in the order of arrival."""
