"""Stands for ``smbus2`` in a process of its own: an emulated MPU-6500 that lives by the machine's clock.

It moves as the recording ``imu.npy`` of the folder EMULATED_BUS says, behind a low-pass that delays by 9.9 ms. A file
``fault`` there is done once and removed: ``lose N`` bytes, ``register N`` falls back to 0, ``identity N`` from now on.
"""

import os
import time
from pathlib import Path

import numpy as np
from emulated_mpu import EmulatedMpu

FOLDER = Path(os.environ["EMULATED_BUS"])
DELAY = 9.9e-3  # s, of the low-pass of 20 Hz
STEP = 0.02  # s, of a frame
SLOWEST = 1.0  # s, between two looks; a chip that was not looked at for longer has forgotten


class SMBus(EmulatedMpu):
    """Bus with one chip."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.rows = np.load(FOLDER / "imu.npy")
        self.until = time.monotonic()

    def _transfer(self, address: int) -> None:
        now = time.monotonic()
        self.until = max(self.until, now - SLOWEST)
        while self.until + STEP <= now:
            k = int(np.searchsorted(self.rows[:, 0], self.until + 0.5 * STEP - DELAY))
            row = self.rows[min(k, len(self.rows) - 1)]
            self.live(STEP, row[1:4], row[4:7])
            self.until += STEP
        if (FOLDER / "fault").exists():
            kind, argument = (FOLDER / "fault").read_text().split()
            (FOLDER / "fault").unlink()
            if kind == "lose":
                self.lose(int(argument))
            elif kind == "register":
                self.registers[int(argument)] = 0
            else:
                self.identity = int(argument)
        super()._transfer(address)
