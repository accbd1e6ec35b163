"""Kernels compiled before a rig begins: in processes beside each other, told as they come, once."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from rigs import REPOSITORY

from borechain.drilling.compile_ahead import ABOUT, PARTS_OF
from borechain.drilling.kernel_parts import PARTS

PROGRAM = """
import contextlib, sys
from borechain.drilling.compile_ahead import are_compiled, compile_ahead

told = []

@contextlib.contextmanager
def show(count):
    told.append(count)
    yield told.append

compile_ahead(sys.argv[1], show)
print(are_compiled(sys.argv[1]), len(told), max(told, default=0))
"""
LACKING = "node.kernels.string.encoder_step"  # a second to compile


@pytest.fixture
def cache(tmp_path: Path) -> Path:
    """What is compiled here, but for the encoder; no part is marked."""
    from node.kernels.arithmetic.jit import folder_in_use
    from node.kernels.step.precompile import warm_up

    warm_up()
    kept = tmp_path / "kernels"
    shutil.copytree(folder_in_use(), kept, copy_function=os.symlink)
    shutil.rmtree(kept / LACKING, ignore_errors=True)
    for mark in (path for path in kept.iterdir() if path.name.partition("-")[0] in PARTS):
        mark.unlink()
    return kept


def run(cache: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.timeout(600)
def test_what_is_lacking_is_compiled_and_told_and_then_never_again(cache: Path) -> None:
    first = run(cache, "-c", PROGRAM, "float64").stdout.split()
    assert first[0] == "True"
    assert int(first[1]) > 1
    assert list((cache / LACKING).glob("*.nbc"))
    assert run(cache, "-c", PROGRAM, "float64").stdout.split() == ["True", "0", "0"]
    next(cache.glob("surveys-*")).unlink()
    assert run(cache, "-c", PROGRAM, "float64").stdout.split()[:2] == ["True", "1"]  # all is there: nothing is compiled


def test_a_part_that_fails_is_not_taken_for_compiled(cache: Path) -> None:
    shutil.rmtree(cache / LACKING, ignore_errors=True)
    (cache / LACKING).touch()  # where its folder is to be
    done = run(cache, "-c", PROGRAM, "float64")
    assert done.stdout.split()[0] == "False", done.stderr
    assert not list(cache.glob("surveys-*"))


def test_a_rig_says_that_it_compiles(cache: Path, tmp_path: Path) -> None:
    words = ("-m", "borechain", "rig", "rig-3", "--inline", "--json", "--out", str(tmp_path / "run"))
    first, second = run(cache, *words), run(cache, *words[:-1], str(tmp_path / "other"))
    count = sum(ABOUT[part] for part in PARTS_OF["float64"])
    assert first.stderr.splitlines()[0].startswith(f"compiling about {count} functions for this machine: ")
    assert "compil" not in second.stderr
    assert json.loads(first.stdout)["digest"] == json.loads(second.stdout)["digest"]


def test_every_kernel_of_a_node_has_its_parts() -> None:
    from node.firmware.tube_settings import KERNELS

    assert set(KERNELS) <= PARTS_OF.keys()
    assert PARTS.keys() == ABOUT.keys()


SET_UP = REPOSITORY / "deploy" / "set_up_shown.py"


@pytest.fixture
def venv(tmp_path: Path) -> Path:
    """What a new environment has when its compiler is there."""
    (tmp_path / "venv" / "bin").mkdir(parents=True)
    python = tmp_path / "venv" / "bin" / "python"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} "$@"\n')
    python.chmod(0o755)
    return tmp_path / "venv"


@pytest.mark.timeout(600)
def test_kernels_are_compiled_beside_an_installation_and_stages_are_told(cache: Path, venv: Path) -> None:
    """The installation waits for a kernel that only the compiler beside it brings."""
    waits = f"touch {venv}/.compiler; until ls {cache}/{LACKING}/*.nbc; do sleep 0.1; done"
    done = run(cache, str(SET_UP), str(venv), "sh", "-c", waits)
    assert done.returncode == 0, done.stderr
    assert done.stderr.splitlines() == ["installing packages, once", "compiling kernels, once"]
    assert run(cache, "-c", PROGRAM, "float64").stdout.split() == ["True", "0", "0"]


def test_a_failed_installation_says_what_it_said_and_compiles_nothing(cache: Path, venv: Path) -> None:
    (venv / ".compiler").touch()  # of the environment before
    done = run(cache, str(SET_UP), str(venv), "sh", "-c", "echo no package; exit 3")
    assert done.returncode == 3
    assert done.stderr.splitlines() == ["installing packages, once", "no package", f"setting up {venv} failed"]
    assert not (cache / LACKING).exists()


def test_a_terminal_sees_a_bar_while_nothing_is_there_yet(venv: Path, tmp_path: Path) -> None:
    import pty

    os.mkfifo(tmp_path / "go")
    ours, theirs = pty.openpty()
    begun = subprocess.Popen([sys.executable, SET_UP, venv, "cat", tmp_path / "go"], stderr=theirs)
    shown = b""
    while b"s  installing packages" not in shown:
        shown += os.read(ours, 1000)
    assert shown.startswith(b"\r[")
    assert begun.poll() is None
    (tmp_path / "go").write_text("")
    assert begun.wait() == 0
    assert os.read(ours, 100000).endswith(b"\r\x1b[K")
    os.close(theirs)
    os.close(ours)
