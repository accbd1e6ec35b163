"""The wheel in fresh environments, outside the checkout: every command helps, and does its job or says what it needs.

Each environment holds exactly what the wheel's metadata asks for, base or with one extra: the distributions are linked
from the environment of the tests, so nothing is downloaded. Other versions of Python need wheels of their own; where
such an interpreter is found, they are installed from the configured index.
"""

from __future__ import annotations

import json
import os
import queue
import re
import shutil
import signal
import subprocess
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path

import forked_commands
import pytest
from packaging.requirements import Requirement
from rigs import free_endpoint

from telemetry.keys import DEFAULT_RIG, port_key
from telemetry.media.zenoh_bus import open_router
from telemetry.messages import Side

pytestmark = pytest.mark.install
ROOT = Path(__file__).parents[1]
EXTRAS = ("", "board", "ground")
OURS = ("borechain", "groundstation", "node", "sim", "telemetry")
RECORD = str(ROOT / "scenarios" / "wellbore-1-path.csv")
TURN_TABLE = str(ROOT / "tests" / "data" / "calibration" / "calibration_node_a1_gyro.csv")
NEEDS = re.compile(r"Error: needs the extra (\w+): pip install 'borechain\[(\w+)\]' \(\w+ is not installed\)\n")
# a command that connects is given an endpoint without a listener: it has passed every check of its options then
NOWHERE = ("--endpoint", "tcp/127.0.0.1:1")
WALK = """
import contextlib, io, click
from borechain.__main__ import cli

def walk(command, words):
    text = io.StringIO()
    with contextlib.redirect_stdout(text):
        command.main([*words, "--help"], prog_name="borechain", standalone_mode=False)
    assert f"Usage: borechain {' '.join(words)}".strip() in text.getvalue(), text.getvalue()
    count = 1
    found = cli
    context = click.Context(cli)
    for word in words:
        found = found.get_command(context, word)
    if isinstance(found, click.Group):
        count += sum(walk(command, [*words, name]) for name in found.list_commands(context))
    return count

print(walk(cli, []))
"""


@dataclass(frozen=True, slots=True)
class Environment:
    """A fresh environment and a folder outside the checkout to work in."""

    python: Path
    folder: Path

    def run(self, *words: str, program: tuple[str, ...] = ("-m", "borechain")) -> subprocess.CompletedProcess[str]:
        return subprocess.run(
            [self.python, *program, *words],
            cwd=self.folder,
            env=surroundings(),
            capture_output=True,
            text=True,
            check=False,
            timeout=240,
        )

    @property
    def site(self) -> Path:
        return next((self.python.parents[1] / "lib").glob("python*/site-packages"))


def surroundings() -> dict[str, str]:
    """Variables of a process that must not find the checkout; compiled kernels are known by their sources alone."""
    return {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "COVERAGE"))}


def pip(python: Path, *words: str | Path) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile", *words]
    return subprocess.run(command, capture_output=True, text=True, check=False, timeout=240)


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    build = [sys.executable, "-m", "pip", "wheel", "--quiet", "--no-build-isolation", "--no-deps"]
    subprocess.run([*build, "--wheel-dir", folder, ROOT], check=True, cwd=folder)
    return next(folder.glob("*.whl"))


def requirements(wheel: Path) -> list[str]:
    with zipfile.ZipFile(wheel) as content:
        name = next(name for name in content.namelist() if name.endswith(".dist-info/METADATA"))
        lines = content.read(name).decode().splitlines()
    return [line.partition(": ")[2] for line in lines if line.startswith("Requires-Dist: ")]


def closure(asked: list[str], extra: str, found: dict[str, metadata.Distribution]) -> dict[str, metadata.Distribution]:
    """Every distribution that ``asked`` needs with ``extra``, from the environment of the tests."""
    for text in asked:
        needed = Requirement(text)
        if needed.marker is not None and not needed.marker.evaluate({"extra": extra}):
            continue
        name = needed.name.lower().replace("_", "-")
        if name not in found:
            found[name] = metadata.distribution(needed.name)
            for inner in ("", *needed.extras):
                closure(found[name].requires or [], inner, found)
    return found


