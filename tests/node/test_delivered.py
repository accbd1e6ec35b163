"""Kernels that come with an installation: unpacked once, loaded without compiling, left alone where they do not fit."""

import os
import platform
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from test_kernel_cache import copied

from node.kernels.arithmetic.delivered import BASELINES, archive_name, find_delivered, pack_kernels

PROGRAM = """
import hashlib, sys
from numba import config
from node.kernels.arithmetic import integers, jit
found = [int(integers.root_of(value)) for value in (0, 1, 2**40 + 7, 2**61)]
hits, misses = (sum(getattr(integers.root_of.stats, name).values()) for name in ("cache_hits", "cache_misses"))
print(hits, misses, jit.folder_in_use().name, jit.processor_in_use(), found)
"""

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(platform.machine() not in BASELINES, reason=f"no baseline is known of {platform.machine()}"),
]


def start(copy: Path, cache: Path, **environment: str) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    return subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=copy,
        env=kept | {"XDG_CACHE_HOME": str(cache), "PYTHONPATH": str(copy)} | environment,
        capture_output=True,
        text=True,
        check=True,
        timeout=250,
    )


def digest_of(said: str) -> str:
    """Digest of the sources, from the name of the folder of their kernels."""
    return said.split()[2].removeprefix("kernels-").removesuffix("-delivered")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the sources with the archive of what they were compiled to for the baseline."""
    folder = tmp_path_factory.mktemp("delivered")
    copy, name = copied(folder / "site"), BASELINES[platform.machine()]
    done = start(copy, folder / "made", NUMBA_CPU_NAME=name.name, NUMBA_CPU_FEATURES=name.features)
    assert done.stdout.split()[:2] == ["0", "1"]
    (cache,) = (folder / "made" / "borechain").iterdir()
    pack_kernels(cache, digest_of(done.stdout), copy / "node" / "delivered")
    return copy


def test_delivered_kernels_are_loaded_and_not_compiled(wheel: Path, tmp_path: Path) -> None:
    first, second = (start(wheel, tmp_path) for _ in range(2))
    assert first.stdout.split()[:2] == ["1", "0"]
    assert f"{BASELINES[platform.machine()].name}, delivered" in first.stdout
    assert second.stdout == first.stdout
    assert (first.stderr, second.stderr) == ("", "")


def test_they_give_what_kernels_compiled_for_this_processor_give(wheel: Path, tmp_path: Path) -> None:
    host = start(wheel, tmp_path, NUMBA_OPT="3")
    assert host.stdout.split()[:2] == ["0", "1"]
    assert "compiled here" in host.stdout
    assert host.stdout.partition("[")[2] == start(wheel, tmp_path).stdout.partition("[")[2]


def test_processes_that_start_at_once_all_load_them(wheel: Path, tmp_path: Path) -> None:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    environment = kept | {"XDG_CACHE_HOME": str(tmp_path), "PYTHONPATH": str(wheel)}
    command = [sys.executable, "-c", PROGRAM]
    started = [
        subprocess.Popen(command, cwd=wheel, env=environment, stdout=subprocess.PIPE, text=True) for _ in range(6)
    ]
    assert {process.communicate(timeout=250)[0].split()[1] for process in started} == {"0"}
    (left,) = (tmp_path / "borechain").iterdir()  # and no half of them
    assert left.name.endswith("-delivered")


def test_a_home_that_cannot_be_written_loads_them_too_and_so_do_its_children(wheel: Path, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = start(wheel, tmp_path / "file", TMPDIR=str(tmp_path))
    assert done.stdout.split()[:2] == ["1", "0"]
    assert "delivered" in done.stdout.partition(", ")[2]
    assert len(done.stderr.splitlines()) == 1


def test_a_damaged_archive_is_named_and_the_kernels_are_compiled(wheel: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(wheel, tmp_path / "site"))
    (archive,) = (copy / "node" / "delivered").iterdir()
    archive.write_bytes(archive.read_bytes()[:-700])
    done = start(copy, tmp_path / "cache")
    assert done.stdout.split()[:2] == ["0", "1"]
    (line,) = done.stderr.splitlines()
    assert line.startswith(f"borechain: expected compiled kernels in {archive} (")
    assert line.endswith("; they are compiled here")


def test_kernels_of_other_sources_are_left_alone(wheel: Path, tmp_path: Path) -> None:
    copy = Path(shutil.copytree(wheel, tmp_path / "site"))
    with (copy / "node" / "kernels" / "arithmetic" / "integers.py").open("a") as kernel:
        kernel.write("# edited\n")
    done = start(copy, tmp_path / "cache")
    assert done.stdout.split()[:2] == ["0", "1"]
    assert "compiled here" in done.stdout


@pytest.mark.parametrize("name", ["NUMBA_OPT", "NUMBA_BOUNDSCHECK", "NUMBA_CPU_NAME"])
def test_other_code_is_compiled_where_it_is_asked_for(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for variable in ("NUMBA_OPT", "NUMBA_BOUNDSCHECK", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES"):
        monkeypatch.delenv(variable, raising=False)
    (tmp_path / archive_name("d1")).touch()
    assert find_delivered("d1", tmp_path) is not None
    assert find_delivered("d2", tmp_path) is None
    monkeypatch.setenv(name, "1")
    assert find_delivered("d1", tmp_path) is None
