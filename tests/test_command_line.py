"""The command line as its user meets it."""

import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from forked_commands import run

from borechain.__main__ import COMMANDS
from telemetry.runtime.one_thread import ONE_THREAD


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_has_help_with_an_example_on_a_line_of_its_own(name: str) -> None:
    done = run(name, "--help")
    assert done.returncode == 0
    assert f"\n    borechain {name}" in done.stdout
    assert "\\b" not in done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(
    ("words", "named"),
    [
        (("drill",), "No such command 'drill'"),
        (("rig",), "Missing argument 'SCENARIO'"),
        (("rig", "x.toml", "--speed", "fast"), "expected max or a number"),
        (("rig", "x.toml", "--speed", "0"), "expected max or a factor"),
        (("rig", "x.toml", "--seed", "-1"), "-1"),
        (("node", "--tube", "0"), "expected 1..250, got 0"),
        (("node", "--tube", "1", "--stiffness-nm", "-1"), "stiffness: expected more than 0 N m/rad, got -1.0"),
        (("node", "--tube", "1", "--joints", "both", "--scheme", "estimate"), "joints: expected marks with a scheme"),
        (("encoder", "--torque-nm", "-5"), "torque.drilling: expected 0..1e+06 N m, got -5.0"),
        (("query", "borechain/#bad", "--endpoint", "tcp/127.0.0.1:1"), "borechain/#bad: expected a key expression"),
        (("watch", "borechain/#bad", "--endpoint", "tcp/127.0.0.1:1"), "borechain/#bad: expected a key expression"),
        (("query", "borechain/*/ground/status", "--endpoint", "nonsense"), "expected tcp/HOST:PORT, got nonsense"),
        (("node", "--tube", "1", "--endpoint", "nonsense"), "expected tcp/HOST:PORT, got nonsense"),
        (("ground", "--rig", "a b"), "rig: String should match pattern"),
        (("ground", "--tube-length-m", "-1"), "--tube-length-m"),
        (("ground", "--key-file", "missing.key"), "missing.key"),
        (("node", "--tube", "1", "--key-file", "missing.key"), "missing.key"),
        (("encoder", "--folder", "pyproject.toml"), "--folder"),
        (("node", "--tube", "1", "--keys", "missing"), "missing"),
        (("node", "--tube", "1", "--keys", "docs", "--key-file", "x"), "--key-file and --keys: expected one of them"),
        (("node", "--tube", "1", "--keys", "docs"), "docs/tube-1.keys: No such file"),
        (("rig", "rig-3", "--endpoint", "tcp/0.0.0.0:7447"), "--insecure allows it"),
        (("router", "--endpoint", "tcp/router:7447"), "expected tls/HOST:PORT, or an address of this machine alone"),
        (("node", "--tube", "1", "--clock", "own", "--above", "2", "--upper", "zenoh:tcp/10.0.0.1:1"), "--insecure"),
        (("query", "borechain/*/ground/status", "--endpoint", "tls/127.0.0.1:1"), "expected --keys with it"),
        (("pki", "tube", "7", "--folder", "nowhere"), "nowhere/rig.secret: No such file"),
        (("rig", "wellbor-1"), "did you mean wellbore-1?"),
        (("scenario", "show", "wellbor-1"), "did you mean wellbore-1?"),
        (("survey", "record.csv", "--out", "stations.parquet"), "expected a name that ends in .csv"),
    ],
)
def test_a_wrong_argument_is_refused_in_words(words: tuple[str, ...], named: str) -> None:
    done = run(*words)
    assert done.returncode in (1, 2)
    assert named in done.stderr
    assert "Traceback" not in done.stderr
    assert done.stdout == ""


def test_a_name_that_is_wrong_is_told_before_a_rig_that_runs() -> None:
    with socket.create_server(("127.0.0.1", 0)) as other:
        done = run("rig", "wellbor-1", "--endpoint", f"tcp/127.0.0.1:{other.getsockname()[1]}")
    assert done.returncode == 2
    assert "did you mean wellbore-1?" in done.stderr


def test_a_folder_that_is_used_is_told_before_a_kernel_is_compiled(tmp_path: Path) -> None:
    used, line = tmp_path / "used", tmp_path / "line.txt"
    used.mkdir()
    (used / "result.json").write_text("{}")
    line.write_text("no folder")
    begun = "from borechain.cli.rig import rig_command; rig_command.compile_for_rig = lambda *_: print('begun'); "
    for folder, said in ((used, "expected a new or empty folder, it holds an earlier run"), (line, "Not a directory")):
        call = f"{begun}rig_command.rig(['wellbore-1', '--inline', '--out', {str(folder)!r}])"
        done = subprocess.run([sys.executable, "-c", call], capture_output=True, text=True, check=False)
        assert (done.returncode, done.stdout) == (1, ""), done.stderr
        assert f"output folder {folder}: {said}" in done.stderr
    assert (used / "result.json").read_text() == "{}"
    assert line.read_text() == "no folder"


@pytest.mark.slow
def test_options_may_stand_in_a_file(tmp_path: Path) -> None:
    path = tmp_path / "node.toml"
    path.write_text('tube = 0\nendpoint = "tcp/127.0.0.1:1"\n')
    assert "expected 1..250, got 0" in run("node", "--config", str(path)).stderr
    path.write_text("tube = 3\ncolour = 1\n")
    refused = run("node", "--config", str(path))
    assert refused.returncode == 2
    assert "colour: unknown key; expected one of above, below, clock, compiled-by, drive-joint-deg" in " ".join(
        refused.stderr.split()
    )
    path.write_text("tube = ")
    assert "not TOML" in run("node", "--config", str(path)).stderr
    assert run("node", "--config", str(tmp_path / "none.toml")).returncode == 2


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("borechain ri", {"plain,rig"}),
        ("borechain rig well", {"plain,wellbore-1", "plain,wellbore-1-wet-clay", "file,well"}),
        ("borechain survey x.csv --method mini", {"plain,minimum-curvature"}),
    ],
)
def test_a_shell_completes_commands_scenarios_and_options(words: str, offered: set[str]) -> None:
    variables = {"_BORECHAIN_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" "))}
    command = [sys.executable, "-c", "from borechain.__main__ import main; main()"]
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=False, timeout=60)
    assert done.stderr == ""
    assert set(done.stdout.split()) == offered


def test_a_shell_gets_its_completion_script() -> None:
    command = [sys.executable, "-c", "from borechain.__main__ import main; main()"]
    for shell in ("bash", "zsh", "fish"):
        variables = {"_BORECHAIN_COMPLETE": f"{shell}_source"}
        done = subprocess.run(
            command, env=os.environ | variables, capture_output=True, text=True, check=False, timeout=60
        )
        assert done.returncode == 0, done.stderr
        assert "_BORECHAIN_COMPLETE" in done.stdout


def test_the_version_is_told() -> None:
    assert run("--version").stdout.startswith("borechain, version ")


@pytest.mark.parametrize(("told", "threads"), [(None, "1"), ("2", "2")])
def test_matrices_are_multiplied_in_one_thread_unless_the_environment_says_how_many(
    told: str | None, threads: str
) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in ONE_THREAD}
    environment |= dict.fromkeys(ONE_THREAD, told) if told else {}
    lines = (
        "import os; from borechain.__main__ import cli; cli(['check', '--help'], standalone_mode=False)\n"
        f"print(*map(os.environ.get, {ONE_THREAD}))"
    )
    said = subprocess.run([sys.executable, "-c", lines], env=environment, capture_output=True, text=True, check=True)
    assert said.stdout.splitlines()[-1].split() == [threads] * len(ONE_THREAD)
