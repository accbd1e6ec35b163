"""Compiling and running the step in C for its tests, and what to install where that cannot be."""

import itertools
import json
import os
import signal
import subprocess
import sys
from pathlib import Path

from needed_programs import needs, needs_gcc  # noqa: F401  # handed on to the chip's tests
from recorded_calls import Layout, layout_of

from node.translation.chip_program import BARE
from node.translation.toolchains import OPTIONS, TOOLCHAINS

SMALLER = """
import json
from node.translation.imu_limit import limit_imus
limit_imus(1)
from node.kernels.record.integer_node import FIXED_NODE, FIXED_PARAMETERS, FIXED_SETTINGS
from recorded_calls import fields_of
sizes = FIXED_NODE.itemsize, FIXED_SETTINGS.itemsize, 2 * FIXED_PARAMETERS.itemsize, 1
print(json.dumps([fields_of(FIXED_NODE), fields_of(FIXED_SETTINGS), sizes]))
"""
HERE = Path(__file__).parent / "chip"
RISCV_MEMORY = ("flash=0x80000000", "flash_size=0x400000", "ram=0x80400000", "ram_size=0x1000000", "stack_size=0x8000")
HOST = ("-std=gnu99", "-O1", "-fwrapv")
CHECKED = ("-fno-wrapv", "-fsanitize=undefined,bounds-strict,address", "-fno-sanitize-recover=all")
TRAPPED = (
    "-DTRAPPED", "-D_POSIX_C_SOURCE=200809L", "-fno-wrapv", "-fsanitize=undefined,bounds-strict",
    "-fsanitize-undefined-trap-on-error",
)  # fmt: skip


def run_program(
    *command: str | Path, folder: Path, environment: dict[str, str] | None = None
) -> subprocess.CompletedProcess[str]:
    """What a program says."""
    return subprocess.run(
        list(map(str, command)), cwd=folder, env=environment, capture_output=True, text=True, check=False
    )


def compile_replay(folder: Path, *options: str, code: str = "borechain_step.c", name: str = "replay") -> Path:
    """The program that replays calls, for this machine, of the step that lies in ``folder``."""
    done = run_program("gcc", *HOST, *options, "-I.", code, HERE / "replay.c", "-o", name, folder=folder)
    assert done.returncode == 0, done.stderr[-2000:]
    return folder / name


def said_numbers(text: str) -> dict[str, int]:
    """The last numbers that the program said, by their names."""
    words = text.split()
    return {name: int(number) for name, number in itertools.pairwise(words) if number.isdigit()}


def compile_for_chip(folder: Path, target: str) -> Path:
    """The same for a bare chip in QEMU, with the instructions and the stack counted where that is an Arm."""
    toolchain = TOOLCHAINS[target]
    step = run_program(
        toolchain.prefix + "gcc", *toolchain.options, *OPTIONS, "-c", "borechain_step.c", "-o", f"{target}.o",
        folder=folder,
    )  # fmt: skip
    assert step.returncode == 0, step.stderr[-2000:]
    if target == "riscv32":
        bare = (
            "--specs=picolibc.specs", "--oslib=semihost", "--crt0=hosted",
            *(f"-Wl,--defsym=__{one}" for one in RISCV_MEMORY), HERE / "replay.c",
        )  # fmt: skip
    else:
        bare = (
            "--specs=rdimon.specs",
            "-DCOUNT_ON_CHIP",
            "-T",
            BARE / "mps2.ld",
            BARE / "startup.c",
            HERE / "replay.c",
        )
    made = run_program(
        toolchain.prefix + "gcc", *toolchain.options, "-O2", "-I.", *bare, f"{target}.o", "-o", f"{target}.elf",
        folder=folder,
    )  # fmt: skip
    assert made.returncode == 0, made.stderr[-2000:]
    return folder / f"{target}.elf"


MACHINES = {
    "cortex-m4": ("qemu-system-arm", "-M", "mps2-an386", "-icount", "shift=0"),
    "cortex-m0plus": ("qemu-system-arm", "-M", "mps2-an385", "-icount", "shift=0"),
    "riscv32": ("qemu-system-riscv32", "-M", "virt", "-bios", "none", "-m", "64M"),
}


def run_on_chip(target: str, program: Path, folder: Path) -> subprocess.CompletedProcess[str]:
    """What the program says in QEMU; ``folder`` has its calls.bin.

    Of one that a signal has ended it is told how far it was.
    """
    program_name, *machine = MACHINES[target]
    quiet = ("-nographic", "-monitor", "none", "-serial", "null")
    hosted = ("-semihosting-config", "enable=on,target=native")
    done = run_program(program_name, *machine, *quiet, *hosted, "-kernel", program, folder=folder)
    if done.returncode < 0:
        ended, said = signal.Signals(-done.returncode).name, said_numbers(done.stdout + done.stderr)
        raise AssertionError(f"{target}: {program_name} was ended by {ended}; until then {said}")
    return done


def layout_of_one() -> Layout:
    """Where the records of a node of one IMU lie."""
    paths = os.pathsep.join(path for path in sys.path if path)
    done = run_program(
        sys.executable, "-c", SMALLER, folder=Path.cwd(), environment={**os.environ, "PYTHONPATH": paths}
    )
    assert done.returncode == 0, done.stderr
    node, settings, sizes = json.loads(done.stdout)
    return layout_of(node, settings, sizes)
