"""Registers of an InvenSense IMU behind the interface of ``smbus2.SMBus``: what a driver relies on, what goes wrong."""

import errno
import math
import struct
from dataclasses import dataclass

G = 9.80665
RATE_RANGES, FORCE_RANGES = (250.0, 500.0, 1000.0, 2000.0), (2.0, 4.0, 8.0, 16.0)
CAPACITY = 512


@dataclass(frozen=True)
class Chip:
    """What the manual of a chip says; a register is its bank times 256 plus its address."""

    identity: int
    after_reset: dict[int, int]
    writable: frozenset[int]
    capacity: int = 512
    warmth: tuple[float, float] = (333.87, 21.0)  # counts for a degree, C at zero
    who_am_i: int = 0x75
    power: int = 0x6B
    user: int = 0x6A
    fifo_reset: tuple[int, int] = (0x6A, 0x04)
    status: int = 0x3A
    count: int = 0x72
    data: int = 0x74
    divider: int = 0x19
    rate: tuple[int, int] = (0x1B, 3)  # register and shift of its range
    force: tuple[int, int] = (0x1C, 3)
    enabled: tuple[int, int] = (0x23, 0xF8)
    stops_when_full: tuple[int, int] = (0x1A, 0x40)
    base: float = 1000.0
    order: str = "ftw"
    bank: int | None = None


PLAIN = {0x19, 0x1A, 0x1B, 0x1C, 0x1D, 0x23, 0x68, 0x6A, 0x6B, 0x6C}
CHIPS = {
    "mpu6500": Chip(0x70, {0x6B: 0x01}, frozenset(PLAIN)),
    "mpu9250": Chip(0x71, {0x6B: 0x01}, frozenset(PLAIN)),
    "mpu6050": Chip(0x68, {0x6B: 0x40}, frozenset(PLAIN - {0x1D}), 1024, (340.0, 36.53), stops_when_full=(0x1A, 0)),
    "icm20948": Chip(
        0xEA,
        {0x06: 0x41, 0x201: 0x01, 0x214: 0x01},
        frozenset({0x03, 0x06, 0x07, 0x67, 0x68, 0x69, 0x200, 0x201, 0x210, 0x211, 0x214}),
        who_am_i=0x00,
        power=0x06,
        user=0x03,
        fifo_reset=(0x68, 0x1F),
        status=0x1B,
        count=0x70,
        data=0x72,
        divider=0x200,
        rate=(0x201, 1),
        force=(0x214, 1),
        enabled=(0x67, 0x1F),
        stops_when_full=(0x69, 0x1F),
        base=1125.0,
        order="fwt",
        bank=0x7F,
    ),
}


