"""InvenSense MPU-6500 over I2C: six axes and temperature through the FIFO, averaged over the cycle.

Sampled at 50 Hz behind the sensor's own low-pass of 20 Hz, a cycle is 26 frames of 14 bytes, well inside the FIFO's
512. The mean of the frames is that of their own window, which ends half a frame after the newest, earlier by the delay
of the low-pass; the sample says so, and what the eighths of the cycle turned. Source: InvenSense, MPU-6500 register
map and descriptions, revision 2.1 (registers, WHO_AM_I = 0x70, temperature, delays) and product specification,
revision 1.3 (sensitivities).
"""

from __future__ import annotations

import importlib
import math
import struct
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, Protocol, cast

import numpy as np

from node.errors import SensorError
from node.process.drivers.fifo_window import Array, parts_of, window_std
from node.process.drivers.frame_clock import FrameClock
from node.process.drivers.source import ImuSample

SMPLRT_DIV, CONFIG, GYRO_CONFIG, ACCEL_CONFIG, ACCEL_CONFIG_2 = 0x19, 0x1A, 0x1B, 0x1C, 0x1D
FIFO_EN, INT_STATUS, SIGNAL_PATH_RESET, USER_CTRL, PWR_MGMT_1, PWR_MGMT_2 = 0x23, 0x3A, 0x68, 0x6A, 0x6B, 0x6C
FIFO_COUNT_H, FIFO_R_W, WHO_AM_I = 0x72, 0x74, 0x75

IDENTITY: Final = 0x70
ADDRESS: Final = 0x68  # 0x69 with AD0 high
RATE_RANGES: Final = {250: 0, 500: 1, 1000: 2, 2000: 3}  # deg/s: FS_SEL
FORCE_RANGES: Final = {2: 0, 4: 1, 8: 2, 16: 3}  # g: ACCEL_FS_SEL
LOW_PASS: Final = {184: 1, 92: 2, 41: 3, 20: 4, 10: 5, 5: 6}  # Hz: DLPF_CFG
DELAYS: Final = {184: 2.9e-3, 92: 3.9e-3, 41: 5.9e-3, 20: 9.9e-3, 10: 17.85e-3, 5: 33.48e-3}  # s, of the gyroscope
FRAME: Final = 14  # bytes: force, temperature, rate, in the order of the registers
BURST: Final = 28  # bytes of a read; SMBus allows 32
CAPACITY: Final = 512
OVERFLOWN: Final = 0x10  # of INT_STATUS
STOP_WHEN_FULL: Final = 0x40  # of CONFIG: frames stay whole
FIFO_ON, FIFO_RESET = 0x40, 0x04  # of USER_CTRL
EVERYTHING: Final = 0xF8  # of FIFO_EN: temperature, three rates, force
G: Final = 9.80665  # m/s^2
RESET_TIME, WAKE_TIME = 0.1, 0.05  # s
TRIES: Final = 2  # of one transfer


class Bus(Protocol):
    """The part of ``smbus2.SMBus`` that is used."""

    def read_byte_data(self, i2c_addr: int, register: int) -> int:
        """One register."""

    def write_byte_data(self, i2c_addr: int, register: int, value: int) -> None:
        """Set one register."""

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int) -> list[int]:
        """Up to 32 registers, or bytes of the FIFO."""

    def close(self) -> None:
        """Release the bus."""


def open_bus(number: int) -> Bus:
    """Bus ``/dev/i2c-NUMBER`` through smbus2.

    Raises
    ------
    SensorError
        When the library or the bus is absent.
    """
    try:
        library: Any = importlib.import_module("smbus2")
    except ImportError as error:
        raise SensorError("mpu6500: needs the extra board: pip install 'borechain[board]'") from error
    try:
        return cast("Bus", library.SMBus(number))
    except OSError as error:
        raise SensorError(f"mpu6500: /dev/i2c-{number}: {error}") from error


