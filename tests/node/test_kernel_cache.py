"""Where compiled kernels are kept: a folder that cannot be written is replaced by a temporary one, and said so once."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PROGRAM = (
    "import subprocess, sys; from numba import config; import node.kernels.arithmetic.jit; print(config.CACHE_DIR);"
    "subprocess.run([sys.executable, '-c', 'import node.kernels.arithmetic.jit'], check=True)"
)


def start(cache: Path, temporary: Path) -> subprocess.CompletedProcess[str]:
    kept = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    return subprocess.run(
        [sys.executable, "-c", PROGRAM],
        env=kept | {"XDG_CACHE_HOME": str(cache), "TMPDIR": str(temporary)},
        capture_output=True,
        text=True,
        check=True,
        timeout=60,
    )


@pytest.mark.slow
def test_a_folder_that_can_be_written_is_used_without_a_word(tmp_path: Path) -> None:
    done = start(tmp_path / "cache", tmp_path)
    assert Path(done.stdout.strip()).parent == tmp_path / "cache" / "borechain"
    assert done.stderr == ""


@pytest.mark.slow
def test_another_is_used_and_named_once_for_all_processes(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    done = start(tmp_path / "file", tmp_path)
    folder = Path(done.stdout.strip())
    assert folder.parent == tmp_path
    assert folder.stat().st_mode & 0o777 == 0o700
    assert len(done.stderr.splitlines()) == 1
    assert f"kept in {folder}, for {tmp_path / 'file'}" in done.stderr
    assert Path(start(tmp_path / "file", tmp_path).stdout.strip()) == folder
    for mode in (0o777, 0o750):  # not trusted where others can write or read
        folder.chmod(mode)
        assert Path(start(tmp_path / "file", tmp_path).stdout.strip()) != folder


def copied(folder: Path) -> Path:
    """A copy of what a node is made of, written now."""
    for package in ("node", "telemetry"):
        for source in (ROOT / package).rglob("*.py"):
            made = folder / source.relative_to(ROOT)
            made.parent.mkdir(parents=True, exist_ok=True)
            made.write_bytes(source.read_bytes())
    return folder


def digest_in(folder: Path) -> str:
    program = "from node.kernels.arithmetic.jit import source_digest; print(source_digest())"
    return subprocess.run(
        [sys.executable, "-c", program], cwd=folder, capture_output=True, text=True, check=True
    ).stdout


@pytest.mark.slow
def test_a_copy_of_the_sources_loads_what_was_compiled_of_them(tmp_path: Path) -> None:
    from node.kernels.step.precompile import warm_up

    warm_up()
    program = """
import node, node.kernels.step.node_step as step
from node.kernels.step.precompile import warm_up
warm_up()
print(node.__file__)
print([sum(function.stats.cache_misses.values()) for function in (step.node_step, step.node_aiding)])
"""
    run = [sys.executable, "-c", program]
    done = subprocess.run(run, cwd=copied(tmp_path), capture_output=True, text=True, check=True, timeout=250)
    assert done.stdout.splitlines() == [str(tmp_path / "node" / "__init__.py"), "[0, 0]"]


@pytest.mark.slow
def test_an_edited_kernel_is_another(tmp_path: Path) -> None:
    digest = digest_in(copied(tmp_path))
    assert digest == digest_in(ROOT)
    with (tmp_path / "node" / "kernels" / "turns" / "gates.py").open("a") as kernel:
        kernel.write("# edited\n")
    assert digest_in(tmp_path) != digest


@pytest.mark.slow
def test_processes_of_a_rig_load_no_linear_algebra() -> None:
    shown = "print([name for name in sys.modules if name.count('.') and 'scipy' in name])"
    program = f"import borechain.drilling.preload, sys; {shown}"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True, timeout=250)
    assert "linalg" not in done.stdout
    assert "spatial" not in done.stdout
