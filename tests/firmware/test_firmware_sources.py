"""The hand-written C as a whole: two compilers take it, it needs no library, and it is small."""

import subprocess
from pathlib import Path

import pytest
from c_library import compile_strictly
from needed_programs import needs, needs_clang, needs_gcc

from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec

FIRMWARE = Path(__file__).parents[2] / "firmware"
SOURCES = sorted(path.name for path in FIRMWARE.glob("*.c"))
CHIP = ("-mcpu=cortex-m4", "-mthumb", "-Os", "-ffreestanding")
OF_THE_COMPILER = {"memcpy", "memset", "memcmp", "__aeabi_ldivmod", "__aeabi_uldivmod"}  # gcc asks for them itself
MOST_FLASH = 17_500  # bytes, the codec included: 12 000 of the link, 4 700 of clock, payloads and hash


def folder_with_codec(folder: Path) -> Path:
    written = write_native_codec()
    (folder / NATIVE_HEADER).write_text(written.header)
    (folder / NATIVE_CODE).write_text(written.code)
    return folder


@pytest.mark.parametrize("compiler", [pytest.param("gcc", marks=needs_gcc), pytest.param("clang", marks=needs_clang)])
def test_two_compilers_take_every_source_without_a_warning(compiler: str, tmp_path: Path) -> None:
    paths = [FIRMWARE / name for name in SOURCES]
    done = compile_strictly(folder_with_codec(tmp_path), compiler, "-O2", "-I.", "-c", *paths)
    assert (done.returncode, done.stderr) == (0, "")


def shown(tmp_path: Path, tool: str, *words: str) -> list[list[str]]:
    """Words of each line that a tool of the chip's compiler prints."""
    done = subprocess.run([f"arm-none-eabi-{tool}", *words], cwd=tmp_path, check=True, capture_output=True, text=True)
    return [line.split() for line in done.stdout.splitlines()]


@needs("arm-none-eabi-gcc", "gcc-arm-none-eabi")
def test_a_chip_needs_no_library_for_it_and_little_flash(tmp_path: Path) -> None:
    paths = [*(FIRMWARE / name for name in SOURCES), folder_with_codec(tmp_path) / NATIVE_CODE]
    done = compile_strictly(tmp_path, "arm-none-eabi-gcc", *CHIP, "-I.", "-c", *paths)
    assert (done.returncode, done.stderr) == (0, "")
    objects = sorted(path.name for path in tmp_path.glob("*.o"))
    symbols = [line for name in objects for line in shown(tmp_path, "nm", name) if len(line) > 1]
    defined = {line[-1] for line in symbols if line[-2] != "U"}
    wanted = {line[-1] for line in symbols if line[-2] == "U"}
    assert wanted - defined <= OF_THE_COMPILER
    sizes = [list(map(int, line[:3])) for line in shown(tmp_path, "size", *objects)[1:]]
    assert sum(flash for flash, _, _ in sizes) <= MOST_FLASH
    assert sum(data + zeroed for _, data, zeroed in sizes) == 0
