"""A whole tube on an emulated chip for the tests: its program, its flash in a file, its joints and its sensor."""

from __future__ import annotations

import contextlib
import re
import struct
import subprocess
import tempfile
import threading
import time
import tty
from pathlib import Path

from chip_sources import write_chip_sources

from node.firmware.node_image import IMAGE, provision_node
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.integer_node import READING_SCALES
from node.process.drivers.timed import TimedImu
from node.translation.toolchains import OPTIONS, TOOLCHAINS
from sim.can.can_hub import CanHub
from telemetry.errors import MediumError
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_medium import CanSettings
from telemetry.media.can_port import open_controller
from telemetry.media.chip_bridge import ChipBridge
from telemetry.media.serial_line import SerialLine
from telemetry.presentation.can_c_codec import NATIVE_CODE

FIRMWARE = Path(__file__).parents[2] / "firmware"
TUBE_SOURCES = FIRMWARE / "tube"
FLASH_SIZE = 16 << 20  # of the emulator's memory that a file holds
BOARD_AT, POWER_AT, KEYS_AT = 0x10000, 0x10010, 0x14000
PATIENCE = 60.0
MARK = b"\xb5"
LINKED = ("-Wl,--gc-sections", "-DCHIP_END_ROOM=480u", "-nostartfiles", "--specs=nano.specs")


