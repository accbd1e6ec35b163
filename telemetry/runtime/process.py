"""What every process with an endpoint does when it is driven from outside, whatever it measures or stores."""

from __future__ import annotations

from typing import Any

from telemetry.application.endpoint import Endpoint
from telemetry.messages import Side


class Process:
    """Base of a process: hands time and frames to its ``endpoint``; a subclass takes what it can use of the rest."""

    endpoint: Endpoint

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived at one end; what it says to this process is for a subclass to take."""
        self.endpoint.receive(side, frame, now)

    def on_cycle(self, data: Any, now: float) -> None:
        """A cycle has ended; a process without a sensor has none."""

    def on_overrun(self, missed: int, now: float) -> None:
        """A cycle ended at ``now`` when ``missed`` later ones should have begun; only an own clock tells."""

    def close(self) -> None:
        """The process ends as it was asked to: let sensors go, keep what is worth keeping."""

    def on_depth(self, rig_time: float, md: float) -> None:
        """The rig measured the depth of the bit (m); most processes do not hear it."""

    def on_timer(self, now: float) -> None:
        """Let time pass: hello, time requests, repetition."""
        self.endpoint.advance(now)

    def take_frames(self, now: float) -> list[tuple[Side, bytes]]:
        """Frames to send now."""
        return self.endpoint.take_frames(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer."""
        return self.endpoint.next_wake(now)