def fresh(wheel: Path, extra: str, folder: Path) -> Environment:
    """An environment with the wheel and what its metadata asks for."""
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", folder / "venv"], check=True)
    made = Environment(folder / "venv" / "bin" / "python", folder / "work")
    made.folder.mkdir()
    for distribution in closure(requirements(wheel), extra, {}).values():
        for top in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            if not (made.site / top).exists():
                (made.site / top).symlink_to(Path(str(distribution.locate_file(top))))
    done = pip(made.python, "--no-deps", "--no-index", wheel)
    assert done.returncode == 0, done.stderr
    return made


def test_all_is_every_extra_of_an_installation(wheel: Path) -> None:
    asked = [Requirement(text) for text in requirements(wheel)]
    parts = {
        extra: {r.name for r in asked if r.marker is not None and r.marker.evaluate({"extra": extra})}
        for extra in ("all", "board", "campaign", "can", "files", "ground", "page", "postgresql")
    }
    assert parts.pop("all") == set().union(*parts.values())
    assert parts["page"] < parts["ground"]


def test_a_live_page_needs_nothing_beyond_its_extra() -> None:
    """What a demonstration's processes import, with all that only another extra brings out of the way."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        extras = tomllib.load(file)["project"]["optional-dependencies"]
    brought = {Requirement(text).name for text in extras["page"]}
    others = {Requirement(text).name for extra in ("all", "dev") for text in extras[extra]} - brought
    program = f"""
