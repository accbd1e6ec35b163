"""Lines of a GPIO chip against a kernel in a pipe, byte by byte as linux/gpio.h lays its structs out; what a decoder
of two lines and an index makes of each edge, at each of its bounds."""

from __future__ import annotations

import contextlib
import ctypes
import errno
import fcntl
import os
from pathlib import Path
from typing import Any

import pytest

from node.errors import SensorCause, SensorError
from node.process.drivers import gpio_lines
from node.process.drivers.gpio_encoder import ALONE, WIDTH, GpioEncoder
from node.process.drivers.gpio_lines import ChipLines, LineEdge

U32, U64, I32 = ctypes.c_uint32, ctypes.c_uint64, ctypes.c_int32
TURN = 4096  # counts


class LineAttribute(ctypes.Structure):
    _fields_ = [("id", U32), ("padding", U32), ("value", U64)]


class ConfigAttribute(ctypes.Structure):
    _fields_ = [("attribute", LineAttribute), ("mask", U64)]


class LineConfig(ctypes.Structure):
    _fields_ = [("flags", U64), ("count", U32), ("padding", U32 * 5), ("attributes", ConfigAttribute * 10)]


class LineRequest(ctypes.Structure):
    _fields_ = [
        ("offsets", U32 * 64),
        ("consumer", ctypes.c_char * 32),
        ("config", LineConfig),
        ("num_lines", U32),
        ("event_buffer_size", U32),
        ("padding", U32 * 5),
        ("fd", I32),
    ]


class LineValues(ctypes.Structure):
    _fields_ = [("bits", U64), ("mask", U64)]


class LineEvent(ctypes.Structure):
    _fields_ = [("ns", U64), ("id", U32), ("offset", U32), ("seqno", U32), ("line_seqno", U32), ("padding", U32 * 6)]


def request_code(number: int, struct: type[ctypes.Structure]) -> int:
    """_IOWR(0xB4, number, struct) of asm-generic/ioctl.h: direction, size, type and number."""
    return (2 | 1) << 30 | ctypes.sizeof(struct) << 16 | 0xB4 << 8 | number