class Mpu6500:
    """One sensor.

    Parameters
    ----------
    connect : makes the bus
    address : of the sensor on it
    rate_range : deg/s, 250, 500, 1000 or 2000
    force_range : g, 2, 4, 8 or 16
    low_pass : Hz, 5, 10, 20, 41, 92 or 184
    sample_rate : Hz, 4..1000, at which the FIFO is filled
    sleep : waits, s
    """

    def __init__(
        self,
        connect: Callable[[], Bus],
        address: int = ADDRESS,
        rate_range: int = 500,
        force_range: int = 8,
        low_pass: int = 20,
        sample_rate: int = 50,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        for name, value, choices in (
            ("rate_range", rate_range, RATE_RANGES),
            ("force_range", force_range, FORCE_RANGES),
            ("low_pass", low_pass, LOW_PASS),
        ):
            if value not in choices:
                raise SensorError(f"mpu6500: {name}: expected one of {', '.join(map(str, choices))}, got {value}")
        if not 4 <= sample_rate <= 1000:
            raise SensorError(f"mpu6500: sample_rate: expected 4..1000 Hz, got {sample_rate}")
        self._connect, self._address, self._sleep = connect, address, sleep
        self._divider = round(1000 / sample_rate) - 1
        self.sample_rate = 1000.0 / (self._divider + 1)  # Hz
        self._rate_select, self._force_select = RATE_RANGES[rate_range], FORCE_RANGES[force_range]
        self._low_pass, self._delay = LOW_PASS[low_pass], DELAYS[low_pass]
        self._frames = FrameClock(self.sample_rate)
        self._rate_lsb = math.radians(rate_range) / 32768.0
        self._force_lsb = force_range * G / 32768.0
        self._bus: Bus | None = None
        self._fresh = True  # nothing was read since the start: the FIFO need not hold one cycle

    def start(self) -> None:
        """Reset, identify, configure, read the configuration back and empty the FIFO."""
        self.close()
        self._bus = self._connect()
        identity = self._get(WHO_AM_I)
        if identity != IDENTITY:
            raise SensorError(f"mpu6500: WHO_AM_I: expected 0x{IDENTITY:02x}, got 0x{identity:02x}")
        self._set(PWR_MGMT_1, 0x80)
        self._sleep(RESET_TIME)
        self._set(SIGNAL_PATH_RESET, 0x07)
        self._sleep(RESET_TIME)
        for register, value in self._settings():
            self._set(register, value)
        self._sleep(WAKE_TIME)
        for register, value in self._settings():
            found = self._get(register)
            if found != value:
                raise SensorError(f"mpu6500: register 0x{register:02x}: expected 0x{value:02x}, got 0x{found:02x}")
        self._empty()
        self._fresh = True
        self._frames.begin()

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean of the frames since the last read, which must be about those of a cycle from ``begin`` to ``end``."""
        overflown = self._get(INT_STATUS) & OVERFLOWN
        high, low = self._block(FIFO_COUNT_H, 2)
        count = high << 8 | low
        fresh, self._fresh = self._fresh, False
        if count > CAPACITY or (overflown and not fresh):
            self._empty()
            raise SensorError(f"mpu6500: the FIFO has overflown, {count} bytes: readings of this cycle are lost")
        frames = count // FRAME
        expected = (end - begin) * self.sample_rate
        if frames < 1 or (not fresh and not frames >= 0.5 * expected):
            self._empty()
            raise SensorError(f"mpu6500: expected about {expected:.0f} frames in the FIFO, got {frames}")
        sample, rates = self._mean(self._drain(frames * FRAME))
        self._frames.on_read(end, frames)
        shown = self._frames.end - self._delay
        if not (fresh or overflown):  # else its window may be any
            parts = parts_of(rates, (shown - frames * self._frames.period, shown), begin, end)
            sample = replace(sample, parts=parts)
        if overflown:
            self._empty()
            self._frames.begin()
        return replace(sample, late=end - shown, late_std=window_std(self._frames.std, self._delay))

    def close(self) -> None:
        """Release the bus."""
        if self._bus is not None:
            self._bus.close()
            self._bus = None

    def _settings(self) -> tuple[tuple[int, int], ...]:
        return (
            (PWR_MGMT_1, 0x01),  # awake, clock of the gyroscope
            (PWR_MGMT_2, 0x00),  # every axis on
            (CONFIG, STOP_WHEN_FULL | self._low_pass),
            (SMPLRT_DIV, self._divider),
            (GYRO_CONFIG, self._rate_select << 3),
            (ACCEL_CONFIG, self._force_select << 3),
            (ACCEL_CONFIG_2, self._low_pass),
            (FIFO_EN, EVERYTHING),
        )

    def _empty(self) -> None:
        self._set(USER_CTRL, FIFO_RESET)
        self._set(USER_CTRL, FIFO_ON)

    def _drain(self, length: int) -> bytes:
        taken = bytearray()
        while len(taken) < length:
            taken += bytes(self._block(FIFO_R_W, min(BURST, length - len(taken))))
        return bytes(taken)

    def _mean(self, data: bytes) -> tuple[ImuSample, Array]:
        frames = np.array(list(struct.iter_unpack(">7h", data)), dtype=np.float64)
        force = frames[:, :3].mean(axis=0) * self._force_lsb
        rate = frames[:, 4:].mean(axis=0) * self._rate_lsb
        at_range = (frames >= 32767.0) | (frames <= -32768.0)
        saturated = int(np.any(at_range[:, 4:])) | 2 * int(np.any(at_range[:, :3]))
        sample = ImuSample(
            (float(rate[0]), float(rate[1]), float(rate[2])),
            (float(force[0]), float(force[1]), float(force[2])),
            float(frames[:, 3].mean()) / 333.87 + 21.0,
            saturated,
        )
        return sample, frames[:, 6] * self._rate_lsb

    def _get(self, register: int) -> int:
        return self._block(register, 1)[0]

    def _block(self, register: int, length: int) -> list[int]:
        def transfer(bus: Bus) -> list[int]:
            if length == 1:
                return [bus.read_byte_data(self._address, register)]
            return bus.read_i2c_block_data(self._address, register, length)

        # a repeated read of the FIFO would take other bytes than the one that failed
        found: list[int] = self._transfer(register, transfer, 1 if register == FIFO_R_W else TRIES)
        if len(found) != length:
            raise SensorError(f"mpu6500: register 0x{register:02x}: expected {length} bytes, got {len(found)}")
        return found

    def _set(self, register: int, value: int) -> None:
        self._transfer(register, lambda bus: bus.write_byte_data(self._address, register, value), TRIES)

    def _transfer(self, register: int, transfer: Callable[[Bus], Any], tries: int) -> Any:
        if self._bus is None:
            raise SensorError("mpu6500: not started")
        for attempt in range(tries):
            try:
                return transfer(self._bus)
            except OSError as error:
                if attempt == tries - 1:
                    raise SensorError(f"mpu6500: register 0x{register:02x}: {error}") from error
        raise SensorError(f"mpu6500: register 0x{register:02x}: no answer")
