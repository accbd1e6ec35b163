"""A ground station that does nothing while its lease of the rig is in doubt: it does not write, nor acknowledge."""

from __future__ import annotations

import math
from typing import Any

from groundstation.gateway.lease import RigLease
from groundstation.service.process.ground_process import GroundProcess
from telemetry.errors import MediumError
from telemetry.media.port import PortFrame
from telemetry.messages import Side
from telemetry.runtime.joint_watch import JointFault
from telemetry.runtime.process_interface import Process
from telemetry.unwritten import Content

LOOK_AGAIN = 0.5  # s, own clock, while the lease is in doubt


class LeasedProcess(Process):
    """Hands events to the ground station as long as its lease stands; answers go on all the time.

    What is not taken in is not acknowledged, so that the string keeps it for the ground station that has the rig.

    Parameters
    ----------
    ground : the ground station
    lease : its lease
    """

    def __init__(self, ground: GroundProcess, lease: RigLease) -> None:
        self._ground, self._lease = ground, lease
        self._trouble = ""
        self.endpoint = ground.endpoint

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived."""
        if self._may_act(now):
            self._ground.on_frame(side, frame, now, margin)

    def on_cycle(self, data: Any, now: float) -> None:
        """A cycle has ended."""
        if self._may_act(now):
            self._ground.on_cycle(data, now)

    def on_overrun(self, missed: int, now: float) -> None:
        """A cycle ended late."""
        if self._may_act(now):
            self._ground.on_overrun(missed, now)

    def on_joint_fault(self, fault: JointFault, now: float) -> None:
        """A joint has a fault."""
        if self._may_act(now):
            self._ground.on_joint_fault(fault, now)

    def on_depth(self, payload: bytes, now: float) -> None:
        """Bytes came from the source of the depth."""
        if self._may_act(now):
            self._ground.on_depth(payload, now)

    def on_timer(self, now: float) -> None:
        """A timer is due."""
        if self._may_act(now):
            self._ground.on_timer(now)

    def take_frames(self, now: float) -> list[tuple[Side, PortFrame]]:
        """Frames to send now; none, and so no receipt, while the lease is in doubt."""
        return self._ground.take_frames(now) if self._may_act(now) else []

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer."""
        return self._ground.next_wake(now) if not self._trouble else now + LOOK_AGAIN

    def close(self) -> None:
        """End in good order."""
        self._ground.close()

    def _may_act(self, now: float) -> bool:
        """Whether the lease stands; the crew is told when that changes.

        Raises
        ------
        MediumError
            When only a new session is heard again: the process has to start anew.
        """
        if self._lease.is_deaf:
            raise MediumError("the router has forgotten this ground station, which has slept for long; start it again")
        trouble = self._lease.trouble
        if bool(trouble) != bool(self._trouble) or (trouble and self._lease.is_lost and trouble != self._trouble):
            self._ground.bar(trouble, now)
            self._trouble = trouble
        return not trouble
