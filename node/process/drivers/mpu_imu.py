"""InvenSense IMUs over I2C (MPU-6050, 6500, 9250, ICM-20948): axes and temperature by FIFO, averaged over the cycle.

Sampled at 50 Hz behind the sensor's own low-pass of 20 Hz, a cycle is 26 frames of 14 bytes, well inside the FIFO's
512. The mean of the frames is that of their own window, which ends half a frame after the newest, earlier by the delay
of the low-pass; the sample says so, and what the eighths of the cycle turned. Every cycle proves what it read: identity
and all settings are read back after the frames, which stay whole or cost the cycle. Source: ``mpu_chips``, and
InvenSense, MPU-6500 product specification, revision 1.3 (sensitivities).
"""

from __future__ import annotations

import importlib
import math
import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final, Protocol, cast

import numpy as np

from node.errors import SensorCause, SensorError
from node.process.drivers.fifo_window import Array, parts_of, window_std
from node.process.drivers.frame_clock import FrameClock
from node.process.drivers.mpu_chips import (
    FORCE_RANGES,
    FRAME,
    MPU6500,
    RATE_RANGES,
    MpuChip,
    RangeChoice,
    Settings,
    family_of,
)
from node.process.drivers.source import NOTHING, ImuSample

ADDRESS: Final = 0x68  # 0x69 with AD0 high
BURST: Final = 28  # bytes of a read; SMBus allows 32
G: Final = 9.80665  # m/s^2
RESET_TIME, WAKE_TIME = 0.1, 0.05  # s
TRIES: Final = 2  # of one transfer
WHOLE: Final = 0.9  # of the frames of a cycle, by which a sensor that was started anew has measured all of it
STANDS: Final = 4  # frames, from which on a count that does not fall by reading is told from a frame that came
FARTHEST_WARMTH: Final = 1.0  # C between two frames of a cycle, ten times their noise; more is another word


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
        raise SensorError("i2c: needs the extra board: pip install 'borechain[board]'") from error
    try:
        return cast("Bus", library.SMBus(number))
    except OSError as error:
        raise SensorError(f"i2c: /dev/i2c-{number}: {error}") from error


