"""A chip on a serial line as one end of a joint: orders and garbage, what it is told, a chip and a bus that go."""

from __future__ import annotations

import contextlib
import os
import select
import subprocess
import sys
import threading
import time
import tty
from collections.abc import Iterator
from pathlib import Path

import pytest
from c_isotp import Inward, Outward, load_isotp
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st
from needed_programs import needs_gcc
from waiting import PATIENCE, until

from borechain.cli.link.link import link
from sim.can.can_hub import CanHub, running_hub
from telemetry.errors import MediumError
from telemetry.media.can_identifier import FLOW_CONTROL, PRESENCE, TUNNEL, Identifier, packed_identifier
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_medium import FRAMES, CanSettings
from telemetry.media.can_port import open_controller
from telemetry.media.can_timing import FD_LENGTHS
from telemetry.media.chip_bridge import ChipBridge
from telemetry.media.media_table import open_medium
from telemetry.media.port import PortFrame, Priority, TubeEnd
from telemetry.media.serial_line import SerialLine
from telemetry.media.slcan import SlcanAdapter, SlcanFrame
from telemetry.messages import Side

CHIP, TUBE = 2, 1


def opened(*, fd: bool) -> SlcanAdapter:
    adapter = SlcanAdapter(fd=fd)
    assert adapter.take(b"\r\rC\rS6\rY2\rO\r") == ([], b"\r\r\r\r\r\r")
    return adapter


@pytest.mark.parametrize(
    ("fd", "line", "frame"),
    [
        (False, b"T0420200030102FF\r", SlcanFrame(0x04202000, b"\x01\x02\xff")),
        (False, b"T1FFFFFFF0\r", SlcanFrame(0x1FFFFFFF, b"")),
        (True, b"B04202000D" + b"0a" * 32 + b"\r", SlcanFrame(0x04202000, b"\n" * 32)),
        (True, b"D04202000F" + b"00" * 64 + b"\r", SlcanFrame(0x04202000, bytes(64))),
        (True, b"B0420200080102030405060708\r", SlcanFrame(0x04202000, bytes(range(1, 9)))),
    ],
)
def test_frames_are_read_as_the_manual_has_them(fd: bool, line: bytes, frame: SlcanFrame) -> None:
    adapter = opened(fd=fd)
    assert adapter.take(line) == ([frame], b"")  # answered once the bus has acknowledged it
    assert adapter.take(adapter.told(frame)) == ([frame], b"")
    assert not adapter.counters


@given(st.integers(0, 2**29 - 1), st.sampled_from(FD_LENGTHS), st.integers(0, 255), st.booleans(), st.data())
def test_a_frame_told_is_the_frame_read_however_it_is_cut(
    identifier: int, length: int, byte: int, fd: bool, data: st.DataObject
) -> None:
    adapter = opened(fd=fd)
    frame = SlcanFrame(identifier, bytes([byte] * (length if fd else min(length, 8))))
    line = adapter.told(frame) + adapter.told(frame)
    cut = data.draw(st.integers(0, len(line)))
    first, second = adapter.take(line[:cut]), adapter.take(line[cut:])
    assert first[0] + second[0] == [frame, frame]


GARBAGE = (
    b"X", b"T0420200", b"T2420200000", b"T042020009" + b"00" * 12, b"T042020003010", b"T04202000301020G", b"t1230",
    b"R042020000", b"Z1", b"S9", b"L", b"\x00\xff\xfe", b"B" * 500, b"O\n",
)  # fmt: skip


@pytest.mark.parametrize("line", GARBAGE)
def test_garbage_is_answered_with_a_bell_and_the_next_frame_is_read(line: bytes) -> None:
    adapter = opened(fd=False)
    assert adapter.take(line + b"\r") == ([], b"\a")
    assert adapter.counters == {"garbage": 1}
    assert [line.startswith(shown) for shown in adapter.garbage] == [True]
    assert adapter.take(b"T042020000\r")[0] == [SlcanFrame(0x04202000, b"")]


def test_a_chip_that_resets_in_the_middle_of_a_frame_loses_that_frame_alone() -> None:
    adapter = opened(fd=True)
    assert adapter.take(b"B04202000D0a0a") == ([], b"")
    assert adapter.take(b"\rC\rO\r") == ([], b"\a\r\r")
    assert adapter.take(b"B042020000\r")[0] == [SlcanFrame(0x04202000, b"")]


