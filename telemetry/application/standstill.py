"""Whether what comes now may have waited while this process stood still.

A process that is frozen, or starved, finds in its inbox what was said long ago. A state that names its time is as old
as it says; one of a tube that did not know rig time yet would count as said now.
"""

from __future__ import annotations

import math

from telemetry.messages import EPOCH_UNKNOWN, Message, NodeFlag, NodeState

STOOD_STILL = 2.0  # s without an event; a running process has one every second, its hello
DRAINED_AFTER = 1.0  # s, in which what waited has come


class Standstill:
    """Follows the events of a process to find when it stood still."""

    def __init__(self) -> None:
        self._moved_at = math.nan
        self._waited_until = -math.inf

    def move(self, now: float) -> None:
        """Note an event of the process at ``now`` (s, own clock)."""
        if now - self._moved_at > STOOD_STILL:
            self._waited_until = now + DRAINED_AFTER
        self._moved_at = now

    def may_have_waited(self, now: float) -> bool:
        """Return whether what comes at ``now`` (s) may have been sent before the process went on."""
        return now <= self._waited_until


def is_undated(message: Message) -> bool:
    """Return whether a message is a state without a time, from a tube that did not know rig time."""
    if not isinstance(message, NodeState):
        return False
    return message.epoch == EPOCH_UNKNOWN or NodeFlag.CLOCK_UNSYNCHRONISED in message.flags
