"""The start of an InvenSense chip, transfer by transfer and pause by pause, as its data sheet asks for it."""

from __future__ import annotations

from typing import Any

import pytest
from emulated_mpu import EmulatedMpu

from node.process.drivers.mpu_chips import CHIPS
from node.process.drivers.mpu_imu import MpuImu

RESET, WAKE = 0.1, 0.05  # s: after a reset 100 ms (register map, PWR_MGMT_1), a gyroscope starts within 35 ms


class Traced(EmulatedMpu):
    """Notes transfers and pauses in their order: reads with their length, and what is written."""

    def __init__(self, chip: str) -> None:
        super().__init__(chip=chip)
        self.notes: list[tuple[Any, ...]] = []

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        self.notes.append(("write", register, value))
        super().write_byte_data(i2c_addr, register, value, force)

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        self.notes.append(("read", register, 1))
        return super().read_i2c_block_data(i2c_addr, register, 1)[0]

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force: bool | None = None) -> list[int]:
        self.notes.append(("read", register, length))
        return super().read_i2c_block_data(i2c_addr, register, length, force)

    def sleep(self, seconds: float) -> None:
        self.notes.append(("sleep", seconds))

    def close(self) -> None:
        self.notes.append(("close",))


def started(chip: str, **options: Any) -> tuple[Traced, MpuImu]:
    sensor = Traced(chip)
    driver = MpuImu(sensor.connect, chip=CHIPS[chip], sleep=sensor.sleep, **options)
    driver.start()
    return sensor, driver


def w(register: int, value: int) -> tuple[Any, ...]:
    return ("write", register, value)


def r(register: int, length: int = 1) -> tuple[Any, ...]:
    return ("read", register, length)


STARTS = {
    "mpu6500": [
        r(0x75), w(0x6B, 0x80), ("sleep", RESET), w(0x68, 0x07), ("sleep", RESET),
        w(0x6B, 0x01), w(0x6C, 0x00), w(0x1A, 0x44), w(0x19, 19), w(0x1B, 0x08), w(0x1C, 0x10), w(0x1D, 0x04),
        w(0x23, 0xF8), w(0x6A, 0x40), ("sleep", WAKE),
        r(0x75), r(0x19, 5), r(0x23), r(0x6A, 3), w(0x6A, 0x04), w(0x6A, 0x40),
    ],
    "mpu6050": [
        r(0x75), w(0x6B, 0x80), ("sleep", RESET), w(0x68, 0x07), ("sleep", RESET),
        w(0x6B, 0x01), w(0x6C, 0x00), w(0x1A, 0x04), w(0x19, 19), w(0x1B, 0x08), w(0x1C, 0x10),
        w(0x23, 0xF8), w(0x6A, 0x40), ("sleep", WAKE),
        r(0x75), r(0x19, 4), r(0x23), r(0x6A, 3), w(0x6A, 0x04), w(0x6A, 0x40),
    ],
    # every bank is chosen before its first register, and after the reset nothing is taken for chosen
    "icm20948": [
        w(0x7F, 0x00), r(0x00), w(0x06, 0x80), ("sleep", RESET), w(0x7F, 0x00),
        w(0x06, 0x01), w(0x07, 0x00), w(0x7F, 0x20), w(0x00, 21), w(0x01, 0x23), w(0x10, 0x00), w(0x11, 21),
        w(0x14, 0x25), w(0x7F, 0x00), w(0x67, 0x1F), w(0x69, 0x1F), w(0x03, 0x40), ("sleep", WAKE),
        r(0x00), r(0x03), r(0x06, 2), r(0x67), r(0x69), w(0x7F, 0x20), r(0x00, 2), r(0x10, 2), r(0x14),
        w(0x7F, 0x00), w(0x68, 0x1F), w(0x68, 0x00), w(0x03, 0x40),
    ],
}  # fmt: skip


@pytest.mark.parametrize("chip", STARTS)
@pytest.mark.parametrize("starts", [1, 2])
def test_a_start_is_that_of_the_data_sheet_and_so_is_the_next(chip: str, starts: int) -> None:
    sensor, driver = started(chip)
    for _ in range(starts - 1):
        sensor.notes.clear()
        driver.start()
        assert sensor.notes.pop(0) == ("close",)
    assert sensor.notes == STARTS[chip]
    assert sensor.opened == starts


def test_an_mpu9250_starts_as_an_mpu6500_of_another_identity() -> None:
    assert started("mpu9250")[0].notes == STARTS["mpu6500"]


@pytest.mark.parametrize(
    ("chip", "asked", "rate"),
    [("mpu6500", 50, 50.0), ("mpu6500", 300, 1000.0 / 3.0), ("mpu6500", 4, 4.0), ("mpu6500", 1000, 1000.0),
     ("icm20948", 50, 1125.0 / 22.0), ("icm20948", 5, 1125.0 / 225.0)],
)  # fmt: skip
def test_the_rate_is_the_nearest_that_a_divider_gives(chip: str, asked: int, rate: float) -> None:
    driver = started(chip, sample_rate=asked)[1]
    assert driver.sample_rate == pytest.approx(rate)
    assert driver.counted_rate == pytest.approx(rate)
    assert driver.description == f"{chip} at 0x68, {rate:.1f} Hz"


@pytest.mark.parametrize("chip", ["mpu6500", "icm20948"])
def test_a_cycle_reads_status_and_count_frames_but_the_last_count_last_frame_count_and_proof(chip: str) -> None:
    """The status first, since reading clears it; 28 bytes at a time, since SMBus gives 32 and a frame has 14."""
    sensor, driver = started(chip)
    sensor.live(0.1, (0.0, 0.0, 0.1), (0.0, 0.0, 9.8))
    sensor.notes.clear()
    driver.read(10.0, 10.1)
    status, count, fifo = (0x3A, 0x72, 0x74) if chip == "mpu6500" else (0x1B, 0x70, 0x72)
    reads = [r(status), r(count, 2), r(fifo, 28), r(fifo, 28), r(count, 2), r(fifo, 14), r(count, 2)]
    bank = [("write", 0x7F, 0x00)] if chip == "icm20948" else []
    assert [note for note in sensor.notes if note not in bank][: len(reads)] == reads
    proof = [note for note in STARTS[chip][STARTS[chip].index(("sleep", WAKE)) + 1 :] if note[0] == "read"]
    assert [note for note in sensor.notes if note[0] == "read"][len(reads) :] == proof


def test_a_driver_that_is_closed_gives_its_bus_back_once() -> None:
    sensor, driver = started("mpu6500")
    sensor.notes.clear()
    driver.close()
    driver.close()
    assert sensor.notes == [("close",)]
