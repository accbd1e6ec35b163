"""The interface of a process: everything it does when events come, whoever drives it."""

from __future__ import annotations

import math
from typing import Any

from telemetry.application.endpoint import Endpoint
from telemetry.media.port import PortFrame
from telemetry.messages import Side
from telemetry.runtime.joint_watch import JointFault
from telemetry.unwritten import Content


class Process:
    """Base of a process: hands time and frames to its ``endpoint``; a subclass takes what it can use of the rest.

    It is driven by a stepper (``stepped``) or by a clock of its own (``own_clock``) and knows neither. Calls come one
    at a time, ``now`` is its own clock (s).
    """

    endpoint: Endpoint

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived at one end; the messages for this process are for a subclass to take.

        A radio tells the ``margin`` (dB) over its threshold with which it was heard.
        """
        self.endpoint.receive(side, frame, now, margin)

    def on_cycle(self, data: Any, now: float) -> None:
        """A cycle has ended with the sample ``data``; a process without a sensor ignores it."""

    def on_overrun(self, missed: int, now: float) -> None:
        """A cycle ended at ``now`` when ``missed`` later ones should have begun; only an own clock reports it."""

    def on_joint_fault(self, fault: JointFault, now: float) -> None:
        """Something went wrong at a joint, see ``joint_watch``; only an own clock reports it."""

    def on_depth(self, payload: bytes, now: float) -> None:
        """The rig sent a reading of the depth of the bit, or somebody sent other bytes; most processes hear none."""

    def on_timer(self, now: float) -> None:
        """A timer named by ``next_wake`` is due: hello, time requests, repetition."""
        self.endpoint.advance(now)

    def before_frames(self) -> None:
        """Frames are about to be taken: what must be on a disk before they leave is to be put there."""

    def take_frames(self, now: float) -> list[tuple[Side, PortFrame]]:
        """Frames to send now."""
        self.before_frames()
        return self.endpoint.take_frames(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer, infinite if none."""
        return self.endpoint.next_wake(now)

    def close(self) -> None:
        """The process ends as it was asked to: let sensors go, keep what is worth keeping."""
