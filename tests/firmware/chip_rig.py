"""A chip's node on this machine, in told time, below a base that is the encoder too."""

from __future__ import annotations

import ctypes
import math
from typing import Any

from chip_in_process import ChipBetween, ChipNode, Neighbour

from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from telemetry.application.endpoint import Endpoint
from telemetry.messages import BASE, Aiding, Event, Side, SurveyMeasurement

CHIP, BELOW = 2, 1
EPOCH = 3
OFFSET = 0.7  # rad, of the joint to the drive head
SETTINGS = TubeSettings(CHIP, drive_joint=MakeUpAngle(OFFSET, 1e-3), lower_joint=MakeUpAngle(-0.4, 1e-3), state_every=2)


class Rig:
    """A base that is the encoder too, the chip, and perhaps a tube below; the head turns as it is told to."""

    def __init__(self, library: ctypes.CDLL, image: bytes, *, below: bool = False) -> None:
        endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=EPOCH, is_clock_root=True)
        endpoint.place.hops = 0
        self.base = Neighbour(endpoint, Side.LOWER)
        tube = Endpoint(BELOW, frozenset({Side.UPPER}), boot_count=1) if below else None
        self.tube = None if tube is None else Neighbour(tube, Side.UPPER)
        self.chip = ChipNode(library, image, SETTINGS, clock_off_us=123_456_789)
        self.world = ChipBetween(self.chip, self.base, self.tube)
        self.world.after_cycle = self._aid
        self.yaw, self._sequence = 1.0, 0
        self._receipted: set[int] = set()

    def _aid(self, now: float) -> None:
        self._sequence += 1
        aiding = Aiding(self.yaw % math.tau, 1e-8, 0.0, 0.0, 0.0, now, 1, 0, epoch=EPOCH)
        self.base.endpoint.send_aiding(aiding, now)
        for message in self.base.heard:
            if isinstance(message, Event | SurveyMeasurement) and id(message) not in self._receipted:
                self._receipted.add(id(message))
                self.base.endpoint.mail.acknowledge(message)

    def heard(self, kind: type) -> list[Any]:
        """Messages of a kind that the base has heard from the chip."""
        return [m for m in self.base.heard if isinstance(m, kind) and m.tube == CHIP]