class MpuImu:
    """One sensor.

    Parameters
    ----------
    connect : makes the bus
    address : of the sensor on it
    rate_range : deg/s, 250, 500, 1000 or 2000
    force_range : g, 2, 4, 8 or 16
    low_pass : Hz, 5, 10, 20, 41, 92 or 184
    sample_rate : Hz, 4..1000, at which the FIFO is filled
    chip : which of the family it is
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
        chip: MpuChip = MPU6500,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        for name, value, choices in (
            ("rate_range", rate_range, RATE_RANGES),
            ("force_range", force_range, FORCE_RANGES),
            ("low_pass", low_pass, chip.delays),
        ):
            if value not in choices:
                raise SensorError(f"{chip.name}: {name}: expected one of {', '.join(map(str, choices))}, got {value}")
        slowest = math.ceil(chip.base_rate / 256)
        if not slowest <= sample_rate <= 1000:
            raise SensorError(f"{chip.name}: sample_rate: expected {slowest}..1000 Hz, got {sample_rate}")
        self._connect, self._address, self._chip, self._sleep = connect, address, chip, sleep
        divider = round(chip.base_rate / sample_rate) - 1
        self.sample_rate = chip.base_rate / (divider + 1)  # Hz
        choice = RangeChoice(RATE_RANGES[rate_range], FORCE_RANGES[force_range], low_pass, divider)
        self._settings, self._delay = chip.all_settings(choice), chip.delays[low_pass]
        self._blocks = neighbouring_registers(self._settings)
        self._frames = FrameClock(self.sample_rate)
        self._rate_lsb = math.radians(rate_range) / 32768.0
        self._force_lsb = force_range * G / 32768.0
        self._bus: Bus | None = None
        self._bank = 0
        self._fresh = True  # nothing was read since the start: the FIFO need not hold one cycle
        self._starts = 0

    @property
    def description(self) -> str:
        """The chip, where it is, and how it is set."""
        return f"{self._chip.name} at 0x{self._address:02x}, {self.sample_rate:.1f} Hz"

    @property
    def counted_rate(self) -> float:
        """Rate of the frames, Hz, as counted so far."""
        return 1.0 / self._frames.period

    def start(self) -> None:
        """Reset, identify, configure, read the configuration back and empty the FIFO."""
        chip = self._chip
        self.close()
        self._bus, self._bank = self._connect(), -1
        self._identify()
        self._set(chip.power, 0x80)
        self._sleep(RESET_TIME)
        self._bank = -1
        if chip.path_reset is not None:
            self._set(chip.path_reset, 0x07)
            self._sleep(RESET_TIME)
        for register, value in self._settings:
            self._set(register, value)
        self._sleep(WAKE_TIME)
        self._prove()
        self._empty()
        self._fresh = True
        self._starts += 1
        self._frames.begin()

    def read(self, begin: float, end: float) -> ImuSample:
        """Mean of the frames since the last read, which must be about those of a cycle from ``begin`` to ``end``.

        What is read is proved first: the sensor is the one that was configured, and still is as it was; frames are
        whole, before and after they were read. A sensor that was started anew within the cycle gives no numbers.
        """
        try:
            return self._proved(begin, end)
        except SensorError as error:
            if error.cause not in (SensorCause.BUS, SensorCause.IDENTITY, SensorCause.REGISTER):
                self._prove()  # a sensor that was reset holds no frames: its settings say why
                self._empty()
            raise

    def close(self) -> None:
        """Release the bus."""
        if self._bus is not None:
            self._bus.close()
            self._bus = None

    def _proved(self, begin: float, end: float) -> ImuSample:
        chip = self._chip
        overflown = self._get(chip.status) & chip.overflown
        count = self._waiting()
        fresh, self._fresh = self._fresh, False
        if count > chip.capacity or (overflown and not fresh):
            cut = f" and {count % FRAME} of them are no whole frame" if count % FRAME else ""
            raise SensorError(
                f"{chip.name}: the FIFO has overflown, {count} bytes{cut}: readings of this cycle are lost",
                SensorCause.OVERFLOW,
            )
        if count % FRAME and not overflown:
            raise self._cut_error(count)
        frames = count // FRAME
        expected = (end - begin) * self.sample_rate
        if frames < 1 or (not fresh and not frames >= 0.5 * expected):
            raise SensorError(f"{chip.name}: expected about {expected:.0f} frames in the FIFO, got {frames}")
        words = self._drain(frames, overflown != 0)
        self._prove()
        if fresh and self._starts > 1 and frames < WHOLE * expected - 1.0:
            return ImuSample(NOTHING, NOTHING)
        sample, rates = self._mean(words)
        self._frames.on_read(end, frames)
        shown = self._frames.end - self._delay
        if not (fresh or overflown):  # else its window may be any
            parts = parts_of(rates, (shown - frames * self._frames.period, shown), begin, end)
            sample = replace(sample, parts=parts)
        if overflown:
            self._empty()
            self._frames.begin()
        return replace(sample, late=end - shown, late_std=window_std(self._frames.std, self._delay))

    def _identify(self) -> None:
        """Check which chip answers."""
        chip = self._chip
        identity = self._get(chip.identity_register)
        if identity not in chip.identities:
            other = family_of(identity)
            hint = f", which is an {other}: name it {other}:BUS" if other else ""
            raise SensorError(
                f"{chip.name}: WHO_AM_I: expected 0x{chip.identities[0]:02x}, got 0x{identity:02x}{hint}",
                SensorCause.IDENTITY,
            )

    def _prove(self) -> None:
        """Check that it is the chip that was found at the start, and that every setting is the one that was made."""
        self._identify()
        for first, values in self._blocks:
            found = self._block(first, len(values))
            for k, (value, got) in enumerate(zip(values, found, strict=True)):
                if got != value:
                    raise SensorError(
                        f"{self._chip.name}: register 0x{first + k:02x}: expected 0x{value:02x}, got 0x{got:02x}",
                        SensorCause.REGISTER,
                    )

    def _waiting(self) -> int:
        """Bytes in the FIFO."""
        high, low = self._block(self._chip.count, 2)
        count = high << 8 | low
        if count % FRAME:  # it may have been read while a frame was being written
            high, low = self._block(self._chip.count, 2)
            count = high << 8 | low
        return count

    def _cut_error(self, count: int) -> SensorError:
        return SensorError(
            f"{self._chip.name}: {count % FRAME} bytes beyond {count // FRAME} whole frames in the FIFO: bytes were "
            "lost, readings of this cycle are",
            SensorCause.LOST_BYTES,
        )

    def _empty(self) -> None:
        for register, value in self._chip.empty:
            self._set(register, value)

    def _drain(self, frames: int, is_full: bool) -> Array:
        """Words (n, 7) of so many frames. Before the last of them and after it, what waits must be whole frames.

        Bytes that are lost on the way would be missing at the end, where an empty FIFO gives others in their place; so
        the count is looked at while there is one frame left.
        """
        taken = self._take((frames - 1) * FRAME)
        left = self._waiting()
        if not is_full and (left % FRAME or left < FRAME):
            raise self._cut_error(left)
        if frames >= STANDS and left >= frames * FRAME:
            raise SensorError(
                f"{self._chip.name}: the FIFO's count stands: {left} bytes after {len(taken)} were read",
                SensorCause.COUNTER,
            )
        words = np.frombuffer(taken + self._take(FRAME), dtype=">i2").reshape(frames, FRAME // 2).astype(np.float64)
        if (left := self._waiting()) % FRAME and not is_full:
            raise self._cut_error(left)
        warmth = words[:, self._chip.warmth_at]
        if float(np.ptp(warmth)) > FARTHEST_WARMTH * self._chip.warmth[0]:
            raise SensorError(
                f"{self._chip.name}: temperatures of the frames of one cycle differ by "
                f"{float(np.ptp(warmth)) / self._chip.warmth[0]:.1f} C: the borders of the frames are lost",
                SensorCause.LOST_BYTES,
            )
        return words

    def _take(self, length: int) -> bytes:
        taken = bytearray()
        while len(taken) < length:
            taken += bytes(self._block(self._chip.fifo, min(BURST, length - len(taken))))
        return bytes(taken)

    def _mean(self, frames: Array) -> tuple[ImuSample, Array]:
        chip = self._chip
        forces = frames[:, chip.force_at : chip.force_at + 3]
        rates = frames[:, chip.rate_at : chip.rate_at + 3]
        force, rate = forces.mean(axis=0) * self._force_lsb, rates.mean(axis=0) * self._rate_lsb
        at_range = (frames >= 32767.0) | (frames <= -32768.0)
        gyro, accelerometer = (np.any(at_range[:, at : at + 3]) for at in (chip.rate_at, chip.force_at))
        saturated = int(gyro) | 2 * int(accelerometer)
        sample = ImuSample(
            (float(rate[0]), float(rate[1]), float(rate[2])),
            (float(force[0]), float(force[1]), float(force[2])),
            float(frames[:, chip.warmth_at].mean()) / chip.warmth[0] + chip.warmth[1],
            saturated,
        )
        return sample, rates[:, 2] * self._rate_lsb

    def _get(self, register: int) -> int:
        return self._block(register, 1)[0]

    def _block(self, register: int, length: int) -> list[int]:
        self._select(register)

        def transfer(bus: Bus) -> list[int]:
            if length == 1:
                return [bus.read_byte_data(self._address, register & 0xFF)]
            return bus.read_i2c_block_data(self._address, register & 0xFF, length)

        # a repeated read of the FIFO would take other bytes than the one that failed
        found: list[int] = self._transfer(register, transfer, 1 if register == self._chip.fifo else TRIES)
        if len(found) != length:
            raise SensorError(
                f"{self._chip.name}: register 0x{register:02x}: expected {length} bytes, got {len(found)}",
                SensorCause.BUS,
            )
        return found

    def _set(self, register: int, value: int) -> None:
        self._select(register)
        self._transfer(register, lambda bus: bus.write_byte_data(self._address, register & 0xFF, value), TRIES)

    def _select(self, register: int) -> None:
        """Choose the bank of a register, where the chip has banks."""
        at, bank = self._chip.bank_select, register >> 8
        if at is None or bank == self._bank:
            return
        self._transfer(at, lambda bus: bus.write_byte_data(self._address, at, bank << 4), TRIES)
        self._bank = bank

    def _transfer(self, register: int, transfer: Callable[[Bus], Any], tries: int) -> Any:
        if self._bus is None:
            raise SensorError(f"{self._chip.name}: not started")
        for attempt in range(tries):
            try:
                return transfer(self._bus)
            except OSError as error:
                if attempt == tries - 1:
                    raise SensorError(
                        f"{self._chip.name}: register 0x{register:02x}: {error}", SensorCause.BUS
                    ) from error
        raise SensorError(f"{self._chip.name}: register 0x{register:02x}: no answer", SensorCause.BUS)


def neighbouring_registers(settings: Settings) -> tuple[tuple[int, tuple[int, ...]], ...]:
    """Settings as blocks of registers that follow on each other: the first of each, and their values."""
    blocks: list[tuple[int, list[int]]] = []
    for register, value in sorted(settings):
        if blocks and register == blocks[-1][0] + len(blocks[-1][1]):
            blocks[-1][1].append(value)
        else:
            blocks.append((register, [value]))
    return tuple((first, tuple(values)) for first, values in blocks)
