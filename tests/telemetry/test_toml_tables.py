"""TOML that exhausts its reader is refused in one line, by every command that reads one."""

import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from hypothesis import given
from hypothesis import strategies as st

from borechain.cli.rig.rig_command import rig
from borechain.cli.survey.survey import survey
from borechain.cli.survey.wall_command import wall
from groundstation.command import ground
from telemetry.toml_tables import DEEPEST, LONGEST, parse_toml_tables

BRACKETS = "a = " + "[" * 60_000
DOTS = ".".join("a" * 60_000) + " = 1"
COMMANDS = {
    "rig": (rig, ["{file}", "--inline"]),
    "wall": (wall, ["{file}"]),
    "survey": (survey, ["{stations}", "--instrument", "{file}"]),
    "ground": (ground, ["--config", "{file}"]),
}


@given(st.integers(1, 3 * DEEPEST), st.sampled_from(["arrays", "tables", "keys"]))
def test_as_deep_as_allowed_is_read_and_no_deeper(depth: int, by: str) -> None:
    """The whole is a table itself, so of one more there is one less to write."""
    text = {
        "arrays": "a = " + "[" * depth + "]" * depth,
        "tables": "a = " + "{b = " * depth + "1" + "}" * depth,
        "keys": ".".join("a" * (depth + 1)) + " = 1",
    }[by]
    if depth + 1 <= DEEPEST:
        assert parse_toml_tables(text) == tomllib.loads(text)
    else:
        with pytest.raises(tomllib.TOMLDecodeError, match=f"at most {DEEPEST} deep"):
            parse_toml_tables(text)


@pytest.mark.parametrize("text", [BRACKETS, DOTS, "#" * (LONGEST + 1)], ids=["brackets", "dots", "long"])
def test_what_would_exhaust_its_reader_is_refused(text: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match="expected"):
        parse_toml_tables(text)


def test_the_longest_that_is_allowed_is_read() -> None:
    assert parse_toml_tables("a = 1 #" + "#" * (LONGEST - 7)) == {"a": 1}


@pytest.mark.parametrize("asked", COMMANDS)
@pytest.mark.parametrize("text", [BRACKETS, DOTS], ids=["brackets", "dots"])
def test_a_command_refuses_it_in_a_line(asked: str, text: str, tmp_path: Path) -> None:
    stations, file = tmp_path / "stations.csv", tmp_path / "deep.toml"
    stations.write_text("md_m,inclination_deg,azimuth_deg\n0,0,0\n10,5,20\n")
    file.write_text(text)
    command, words = COMMANDS[asked]
    done = CliRunner().invoke(command, [word.format(file=file, stations=stations) for word in words])
    assert done.exit_code == 2, done.output
    assert done.exception is None or isinstance(done.exception, SystemExit)
    assert f"at most {DEEPEST} deep" in done.output
    assert "Traceback" not in done.output
