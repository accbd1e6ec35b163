"""A chip's node compiled for this machine, between endpoints of the product, in told time: no clock, no process."""

from __future__ import annotations

import ctypes
import math
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from c_library import CHECKED_LIBRARY, compile_checked

from node.firmware.event_words import EVENTS_HEADER, write_event_table
from node.firmware.node_image import IMAGE, LOADER, LOADER_TEXT, provision_node
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.integer_node import READING_SCALES
from node.kernels.record.node_record import READING
from node.kernels.record.sensor_record import MAX_IMUS
from node.translation.c_file import CODE
from node.translation.firmware_build import FirmwareRequest, build_firmware
from node.translation.orders_file import ORDERS_CODE
from telemetry.application.endpoint import Endpoint
from telemetry.media.can_exchange import CanExchange
from telemetry.media.port import MAX_FRAME
from telemetry.media.send_queue import SendQueue
from telemetry.messages import ENCODER, Side
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec
from telemetry.presentation.can_native import NativeProfile

FIRMWARE = Path(__file__).parents[2] / "firmware"
SHIM = Path(__file__).parent / "node_shim.c"
GRAVITY = 9.80665
NOTHING, FD = 255, 64
STEP_US = 5000
EXCHANGES, WRONG_ABOVE, WRONG_BELOW, BOOTS, NEXT_NUMBER, OVERFLOWS, KEPT_BYTES, BLOCK_VERSION = range(8)
UNTRUSTED, ANSWERED = 8, 9


def build_node(folder: Path) -> None:
    """Compile the node's C; an undefined operation in what is written by hand ends the process that runs it."""
    build_firmware(FirmwareRequest("c", MAX_IMUS, folder))
    codec = write_native_codec()
    for name, text in ((NATIVE_HEADER, codec.header), (NATIVE_CODE, codec.code), (EVENTS_HEADER, write_event_table())):
        (folder / name).write_text(text)
    (folder / LOADER).write_text(LOADER_TEXT)
    own = [*FIRMWARE.glob("*.c"), *(FIRMWARE / "tube").glob("*.c"), SHIM]
    includes = ("-I.", f"-I{FIRMWARE}", f"-I{FIRMWARE / 'tube'}", "-Wno-array-bounds", "-DCHIP_END_ROOM=480u")
    step = ["gcc", "-std=c99", "-O1", "-fwrapv", "-fPIC", "-c", CODE, ORDERS_CODE, NATIVE_CODE]  # checked elsewhere
    subprocess.run(step, cwd=folder, check=True)
    objects = [str(Path(name).with_suffix(".o")) for name in (CODE, ORDERS_CODE, NATIVE_CODE)]
    compile_checked(folder, [*objects, *own], *includes)


def load_node(folder: Path) -> ctypes.CDLL:
    """The library of a folder in which the node was compiled."""
    library = ctypes.CDLL(str(folder / CHECKED_LIBRARY))
    library.shim_number.restype = ctypes.c_int64
    library.shim_key(None)
    library.shim_page(b"", 0)
    library.shim_next.restype = ctypes.c_uint8
    return library


class PowerFailedError(Exception):
    """The chip's power is gone."""


class ChipNode:
    """The node, on a clock that may be off."""

    def __init__(self, library: ctypes.CDLL, image: bytes, settings: TubeSettings, clock_off_us: int = 0) -> None:
        self._library, self._image, self._settings, self._off = library, image, settings, clock_off_us
        library.shim_clear()
        self.begin(0)

    def begin(self, now_us: int) -> None:
        """Start, as after a power cut."""
        var = round(self._settings.mount_std**2 * 2.0**56)
        arguments = (self._image, len(self._image), self._settings.tube, ctypes.c_int64(var), 7, self._own(now_us))
        assert self._library.shim_begin(*arguments) == 1

    def _own(self, now_us: int) -> ctypes.c_int64:
        return ctypes.c_int64(now_us + self._off)

    def _alive(self, answer: int) -> None:
        if answer < 0:
            raise PowerFailedError

    def read_sensor(self, rate: tuple[float, ...], force: tuple[float, ...], now_us: int) -> None:
        """A cycle's means, rad/s and m/s^2."""
        row = np.zeros(MAX_IMUS * READING, np.int64)
        values = (*rate, *(component / GRAVITY for component in force), 25.0)
        row[:7] = [round(value * scale) for value, scale in zip(values, READING_SCALES[:7], strict=True)]
        self._alive(self._library.shim_readings(row.ctypes.data_as(ctypes.c_void_p), self._own(now_us)))

    def advance(self, now_us: int) -> None:
        self._alive(self._library.shim_advance(self._own(now_us)))

    def on_frame(self, side: Side, identifier: int, data: bytes, now_us: int) -> None:
        self._alive(self._library.shim_frame(int(side), identifier, data, len(data), self._own(now_us)))

    def next_frame(self, side: Side, now_us: int) -> tuple[int, bytes] | None:
        identifier, data = ctypes.c_uint32(), (ctypes.c_uint8 * FD)()
        length = self._library.shim_next(int(side), ctypes.byref(identifier), data, self._own(now_us))
        if length == NOTHING:
            return None
        self._library.shim_acknowledged(int(side))
        return identifier.value, bytes(data)[:length]

    def power_fails_after(self, words: int) -> None:
        self._library.shim_power(ctypes.c_long(words))

    def number(self, which: int) -> int:
        return int(self._library.shim_number(which))