import sys
sys.modules.update(dict.fromkeys({sorted(name.replace("-", "_") for name in others)!r}))
import borechain.cli.rig.demo, borechain.drilling.rig_processes, groundstation.ground_host
import groundstation.gateway.page.application, groundstation.gateway.page.server
"""
    done = subprocess.run([sys.executable, "-c", program], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[-2000:]


def test_a_wheel_holds_its_data_and_its_types(wheel: Path) -> None:
    with zipfile.ZipFile(wheel) as content:
        names = set(content.namelist())
    assert {f"{package}/py.typed" for package in OURS} <= names
    assert {f"sim/{path.relative_to(ROOT)}" for path in (ROOT / "scenarios").rglob("*.*")} <= names
    data = [*(ROOT / "groundstation").rglob("*.to*ml"), *(ROOT / "groundstation" / "gateway").rglob("static/**/*.*")]
    assert {str(path.relative_to(ROOT)) for path in data} <= names


JOBS = [  # words, the extra that the job needs or None, status and a word of its output where it is there
    (("scenario", "list", "--json"), None, 0, "wellbore-1"),
    (("scenario", "show", "wellbore-1"), None, 0, "[rig]"),
    (("survey", RECORD, "--json"), None, 0, "stations"),
    (("survey", RECORD), "ground", 0, "closure"),
    (("survey", RECORD, "--json", "--plot", "survey.svg"), "ground", 0, "stations"),
    (("wall", str(ROOT / "scenarios" / "walls" / "wall-40.toml"), "--json"), "ground", 3, "joints"),
    (("calibrate", "turntable", TURN_TABLE, "--reference", "720", "--json"), None, 0, "matrix"),
    (
        ("calibrate", "turntable", TURN_TABLE, "--reference", "720", "--json", "--certificate", "a.pdf"),
        "ground",
        0,
        "matrix",
    ),
    (("node", "--tube", "1", "--imu", "mpu6500:1", "--imu-noise", "-1"), "board", 2, "noise"),
    (("medium", "rig-3", "--speed", "0"), None, 2, "expected max or a factor"),
    (("ground", "--key-file", "missing.key", *NOWHERE), "ground", 1, "missing.key"),
    (("rig", "rig-3", "--endpoint", "nonsense", "--out", "never"), "ground", 1, "expected tcp/HOST:PORT"),
    (("ground", "--page", "0.0.0.0:8080", *NOWHERE), "ground", 2, "--insecure allows it"),
    (("demo", "--page", "nonsense"), "ground", 2, "page: expected HOST:PORT"),
    (("query", "borechain/*/ground/status", "--timeout", "0.2", *NOWHERE), None, 1, "no router at"),
    (("crew", *NOWHERE), "ground", 1, "no router at"),
    (("replay", "missing.mcap"), "ground", 2, "missing.mcap"),
    (("campaign", "rig-3", "--runs", "1", "--json"), "campaign", 0, "honesty"),
    (("bench", "survey", "--json"), None, 1, "are in the repository"),
    (("link", "load", "--tubes", "10", "--json"), None, 0, "load_percent"),
    (("link", "dbc"), None, 0, "BO_ "),
    (("link", "dbc", "--check", RECORD), "can", 2, "expected a DBC file"),
]


@pytest.mark.parametrize("extra", EXTRAS, ids=lambda extra: extra or "base")
def test_every_command_helps_and_does_its_job_or_names_the_extra_it_needs(
    wheel: Path, tmp_path: Path, extra: str
) -> None:
    environment = fresh(wheel, extra, tmp_path)
    helped = environment.run("-c", WALK, program=())
    assert helped.returncode == 0, helped.stderr
    assert int(helped.stdout) > 30
    started = environment.run("--version")
    assert (started.returncode, "version" in started.stdout) == (0, True), started.stderr
    with forked_commands.Forker(environment.python, cwd=environment.folder, env=surroundings()) as forker:
        check_jobs(environment, forker, extra)
    assert not (environment.folder / "never").exists()
    assert (environment.folder / "run").exists() == (extra == "ground")
    if extra == "ground":
        assert "Usage: python -m groundstation" in environment.run("--help", program=("-m", "groundstation")).stdout
    else:
        assert NEEDS.fullmatch(environment.run(program=("-m", "groundstation")).stderr)
    overwritten = environment.site / "node" / "__init__.py"
    overwritten.write_text('"""A foreign one, installed over ours."""\n')
    refused = environment.run("router")
    assert (refused.returncode, len(refused.stderr.splitlines())) == (1, 1)
    assert str(overwritten) in refused.stderr


def check_jobs(environment: Environment, forker: forked_commands.Forker, extra: str) -> None:
    """Every command does its job there, or names the extra that it needs."""
    for words, needed, status, expected in JOBS:
        done = forked_commands.run(*words, cwd=environment.folder, source=forker)
        assert "Traceback" not in done.stderr, done.stderr
        if needed in (None, extra):
            assert (done.returncode, expected in done.stdout + done.stderr) == (status, True), (words, done.stderr)
        else:
            refused = NEEDS.fullmatch(done.stderr)
            assert refused is not None, (words, done.stderr)
            assert refused.groups() == (needed, needed), words
            assert (done.returncode, done.stdout) == (1, "")
    drilled = forked_commands.run(
        "rig", "rig-3", "--inline", "--json", "--out", "run", cwd=environment.folder, source=forker
    )
    if extra == "ground":
        assert [station["md_m"] for station in json.loads(drilled.stdout)["stations"]] == [2.0, 4.0, 6.0]
    else:
        assert NEEDS.fullmatch(drilled.stderr)


@pytest.fixture
def board(wheel: Path, tmp_path: Path) -> Iterator[Environment]:
    """What a tube's board holds: node and telemetry, nothing else of ours."""
    made = fresh(wheel, "board", tmp_path)
    for package in set(OURS) - {"node", "telemetry"}:
        shutil.rmtree(made.site / package)
    return made


def test_a_board_runs_its_node_without_the_other_packages(board: Environment) -> None:
    (board.folder / "imu.csv").write_text("".join(f"{k / 1.9},0,0,0,0,0,-9.81\n" for k in range(600)))
    endpoint = free_endpoint()
    own = ("--clock", "own", "--imu", "replay:imu.csv", "--above", "encoder", "--endpoint", endpoint)
    frames: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    with open_router(endpoint) as bus:
        bus.subscribe(port_key(DEFAULT_RIG, 1, Side.UPPER, "tx"), lambda _key, frame: frames.put(frame))
        command = [board.python, "-m", "node", "--tube", "1", *own]
        with subprocess.Popen(command, cwd=board.folder, env=surroundings()) as node:
            assert frames.get(timeout=240)
            node.send_signal(signal.SIGTERM)
            assert node.wait(60) == 0
    assert "Usage: python -m node encoder" in board.run("encoder", "--help", program=("-m", "node")).stdout
    refused = board.run("--tube", "0", program=("-m", "node"))
    assert (refused.returncode, refused.stderr) == (2, "Error: tube: expected 1..250, got 0\n")


