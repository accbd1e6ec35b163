"""The lists of planted defects are such that they can be planted; `make planted` plants them."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
from choice_of_tests import choose_tests
from defect_lists import KINDS, ROOT, Defect, DefectError, read_defects, sample_of
from mutants import AREAS, TRUSTED, changes_of, drawn_mutants, files_of, mutant_of

DEFECTS = read_defects()


def test_every_defect_can_be_planted_and_has_tests_that_are_to_notice() -> None:
    for defect in DEFECTS:
        assert defect.planted_text(ROOT) != (ROOT / defect.file).read_text(encoding="utf-8")
        assert choose_tests(defect, ROOT), defect.name


def test_every_kind_is_planted_and_a_sample_has_each() -> None:
    assert {defect.kind for defect in DEFECTS} == set(KINDS)
    sample = sample_of(DEFECTS, 40)
    assert len({defect.name for defect in sample}) == 40
    assert {defect.package for defect in sample} == {defect.package for defect in DEFECTS}


def row(**change: object) -> str:
    fields = {"name": "n", "kind": 8, "file": "telemetry/keys.py", "old": "old", "new": "new"} | change
    return "[[defect]]\n" + "\n".join(f"{name} = {value!r}" for name, value in fields.items()) + "\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (row(kind=9), "n: expected a kind of 1..8, got 9"),
        (row(new="old"), "n: expected a new text that differs"),
        (row() + row(), "n: expected a name of its own, found it 2 times"),
    ],
)
def test_a_list_that_is_wrong_is_named(tmp_path: Path, text: str, told: str) -> None:
    (tmp_path / "one.toml").write_text(text)
    with pytest.raises(DefectError, match=told):
        read_defects(tmp_path)


@pytest.mark.parametrize("text", ["it is gone", "old and old"])
def test_a_defect_whose_text_is_gone_or_twice_there_is_named(tmp_path: Path, text: str) -> None:
    (tmp_path / "one.py").write_text(text)
    with pytest.raises(DefectError, match=r"a name: expected its old text once in one\.py, found it [02] times"):
        Defect("a name", "one", 8, "one.py", "old", "new").planted_text(tmp_path)


def test_a_file_without_tests_is_named() -> None:
    with pytest.raises(DefectError, match="name them"):
        choose_tests(Defect("a name", "one", 1, "groundstation/gateway/page/static/js/plan.js", "a", "b"), ROOT)
    with pytest.raises(DefectError, match=r"got nowhere\.py"):
        choose_tests(Defect("a name", "one", 1, "telemetry/keys.py", "a", "b", ("nowhere.py",)), ROOT)


def test_who_looks_at_a_whole_room_is_chosen_beside_who_imports_the_module() -> None:
    for file, test in (
        ("borechain/cli/survey/clearance_command.py", "test_options_whole.py"),
        ("borechain/studies/judged_hole.py", "studies/test_studies_whole.py"),
    ):
        assert choose_tests(Defect("a name", "one", 1, file, "a", "b"), ROOT)[0] == test
    assert "test_options_whole.py" not in choose_tests(
        Defect("a name", "one", 1, "borechain/crew/app.py", "a", "b"), ROOT
    )


def test_every_module_of_which_mutants_are_drawn_has_tests_that_are_to_notice() -> None:
    for area in (*AREAS, *TRUSTED):
        for file in filter(changes_of, files_of(ROOT, area)):
            name = file.relative_to(ROOT).as_posix()
            assert choose_tests(Defect(name, area, 8, name, "a", "b"), ROOT), name


SOURCE = '''"""± 1 < 2 of a docstring, which is no part of it."""
LIMIT: Final = 3

def f(a: int = 1, *, b: float = 0.5) -> bool:
    for k in range(2):
        if not a <= k and -b * 2.0 != k:
            continue
    return a // 2 in (4, 5) or f"{a + 1}"
'''


def test_every_change_of_a_source_is_made_once_at_its_place(tmp_path: Path) -> None:
    file = tmp_path / "one.py"
    file.write_text(SOURCE, encoding="utf-8")
    found = [mutant_of(tmp_path, "survey", file, change) for change in changes_of(file)]
    changes = sorted((mutant.old, mutant.new) for mutant in found)
    assert changes == sorted([
        ("3", "4"), ("1", "2"), ("0.5", "0.75"), ("2", "3"), ("not ", ""), ("<=", "<"), ("and", "or"), ("-", ""),
        ("*", "/"), ("2.0", "3.0"), ("!=", "=="), ("continue", "break"), ("//", "/"), ("2", "3"), ("in", "not in"),
        ("4", "5"), ("5", "6"), ("or", "and"),
    ])  # fmt: skip
    texts = [mutant.planted_text(tmp_path) for mutant in found]
    assert len(set(texts)) == len(texts)
    for text in texts:
        compile(text, "one.py", "exec")
        assert sum(a != b for a, b in zip(text.splitlines(), SOURCE.splitlines(), strict=True)) == 1


@pytest.mark.slow
def test_a_sample_of_mutants_is_the_same_by_its_seed_and_has_each_area() -> None:
    one, again = drawn_mutants(ROOT, 40, 1), drawn_mutants(ROOT, 40, 1)
    assert [m.name for m in one] == [m.name for m in again]
    assert len({m.name for m in one}) == 40
    assert {m.package for m in one} == set(AREAS)
    assert all("kernels" not in file.parts for area in AREAS for file in files_of(ROOT, area))


HARMLESS = """
[[defect]]
name = "a word of a comment"
kind = 8
file = "telemetry/transport/nearest.py"
old = "# s of listening before the first is chosen"
new = "# s of waiting before the first is chosen"
tests = ["telemetry/test_nearest.py"]

[[defect]]
name = "the farthest is chosen"
kind = 7
file = "telemetry/transport/nearest.py"
old = "sender == min(self._heard, key=self._distance)"
new = "sender == max(self._heard, key=self._distance)"
tests = ["telemetry/test_nearest.py"]
"""


@pytest.mark.slow
def test_what_is_noticed_and_what_survives_is_told_by_package_and_kind(tmp_path: Path) -> None:
    (tmp_path / "some.toml").write_text(HARMLESS)
    command = [sys.executable, str(ROOT / "tests/planted/run_planted.py"), "--fast", "--jobs", "1"]
    done = subprocess.run([*command, "--lists", str(tmp_path)], capture_output=True, text=True, check=False)
    told = done.stdout.splitlines()
    assert done.returncode == 1, done.stderr
    assert "   1 of   2   50 %  package some" in told
    assert "   1 of   1  100 %  kind 7 (keeping the wrong one)" in told
    assert told[-1] == "survives: a word of a comment (telemetry/transport/nearest.py)"
    assert any("the farthest is chosen: found by FAILED tests/telemetry/test_nearest.py" in line for line in told)
    (tmp_path / "some.toml").write_text(HARMLESS.replace("min(self._heard", "least(self._heard"))
    gone = subprocess.run([*command, "--lists", str(tmp_path)], capture_output=True, text=True, check=False)
    assert gone.returncode == 2
    assert "the farthest is chosen: expected its old text once in telemetry/transport/nearest.py" in gone.stderr
