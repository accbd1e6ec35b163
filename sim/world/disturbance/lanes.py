"""Normal numbers of a node and cycle of a campaign: which three of them a disturbance takes."""

from __future__ import annotations

from enum import IntEnum

WIDTH = 3  # numbers of a lane


class Lane(IntEnum):
    """Lane ``n`` is the numbers ``3 n`` to ``3 n + 2``; a lane once given is never used for another purpose."""

    WHITE = 0
    WANDER = 1
    FORCE = 2
    HOP = 3  # clock of the joint above, normal; loss of an aiding there, uniform; one to spare
