"""Parts of a rig's kernels: forked off one compiler, and of an adjustment the loops kept."""

import contextlib
import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[1]
LOOKING = """
import sys
from borechain.drilling import kernel_parts
from numba import njit

def look():
    before = set(sys.modules)
    njit(lambda number: [number])(1.0)
    print(*(set(sys.modules) - before), "|", flush=True)

def fail():
    raise SystemExit(3)

kernel_parts.PARTS = {"one": look, "other": look, "failing": fail}
kernel_parts.compile_beside(list(kernel_parts.PARTS))
"""
WAITING = """
import time
from borechain.drilling import kernel_parts

def wait():
    kernel_parts.say_one()
    time.sleep(3600.0)

kernel_parts.end_when_told()
kernel_parts.PARTS = {"one": wait, "other": wait}
kernel_parts.compile_beside(list(kernel_parts.PARTS))
"""
LOOPS = r"""
import re
import sys
import numpy as np
from borechain.drilling.kernel_parts import keep_loops
from numba import njit

def add_product(one, other, out):
    for a in range(4):
        for i in range(4):
            for b in range(4):
                out[a, b] += one[a, i] * other[i, b]

if sys.argv[1] == "kept":
    keep_loops()
made = njit("void(f8[:, ::1], f8[:, ::1], f8[:, ::1])")(add_product)
one, other, out = np.random.default_rng(1).normal(size=(3, 4, 4))
made(one, other, out)
code = next(iter(made.inspect_asm().values()))
print(len(re.findall(r"\tv?f?mul[sp]?d?\t", code)), out.tobytes().hex())
"""
pytestmark = pytest.mark.slow


def run(cache: Path, *words: str) -> subprocess.CompletedProcess[str]:
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache)}
    command = [sys.executable, *words]
    return subprocess.run(command, cwd=REPOSITORY, env=environment, capture_output=True, text=True, check=False)


def test_a_part_finds_the_compiler_loaded_and_is_marked_by_its_end(tmp_path: Path) -> None:
    """Loading it takes a second, and in a new environment its bytecode is written: once, not by every part."""
    done = run(tmp_path, "-c", LOOKING)
    said = [line for line in done.stdout.splitlines() if line != "."]
    assert [line.strip() for line in said] == ["|", "|"], done.stderr
    assert sorted(path.name.partition("-")[0] for path in tmp_path.iterdir()) == ["one", "other"]


def test_loops_that_are_kept_are_less_code_for_the_same_numbers(tmp_path: Path) -> None:
    (short, kept), (long, usual) = (run(tmp_path, "-c", LOOPS, how).stdout.split() for how in ("kept", "usual"))
    assert kept == usual
    assert 3 * int(short) <= 2 * int(long)


def test_who_is_told_to_end_leaves_no_part_behind(tmp_path: Path) -> None:
    """Parts hold the output open as long as they live."""
    environment = os.environ | {"NUMBA_CACHE_DIR": str(tmp_path)}
    command = [sys.executable, "-c", WAITING]
    with subprocess.Popen(
        command, cwd=REPOSITORY, env=environment, stdout=subprocess.PIPE, start_new_session=True
    ) as running:
        try:
            assert running.stdout is not None
            assert [running.stdout.readline() for _ in range(2)] == [b".\n"] * 2
            running.terminate()
            assert running.communicate(timeout=30.0)[0] == b""
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(running.pid, signal.SIGKILL)
    assert running.returncode == 128 + signal.SIGTERM
