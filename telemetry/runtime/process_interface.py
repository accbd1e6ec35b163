"""The interface of a process: everything it does when events come, with any driver."""

from __future__ import annotations

import math
from typing import Any

from telemetry.application.endpoint import Endpoint
from telemetry.media.port import PortFrame
from telemetry.messages import Side
from telemetry.runtime.joint_watch import JointFault
from telemetry.unwritten import Content

SentFrames = list[tuple[Side, PortFrame]]  # by their side


class Process:
    """Base of a process: hands time and frames to its ``endpoint``; a subclass takes what it can use of the rest.

    It is driven by a stepper (``stepped``) or by a clock of its own (``own_clock``) and knows neither. Calls come one
    at a time, ``now`` is its own clock (s).
    """

    endpoint: Endpoint

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """Handle a frame that arrived at one end; a subclass takes the messages for this process.

        A radio tells the ``margin`` (dB) over its threshold with which it was heard.
        """
        self.endpoint.receive(side, frame, now, margin)

    def on_cycle(self, data: Any, now: float) -> None:
        """Handle the end of a cycle with the sample ``data``; a process without a sensor ignores it."""

    def on_overrun(self, missed: int, now: float) -> None:
        """Handle a cycle that ended at ``now`` (s) when ``missed`` later ones should have begun; own clock only."""

    def on_joint_fault(self, fault: JointFault, now: float) -> None:
        """Handle a fault of a joint, see ``joint_watch``; own clock only."""

    def on_depth(self, payload: bytes, now: float) -> None:
        """Handle bytes from the source of the depth, a reading or anything else; most processes hear none."""

    def on_timer(self, now: float) -> None:
        """Handle a timer named by ``next_wake``: hello, time requests, repetition."""
        self.endpoint.advance(now)

    def before_frames(self) -> None:
        """Prepare for frames to be taken: put on the disk what must be there before they leave."""

    def take_frames(self, now: float) -> SentFrames:
        """Frames to send now."""
        self.before_frames()
        return self.endpoint.take_frames(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer, infinite if none."""
        return self.endpoint.next_wake(now)

    def close(self) -> None:
        """End in good order: release sensors, save what is worth keeping."""
