"""The fuzzing of files begins with files that are good, repeats by its seed, and finds a reader that is not careful."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from file_readers import COMPANIONS, GROUPS, FileKind
from mutations import MUTATIONS, mutate
from run_fuzz import fuzz_group, read_changed

KINDS = [kind for kinds in GROUPS.values() for kind in kinds]


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_every_file_that_is_changed_is_read_as_it_was(kind: FileKind, tmp_path: Path) -> None:
    """Else all that is tried would end at the first look."""
    for name, content in COMPANIONS.items():
        (tmp_path / name).write_bytes(content)
    assert kind.seeds
    for number, content in enumerate(kind.seeds):
        assert read_changed(kind, content, tmp_path / f"good-{number}{kind.ending}") == "read"


@pytest.mark.slow
@pytest.mark.parametrize("kind", KINDS, ids=lambda kind: kind.name)
def test_a_few_changed_files_are_read_or_refused_in_a_line(kind: FileKind, tmp_path: Path) -> None:
    for name, content in COMPANIONS.items():
        (tmp_path / name).write_bytes(content)
    lot = random.Random(kind.name)
    found = [read_changed(kind, mutate(lot, list(kind.seeds)), tmp_path / f"changed{kind.ending}") for _ in range(15)]
    assert set(found) <= {"read", "refused"}


def test_one_seed_makes_the_same_files_and_each_change_changes() -> None:
    seeds = [b"a = 1\nb = 2.5\nc = 3\n", b"d = 4\ne = 5\n"]
    again = [[mutate(random.Random(n), seeds) for n in range(50)] for _ in range(2)]
    assert again[0] == again[1]
    for change in MUTATIONS:
        assert any(change(random.Random(n), *seeds) != seeds[0] for n in range(20))


def careless(path: Path) -> int:
    return 1 // path.read_bytes().count(b"=")


def test_a_reader_that_raises_what_is_no_line_is_found_with_its_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setitem(GROUPS, "careless", (FileKind("careless", ".toml", careless, (b"a = 1\n",)),))
    assert fuzz_group("careless", 0.5, 1, tmp_path / "kept") == 1
    told = capsys.readouterr().out
    assert "careless: ZeroDivisionError at test_fuzzed_files.py" in told
    (file,) = (tmp_path / "kept").iterdir()
    with pytest.raises(ZeroDivisionError):
        careless(file)


def read_by(name: str, content: bytes, folder: Path) -> str:
    kind = next(one for one in KINDS if one.name == name)
    return read_changed(kind, content, folder / f"found{kind.ending}")


@pytest.mark.parametrize("name", ["attitudes", "turn table", "MWD record"])
@pytest.mark.parametrize("end", [b"\x0b", b"\x1c", "\x85".encode(), "\u2028".encode()])
def test_a_header_with_what_ends_a_line_elsewhere_is_refused_in_one(name: str, end: bytes, tmp_path: Path) -> None:
    assert read_by(name, b"position" + end + b"pitch\n1,2\n", tmp_path) == "refused"


def test_a_matrix_of_a_number_beyond_all_is_refused(tmp_path: Path) -> None:
    assert read_by("matrix", b"matrix = [[" + b"9" * 400 + b", 0, 0], [0, 1, 0], [0, 0, 1]]\n", tmp_path) == "refused"