class Kernel:
    """The character device of a chip: what was asked of it, the levels it shows, and a pipe of events."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.read_end, self.write_end = os.pipe()
        self.asked: list[LineRequest] = []
        self.masks: list[int] = []
        self.bits = 0
        self.refuses = 0
        monkeypatch.setattr(gpio_lines.fcntl, "ioctl", self.ioctl)

    def ioctl(self, file: int, code: int, data: bytes) -> bytes:
        if self.refuses:
            raise OSError(self.refuses, os.strerror(self.refuses))
        if code == request_code(0x07, LineRequest):
            request = LineRequest.from_buffer_copy(data)
            self.asked.append(request)
            assert request.fd == -1
            request.fd = self.read_end
            return bytes(request)
        assert code == request_code(0x0E, LineValues)
        assert file == self.read_end
        values = LineValues.from_buffer_copy(data)
        self.masks.append(values.mask)
        values.bits = self.bits & values.mask
        return bytes(values)

    def say(self, *events: LineEvent) -> None:
        os.write(self.write_end, b"".join(map(bytes, events)))


@pytest.fixture
def kernel(monkeypatch: pytest.MonkeyPatch) -> Any:
    made = Kernel(monkeypatch)
    yield made
    for end in (made.read_end, made.write_end):
        with contextlib.suppress(OSError):  # the lines were given back
            os.close(end)


def open_files() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def test_structs_are_as_long_as_the_kernel_s() -> None:
    assert (ctypes.sizeof(LineRequest), ctypes.sizeof(LineValues), ctypes.sizeof(LineEvent)) == (592, 16, 48)


@pytest.mark.parametrize("lines", [(17, 27), (5, 6, 300)])
def test_lines_are_asked_for_as_inputs_with_both_edges(kernel: Kernel, tmp_path: Path, lines: tuple[int, ...]) -> None:
    chip = tmp_path / "gpiochip0"
    chip.touch()
    taken = ChipLines(chip, lines)
    (request,) = kernel.asked
    assert tuple(request.offsets)[: len(lines)] == lines
    assert not any(tuple(request.offsets)[len(lines) :])
    assert request.consumer == b"borechain"
    assert request.num_lines == len(lines)
    assert request.event_buffer_size == 4096
    assert request.config.flags == 0b110100  # INPUT, EDGE_RISING, EDGE_FALLING
    assert request.config.count == 0
    assert not any([*request.padding, *request.config.padding, *bytes(request.config.attributes)])
    kernel.bits = 0b1101
    assert taken.levels() == (1, 0, 1)[: len(lines)]
    assert kernel.masks == [(1 << len(lines)) - 1]
    taken.close()
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(kernel.read_end)


def test_events_are_edges_in_their_order_and_none_is_waited_for(kernel: Kernel, tmp_path: Path) -> None:
    chip = tmp_path / "gpiochip0"
    chip.touch()
    taken = ChipLines(chip, (17, 27))
    assert taken.edges() == []  # and it came back
    kernel.say(LineEvent(1_500_000_000, 1, 17, 8, 3), LineEvent(1_500_000_700, 2, 27, 9, 5))
    found = taken.edges()
    assert [(edge.line, edge.level, edge.number) for edge in found] == [(17, 1, 8), (27, 0, 9)]
    assert [edge.at for edge in found] == pytest.approx([1.5, 1.5000007], abs=1e-10)
    kernel.say(*(LineEvent(k, 2 - k % 2, 17, k, k) for k in range(1, 1201)))  # 57 600 bytes
    assert [edge.number for edge in taken.edges()] == list(range(1, 1201))
    os.write(kernel.write_end, bytes(48 + 5))
    with pytest.raises(SensorError, match=r"^gpio: 5 bytes beyond whole events of 48$") as refused:
        taken.edges()
    assert refused.value.cause is SensorCause.LOST_BYTES


def test_what_a_chip_refuses_is_named_with_the_chip(kernel: Kernel, tmp_path: Path) -> None:
    chip = tmp_path / "gpiochip0"
    with pytest.raises(SensorError, match=rf"^gpio: {chip}: No such file or directory$"):
        ChipLines(chip, (17, 27))
    chip.touch()
    kernel.refuses = errno.EBUSY
    open_before = open_files()
    with pytest.raises(SensorError, match=rf"^gpio: {chip}: lines 17, 27: Device or resource busy$"):
        ChipLines(chip, (17, 27))
    assert open_files() == open_before  # the chip was closed again
    kernel.refuses = 0
    taken = ChipLines(chip, (17, 27))
    assert open_files() == open_before
    kernel.refuses = errno.ENODEV
    with pytest.raises(SensorError, match=rf"^gpio: {chip}: No such device$") as gone:
        taken.levels()
    assert gone.value.cause is SensorCause.BUS
    taken.close()
    with pytest.raises(SensorError, match=rf"^gpio: {chip}: Bad file descriptor: the chip is gone$"):
        taken.edges()


def test_a_pipe_is_made_one_that_never_blocks(kernel: Kernel, tmp_path: Path) -> None:
    chip = tmp_path / "gpiochip0"
    chip.touch()
    assert not fcntl.fcntl(kernel.read_end, fcntl.F_GETFL) & os.O_NONBLOCK
    ChipLines(chip, (1,))
    assert fcntl.fcntl(kernel.read_end, fcntl.F_GETFL) & os.O_NONBLOCK


class Wires:
    """Lines 4 and 9, and an index on 2, whose edges are said by hand."""

    def __init__(self) -> None:
        self.waiting: list[LineEdge] = []
        self.level = [0, 0]
        self.later: list[list[LineEdge]] = []  # that come after the first edges of a read
        self.number = self.closed = 0
        self.now = 1.0

    def turn(self, counts: int) -> None:
        """Turn by so many counts: forward B leads, as in the table of a quadrature 00 01 11 10."""
        for _ in range(abs(counts)):
            same = self.level[0] == self.level[1]
            line = 1 if same == (counts > 0) else 0
            self.level[line] ^= 1
            self.add(LineEdge(self.now, (4, 9)[line], self.level[line], self.number + 1))

    def index(self, level: int = 1) -> None:
        self.add(LineEdge(self.now, 2, level, self.number + 1))

    def add(self, edge: LineEdge) -> None:
        self.number = edge.number
        self.now += 0.001
        self.waiting.append(edge)

    def edges(self) -> list[LineEdge]:
        found, self.waiting = self.waiting, (self.later.pop(0) if self.later else [])
        return found

    def levels(self) -> tuple[int, ...]:
        return (self.level[0], self.level[1], 0)

    def close(self) -> None:
        self.closed += 1


def encoder_on(wires: Wires, lines: tuple[int, ...] = (4, 9)) -> GpioEncoder:
    encoder = GpioEncoder(lambda: wires, lines)
    encoder.start()
    return encoder


def test_the_twelve_last_edges_of_one_sense_are_told_the_newest_first() -> None:
    wires = Wires()
    encoder = encoder_on(wires)
    wires.turn(20)
    sample = encoder.read(5.0)
    assert (sample.count, sample.rising) == (20, True)
    assert sample.edge_at == pytest.approx(1.019)
    assert sample.earlier == pytest.approx(tuple(1.018 - 0.001 * k for k in range(11)))
    wires.turn(-2)
    sample = encoder.read(6.0)
    assert (sample.count, sample.rising, sample.edge_at) == (18, False, pytest.approx(1.021))
    assert sample.earlier == pytest.approx((1.020,))  # those of the other sense are forgotten
    assert encoder.read(7.0) == sample


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("off", "holds"), [(WIDTH, True), (WIDTH + 1, False), (-WIDTH, True), (-WIDTH - 1, False)])
def test_whole_turns_lie_between_two_index_pulses_to_their_width(sign: int, off: int, holds: bool) -> None:
    wires = Wires()
    encoder = encoder_on(wires, (4, 9, 2))
    wires.turn(7)
    wires.index()
    wires.index(0)  # its end tells nothing
    wires.turn(sign * (2 * TURN + off))
    wires.index()
    if holds:
        assert encoder.read(5.0).count == 7 + sign * (2 * TURN + off)
        return
    with pytest.raises(SensorError, match=rf"between two index pulses, got {2 * TURN + off}: another") as refused:
        encoder.read(5.0)
    assert refused.value.cause is SensorCause.RESOLUTION


@pytest.mark.parametrize("line", [0, 1])
@pytest.mark.parametrize("edges", [ALONE - 1, ALONE])
def test_a_line_is_silent_beside_exactly_so_many_edges_of_the_other(line: int, edges: int) -> None:
    wires = Wires()
    encoder = encoder_on(wires)
    for _ in range(edges):
        wires.level[line] ^= 1
        wires.add(LineEdge(wires.now, (4, 9)[line], wires.level[line], wires.number + 1))
    if edges < ALONE:
        assert encoder.read(5.0).count in (-1, 0, 1)
        return
    with pytest.raises(SensorError, match=rf"^gpio: line {(9, 4)[line]} is silent beside 200 edges$") as refused:
        encoder.read(5.0)
    assert refused.value.cause is SensorCause.COUNTER


@pytest.mark.parametrize("missing", [1, 3])
def test_edges_that_are_missing_are_counted_and_a_start_counts_on(missing: int) -> None:
    wires = Wires()
    encoder = encoder_on(wires)
    wires.turn(5)
    assert encoder.read(5.0).count == 5
    wires.number += missing
    wires.turn(1)
    with pytest.raises(SensorError, match=rf"^gpio: {missing} edges were lost$") as refused:
        encoder.read(6.0)
    assert refused.value.cause is SensorCause.OVERFLOW
    wires.number += 100
    encoder.start()
    assert wires.closed == 1
    wires.turn(-2)
    sample = encoder.read(7.0)
    assert (sample.count, len(sample.earlier)) == (3, 1)  # nothing is left of the numbers and edges of before


def test_two_edges_to_one_level_and_levels_that_contradict_are_named() -> None:
    wires = Wires()
    encoder = encoder_on(wires)
    wires.turn(1)
    last = wires.waiting[0]
    wires.add(LineEdge(2.0, last.line, last.level, last.number + 1))
    with pytest.raises(SensorError, match=rf"^gpio: line {last.line}: two edges to level 1 in a row$"):
        encoder.read(5.0)
    encoder.start()
    wires.level[0] ^= 1
    with pytest.raises(SensorError, match=r"^gpio: the levels of the lines contradict the edges$") as refused:
        encoder.read(6.0)
    assert refused.value.cause is SensorCause.COUNTER


def test_an_edge_that_comes_while_the_levels_are_read_is_counted_with_them() -> None:
    wires = Wires()
    encoder = encoder_on(wires)
    wires.turn(3)
    first, last = wires.waiting[:2], wires.waiting[2:]
    wires.waiting, wires.later = first, [last]
    assert encoder.read(5.0).count == 3


def test_an_encoder_that_was_not_started_says_so() -> None:
    encoder = GpioEncoder(Wires, (4, 9))
    with pytest.raises(SensorError, match=r"^gpio: not started$"):
        encoder.read(1.0)
    encoder.start()
    encoder.close()
    with pytest.raises(SensorError, match=r"^gpio: not started$"):
        encoder.read(2.0)
