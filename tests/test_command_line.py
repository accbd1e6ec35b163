"""The command line as its user meets it."""

import subprocess
import sys

import pytest

from borechain.__main__ import COMMANDS


def run(*words: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "borechain", *words], capture_output=True, text=True, check=False, timeout=60
    )


@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_has_help_with_an_example_on_a_line_of_its_own(name: str) -> None:
    done = run(name, "--help")
    assert done.returncode == 0
    assert f"\n    borechain {name}" in done.stdout
    assert "\\b" not in done.stdout


@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("drill",), "No such command 'drill'"),
        (("rig",), "Missing argument 'SCENARIO'"),
        (("rig", "x.toml", "--speed", "fast"), "expected max or a number"),
        (("rig", "x.toml", "--speed", "0"), "expected max or a factor"),
        (("rig", "x.toml", "--seed", "-1"), "-1"),
        (("node", "--tube", "0"), "expected 1..250, got 0"),
        (("query", "borechain/#bad", "--endpoint", "nonsense"), "nonsense"),
    ],
)
def test_a_wrong_argument_is_refused_in_words(words: tuple[str, ...], named: str) -> None:
    done = run(*words)
    assert done.returncode in (1, 2)
    assert named in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_the_version_is_told() -> None:
    assert run("--version").stdout.startswith("borechain, version ")
