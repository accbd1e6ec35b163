"""Whether what comes now may have waited while this process stood still.

A process that is frozen, or starved, finds in its inbox what was said long ago. A state that names its time is as old
as it says; one of a tube that did not know rig time yet would count as said now.
"""

from __future__ import annotations

import math

from telemetry.messages import EPOCH_UNKNOWN, Message, NodeFlag, NodeState

STOOD_STILL = 2.0  # s without an event, which nobody has whose hello is due every second
DRAINED_AFTER = 1.0  # s, in which what waited has come


class Standstill:
    """Follows the events of a process."""

    def __init__(self) -> None:
        self._moved_at = math.nan
        self._waited_until = -math.inf

    def move(self, now: float) -> None:
        """The process does something at ``now`` (s, own clock)."""
        if now - self._moved_at > STOOD_STILL:
            self._waited_until = now + DRAINED_AFTER
        self._moved_at = now

    def may_have_waited(self, now: float) -> bool:
        """Whether what comes at ``now`` (s) may have been said before the process went on."""
        return now <= self._waited_until


def is_undated(message: Message) -> bool:
    """Whether a message is a state that does not say when it was, for its tube did not know rig time."""
    if not isinstance(message, NodeState):
        return False
    return message.epoch == EPOCH_UNKNOWN or NodeFlag.CLOCK_UNSYNCHRONISED in message.flags