@pytest.mark.parametrize(("fd", "line"), [(False, b"B042020000\r"), (True, b"T042020000\r")])
def test_frames_of_the_other_kind_are_named(fd: bool, line: bytes) -> None:
    adapter = opened(fd=fd)
    assert adapter.take(line) == ([], b"\a")
    assert adapter.counters == {"other_frames": 1}


def test_a_chip_that_has_not_opened_neither_sends_nor_hears() -> None:
    adapter = SlcanAdapter(fd=False)
    assert adapter.take(b"T042020000\r") == ([], b"\a")
    assert adapter.counters == {"not_open": 1}
    assert adapter.told(SlcanFrame(5, b"")) == b""
    assert adapter.take(b"V\rN\rF\r") == ([], b"V1013\rNBC01\rF00\r")


@given(st.lists(st.binary(max_size=300), max_size=20), st.booleans())
def test_any_bytes_leave_no_more_than_a_line(received: list[bytes], fd: bool) -> None:
    adapter = SlcanAdapter(fd=fd)
    for part in received:
        _, answers = adapter.take(part)
        assert len(answers) <= 6 * (part.count(b"\r") + 1)
    assert len(adapter._line) <= 138
    assert len(adapter.garbage) <= 8


class ChipEnd:
    """The chip's side of a pseudo terminal."""

    def __init__(self, stack: contextlib.ExitStack) -> None:
        self._file, other = os.openpty()
        tty.setraw(self._file)
        self.path = Path(os.ttyname(other))
        self.rest = b""
        stack.callback(self.leave)
        stack.callback(os.close, other)

    def leave(self) -> None:
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def say(self, content: bytes) -> None:
        while content:
            content = content[os.write(self._file, content) :]

    def hear(self) -> bytes:
        """The next line."""
        deadline = time.monotonic() + PATIENCE
        while b"\r" not in self.rest:
            assert select.select([self._file], [], [], deadline - time.monotonic())[0], "no line came"
            self.rest += os.read(self._file, 4096).replace(b"\a", b"\a\r")
        line, _, self.rest = self.rest.partition(b"\r")
        return line


@pytest.fixture
def stack() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as opened_things:
        yield opened_things


@pytest.fixture
def hub(stack: contextlib.ExitStack) -> CanHub:
    return stack.enter_context(running_hub())


def start_bridge(stack: contextlib.ExitStack, chip: ChipEnd, hub: CanHub, frames: str) -> ChipBridge:
    """A bridge between a chip and the joint of two tubes."""
    register_loopback()
    settings = CanSettings.parse(f"{hub.port}/rig/{CHIP}-{TUBE},interface={INTERFACE},frames={frames}")
    line, is_fd = SerialLine(chip.path, 115200), frames == "fd"
    stack.callback(line.close)
    controller = open_controller(lambda: settings.open_bus(""), "chip", FRAMES[frames] == 64, None)
    stack.callback(controller.shutdown)
    bridge = ChipBridge(line, controller, fd=is_fd, tell=lambda said: None)
    thread = threading.Thread(target=bridge.run)
    thread.start()
    stack.callback(thread.join)
    stack.callback(bridge.stop)
    return bridge


@needs_gcc
@pytest.mark.parametrize("frames", ["fd", "classic"])
def test_a_chips_isotp_and_a_tubes_port_send_to_each_other(
    stack: contextlib.ExitStack, hub: CanHub, tmp_path: Path, frames: str
) -> None:
    isotp, chip, adapter = load_isotp(tmp_path), ChipEnd(stack), SlcanAdapter(fd=frames == "fd")
    adapter.is_open = True  # it reads and writes the same letters at this end
    start_bridge(stack, chip, hub, frames)
    chip.say(b"\r\rC\rO\r")
    assert [chip.hear() for _ in range(4)] == [b""] * 4
    medium = stack.enter_context(open_medium(f"can:{hub.port},interface={INTERFACE},frames={frames}"))
    port = medium.open_port(TubeEnd("rig", TUBE, Side.UPPER, CHIP))
    arrived: list[bytes] = []
    port.listen(lambda payload: arrived.append(bytes(payload)))
    up, down = bytes(range(256)) + b"up" * 30, b"down" * 80
    port.send(PortFrame(down, Priority.BLOCK, None))
    outward, inward, heard = Outward(isotp, up, FRAMES[frames]), Inward(isotp, 500), b""
    is_in_flight, waiting = False, [SlcanFrame(packed_identifier(Priority.HELLO, PRESENCE, CHIP), bytes(8))]
    while not heard or outward.is_open or waiting or not arrived:
        if not is_in_flight:
            if not waiting and (data := outward.next_frame()):
                waiting.append(SlcanFrame(packed_identifier(Priority.SURVEY, TUNNEL, CHIP), data))
            if waiting:
                chip.say(adapter.told(waiting.pop(0)))
                is_in_flight = True
        line = chip.hear()
        if line == b"Z":
            assert is_in_flight
            is_in_flight = False
            continue
        ((bits, data),), _ = adapter.take(line + b"\r")
        identifier = Identifier.unpack(bits)
        assert identifier is not None
        assert identifier.source == TUBE
        if identifier.type == FLOW_CONTROL:
            assert outward.on_flow(data) is None
        elif identifier.type == TUNNEL:
            came = inward.on_frame(data)
            heard = came if isinstance(came, bytes) else heard
            assert not isinstance(came, str)
            if (flow := inward.take_flow()) is not None:
                waiting.append(SlcanFrame(packed_identifier(identifier.priority, FLOW_CONTROL, CHIP), flow))
    assert heard == down
    assert arrived == [up]


