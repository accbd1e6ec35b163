"""InvenSense IMUs on I2C: registers, frames and filters of each chip of the family, as data.

A register is its bank times 256 plus its address; only the ICM-20948 has banks. Sources: InvenSense register maps
MPU-6000/MPU-6050 revision 4.2, MPU-6500 revision 2.1, MPU-9250 revision 1.6 and data sheet ICM-20948 revision 1.5
(WHO_AM_I, temperature, delays). The ICM-20948's tells no delays: two poles at f have 1 / (sqrt(2) pi f).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

RATE_RANGES: Final = {250: 0, 500: 1, 1000: 2, 2000: 3}  # deg/s: FS_SEL
FORCE_RANGES: Final = {2: 0, 4: 1, 8: 2, 16: 3}  # g: ACCEL_FS_SEL
FRAME: Final = 14  # bytes: seven words
EVERYTHING: Final = 0xF8  # of FIFO_EN: temperature, three rates, force
STOP_WHEN_FULL: Final = 0x40  # of CONFIG: frames stay whole
FIFO_ON, FIFO_RESET = 0x40, 0x04  # of USER_CTRL
Settings = tuple[tuple[int, int], ...]


@dataclass(frozen=True, slots=True)
class RangeChoice:
    """What a sensor is set to, as the codes of its registers."""

    rate: int
    force: int
    low_pass: int  # Hz
    divider: int


@dataclass(frozen=True, slots=True)
class MpuChip:
    """One chip: ``settings`` are written at the start, in this order, and read back every cycle."""

    name: str
    identities: tuple[int, ...]
    delays: dict[int, float]  # Hz of its low-pass: s of the gyroscope
    capacity: int  # bytes of its FIFO
    warmth: tuple[float, float]  # counts for a degree, and C at zero counts
    settings: Callable[[RangeChoice], Settings]
    base_rate: float = 1000.0  # Hz, before the divider
    force_at: int = 0  # words of a frame
    warmth_at: int = 3
    rate_at: int = 4
    identity_register: int = 0x75
    power: int = 0x6B
    user: int = 0x6A
    status: int = 0x3A
    overflown: int = 0x10  # of the status
    count: int = 0x72
    fifo: int = 0x74
    path_reset: int | None = 0x68
    empty: Settings = ((0x6A, FIFO_RESET), (0x6A, FIFO_ON))
    bank_select: int | None = None

    def all_settings(self, choice: RangeChoice) -> Settings:
        """What every register must hold while it measures."""
        return (*self.settings(choice), (self.user, FIFO_ON))


def settings_6500(choice: RangeChoice) -> Settings:
    """Of an MPU-6500 or MPU-9250."""
    low_pass = LOW_PASS[choice.low_pass]
    return (
        (0x6B, 0x01),  # PWR_MGMT_1: awake, clock of the gyroscope
        (0x6C, 0x00),  # PWR_MGMT_2: every axis on
        (0x1A, STOP_WHEN_FULL | low_pass),  # CONFIG
        (0x19, choice.divider),  # SMPLRT_DIV
        (0x1B, choice.rate << 3),  # GYRO_CONFIG
        (0x1C, choice.force << 3),  # ACCEL_CONFIG
        (0x1D, low_pass),  # ACCEL_CONFIG_2
        (0x23, EVERYTHING),  # FIFO_EN
    )


def settings_6050(choice: RangeChoice) -> Settings:
    """Of an MPU-6050: one low-pass for both sensors, and a FIFO that drops its oldest bytes."""
    return (
        (0x6B, 0x01),
        (0x6C, 0x00),
        (0x1A, LOW_PASS[choice.low_pass]),
        (0x19, choice.divider),
        (0x1B, choice.rate << 3),
        (0x1C, choice.force << 3),
        (0x23, EVERYTHING),
    )


def settings_20948(choice: RangeChoice) -> Settings:
    """Of an ICM-20948, whose filters are in bank 2."""
    low_pass = LOW_PASS_20948[choice.low_pass]
    return (
        (0x06, 0x01),  # PWR_MGMT_1
        (0x07, 0x00),  # PWR_MGMT_2
        (0x200, choice.divider),  # GYRO_SMPLRT_DIV
        (0x201, low_pass << 3 | choice.rate << 1 | 1),  # GYRO_CONFIG_1
        (0x210, 0x00),  # ACCEL_SMPLRT_DIV_1
        (0x211, choice.divider),  # ACCEL_SMPLRT_DIV_2
        (0x214, low_pass << 3 | choice.force << 1 | 1),  # ACCEL_CONFIG
        (0x67, 0x1F),  # FIFO_EN_2: temperature, three rates, force
        (0x69, 0x1F),  # FIFO_MODE: stop when full
    )


LOW_PASS: Final = {184: 1, 92: 2, 41: 3, 20: 4, 10: 5, 5: 6}  # Hz: DLPF_CFG
LOW_PASS_20948: Final = {184: 0, 92: 2, 41: 3, 20: 4, 10: 5, 5: 6}  # 197, 120, 51, 24, 12 and 6 Hz
DELAYS: Final = {184: 2.9e-3, 92: 3.9e-3, 41: 5.9e-3, 20: 9.9e-3, 10: 17.85e-3, 5: 33.48e-3}
DELAYS_6050: Final = {184: 1.9e-3, 92: 2.8e-3, 41: 4.8e-3, 20: 8.3e-3, 10: 13.4e-3, 5: 18.6e-3}
DELAYS_20948: Final = {184: 1.1e-3, 92: 1.9e-3, 41: 4.4e-3, 20: 9.4e-3, 10: 19.4e-3, 5: 39.5e-3}

MPU6500: Final = MpuChip("mpu6500", (0x70,), DELAYS, 512, (333.87, 21.0), settings_6500)
MPU9250: Final = MpuChip("mpu9250", (0x71, 0x73), DELAYS, 512, (333.87, 21.0), settings_6500)  # 0x73: MPU-9255
# MPU-6000 and MPU-9150 hold the same part
MPU6050: Final = MpuChip("mpu6050", (0x68,), DELAYS_6050, 1024, (340.0, 36.53), settings_6050)
ICM20948: Final = MpuChip(
    "icm20948",
    (0xEA,),
    DELAYS_20948,
    512,
    (333.87, 21.0),
    settings_20948,
    base_rate=1125.0,
    warmth_at=6,
    rate_at=3,
    identity_register=0x00,
    power=0x06,
    user=0x03,
    status=0x1B,
    overflown=0x1F,
    count=0x70,
    fifo=0x72,
    path_reset=None,
    empty=((0x68, 0x1F), (0x68, 0x00), (0x03, FIFO_ON)),
    bank_select=0x7F,
)
CHIPS: Final = {chip.name: chip for chip in (MPU6050, MPU6500, MPU9250, ICM20948)}


def family_of(identity: int) -> str:
    """Name of the chip of an identity, or nothing."""
    return next((chip.name for chip in CHIPS.values() if identity in chip.identities), "")
