"""Registers of an MPU-6500 behind the interface of ``smbus2.SMBus``: what a driver may rely on, and what goes wrong."""

import errno
import math
import struct

G = 9.80665
WRITABLE = {0x19, 0x1A, 0x1B, 0x1C, 0x1D, 0x23, 0x68, 0x6A, 0x6B, 0x6C}
RATE_RANGES, FORCE_RANGES = (250.0, 500.0, 1000.0, 2000.0), (2.0, 4.0, 8.0, 16.0)
CAPACITY = 512


class EmulatedMpu6500:
    """One sensor on a bus. ``live`` lets it sample for a time at a rate (rad/s), a force (m/s^2), a temperature (C)."""

    def __init__(self, address: int = 0x68, identity: int = 0x70) -> None:
        self.address, self.identity = address, identity
        self.fail_next = 0  # transfers that end in an error of the bus
        self.absent = False
        self.deaf: set[int] = set()  # registers that do not take what is written
        self.transfers = 0
        self.opened = 0
        self.reset()

    def connect(self) -> "EmulatedMpu6500":
        self.opened += 1
        return self

    def reset(self) -> None:
        self.registers = dict.fromkeys(range(128), 0)
        self.registers[0x6B] = 0x01
        self.fifo = bytearray()
        self.overflown = False
        self._phase = 0.0

    @property
    def sample_rate(self) -> float:
        return 1000.0 / (1 + self.registers[0x19])

    def live(
        self, seconds: float, rate: tuple[float, ...], force: tuple[float, ...], temperature: float = 25.0
    ) -> None:
        """Fill the FIFO as the sensor would in ``seconds``."""
        self._phase += seconds * self.sample_rate
        count = math.floor(self._phase)
        self._phase -= count
        if self.registers[0x6B] & 0x40 or not self.registers[0x6A] & 0x40 or self.registers[0x23] != 0xF8:
            return
        rate_lsb = math.radians(RATE_RANGES[self.registers[0x1B] >> 3 & 3]) / 32768.0
        force_lsb = FORCE_RANGES[self.registers[0x1C] >> 3 & 3] * G / 32768.0
        for _ in range(count):
            self.push([f / force_lsb for f in force], (temperature - 21.0) * 333.87, [w / rate_lsb for w in rate])

    def push(self, force: list[float], temperature: float, rate: list[float]) -> None:
        """One frame of counts."""
        numbers = [max(-32768, min(32767, round(x))) for x in (*force, temperature, *rate)]
        frame = struct.pack(">7h", *numbers)
        if len(self.fifo) + len(frame) > CAPACITY:
            self.overflown = True
            if self.registers[0x1A] & 0x40:
                return
            del self.fifo[: len(self.fifo) + len(frame) - CAPACITY]
        self.fifo += frame

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        return self.read_i2c_block_data(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        self._transfer(i2c_addr)
        assert register in WRITABLE, f"register 0x{register:02x} is not to be written"
        assert 0 <= value <= 255
        if register == 0x6B and value & 0x80:
            self.reset()
            return
        if register == 0x6A and value & 0x04:
            self.fifo.clear()
            self.overflown = False
            value &= ~0x04
        if register not in self.deaf:
            self.registers[register] = value

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force: bool | None = None) -> list[int]:
        self._transfer(i2c_addr)
        assert 1 <= length <= 32, "SMBus reads at most 32 bytes"
        if register == 0x74:
            taken = list(self.fifo[:length])
            del self.fifo[:length]
            return taken + [0xFF] * (length - len(taken))
        return [self._read(register + k) for k in range(length)]

    def close(self) -> None:
        pass

    def _read(self, register: int) -> int:
        if register == 0x3A:
            value = 0x10 if self.overflown else 0
            self.overflown = False
            return value
        fixed = {0x75: self.identity, 0x72: len(self.fifo) >> 8, 0x73: len(self.fifo) & 0xFF}
        return fixed.get(register, self.registers[register])

    def _transfer(self, address: int) -> None:
        self.transfers += 1
        if self.absent or address != self.address:
            raise OSError(errno.ENXIO, "No such device or address")
        if self.fail_next > 0:
            self.fail_next -= 1
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
