"""Two databases that parted are one again: each survey once, whichever of the two has it, and the hole of them all."""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
from pathlib import Path

import pytest
from click.testing import CliRunner
from hand_fed import Rig

from borechain.cli.ground.merge_command import merge
from groundstation.errors import ConfigurationError, StoreError
from groundstation.service.disk.merged_database import merge_databases


@pytest.fixture
def parted(tmp_path: Path) -> tuple[Path, Path]:
    """Folders of two ground stations: both have the first two stops, each has one of the next two."""
    first, second = tmp_path / "a", tmp_path / "b"
    rig = Rig(first)
    for stop in (1, 2):
        rig.drill(stop, 2.0)
    rig.ground.close()
    shutil.copytree(first, second)
    for folder, stops in ((first, (3,)), (second, (3, 4))):
        rig = Rig(folder)
        rig.now = 3000.0
        rig.md = 4.0
        for stop in stops:
            if folder == second and stop == 3:  # that survey went to the other one
                rig.speak(3)
                rig.depth(6.0)
                rig.speak(3)
            else:
                rig.drill(stop, 2.0)
        rig.ground.close()
    return first, second


def numbers(folder: Path) -> list[int]:
    with contextlib.closing(sqlite3.connect(folder / "ground.sqlite")) as database:
        rows = database.execute("select sequence from messages where kind = 'SurveyMeasurement' order by sequence")
        return [number for (number,) in rows]


def measured(folder: Path) -> list[int]:
    rig = Rig(folder)
    found = sorted(row["sequence"] for row in rig.ask("measurements")["measurements"])
    rig.ground.close()
    return found


def test_each_survey_of_either_is_there_once_and_both_are_left_alone(parted: tuple[Path, Path], tmp_path: Path) -> None:
    first, second = parted
    assert (numbers(first), numbers(second)) == ([1, 2, 3], [1, 2, 4])
    done = merge_databases(first, second, tmp_path / "merged")
    assert (done.shared, done.first_alone, done.second_alone) == (2, 1, 1)
    assert (done.twice, done.damaged) == ((), 0)
    assert (numbers(first), numbers(second)) == ([1, 2, 3], [1, 2, 4])
    assert numbers(tmp_path / "merged") == [1, 2, 3, 4]
    assert measured(tmp_path / "merged") == [1, 2, 3, 4]
    assert [path.name for path in (tmp_path / "merged").iterdir() if path.name.startswith(".")] == []
    swapped = merge_databases(second, first, tmp_path / "swapped")
    assert (swapped.first_alone, swapped.second_alone) == (1, 1)
    assert measured(tmp_path / "swapped") == [1, 2, 3, 4]
    again = merge_databases(tmp_path / "merged", second, tmp_path / "again")
    assert (again.shared, again.first_alone, again.second_alone) == (3, 1, 0)


def test_a_number_with_two_contents_is_kept_twice_and_told(parted: tuple[Path, Path], tmp_path: Path) -> None:
    first, second = parted
    rig = Rig(second)
    rig.now = 6000.0
    rig.speak(4)
    rig.survey(1, 3, 5.0)
    rig.run(3.0)
    rig.ground.close()
    run = CliRunner().invoke(merge, [str(first), str(second), "--into", str(tmp_path / "merged")])
    assert run.exit_code == 0, run.output
    assert "1 numbers have two contents, both are kept: number 3 of tube 1" in run.output
    assert numbers(tmp_path / "merged") == [1, 2, 3, 3, 4]


def test_what_cannot_be_merged_is_one_line_and_writes_nothing(parted: tuple[Path, Path], tmp_path: Path) -> None:
    first, second = parted
    with pytest.raises(ConfigurationError, match="expected a folder without a database"):
        merge_databases(first, second, first)
    with pytest.raises(ConfigurationError, match="found none"):
        merge_databases(first, tmp_path, tmp_path / "merged")
    (second / "ground.sqlite").write_bytes(b"no database at all" * 100)
    with pytest.raises(StoreError, match="database"):
        merge_databases(first, second, tmp_path / "merged")
    assert not list((tmp_path / "merged").glob("*"))
    assert numbers(first) == [1, 2, 3]