def test_a_frame_that_nobody_takes_is_not_acknowledged_until_a_tube_comes(
    stack: contextlib.ExitStack, hub: CanHub
) -> None:
    chip = ChipEnd(stack)
    bridge = start_bridge(stack, chip, hub, "fd")
    chip.say(b"O\r")
    assert chip.hear() == b""
    chip.say(b"B042020000\rV\r")
    assert chip.hear() == b"V1013"  # the frame before it is still on its way
    until(lambda: bridge.counters["from_chip"] == 1)
    medium = stack.enter_context(open_medium(f"can:{hub.port},interface={INTERFACE}"))
    medium.open_port(TubeEnd("rig", TUBE, Side.UPPER, CHIP))
    lines = {chip.hear()}
    while b"Z" not in lines:
        lines.add(chip.hear())


def test_a_chip_that_is_gone_is_one_line(stack: contextlib.ExitStack, hub: CanHub) -> None:
    chip = ChipEnd(stack)
    words = ["link", "chip", "--line", str(chip.path), "--bus", f"{hub.port}/any,interface={INTERFACE}"]
    command = [sys.executable, "-m", "borechain", *words]
    with subprocess.Popen(command, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        assert process.stderr.readline() == f"chip at {chip.path}, segment {hub.port}/any\n"
        chip.say(b"hello\r")
        assert process.stderr.readline() == "chip: expected an order of SLCAN, got b'hello' (1 so far)\n"
        chip.leave()
        said = process.stderr.read().splitlines()
    assert said == ["carried: garbage 1", f"Error: {chip.path}: expected a device at the line, it is gone"]
    assert process.returncode == 1


def ask(*words: str | Path) -> tuple[int, list[str]]:
    done = CliRunner().invoke(link, ["chip", *map(str, words)])
    return done.exit_code, done.output.strip().splitlines()


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("/dev/none", "/dev/none: expected a serial line, got none: No such file or directory"),
        ("/dev/null", "/dev/null: expected a serial line, got something else"),
    ],
)
def test_a_line_that_is_none_is_named(line: str, says: str) -> None:
    assert ask("--line", line, "--bus", "can0") == (1, [f"Error: {says}"])


def test_a_file_is_no_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    code, lines = ask("--line", tmp_path / "file", "--bus", "can0")
    assert (code, len(lines)) == (1, 1)
    assert "expected a serial line, got something else" in lines[0]


@pytest.mark.parametrize(
    ("bus", "code", "says"),
    [
        ("", 2, "expected a channel"),
        ("can0,colour=red", 2, "got colour=red"),
        (f"1/any,interface={INTERFACE}", 1, "no hub answers"),
    ],
)
def test_a_bus_that_is_none_is_named(stack: contextlib.ExitStack, bus: str, code: int, says: str) -> None:
    answered, lines = ask("--line", ChipEnd(stack).path, "--bus", bus)
    assert (answered, len(lines)) == (code, 1)
    assert says in lines[0]


def test_a_line_without_a_reader_is_lost_and_named(stack: contextlib.ExitStack) -> None:
    chip = ChipEnd(stack)
    line = SerialLine(chip.path, 115200)
    assert line.receive(0.0) == b""
    chip.say(b"x")
    assert line.receive(PATIENCE) == b"x"
    chip.leave()
    with pytest.raises(MediumError, match="expected a device at the line, it is gone"):
        line.receive(PATIENCE)
    line.close()
    with pytest.raises(MediumError, match="gone"):
        line.receive(0.0)
