"""``borechain firmware`` as its user meets it: files, sizes and refusals in one line."""

import re
import shutil
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from borechain.cli.firmware.firmware import TARGETS, firmware
from node.kernels.record.sensor_record import MAX_IMUS
from node.translation import toolchains


def build(*words: str | Path) -> Result:
    return CliRunner().invoke(firmware, ["build", *map(str, words)])


def test_the_command_has_the_targets_and_the_imus_of_the_build() -> None:
    assert TARGETS == toolchains.TARGETS
    assert f"1<=x<={MAX_IMUS}" in CliRunner().invoke(firmware, ["build", "--help"]).output


def test_the_source_needs_no_compiler(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = build("--out", tmp_path / "made")
    assert done.exit_code == 0, done.output
    assert {path.name for path in (tmp_path / "made").iterdir()} == {
        "borechain_events.h", "borechain_orders.c", "borechain_orders.h", "borechain_step.c", "borechain_step.h",
        "borechain_step.sizes.txt",
    }  # fmt: skip
    source = re.findall("source ([0-9a-f]{16})", done.output)
    assert f'#define BORECHAIN_DIGEST "{source[0]}"' in (tmp_path / "made" / "borechain_step.h").read_text()


def test_an_unknown_target_is_answered_with_the_list(tmp_path: Path) -> None:
    done = build("--target", "z80", "--out", tmp_path)
    assert done.exit_code == 2
    assert "'c', 'cortex-m4', 'cortex-m0plus', 'riscv32'" in done.output


def test_a_missing_compiler_is_named_with_its_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    done = build("--target", "riscv32", "--out", tmp_path / "made")
    assert done.exit_code == 2
    assert len(done.output.strip().splitlines()) == 1
    assert "install Debian's gcc-riscv64-unknown-elf" in done.output
    assert list((tmp_path / "made").iterdir()) == []


@pytest.mark.parametrize("imus", ["0", "9"])
def test_as_many_imus_as_no_record_holds_are_refused(imus: str, tmp_path: Path) -> None:
    done = build("--imus", imus, "--out", tmp_path)
    assert done.exit_code == 2
    assert "1<=x<=8" in done.output


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("arm-none-eabi-gcc") is None, reason="install Debian's gcc-arm-none-eabi")
def test_a_node_of_one_imu_fits_a_small_chip(tmp_path: Path) -> None:
    """At most 115 kB of flash and 20 kB of memory, of which the stack may have 3."""
    done = build("--target", "cortex-m4", "--imus", "1", "--out", tmp_path)
    assert done.exit_code == 0, done.output
    lines = (tmp_path / "borechain_step.sizes.txt").read_text().splitlines()
    sizes = dict(line.split() for line in lines)
    assert int(sizes["flash_bytes"]) <= 115_000
    assert int(sizes["data_bytes"]) + int(sizes["zeroed_bytes"]) + int(sizes["records_bytes"]) <= 17_600
    page = (Path(__file__).parents[1] / "docs" / "board.md").read_text()
    told = re.findall(r"^\| cortex-m4 \| 1 \| ([0-9.]+) \| [0-9]+ \| ([0-9.]+) \|", page, re.MULTILINE)
    assert told, "no row of a Cortex-M4 with one IMU: python docs/make_board.py"
    assert float(told[0][0]) == pytest.approx(int(sizes["flash_bytes"]) / 1000, rel=0.03)  # of another gcc
    assert float(told[0][1]) == pytest.approx(int(sizes["records_bytes"]) / 1000, abs=0.05)
