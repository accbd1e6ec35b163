"""Which processes a rig has and what each is told, without starting one; commands that only hand over."""

from __future__ import annotations

import importlib
from functools import partial
from pathlib import Path
from typing import Any

import click
import pytest
from click.testing import CliRunner

import borechain.__main__ as entry
from borechain.cli.experiment.laboratory_records import records
from borechain.drilling.rig_host import run_medium
from borechain.drilling.rig_job import RigJob, no_progress, say_on_stderr, show_nothing
from borechain.drilling.rig_processes import process_table, settings_of
from groundstation.ground_host import run_ground
from node.process.node_host import run_encoder, run_node
from sim.rig.transports import Transports
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import BASE, ENCODER, Side

TABLES: dict[str, Any] = {
    "rig": {"tubes": 3, "tube_length_m": 2.0},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "torsion": {"bit_torque_nm": 123.0},
    "schedule": {"stop_s": 40.0},
}


@pytest.mark.parametrize("has_keys", [False, True])
def test_a_rig_has_a_process_a_tube_and_three_more(tmp_path: Path, has_keys: bool) -> None:
    world = World(scenario_of(TABLES), 1)
    keys = tmp_path / "keys" if has_keys else None
    job = RigJob(Path("x.toml"), 7, 2.5, ("node 1 at 3",), rig_name="r", endpoint="tcp/127.0.0.1:9", keys_place=keys)
    transports, steps = Transports(("can", "zenoh"), 5), tmp_path / "steps"
    table = process_table(world, job, tmp_path, None, transports, steps)
    assert list(table.specs) == ["medium", "encoder", "base", "1", "2", "3"]
    medium, encoder, base = (table.specs[name] for name in ("medium", "encoder", "base"))
    assert medium.target is run_medium
    frames = "" if has_keys else f"unixsock-stream/{tmp_path}/frames"
    assert medium.arguments[1:] == (Path("x.toml"), 7, 2.5, ("node 1 at 3",), False, True, transports, "", frames)
    assert encoder.target is run_encoder
    assert encoder.arguments[1:3] == (None, None)
    assert encoder.arguments[3].drilling == 123.0
    assert isinstance(base.target, partial)
    assert base.target.func is run_ground
    assert base.arguments[1] == settings_of(world, job)
    for tube in (1, 2, 3):
        spec = table.specs[str(tube)]
        assert spec.target is run_node
        assert spec.arguments[1] == world.tube_settings(tube)
        assert spec.arguments[1].tube == tube
    places = {name: spec.arguments[0] for name, spec in table.specs.items()}
    assert {place.folder.name for place in places.values()} == {
        "medium",
        "encoder",
        "ground",
        "tube-1",
        "tube-2",
        "tube-3",
    }
    named = {"medium": BASE, "base": BASE, "encoder": ENCODER}
    for name, place in places.items():
        address = named[name] if name in named else int(name)
        met_at = "tcp/127.0.0.1:9" if has_keys or address == BASE else frames
        assert (place.rig, place.endpoint, place.steps, place.keys) == ("r", met_at, steps, keys)
        assert place.key_file == (None if has_keys else tmp_path / "rig.key")
        assert place.media == transports.media_of(address)
    assert (tmp_path / "rig.key").exists() is not has_keys


@pytest.mark.parametrize(
    ("address", "side", "turn", "medium"),
    [
        (1, Side.UPPER, ("can", "zenoh"), "can:5,interface=borechain_loopback,frames=fd"),
        (2, Side.LOWER, ("can", "zenoh"), "can:5,interface=borechain_loopback,frames=fd"),
        (2, Side.UPPER, ("can", "zenoh"), None),
        (3, Side.LOWER, ("can", "zenoh"), None),
        (3, Side.UPPER, ("can", "zenoh"), "can:5,interface=borechain_loopback,frames=fd"),
        (1, Side.UPPER, ("can-classic",), "can:5,interface=borechain_loopback,frames=classic"),
        (ENCODER, Side.UPPER, ("can",), None),
        (BASE, Side.LOWER, ("can",), None),
        (ENCODER, Side.LOWER, ("can",), "can:5,interface=borechain_loopback,frames=fd"),
    ],
)
def test_joints_have_their_transports_in_turn(address: int, side: Side, turn: Any, medium: str | None) -> None:
    transports = Transports(turn, 5)
    assert transports.medium_of(address, side) == medium
    assert transports.need_hub
    assert not Transports(("zenoh",)).need_hub


@pytest.mark.parametrize(
    ("room", "name", "target", "words", "handed"),
    [
        ("borechain.cli.rig.router", "router", "borechain.drilling.router_host.run_router",
         ("--endpoint", "tcp/127.0.0.1:9"), ("tcp/127.0.0.1:9", None)),
        ("borechain.cli.rig.medium", "medium", "borechain.drilling.rig_host.run_medium",
         ("rig-3", "--seed", "4", "--speed", "max", "--router", "--rig", "r"), None),
    ],
)  # fmt: skip
def test_a_command_that_runs_until_it_is_stopped_is_told_what_was_asked(
    room: str, name: str, target: str, words: tuple[str, ...], handed: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked: list[Any] = []
    monkeypatch.setattr(target, lambda *given: asked.append(given))  # which would not end
    command: click.Command = getattr(importlib.import_module(room), name)
    result = CliRunner().invoke(command, list(words), catch_exceptions=False)
    assert result.exit_code == 0, result.output
    (given,) = asked
    if handed is not None:
        assert given == handed
        return
    place, scenario, seed, speed, faults, is_router = given
    assert (place.rig, scenario.stem, seed, speed > 1e9, faults, is_router) == ("r", "rig-3", 4, True, (), True)


def test_records_of_a_laboratory_are_written_and_named(tmp_path: Path) -> None:
    result = CliRunner().invoke(records, ["--out", str(tmp_path), "--seed", "3"], catch_exceptions=False)
    names = result.output.split()
    assert result.exit_code == 0
    assert len(names) > 4
    assert all((tmp_path / name).is_file() or Path(name).is_file() for name in names)


def test_a_line_beside_the_output_and_progress_that_is_not_watched(capsys: pytest.CaptureFixture[str]) -> None:
    say_on_stderr("a line")
    assert capsys.readouterr() == ("", "a line\n")
    with no_progress(None) as show:  # type: ignore[arg-type]
        assert show is show_nothing
    assert (RigJob(Path("x"), 1, 1.0).inline, RigJob(Path("x"), 1, 1.0).chips) == (False, "")


@pytest.mark.parametrize("name", entry.COMMANDS)
def test_every_command_is_where_the_table_says_and_no_other_is_there(name: str) -> None:
    group = entry.LazyGroup()
    context = click.Context(group)
    assert isinstance(group.get_command(context, name), click.Command)
    assert group.get_command(context, f"{name}s") is None
    assert name in group.list_commands(context)


def test_a_module_that_a_command_lacks_is_no_missing_package_of_ours(monkeypatch: pytest.MonkeyPatch) -> None:
    """Only where the package itself is missing a line says so; what it imports in vain is an error as it stands."""
    import builtins

    plain = builtins.__import__

    def lacking(module: str, *more: Any) -> Any:
        if module == "telemetry.runtime.command_line":
            raise ModuleNotFoundError("No module named 'x'", name=missing[0])
        return plain(module, *more)

    missing = ["elsewhere.part"]
    monkeypatch.setattr(builtins, "__import__", lacking)
    with pytest.raises(ModuleNotFoundError):
        entry.main([])
    missing[0] = "telemetry.runtime"
    with pytest.raises(SystemExit, match="borechain: expected the package telemetry of borechain, got "):
        entry.main([])
