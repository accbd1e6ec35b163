"""The surface end as a bare recorder: receipts what must arrive, and notes when each of it came first."""

from __future__ import annotations

import math
from typing import get_args

from telemetry.application.endpoint import Endpoint
from telemetry.messages import BASE, Kept, Side
from telemetry.runtime.process_interface import Process
from telemetry.unwritten import Content


class PlainBase(Process):
    """Base station without a ground station behind it; nothing of it outlasts the run."""

    def __init__(self) -> None:
        self.endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=1)
        self.arrived: dict[
            tuple[int, int], tuple[Kept, float]
        ] = {}  # by tube and sequence: what came, when (own clock)

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived from the encoder."""
        for received in self.endpoint.receive(side, frame, now, margin):
            message = received.message
            if isinstance(message, get_args(Kept)):
                self.arrived.setdefault((message.tube, message.sequence), (message, now))
                self.endpoint.mail.acknowledge(message)
