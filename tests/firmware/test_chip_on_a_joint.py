"""An emulated Cortex-M4 at the end of a joint: its link, signals and bridge, with a tube's own at the other end."""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from needed_programs import needs
from waiting import until

from node.translation.chip_program import BARE
from node.translation.toolchains import TOOLCHAINS
from sim.can.can_hub import CanHub, running_hub
from telemetry.errors import MediumError
from telemetry.frozen import replace
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_medium import CanSettings
from telemetry.media.can_port import open_controller
from telemetry.media.chip_bridge import ChipBridge
from telemetry.media.media_table import open_medium
from telemetry.media.port import Priority, TubeEnd
from telemetry.media.serial_line import SerialLine
from telemetry.messages import Aiding, Hello, NodeMode, NodeState, Side
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec
from telemetry.presentation.can_native import rounded_message
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.transport.hop import HopLink
from telemetry.unwritten import Content

FIRMWARE = Path(__file__).parents[2] / "firmware"
CHIP, TUBE = 2, 1
PATIENCE = 60.0
OPTIONS = ("-std=gnu99", "-Os", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-nostartfiles", "--specs=nano.specs")
MEMORY_OF_BOOTS = 0x21000000
AIDING = Aiding(1.0, 2e-6, 3e-7, -0.3, 1.24, 1234.5, 7, 3, 480.0, 1e-5, True, 5)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder, written = tmp_path_factory.mktemp("chip"), write_native_codec()
    (folder / NATIVE_HEADER).write_text(written.header)
    (folder / NATIVE_CODE).write_text(written.code)
    sources = [*FIRMWARE.glob("*.c"), *(FIRMWARE / "mps2").glob("*.c"), NATIVE_CODE]
    flags = [*TOOLCHAINS["cortex-m4"].options, *OPTIONS, "-I.", f"-I{FIRMWARE}", "-T", str(BARE / "mps2.ld")]
    command = ["arm-none-eabi-gcc", *flags, *map(str, sources), "-o", "chip.elf"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / "chip.elf"


class EmulatedChip:
    """A chip that runs, and its bridge onto the segment."""

    def __init__(self, program: Path, hub: CanHub, boot_count: int) -> None:
        self._stack = contextlib.ExitStack()
        loader = f"loader,addr={MEMORY_OF_BOOTS:#x},data={boot_count},data-len=4"
        self._process = subprocess.Popen(
            ["qemu-system-arm", "-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "pty",
             "-kernel", str(program), "-device", loader],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        found = re.search(r"/dev/\S+", said)
        assert found, said
        line = SerialLine(Path(found.group()), 115200)
        self._stack.callback(line.close)
        settings = CanSettings.parse(f"{hub.port}/rig/{CHIP}-{TUBE},interface={INTERFACE}")
        controller = open_controller(lambda: settings.open_bus(""), "chip", True, None)
        self._stack.callback(controller.shutdown)
        self.bridge = ChipBridge(line, controller, fd=True, tell=lambda said: None)
        self.failure: MediumError | None = None
        self._thread = threading.Thread(target=self._run)
        self._thread.start()

    def _run(self) -> None:
        try:
            self.bridge.run()
        except MediumError as error:
            self.failure = error

    def kill(self) -> None:
        """Take the chip's power away; its bridge ends with it."""
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        self._thread.join(PATIENCE)
        self.bridge.stop()
        self._thread.join()
        self._stack.close()


class Tube:
    """The tube below: a link and a port of the product."""

    def __init__(self, hub: CanHub, stack: contextlib.ExitStack) -> None:
        medium = stack.enter_context(open_medium(f"can:{hub.port},interface={INTERFACE},profile=native"))
        self._port = medium.open_port(TubeEnd("rig", TUBE, Side.UPPER, CHIP))
        self._inbox: list[Content] = []
        self._port.listen(self._inbox.append)
        self.link = HopLink(TUBE, 1)
        self.link.bundle_limit = 0
        self.payloads: list[bytes] = []

    def run_until(self, condition: Callable[[], bool]) -> None:
        """Carry frames until something is so."""
        until(lambda: self._carry_frames() or condition(), PATIENCE)

    def repeat_until(self, aiding: Aiding, condition: Callable[[], bool]) -> None:
        """Send an aiding every second until something is so: one that is lost on a busy machine is not sent again."""
        due = -1.0

        def holds() -> bool:
            nonlocal due
            if (now := time.monotonic()) >= due:
                self.link.send_best_effort(encode_message(aiding), "aiding", Priority.AIDING)
                due = now + 1.0
            return condition()

        self.run_until(holds)

    def _carry_frames(self) -> None:
        now = time.monotonic()
        while self._inbox:
            self.payloads += [bytes(payload) for payload in self.link.receive(self._inbox.pop(0), now)]
        for frame in self.link.take_frames(now):
            self._port.send(frame)

    def messages(self, kind: type) -> list[object]:
        """Messages of a type that came as signals."""
        found = []
        for payload in self.payloads:
            with contextlib.suppress(Exception):
                message = decode_message(payload)
                if isinstance(message, kind):
                    found.append(message)
        return found


@pytest.fixture
def stack() -> Iterator[contextlib.ExitStack]:
    register_loopback()
    with contextlib.ExitStack() as opened:
        yield opened


@pytest.mark.statistical  # 6 s of CPU, most of it the emulator's
@needs("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi")
@needs("qemu-system-arm", "qemu-system-arm")
def test_an_emulated_chip_says_hello_answers_aidings_and_loses_nothing(
    program: Path, stack: contextlib.ExitStack
) -> None:
    hub = stack.enter_context(running_hub())
    chip = EmulatedChip(program, hub, boot_count=5)
    stack.callback(chip.kill)
    tube = Tube(hub, stack)
    tube.run_until(lambda: bool(tube.messages(Hello)))
    assert tube.messages(Hello)[0] == Hello(CHIP, 5, -1, NodeMode.STILL, 1.0)

    seen = rounded_message(AIDING)
    assert isinstance(seen, Aiding)
    for k in range(20):
        aiding = replace(AIDING, valid_at=1000.0 + k, yaw=0.1 * k)
        tube.repeat_until(aiding, lambda k=k: any(s.at == 1000.0 + k for s in tube.messages(NodeState)))  # type: ignore[attr-defined,misc]
        seen = rounded_message(aiding)
        state = next(s for s in tube.messages(NodeState) if s.at == 1000.0 + k)  # type: ignore[attr-defined]
        assert isinstance(state, NodeState)
        assert isinstance(seen, Aiding)
        assert (state.hops, state.mode, state.epoch) == (4, NodeMode.TRACKING, 5)
        assert state.yaw == pytest.approx((seen.yaw + seen.offset) % 6.283185307179586, abs=1e-9)
        assert (state.yaw_var, state.systematic_var) == (seen.yaw_var, seen.systematic_var)

    sent = [os.urandom(length) for length in (1, 61, 62, 63, 300, 400, 17, 200, 399, 128)]
    for payload in sent:
        tube.link.send_reliable(payload, Priority.BLOCK)
    tube.run_until(lambda: set(sent) <= set(tube.payloads) and tube.link.waiting == 0)
    assert sorted(p for p in tube.payloads if p in sent) == sorted(sent)

    chip.kill()
    assert chip.failure is not None
    assert "gone" in str(chip.failure)
    late = os.urandom(250)
    tube.link.send_reliable(late)
    chip = EmulatedChip(program, hub, boot_count=6)
    stack.callback(chip.kill)
    tube.run_until(lambda: tube.payloads.count(late) == 1 and tube.link.waiting == 0)
    assert tube.link.peer == (CHIP, 6)
