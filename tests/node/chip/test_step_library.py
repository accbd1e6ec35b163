"""The step as a library, in a process without numba, beside the node that numba compiles; and what is refused."""

import ctypes
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
from chip_tools import needs, needs_gcc
from click.testing import CliRunner
from library_story import COMMAND

from borechain.__main__ import cli
from node.translation import step_library as library
from node.translation.toolchains import ToolchainError

HERE = Path(__file__).parent
CYCLES = 620  # through both ways to the end of an alignment, a static record, a block, a save and the start from it


def told(kernel: str) -> dict[str, object]:
    """What the story says of one node."""
    paths = os.pathsep.join(map(str, (HERE.parents[2], HERE.parent)))
    command = [sys.executable, "-c", COMMAND, kernel, str(CYCLES)]
    done = subprocess.run(
        command, env=os.environ | {"PYTHONPATH": paths}, capture_output=True, text=True, check=False, timeout=300
    )
    assert done.returncode == 0, done.stderr[-2000:]
    found: dict[str, object] = json.loads(done.stdout)
    return found


@needs("cc", "gcc")
@pytest.mark.slow
@pytest.mark.timeout(300)
def test_a_node_without_numba_says_and_remembers_what_one_with_it_does() -> None:
    """All that it says, and its whole record after every cycle, of a node of one IMU and of a cluster."""
    compiled, without = told("fixed"), told("library")
    assert without["digests"] == compiled["digests"]
    assert without["said"] == compiled["said"]
    assert (compiled["llvm"], without["llvm"]) == (True, False)
    assert float(str(without["memory_mb"])) < float(str(compiled["memory_mb"])) / 2


@needs_gcc
def test_a_library_of_other_records_or_of_none_is_refused(tmp_path: Path) -> None:
    names = "const long long library_layout[5] = {1, 2, 3, 4, 5}; int library_step(void) {return 0;} int library_aiding"
    for name, text, said in (
        (
            "other",
            f"{names}(void) {{return 0;}}",
            r"other.so: expected records of layout, IMUs and bytes \(.*\), got \(1, 2, 3, 4, 5\)",
        ),
        ("none", "int nothing;", "none.so: expected a library of the step, got another file"),
    ):
        source, made = tmp_path / f"{name}.c", tmp_path / f"{name}.so"
        source.write_text(text)
        subprocess.run(["gcc", "-shared", "-fPIC", str(source), "-o", str(made)], check=True)
        with pytest.raises(ToolchainError, match=said):
            library.load_step(made)
    (tmp_path / "text.so").write_text("no library")
    with pytest.raises(ToolchainError, match=r"text.so: expected a library of the step, got another file"):
        library.load_step(tmp_path / "text.so")


def test_a_board_without_a_compiler_is_told_the_package(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(ToolchainError, match=r"expected a C compiler on the path, found none; install Debian's gcc"):
        library.find_compiler()


def test_floats_in_c_are_refused() -> None:
    done = CliRunner().invoke(cli, ["node", "--tube", "1", "--compiled-by", "c"])
    assert done.exit_code != 0
    assert "--compiled-by c: expected --kernel fixed with it, got float64" in done.output


@needs("cc", "gcc")
@pytest.mark.slow
def test_a_library_is_made_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The second node finds that of the first, whatever compiler there is now."""
    monkeypatch.setattr(library, "folder_in_use", lambda: tmp_path / "kernels")
    made = library.step_library()
    monkeypatch.setenv("PATH", str(tmp_path))
    assert library.step_library() == made
    assert [path.name for path in made.parent.iterdir()] == [made.name]
    assert isinstance(library.load_step(made).step, ctypes._CFuncPtr)
