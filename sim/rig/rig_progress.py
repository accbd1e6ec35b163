"""What a rig is doing, and how long it waits for a process that does not come."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Final

from sim.errors import RigError

ATTACH_LIMIT: Final = 90.0  # wall s


@dataclass(slots=True)
class RigProgress:
    """What the rig is doing, for display."""

    phase: str
    rig_time: float
    begin: float
    end: float
    wanted: list[int] = field(default_factory=list)
    kill: list[int] = field(default_factory=list)
    finished: bool = False
    cue: str = ""  # what the operator is to do now


def give_up(name: str, waited: float) -> None:
    """Wait no longer for a process that was started and does not come.

    Raises
    ------
    RigError
        After ``ATTACH_LIMIT``.
    """
    if waited >= ATTACH_LIMIT:
        raise RigError(f"process {name} did not attach within {ATTACH_LIMIT:.0f} s")
