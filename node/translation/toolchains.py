"""Compilers of the chips: which one makes what of the step, and how much of a chip that takes."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Final, NamedTuple

from node.errors import NodeConfigurationError
from node.translation.c_file import CODE

OPTIONS: Final = ("-std=c99", "-Os", "-fwrapv", "-ffreestanding", "-ffunction-sections", "-fdata-sections")
# gcc follows loops over IMUs beyond the number that the entry points admit
WARNINGS: Final = ("-Wall", "-Wextra", "-Wconversion", "-Wno-array-bounds", "-Werror")


class ToolchainError(NodeConfigurationError):
    """A compiler is not there, or did not take the code; the message says which package has it."""


class Toolchain(NamedTuple):
    """What compiles for one kind of chip.

    Attributes
    ----------
    prefix : of the names of its tools
    package : of Debian, that has them
    options : of the kind of chip
    """

    prefix: str
    package: str
    options: tuple[str, ...]


class CodeSize(NamedTuple):
    """What an object takes, bytes: code with its constants, memory set and memory zeroed as it starts."""

    flash: int
    data: int
    zeroed: int


TOOLCHAINS: Final[dict[str, Toolchain]] = {
    "cortex-m4": Toolchain("arm-none-eabi-", "gcc-arm-none-eabi", ("-mcpu=cortex-m4", "-mthumb", "-mfloat-abi=soft")),
    "cortex-m0plus": Toolchain("arm-none-eabi-", "gcc-arm-none-eabi", ("-mcpu=cortex-m0plus", "-mthumb")),
    "riscv32": Toolchain("riscv64-unknown-elf-", "gcc-riscv64-unknown-elf", ("-march=rv32imc", "-mabi=ilp32")),
}
TARGETS: Final = ("c", *TOOLCHAINS)


def find_tool(target: str, tool: str) -> str:
    """A tool of a target's compiler.

    Raises
    ------
    ToolchainError
        When it is not installed: the message names Debian's package.
    """
    toolchain = TOOLCHAINS[target]
    found = shutil.which(toolchain.prefix + tool)
    if found is None:
        raise ToolchainError(
            f"target {target}: expected {toolchain.prefix}{tool} on the path, found none; "
            f"install Debian's {toolchain.package}, or take --target c and a compiler of your own"
        )
    return found


def compile_step(target: str, folder: Path) -> tuple[Path, CodeSize]:
    """Object of the step that lies in ``folder``, and its size.

    Raises
    ------
    ToolchainError
        When the compiler is missing or does not take the code.
    """
    made = folder / f"borechain_step-{target}.o"
    options = (*TOOLCHAINS[target].options, *OPTIONS, *WARNINGS)
    run_tool([find_tool(target, "gcc"), *options, "-c", CODE, "-o", made.name], folder)
    shown = run_tool([find_tool(target, "size"), made.name], folder)
    return made, CodeSize(*map(int, shown.splitlines()[1].split()[:3]))


def run_tool(command: list[str], folder: Path) -> str:
    """What a tool prints that runs in ``folder``.

    Raises
    ------
    ToolchainError
        With its first complaint.
    """
    done = subprocess.run(command, check=False, cwd=folder, capture_output=True, text=True)
    if done.returncode != 0:
        said = [line for line in done.stderr.splitlines() if "error" in line] or done.stderr.splitlines() or ["nothing"]
        raise ToolchainError(f"{Path(command[0]).name}: expected it to take the code, it says: {said[0]}")
    return done.stdout
