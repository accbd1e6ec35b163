"""Kernels compiled whole: the same numbers, nothing missing inside, and only what was called from outside is kept.

tests/test_installation.py runs this file with the lowest numba that pyproject.toml allows as well.
"""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
KERNELS = """
import math
from node.kernels.arithmetic.jit import kernel

@kernel
def lowest(x: float, n: int) -> float:
    total = 0.0
    for k in range(n):
        total += math.sin(x * k) / (k + 1)
    if n > 1000000:
        raise ValueError("too many")
    return total

@kernel
def left(x: float, n: int) -> float:
    return lowest(x, n) * x + math.exp(-x)

@kernel
def right(x: float, n: int) -> float:
    return left(x + 1.0, n) - lowest(x, n + 1)

@kernel
def top(x: float, n: int) -> float:
    return lowest(x, 3) + left(x, n) * right(x, n)

@kernel
def other(x: float, n: int) -> float:
    return right(x, n) + left(x, n)
"""
PROGRAM = """
import contextlib, sys
import inside
from borechain.drilling.whole_compilation import compiled_whole
from node.kernels.arithmetic.jit import folder_in_use

with compiled_whole() if sys.argv[1] == "whole" else contextlib.nullcontext():
    found = [getattr(inside, name)(x / 7, 5).hex() for name in sys.argv[2].split(",") for x in range(-9, 9)]
kept = sorted(path.name.rpartition("-")[0] for path in folder_in_use().rglob("*.nbc"))
print(*found, *kept, sep="\\n")
print(*(getattr(inside, name)(x / 7, 5).hex() for name in sys.argv[3].split(",") for x in range(-9, 9)), sep="\\n")
hits = sum(sum(getattr(inside, name).stats.cache_hits.values()) for name in sys.argv[2].split(","))
print(hits)
"""


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    made = tmp_path_factory.mktemp("whole")
    (made / "inside.py").write_text(KERNELS)
    return made


def run(folder: Path, cache: Path, *words: str) -> list[str]:
    cache.mkdir(exist_ok=True)
    environment = os.environ | {"NUMBA_CACHE_DIR": str(cache), "PYTHONPATH": f"{folder}:{ROOT}"}
    command = [sys.executable, "-c", PROGRAM, *words]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=False, timeout=250)
    assert done.returncode == 0, done.stderr
    return done.stdout.split()


@pytest.fixture(scope="module")
def usual(folder: Path) -> dict[str, list[str]]:
    """Numbers of kernels that numba compiles one by one."""
    said = run(folder, folder / "usual", "usual", "lowest,left,right,top,other", "top")
    return {name: said[18 * k : 18 * (k + 1)] for k, name in enumerate(("lowest", "left", "right", "top", "other"))}


@pytest.mark.slow
def test_numbers_are_those_of_numba_and_only_what_was_called_is_kept(
    folder: Path, usual: dict[str, list[str]], tmp_path: Path
) -> None:
    said = run(folder, tmp_path / "kept", "whole", "top,other", "top")
    assert said[:36] == usual["top"] + usual["other"]
    assert said[36:38] == ["inside.other", "inside.top"]
    again = run(folder, tmp_path / "kept", "usual", "top,other", "top")  # loaded, with all that is inside
    assert again[:36] == said[:36]
    assert again[-1] == "2"


@pytest.mark.slow
def test_what_was_inside_can_be_called_meanwhile_and_afterwards(
    folder: Path, usual: dict[str, list[str]], tmp_path: Path
) -> None:
    said = run(folder, tmp_path / "kept", "whole", "other,left", "right,lowest")
    assert said[:36] == usual["other"] + usual["left"]
    assert said[36:38] == ["inside.left", "inside.other"]
    assert said[38:74] == usual["right"] + usual["lowest"]


@pytest.mark.slow
def test_a_kernel_takes_in_one_that_was_kept_before(folder: Path, usual: dict[str, list[str]], tmp_path: Path) -> None:
    """As the part ``step`` takes in the end of a step, which another process compiles."""
    run(folder, tmp_path / "kept", "whole", "right", "right")
    said = run(folder, tmp_path / "kept", "whole", "top,other", "right")
    assert said[:36] == usual["top"] + usual["other"]
    assert said[36:39] == ["inside.other", "inside.right", "inside.top"]