@pytest.mark.parametrize("name", ["node", "telemetry", "sim", "groundstation"])
def test_a_package_of_somebody_else_is_named_with_its_place(tmp_path: Path, name: str) -> None:
    foreign = tmp_path / "foreign" / name / "__init__.py"
    foreign.parent.mkdir(parents=True)
    foreign.write_text('"""A foreign one."""\n')
    path = [str(foreign.parents[1]), str(ROOT)]
    program = f"import sys; sys.path[:0] = {path}; from borechain.__main__ import main; main(['router'])"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False, timeout=60)
    assert done.returncode == 1
    assert len(done.stderr.splitlines()) == 1
    assert str(foreign) in done.stderr


def test_the_lowest_numba_allowed_does_what_the_kernels_lean_on(tmp_path: Path) -> None:
    """Of numba's private modules, see ``node.kernels.arithmetic.compiler``; no later one may be the first to do it."""
    asked = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    lowest = {needed.name: str(needed.specifier).removeprefix(">=") for needed in map(Requirement, asked)}
    subprocess.run([sys.executable, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    made = Environment(tmp_path / "venv" / "bin" / "python", tmp_path)
    done = pip(made.python, "--only-binary", ":all:", f"numba=={lowest['numba']}", f"numpy>={lowest['numpy']}")
    if done.returncode:
        pytest.skip(f"numba {lowest['numba']}: the index has no wheel of it: {done.stderr.strip().splitlines()[-1]}")
    for distribution in closure(["pytest"], "", {}).values():
        for top in {file.parts[0] for file in distribution.files or ()} - {"..", "__pycache__"}:
            (made.site / top).symlink_to(Path(str(distribution.locate_file(top))))
    options = ("--noconftest", "-c", os.devnull, "-p", "no:cacheprovider", "-W", "ignore::pytest.PytestWarning")
    tests = [str(ROOT / "tests" / "node" / f"test_{name}.py") for name in ("compiler", "whole_compilation")]
    program = f"import sys; sys.path.insert(0, {str(ROOT)!r}); import numba, pytest; print(numba.__version__); "
    program += f"sys.exit(pytest.main({[*options, *tests]!r}))"
    done = made.run("-c", program, program=())
    assert (done.returncode, done.stdout.splitlines()[0]) == (0, lowest["numba"]), done.stdout


@pytest.mark.parametrize("version", ["3.12", "3.13"])
def test_another_python_installs_and_surveys(wheel: Path, tmp_path: Path, version: str) -> None:
    found = shutil.which(f"python{version}")
    if found is None or subprocess.run([found, "-c", ""], capture_output=True, check=False).returncode:
        pytest.skip(f"no python{version} on this machine")
    subprocess.run([found, "-m", "venv", "--without-pip", tmp_path / "venv"], check=True)
    made = Environment(tmp_path / "venv" / "bin" / "python", tmp_path)
    pinned = re.findall(r"^([a-zA-Z0-9_.-]+==[^ \\]+)", (ROOT / "requirements.lock").read_text(), re.MULTILINE)
    constraints = tmp_path / "constraints.txt"
    constraints.write_text("\n".join(pinned))
    done = pip(made.python, "--only-binary", ":all:", "--constraint", constraints, wheel)
    if done.returncode:
        pytest.skip(f"python{version}: the index has no wheels for it: {done.stderr.strip().splitlines()[-1]}")
    done = made.run("survey", RECORD, "--json")
    assert done.returncode == 0, done.stderr
    assert len(json.loads(done.stdout)["stations"]) == 11
    done = made.run("-c", WALK, program=())
    assert done.returncode == 0, done.stderr