class Neighbour:
    """An endpoint of the product with its exchange, at the other end of one of the chip's joints."""

    def __init__(self, endpoint: Endpoint, side: Side) -> None:
        self.endpoint, self.side = endpoint, side
        endpoint.limit_bundles(side, 0)  # as a port of CAN does
        self.exchange = CanExchange(endpoint.address, FD, SendQueue(MAX_FRAME), 9, 0.0, NativeProfile())
        self.heard: list[Any] = []

    def next_frame(self, now: float) -> tuple[int, bytes] | None:
        for _, frame in self.endpoint.take_frames(now):
            self.exchange.queue.offer(frame)
        self.exchange.advance(now)
        found = self.exchange.next_frame(now)
        if found is None:
            return None
        self.exchange.on_acknowledged(now)
        return found.identifier, found.data

    def on_frame(self, identifier: int, data: bytes, now: float) -> None:
        content = self.exchange.on_frame(identifier, data, now)
        if content is not None:
            self.heard += [received.message for received in self.endpoint.receive(self.side, content, now)]


class ChipBetween:
    """An end above, the chip, an end below; time is told in steps of ``STEP_US``.

    ``lose`` says of each frame whether it is lost on its way.
    """

    def __init__(self, chip: ChipNode, above: Neighbour, below: Neighbour | None = None) -> None:
        self.chip, self.above, self.below = chip, above, below
        self.now_us = 1_000_000
        self.lose: Callable[[], bool] = lambda: False
        self.cycle_due_us = self.now_us
        self.motion: Callable[[float], float] = lambda at: 0.0  # rad/s at a rig time
        self.random = np.random.default_rng(5)
        self.after_cycle: Callable[[float], None] = lambda now: None

    @property
    def now(self) -> float:
        """Rig time, s."""
        return self.now_us / 1e6

    def _joints(self) -> Iterator[tuple[Neighbour, Side]]:
        yield self.above, Side.UPPER
        if self.below is not None:
            yield self.below, Side.LOWER

    def step(self) -> None:
        """What happens in one step of time."""
        self.now_us += STEP_US
        if self.now_us >= self.cycle_due_us:
            self.cycle_due_us += round(PERIOD * 1e6)
            noise = self.random.normal(0.0, 1.0, 6)
            rate = (*(1e-4 * noise[:2]), self.motion(self.now) + 1e-4 * noise[2])
            force = (3e-3 * noise[3], 0.34 + 3e-3 * noise[4], -9.8 + 3e-3 * noise[5])
            self.chip.read_sensor(rate, force, self.now_us)
            self.after_cycle(self.now)
        self.chip.advance(self.now_us)
        for neighbour, side in self._joints():
            neighbour.endpoint.advance(self.now)
            if (into := neighbour.next_frame(self.now)) is not None and not self.lose():
                self.chip.on_frame(side, *into, self.now_us)
            if (out := self.chip.next_frame(side, self.now_us)) is not None and not self.lose():
                neighbour.on_frame(*out, self.now)

    def run(self, seconds: float) -> None:
        """So many seconds of rig time."""
        end = self.now_us + round(seconds * 1e6)
        while self.now_us < end:
            self.step()

    def run_until(self, holds: Callable[[], bool], seconds: float) -> None:
        """Until something is so, which it must be within so many seconds."""
        end = self.now_us + round(seconds * 1e6)
        while not holds():
            assert self.now_us < end
            self.step()


def image_of(settings: TubeSettings, folder: Path) -> bytes:
    """Image that the chip of a tube begins with."""
    provision_node(settings, MAX_IMUS, folder)  # of eight IMUs: that of one is another process's work
    return (folder / IMAGE).read_bytes()


def encoder_above(boots: int = 3) -> Neighbour:
    """The encoder, whose clock is rig time."""
    endpoint = Endpoint(ENCODER, frozenset({Side.LOWER}), boot_count=boots, is_clock_root=True)
    return Neighbour(endpoint, Side.LOWER)


def wrapped(angle: float) -> float:
    """An angle in (-pi, pi]."""
    return math.remainder(angle, math.tau)