class EmulatedMpu:
    """One sensor on a bus. ``live`` lets it sample for a time at a rate (rad/s), a force (m/s^2), a temperature (C)."""

    def __init__(self, address: int = 0x68, identity: int | None = None, chip: str = "mpu6500") -> None:
        self.chip = CHIPS[chip]
        self.address, self.identity = address, self.chip.identity if identity is None else identity
        self.fail_next = 0  # transfers that end in an error of the bus
        self.lose_in: tuple[int, int] | None = None  # reads of the FIFO until bytes are lost, and how many
        self.stands_at: int | None = None  # a count that does not count
        self.absent = False
        self.deaf: set[int] = set()  # registers that do not take what is written
        self.transfers = 0
        self.opened = 0
        self.reset()

    def connect(self) -> "EmulatedMpu":
        self.opened += 1
        return self

    def reset(self) -> None:
        self.registers = {bank << 8 | at: 0 for bank in range(4) for at in range(128)}
        self.registers.update(self.chip.after_reset)
        self.fifo = bytearray()
        self.overflown = False
        self._phase = 0.0
        self._bank = self._to_lose = 0

    @property
    def sample_rate(self) -> float:
        return self.chip.base / (1 + self.registers[self.chip.divider])

    def live(
        self, seconds: float, rate: tuple[float, ...], force: tuple[float, ...], temperature: float = 25.0
    ) -> None:
        """Fill the FIFO as the sensor would in ``seconds``."""
        chip = self.chip
        self._phase += seconds * self.sample_rate
        count = math.floor(self._phase)
        self._phase -= count
        enabled, bits = chip.enabled
        if self.registers[chip.power] & 0x40 or not self.registers[chip.user] & 0x40 or self.registers[enabled] != bits:
            return
        rate_lsb = math.radians(RATE_RANGES[self.registers[chip.rate[0]] >> chip.rate[1] & 3]) / 32768.0
        force_lsb = FORCE_RANGES[self.registers[chip.force[0]] >> chip.force[1] & 3] * G / 32768.0
        scale, zero = chip.warmth
        for _ in range(count):
            self.push([f / force_lsb for f in force], (temperature - zero) * scale, [w / rate_lsb for w in rate])

    def push(self, force: list[float], temperature: float, rate: list[float]) -> None:
        """One frame of counts."""
        parts = {"f": force, "t": [temperature], "w": rate}
        numbers = [max(-32768, min(32767, round(x))) for name in self.chip.order for x in parts[name]]
        frame = struct.pack(">7h", *numbers)
        if len(self.fifo) + len(frame) > self.chip.capacity:
            self.overflown = True
            register, bits = self.chip.stops_when_full
            if bits and self.registers[register] & bits == bits:
                return
            del self.fifo[: len(self.fifo) + len(frame) - self.chip.capacity]
        self.fifo += frame
        del self.fifo[: self._to_lose]
        self._to_lose = 0

    def lose(self, count: int) -> None:
        """Lose the oldest bytes of the next frame, as a transfer that broke off does."""
        self._to_lose = count

    def read_byte_data(self, i2c_addr: int, register: int, force: bool | None = None) -> int:
        return self.read_i2c_block_data(i2c_addr, register, 1)[0]

    def write_byte_data(self, i2c_addr: int, register: int, value: int, force: bool | None = None) -> None:
        self._transfer(i2c_addr)
        assert 0 <= value <= 255
        if register == self.chip.bank:
            self._bank = value >> 4
            return
        place = self._bank << 8 | register
        assert place in self.chip.writable, f"register 0x{place:02x} is not to be written"
        if place == self.chip.power and value & 0x80:
            self.reset()
            return
        at, bits = self.chip.fifo_reset
        if place == at and value & bits:
            self.fifo.clear()
            self.overflown = False
            value &= ~bits
        if place not in self.deaf:
            self.registers[place] = value

    def read_i2c_block_data(self, i2c_addr: int, register: int, length: int, force: bool | None = None) -> list[int]:
        self._transfer(i2c_addr)
        assert 1 <= length <= 32, "SMBus reads at most 32 bytes"
        place = self._bank << 8 | register
        if place == self.chip.data:
            if self.lose_in is not None:
                reads, count = self.lose_in
                if reads == 0:
                    del self.fifo[:count]
                self.lose_in = (reads - 1, count) if reads else None
            taken = list(self.fifo[:length])
            del self.fifo[:length]
            return taken + [0xFF] * (length - len(taken))
        return [self._read(place + k) for k in range(length)]

    def close(self) -> None:
        pass

    def _read(self, register: int) -> int:
        chip = self.chip
        if register == chip.status:
            value = 0x10 if self.overflown else 0
            self.overflown = False
            return value
        count = len(self.fifo) if self.stands_at is None else self.stands_at
        fixed = {chip.who_am_i: self.identity, chip.count: count >> 8, chip.count + 1: count & 0xFF}
        return fixed.get(register, self.registers[register])

    def _transfer(self, address: int) -> None:
        self.transfers += 1
        if self.absent or address != self.address:
            raise OSError(errno.ENXIO, "No such device or address")
        if self.fail_next > 0:
            self.fail_next -= 1
            raise OSError(errno.EREMOTEIO, "Remote I/O error")
