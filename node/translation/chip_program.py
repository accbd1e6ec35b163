"""The program of an emulated chip that steps for a host: made once a source of the kernels, and started in QEMU."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path
from typing import Final

from node.kernels.arithmetic.jit import folder_in_use
from node.translation.c_file import CODE, HEADER, write_c_files
from node.translation.toolchains import OPTIONS, TOOLCHAINS, ToolchainError, find_tool, run_tool

TARGET, EMULATOR = "cortex-m4", "qemu-system-arm"
BARE: Final = Path(__file__).parent / "bare"
SOURCES: Final = ("chip_server.c", "startup.c", "mps2.ld")
BARE_OPTIONS: Final = ("-O2", "-I.", "--specs=rdimon.specs", "-T", "mps2.ld")


def chip_program() -> Path:
    """The program for QEMU's mps2-an386, kept beside the compiled kernels.

    Raises
    ------
    ToolchainError
        When compiler or emulator is missing; the message names Debian's packages.
    """
    find_tool(TARGET, "gcc")
    find_emulator()
    written = write_c_files()
    place = folder_in_use() / f"chip-{written.digest}.elf"
    if place.exists():
        return place
    with tempfile.TemporaryDirectory(prefix="borechain-chip-") as temporary:
        folder = Path(temporary)
        (folder / HEADER).write_text(written.header, encoding="utf-8")
        (folder / CODE).write_text(written.code, encoding="utf-8")
        for name in SOURCES:
            shutil.copy(BARE / name, folder)
        link_program(folder)
        fresh = place.with_name(f"{place.name}.{folder.name}")
        shutil.copy(folder / "chip.elf", fresh)
        fresh.replace(place)
    return place


def link_program(folder: Path) -> None:
    """Make ``chip.elf`` in a folder that has all sources."""
    gcc, options = find_tool(TARGET, "gcc"), TOOLCHAINS[TARGET].options
    run_tool([gcc, *options, *OPTIONS, "-c", CODE, "-o", "step.o"], folder)
    run_tool([gcc, *options, *BARE_OPTIONS, "startup.c", "chip_server.c", "step.o", "-o", "chip.elf"], folder)


def find_emulator() -> str:
    """The emulator.

    Raises
    ------
    ToolchainError
        When it is not installed: the message names Debian's package.
    """
    found = shutil.which(EMULATOR)
    if found is None:
        raise ToolchainError(f"a chip: expected {EMULATOR} on the path, found none; install Debian's {EMULATOR}")
    return found


def start_chip(program: Path, folder: Path) -> subprocess.Popen[bytes]:
    """An emulated Cortex-M4 that runs ``program`` and finds its files in ``folder``."""
    machine = ("-M", "mps2-an386", "-nographic", "-monitor", "none", "-serial", "null")
    hosted = ("-semihosting-config", "enable=on,target=native")
    return subprocess.Popen(
        [find_emulator(), *machine, *hosted, "-kernel", str(program)],
        cwd=folder,
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
