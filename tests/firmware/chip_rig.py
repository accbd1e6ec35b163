"""A chip's node on this machine, in told time, below a base that is the encoder too."""

from __future__ import annotations

import ctypes
import math
import random
from functools import partial
from pathlib import Path
from typing import Any

from chip_in_process import ChipBetween, ChipNode, Neighbour

from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.process.key_page import pack_key_page
from telemetry.application.endpoint import Endpoint
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.application.seals import Keys, Seals
from telemetry.messages import BASE, ENCODER, Aiding, Event, Side, SurveyMeasurement
from telemetry.transport.key_ring import key_file, read_ring

CHIP, BELOW = 2, 1
EPOCH = 3
OFFSET = 0.7  # rad, of the joint to the drive head
SETTINGS = TubeSettings(CHIP, drive_joint=MakeUpAngle(OFFSET, 1e-3), lower_joint=MakeUpAngle(-0.4, 1e-3), state_every=2)


class Rig:
    """A base that is the encoder too, the chip, and perhaps a tube below; the head turns as it is told to."""

    def __init__(
        self,
        library: ctypes.CDLL,
        image: bytes,
        *,
        below: bool = False,
        epoch: int = EPOCH,
        keys: Path | None = None,
    ) -> None:
        self._epoch, self._keys = epoch, keys
        page = b"" if keys is None else pack_key_page(read_ring(key_file(keys, CHIP), CHIP))
        library.shim_page(page, len(page))
        self._measured = None if keys is None else MeasurementSeal(Keys(key_file(keys, ENCODER), ENCODER).current)
        seals = self._seals_of(BASE, Side.LOWER)
        endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=epoch, is_clock_root=True, seals=seals)
        endpoint.place.hops = 0
        self.base = Neighbour(endpoint, Side.LOWER)
        seals = self._seals_of(BELOW, Side.UPPER) if below else None
        tube = Endpoint(BELOW, frozenset({Side.UPPER}), boot_count=1, seals=seals) if below else None
        self.tube = None if tube is None else Neighbour(tube, Side.UPPER)
        self.chip = ChipNode(library, image, SETTINGS, clock_off_us=123_456_789)
        self.world = ChipBetween(self.chip, self.base, self.tube)
        self.world.after_cycle = self._aid
        self.yaw, self._sequence = 1.0, 0
        self._receipted: set[int] = set()

    def _seals_of(self, address: int, side: Side) -> Seals | None:
        if self._keys is None:
            return None
        lot = partial(random.Random(address).getrandbits, 64)
        return Seals(Keys(key_file(self._keys, address), address), address, {side}, lot)

    def _aid(self, now: float) -> None:
        self._sequence += 1
        aiding = Aiding(self.yaw % math.tau, 1e-8, 0.0, 0.0, 0.0, now, 1, 0, epoch=self._epoch)
        aiding = aiding if self._measured is None else self._measured.close(aiding)
        self.base.endpoint.send_aiding(aiding, now)
        for message in self.base.heard:
            if isinstance(message, Event | SurveyMeasurement) and id(message) not in self._receipted:
                self._receipted.add(id(message))
                self.base.endpoint.mail.acknowledge(message)

    def heard(self, kind: type) -> list[Any]:
        """Messages of a kind that the base has heard from the chip."""
        return [m for m in self.base.heard if isinstance(m, kind) and m.tube == CHIP]
