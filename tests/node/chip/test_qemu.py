"""The step in C on emulated chips: the same calls as on this machine, the same bytes, in so many instructions."""

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
from chip_tools import MACHINES, compile_for_chip, run_on_chip, said_numbers
from chip_worlds import every_world, rough_node
from recorded_calls import record_calls

from node.translation.firmware_build import FirmwareRequest, build_firmware
from node.translation.toolchains import TOOLCHAINS

LIMITS = {"step_most": 120_000, "stack": 3_000}  # instructions and bytes, of a node of one IMU
SLOWEST = 2_000_000  # instructions: a sixteenth of a cycle at 64 MHz, for the end of an alignment by extremes
EMULATORS = {"qemu-system-arm": "qemu-system-arm", "qemu-system-riscv32": "qemu-system-misc"}
LIBRARIES = {"arm-none-eabi-": "libnewlib-arm-none-eabi", "riscv64-unknown-elf-": "picolibc-riscv64-unknown-elf"}


def missing(target: str) -> str:
    """What to install for a target; nothing where all of it is there."""
    toolchain, emulator = TOOLCHAINS[target], MACHINES[target][0]
    wanted = []
    if shutil.which(toolchain.prefix + "gcc") is None:
        wanted += [toolchain.package, LIBRARIES[toolchain.prefix]]
    if shutil.which(emulator) is None:
        wanted.append(EMULATORS[emulator])
    return " ".join(wanted)


def on(target: str, *marks: pytest.MarkDecorator):
    """A target, left out by the names of what its machine lacks."""
    lacks = missing(target)
    skip = pytest.mark.skipif(bool(lacks), reason=f"{target}: install Debian's {lacks} (make test-firmware)")
    return pytest.param(target, marks=[skip, *marks])


def replayed(target: str, folder: Path, *worlds: Callable[[], object]) -> dict[str, int]:
    """What a chip says of all calls of these worlds."""
    build_firmware(FirmwareRequest("c", out=folder))
    made = record_calls(folder / "calls.bin", *worlds)
    done = run_on_chip(target, compile_for_chip(folder, target), folder)
    found = said_numbers(done.stdout + done.stderr)  # where riscv32's library says it, one letter at a time
    assert done.returncode == 0, (done.returncode, done.stdout, done.stderr)
    assert (found["calls"], found["wrong"]) == (made, 0)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("target", [on("cortex-m4")])
def test_a_chip_gives_the_same_on_every_call(target: str, tmp_path: Path) -> None:
    found = replayed(target, tmp_path, *every_world(100))
    assert found["calls"] > 8_000
    assert found["step_most"] < SLOWEST


@pytest.mark.slow
@pytest.mark.parametrize("target", [on("cortex-m4")])
def test_a_step_of_one_imu_is_short(target: str, tmp_path: Path) -> None:
    found = replayed(target, tmp_path, rough_node(6, 1, 0, 900))
    assert {name: found[name] for name in LIMITS if found[name] > LIMITS[name]} == {}


@pytest.mark.statistical
@pytest.mark.timeout(
    3600
)  # 110 s of processor time for the calls, up to 175 s for an emulator: minutes on a busy machine
@pytest.mark.parametrize("target", [on(target) for target in MACHINES])
def test_chips_give_the_same_on_a_hundred_thousand_calls(target: str, tmp_path: Path) -> None:
    assert replayed(target, tmp_path, *every_world(14_000))["calls"] > 100_000
