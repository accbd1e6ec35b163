"""Settings of the InvenSense chips as their manuals print them, code by code; and what a broken read may not do."""

from __future__ import annotations

import math

import pytest
from emulated_mpu import EmulatedMpu

from node.errors import SensorCause, SensorError
from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.mpu_chips import ICM20948, MPU6050, MPU6500, MPU9250, MpuChip
from node.process.drivers.mpu_imu import MpuImu

# gyroscope's delay (ms) of each low-pass (Hz), and its code: MPU-6500 register 26, MPU-6050 register 26
DELAYS_6500 = {184: (1, 2.9), 92: (2, 3.9), 41: (3, 5.9), 20: (4, 9.9), 10: (5, 17.85), 5: (6, 33.48)}
DELAYS_6050 = {184: (1, 1.9), 92: (2, 2.8), 41: (3, 4.8), 20: (4, 8.3), 10: (5, 13.4), 5: (6, 18.6)}
# ICM-20948, table 16: bandwidth (3 dB) of the code; two poles delay by 1 / (sqrt(2) pi f)
BANDS_20948 = {184: (0, 196.6), 92: (2, 119.5), 41: (3, 51.2), 20: (4, 23.9), 10: (5, 11.6), 5: (6, 5.7)}
RATES, FORCES = {250: 0, 500: 1, 1000: 2, 2000: 3}, {2: 0, 4: 1, 8: 2, 16: 3}


def written(chip: MpuChip, **choice: int) -> dict[int, int]:
    """Registers of the emulated chip once a driver has started it."""
    sensor = EmulatedMpu(chip=chip.name)
    MpuImu(sensor.connect, chip=chip, sleep=lambda _: None, **choice).start()
    return sensor.registers


@pytest.mark.parametrize("low_pass", list(DELAYS_6500))
@pytest.mark.parametrize(("rate", "force"), [(250, 2), (500, 16), (1000, 8), (2000, 4)])
@pytest.mark.parametrize("chip", [MPU6500, MPU9250, MPU6050])
def test_an_mpu_is_set_as_its_map_of_registers_says(chip: MpuChip, rate: int, force: int, low_pass: int) -> None:
    found = written(chip, rate_range=rate, force_range=force, low_pass=low_pass, sample_rate=100)
    code, delay_ms = (DELAYS_6050 if chip is MPU6050 else DELAYS_6500)[low_pass]
    own = {0x1A: code} if chip is MPU6050 else {0x1A: 0x40 | code, 0x1D: code}
    expected = {0x6B: 1, 0x6C: 0, 0x19: 9, 0x1B: RATES[rate] << 3, 0x1C: FORCES[force] << 3, 0x23: 0xF8, 0x6A: 0x40}
    assert {at: found[at] for at in expected | own} == expected | own
    assert chip.delays[low_pass] == pytest.approx(delay_ms / 1000.0)


@pytest.mark.parametrize("low_pass", list(BANDS_20948))
@pytest.mark.parametrize(("rate", "force"), [(250, 2), (500, 16), (1000, 8), (2000, 4)])
def test_an_icm_is_set_as_its_data_sheet_says(rate: int, force: int, low_pass: int) -> None:
    found = written(ICM20948, rate_range=rate, force_range=force, low_pass=low_pass, sample_rate=75)
    code, band = BANDS_20948[low_pass]
    expected = {
        0x06: 1, 0x07: 0, 0x200: 14, 0x201: code << 3 | RATES[rate] << 1 | 1, 0x210: 0, 0x211: 14,
        0x214: code << 3 | FORCES[force] << 1 | 1, 0x67: 0x1F, 0x69: 0x1F, 0x03: 0x40,
    }  # fmt: skip
    assert {at: found[at] for at in expected} == expected
    assert ICM20948.delays[low_pass] == pytest.approx(1.0 / (math.sqrt(2.0) * math.pi * band), abs=6e-5)


class FailsOnce(EmulatedMpu):
    """The next block read of one register fails once, and is counted."""

    at, reads = -1, 0

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force: bool | None = None) -> list[int]:
        if register == self.at:
            self.reads += 1
            if self.reads == 1:
                raise OSError(5, "Input/output error")
        return super().read_i2c_block_data(i2c_addr, register, length, force)


@pytest.mark.parametrize(("at", "goes_on"), [(0x74, False), (0x72, True), (0x19, True)])
def test_a_read_that_failed_is_made_again_but_of_the_frames(at: int, goes_on: bool) -> None:
    """What a broken read took from the FIFO is gone: a second one would take other bytes for them."""
    sensor = FailsOnce()
    driver = MpuImu(sensor.connect, sleep=lambda _: None)
    driver.start()
    sensor.live(PERIOD, (0.0, 0.0, 0.1), (0.0, 0.0, 9.8))
    sensor.at = at
    if goes_on:
        assert driver.read(10.0, 10.0 + PERIOD).rate[2] == pytest.approx(0.1, abs=1e-3)
        return
    with pytest.raises(SensorError) as refused:
        driver.read(10.0, 10.0 + PERIOD)
    assert (refused.value.cause, sensor.reads) == (SensorCause.BUS, 1)


def test_a_fifo_that_ran_over_before_the_first_cycle_is_emptied() -> None:
    """What waits in it is of no known time: the next cycle has its own frames alone."""
    sensor = EmulatedMpu()
    driver = MpuImu(sensor.connect, sleep=lambda _: None)
    driver.start()
    sensor.live(3.0, (0.0, 0.0, 0.5), (0.0, 0.0, 9.8))
    driver.read(10.0, 13.0)
    assert sensor.fifo == bytearray()
    sensor.live(PERIOD, (0.0, 0.0, -0.2), (0.0, 0.0, 9.8))
    assert driver.read(13.0, 13.0 + PERIOD).rate[2] == pytest.approx(-0.2, abs=1e-3)