def build_tube(folder: Path) -> Path:
    """The program of a tube for QEMU's mps2-an386, from the sources of the product, linked for 192 kB and 32 kB."""
    write_chip_sources(folder)
    places = (FIRMWARE, TUBE_SOURCES, TUBE_SOURCES / "mps2")
    sources = [str(source) for place in places for source in sorted(place.glob("*.c"))]
    own = ("borechain_step.c", "borechain_orders.c", NATIVE_CODE, str(FIRMWARE / "mps2" / "start.c"))
    options = [option for option in (*TOOLCHAINS["cortex-m4"].options, *OPTIONS) if option != "-ffreestanding"]
    script = ("-T", str(TUBE_SOURCES / "mps2" / "mps2_small.ld"))
    includes = ("-I.", f"-I{FIRMWARE}", f"-I{TUBE_SOURCES}")
    command = ["arm-none-eabi-gcc", *options, *LINKED, *includes, *script, *sources, *own, "-o", "tube.elf"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / "tube.elf"


def sizes_of(program: Path) -> tuple[int, int]:
    """Bytes of flash and of memory, the stack included, that a program takes."""
    shown = subprocess.run(["arm-none-eabi-size", str(program)], capture_output=True, text=True, check=True).stdout
    text, data, zeroed = map(int, shown.splitlines()[1].split()[:3])
    return text + data, data + zeroed


class TubeFlash:
    """The flash of a board, in a file that the emulator shares; ``key_page`` is of its seals, where it has any."""

    def __init__(
        self, path: Path, settings: TubeSettings, folder: Path, block_key: bytes = b"", key_page: bytes = b""
    ) -> None:
        self.path = path
        provision_node(settings, 1, folder)
        with path.open("wb") as file:
            file.truncate(FLASH_SIZE)
            file.write((folder / IMAGE).read_bytes())
            for slot in range(2):
                file.seek(0x8000 + 0x4000 * slot)
                file.write(b"\xff" * 0x4000)
            file.seek(BOARD_AT)
            mount_var = round(settings.mount_std**2 * 2.0**56)
            file.write(struct.pack("<IIqII32s", settings.tube, bool(block_key), mount_var, 0, 0, block_key))
            file.seek(KEYS_AT)
            file.write(key_page)

    def power_fails_after(self, words: int) -> None:
        """Let the power fail after so many more words of flash; 0: it holds."""
        with self.path.open("r+b") as file:
            file.seek(POWER_AT)
            file.write(struct.pack("<I", words))

    @property
    def has_failed(self) -> bool:
        """Whether it has, after it was to."""
        with self.path.open("rb") as file:
            file.seek(POWER_AT)
            return file.read(4) == bytes(4)


def window_begin(ended: float, now: float) -> float:
    """Where the window of a reading begins (s) that is taken ``now``, after one that ``ended``.

    Nothing is lost between: a machine that is busy reads late, and a sensor has gone on meanwhile. Where a whole cycle
    is missing the window is that of a cycle, as the chip takes it.
    """
    return ended if now - ended < 1.5 * PERIOD else now - PERIOD


def next_due(due: float, now: float) -> float:
    """When (s) the cycle after one that was due and read ``now`` is read: half a cycle later at the least."""
    return due + PERIOD * (1 + round(max(now - due, 0.0) / PERIOD))


class SensorLine(threading.Thread):
    """What the chip's sensor measures, a cycle at a time, from a recording by the clock of this machine."""

    def __init__(self, line: Path, recording: Path) -> None:
        super().__init__(daemon=True)
        self._line, self._imu = line, TimedImu(recording)
        self._imu.start()
        self._ends = threading.Event()
        self._gravity = float(default_config()[0]["gravity"])

    def run(self) -> None:
        """Write a cycle's mean as it ends, until the line is gone or it is stopped."""
        ended = time.monotonic()
        due = ended + PERIOD
        with contextlib.suppress(OSError), self._line.open("wb", buffering=0) as line:
            tty.setraw(line)
            while not self._ends.wait(max(due - time.monotonic(), 0.0)):
                now = time.monotonic()
                sample = self._imu.read(window_begin(ended, now), now)
                ended, due = now, next_due(due, now)
                numbers = (*sample.rate, *(force / self._gravity for force in sample.force), sample.temperature)
                scaled = [round(x * scale) for x, scale in zip(numbers, READING_SCALES[:7].tolist(), strict=True)]
                body = struct.pack("<7q", *scaled)
                line.write(MARK + body + bytes([sum(body) & 0xFF]))

    def stop(self) -> None:
        """End it."""
        self._ends.set()
        self.join(PATIENCE)


class EmulatedTube:
    """A board that runs, its bridges onto two segments and its sensor.

    Parameters
    ----------
    segments : names of the upper and of the lower segment on the hub
    """

    def __init__(
        self, program: Path, flash: TubeFlash, hub: CanHub, segments: tuple[str, str], recording: Path
    ) -> None:
        self._stack = contextlib.ExitStack()
        self.monitor = Path(self._stack.enter_context(tempfile.TemporaryDirectory(prefix="chip-"))) / "monitor"
        backend = f"memory-backend-file,id=flash,size={FLASH_SIZE},mem-path={flash.path},share=on"
        self._process = subprocess.Popen(
            ["qemu-system-arm", "-M", "mps2-an386,memory-backend=flash", "-object", backend, "-display", "none",
             "-monitor", "none", "-qmp", f"unix:{self.monitor},server=on,wait=off",
             "-serial", "pty", "-serial", "pty", "-serial", "pty", "-kernel", str(program)],
            stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
        )  # fmt: skip
        lines = [self._told_line() for _ in range(3)]
        self._bridges = [self._bridge(lines[k], hub, segment) for k, segment in enumerate(segments)]
        self._threads = [threading.Thread(target=self._run, args=(bridge,)) for bridge in self._bridges]
        self._sensor = SensorLine(lines[2], recording)
        for thread in (*self._threads, self._sensor):
            thread.start()

    def _told_line(self) -> Path:
        assert self._process.stdout is not None
        said = self._process.stdout.readline()
        found = re.search(r"/dev/\S+", said)
        assert found, said
        return Path(found.group())

    def _bridge(self, line: Path, hub: CanHub, segment: str) -> ChipBridge:
        serial = SerialLine(line, 115200)
        self._stack.callback(serial.close)
        settings = CanSettings.parse(f"{hub.port}/{segment},interface={INTERFACE}")
        controller = open_controller(lambda: settings.open_bus(""), "chip", True, None)
        self._stack.callback(controller.shutdown)
        return ChipBridge(serial, controller, fd=True, tell=lambda said: None)

    @staticmethod
    def _run(bridge: ChipBridge) -> None:
        with contextlib.suppress(MediumError):  # the line ends with the emulator
            bridge.run()

    def kill(self) -> None:
        """Take the board's power away."""
        self._sensor.stop()
        self._process.kill()
        self._process.wait()
        assert self._process.stdout is not None
        self._process.stdout.close()
        for thread, bridge in zip(self._threads, self._bridges, strict=True):
            thread.join(5.0)
            bridge.stop()
            thread.join(PATIENCE)
        self._stack.close()
