"""What the page about boards says is what the commands take."""

from __future__ import annotations

import configparser
import re
import shlex
import shutil
import subprocess
from pathlib import Path

import click
import pytest
import yaml

from borechain.__main__ import cli
from groundstation.errors import StoreError
from telemetry.runtime.command_line import fault_of

ROOT = Path(__file__).parents[1]
PAGE = (ROOT / "docs" / "deploy.md").read_text()
UNITS = sorted((ROOT / "deploy" / "systemd").glob("*.service"))
PROGRAM = "/opt/borechain/bin/borechain"


def config_of(name: str) -> str:
    """The lines that the page gives for a configuration file."""
    after = PAGE.partition(f"`/etc/borechain/{name}`")[2]
    block = re.search(r"\n\n((?:    .+\n)+)", after)
    assert block
    return re.sub(r"^    ", "", block[1], flags=re.MULTILINE)


def read_unit(unit: Path) -> configparser.ConfigParser:
    parser = configparser.ConfigParser(interpolation=None, strict=False)
    parser.optionxform = str  # type: ignore[assignment, method-assign]
    parser.read_string(unit.read_text())
    return parser


def started(unit: Path) -> list[str]:
    """Words of the command that a unit starts."""
    return shlex.split(read_unit(unit)["Service"]["ExecStart"].replace("%i", "7"))


@pytest.mark.parametrize("unit", [unit for unit in UNITS if "-can" not in unit.name], ids=lambda unit: unit.stem)
def test_a_unit_starts_a_command_with_options_that_it_has(unit: Path, tmp_path: Path) -> None:
    program, name, *words = started(unit)
    assert program == PROGRAM
    for word in words:
        if word.startswith("/etc/borechain/"):
            config = Path(word).name
            (tmp_path / config).write_text(config_of(config) if config.endswith(".toml") else "")
    words = [word.replace("/etc/borechain", str(tmp_path)) for word in words]
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    context = command.make_context(name, words)
    assert context.params["keys_place"].exists()


def test_every_unit_is_named_on_the_page_and_runs_as_no_root() -> None:
    assert len(UNITS) == 6
    for unit in UNITS:
        assert unit.stem.rstrip("@") in PAGE
        if "-can" not in unit.name:
            assert "\nUser=borechain\n" in unit.read_text()


@pytest.mark.parametrize("unit", [unit for unit in UNITS if "-can" not in unit.name], ids=lambda unit: unit.stem)
def test_a_process_that_ends_is_started_again_however_often_it_does(unit: Path) -> None:
    """A ground station ends by itself for a backup in its database's place; usually systemd gives up at the fifth."""
    read = read_unit(unit)
    assert read["Service"]["Restart"] == "always"
    assert not {"RestartPreventExitStatus", "SuccessExitStatus"} & set(read["Service"])
    assert read["Unit"]["StartLimitIntervalSec"] == "0"


def test_a_container_that_fails_is_started_again_and_a_ground_station_that_ends_for_a_backup_fails() -> None:
    services = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]
    restarts = {name: service.get("restart") for name, service in services.items()}
    assert restarts.pop("keys") is None  # which is done once
    assert set(restarts.values()) == {"on-failure"}  # without a number of tries
    fault = fault_of(StoreError("database ground.sqlite: another one lies in its place"))
    assert fault is not None
    assert fault.exit_code not in (0, None)


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="no systemd-analyze here")
@pytest.mark.parametrize("unit", UNITS, ids=lambda unit: unit.stem)
def test_systemd_finds_no_fault_in_a_unit(unit: Path, tmp_path: Path) -> None:
    copy = tmp_path / unit.name.replace("@", "@7")
    copy.write_text(unit.read_text().replace(PROGRAM, "/bin/true").replace("/usr/sbin/ip", "/bin/true"))
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", str(copy)], capture_output=True, text=True, check=False, timeout=60
    )
    faults = [line for line in done.stderr.splitlines() if unit.name.partition("@")[0] in line]
    assert faults == []


def test_what_the_kernel_drives_is_given_to_the_user_of_the_units() -> None:
    rules = [
        line for line in (ROOT / "deploy" / "udev" / "60-borechain.rules").read_text().splitlines() if line[0] != "#"
    ]
    assert [re.match(r'SUBSYSTEM=="(\w+)"', rule)[1] for rule in rules] == ["iio", "counter", "gpio", "tty"]  # type: ignore[index]
    for rule in rules:
        parts = re.findall(r'([A-Z]+(?:\{[A-Z_]+\})?)(==|\+=|=)"([^"]+)"(?:, |$)', rule)
        assert ", ".join(f'{name}{sign}"{value}"' for name, sign, value in parts) == rule
        assert ("GROUP", "=", "borechain") in parts


@pytest.mark.skipif(shutil.which("udevadm") is None, reason="no udevadm here")
def test_udev_finds_no_fault_in_the_rules() -> None:
    rules = ROOT / "deploy" / "udev" / "60-borechain.rules"
    done = subprocess.run(["udevadm", "verify", str(rules)], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 0 or "Unknown command verb" in done.stderr + done.stdout, done.stderr


def test_what_a_deployed_process_is_given_is_made_by_the_keys_command(tmp_path: Path) -> None:
    from sealed_string import make_folder

    folder = make_folder(tmp_path / "stick", 7)
    table = PAGE.partition("| file | goes to |")[2].partition("\n\n")[0]
    named = set(re.findall(r"`([a-z0-9-]+\.[a-z]+)`", table))
    assert len(named) > 15
    assert [name for name in sorted(named) if not (folder / name).exists()] == []
