"""A board whose parts are emulated and can be broken, each alone: IMU, encoder, CAN, clock, disk, keys, kernels."""

from __future__ import annotations

import datetime
import json
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from emulated_encoders import EmulatedCounter
from emulated_mpu import EmulatedMpu

from borechain.pki.rig_keys import add_tube, init_rig
from node.process import board_places
from node.process.board_sensors import check_encoder, check_imu
from node.process.drivers.mpu_imu import MpuImu
from node.process.drivers.quadrature import QuadratureFile

NOW = datetime.datetime(2026, 11, 27, 7, 0, tzinfo=datetime.UTC)
GOOD_CAN = {
    "ifname": "can0",
    "flags": ["NOARP", "UP", "LOWER_UP", "ECHO"],
    "link_type": "can",
    "linkinfo": {
        "info_kind": "can",
        "info_data": {
            "ctrlmode": ["FD"],
            "state": "ERROR-ACTIVE",
            "berr_counter": {"tx": 0, "rx": 3},
            "bittiming": {"bitrate": 500000},
            "data_bittiming": {"bitrate": 2000000},
        },
    },
}


class EmulatedBoard:
    """A board whose parts are emulated; time is that of its sensor."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch, clock: datetime.datetime = NOW) -> None:
        self.folder, self.now, self.turn, self.halves = folder, 100.0, 90.0, 0
        self.chip = EmulatedMpu()
        self.driver = MpuImu(self.chip.connect, sleep=lambda _: None)
        self.counter = EmulatedCounter(folder / "counters")
        self.random = np.random.default_rng(3)
        self.bias, self.force, self.noise, self.temperature = (
            np.radians([0.5, -1.0, 0.2]),
            1.0,
            math.radians(0.05),
            31.0,
        )
        self.quicker, self.step, self.stops_at = 1.0, 1, 10**9
        self.can = json.loads(json.dumps(GOOD_CAN))
        self.clock = clock
        self.keys = folder / "stick"
        init_rig(self.keys, "rig-1", clock)
        add_tube(self.keys, 7, clock)
        add_tube(self.keys, 8, clock)
        self.key_place = self.keys / "tube-7.keys"
        self.kernels = folder / "kernels"
        (self.kernels / "node.kernels.step.node_step").mkdir(parents=True)
        self.index = self.kernels / "node.kernels.step.node_step" / "node_step.node_step-9.py311.nbi"
        self.index.touch()
        self.programs = folder / "bin"
        self.programs.mkdir()
        monkeypatch.setenv("PATH", str(self.programs), prepend=":")

    def sleep(self, seconds: float) -> None:
        """Let the sensor live."""
        self.now += seconds
        for _ in range(26):
            noise = self.random.normal(0.0, 1.0, 3)
            rate = self.bias + self.noise * noise
            force = self.force * (np.array([0.2, -0.3, -9.79]) + 15.0 * self.noise * noise)
            self.chip.live(seconds * self.quicker / 26.0, tuple(rate), tuple(force), self.temperature)

    def turn_head(self) -> bool:
        """Turn on by a half; whether there is more to come."""
        self.halves += 1
        self.counter.turn_to(min(self.step * round(self.halves * self.turn * 2048 / 360.0), self.stops_at))
        return self.halves < 2

    def write_program(self) -> None:
        """A program ``ip`` that shows the CAN controller as it is now."""
        program = self.programs / "ip"
        program.write_text(f"#!/bin/sh\ncat <<'END'\n{json.dumps([self.can] if self.can else [])}\nEND\n")
        program.chmod(0o755)

    def findings(self) -> dict[str, tuple[bool, str]]:
        """What a check before the tube goes down finds."""
        self.write_program()
        lines = check_imu(self.driver, clock=lambda: self.now, sleep=self.sleep)
        lines += check_encoder(QuadratureFile(self.counter.place / "count"), 90.0, lambda: self.now, self.turn_head)
        lines += [board_places.check_can("can", "can0"), board_places.check_clock(self.clock)]
        lines += [
            board_places.check_disk(self.folder / "state"),
            board_places.check_keys(self.key_place, 7, self.clock),
        ]
        lines += [board_places.check_kernels(self.kernels)]
        return {line.part: (line.good, line.text) for line in lines}


def can_with(**data: object) -> Callable[[EmulatedBoard], object]:
    """What changes the CAN controller."""
    return lambda one: one.can["linkinfo"]["info_data"].update(data)
