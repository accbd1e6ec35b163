"""A backup that is restored under a running ground station: it ends, and goes on with it where it is started again."""

import shutil
import sqlite3
from collections.abc import Callable
from pathlib import Path

import pytest
from hand_fed import Rig

from groundstation.errors import StoreError

BEFORE, AFTER = 2, 3  # tubes that were drilled in before the backup was made, and when it is restored


def database_of(folder: Path) -> Path:
    return folder / "ground.sqlite"


def backup_of(folder: Path) -> Path:
    """A backup beside the database, as SQLite makes it while a ground station runs."""
    path = folder / "backup.sqlite"
    source, copy = sqlite3.connect(database_of(folder)), sqlite3.connect(path)
    source.backup(copy)
    source.close()
    copy.close()
    return path


def a_backup(folder: Path, backup: Path) -> None:
    backup.replace(database_of(folder))


def nothing(folder: Path, backup: Path) -> None:
    del backup
    database_of(folder).unlink()


def a_half(folder: Path, backup: Path) -> None:
    """A copy that is still under way."""
    (folder / "half").write_bytes(backup.read_bytes()[: backup.stat().st_size // 2])
    (folder / "half").replace(database_of(folder))


def all_but_the_end(folder: Path, backup: Path) -> None:
    """A copy of which every table can be read but the last page."""
    (folder / "most").write_bytes(backup.read_bytes()[:-1])
    (folder / "most").replace(database_of(folder))


def a_beginning(folder: Path, backup: Path) -> None:
    (folder / "begun").write_bytes(backup.read_bytes()[:20])
    (folder / "begun").replace(database_of(folder))


def no_database(folder: Path, backup: Path) -> None:
    (folder / "text").write_bytes(b"no database".ljust(backup.stat().st_size, b"."))
    (folder / "text").replace(database_of(folder))


def a_foreign_one(folder: Path, backup: Path) -> None:
    del backup
    other = sqlite3.connect(folder / "foreign.sqlite")
    other.execute("create table recipes (name text)")
    other.commit()
    other.close()
    (folder / "foreign.sqlite").replace(database_of(folder))


def a_later_one(folder: Path, backup: Path) -> None:
    later = sqlite3.connect(backup)
    later.execute("update meta set value = '99' where name = 'schema'")
    later.commit()
    later.close()
    backup.replace(database_of(folder))


@pytest.fixture
def rig(tmp_path: Path) -> Rig:
    made = Rig(tmp_path)
    for stop in range(1, AFTER + 1):
        made.drill(stop, 2.0)
        if stop == BEFORE:
            backup_of(tmp_path)
    return made


def surveys(rig: Rig) -> int:
    return len(rig.ask("measurements")["measurements"])


def test_a_ground_station_ends_for_the_backup_in_its_place_and_starts_on_it(rig: Rig, tmp_path: Path) -> None:
    a_backup(tmp_path, tmp_path / "backup.sqlite")
    with pytest.raises(StoreError, match="another one lies in its place; start the ground station again on it"):
        rig.drill(AFTER + 1, 2.0)
    rig.ground.close()
    again = Rig(tmp_path)
    again.now = rig.now
    assert surveys(again) == BEFORE
    again.run(2.0)
    again.survey(1, AFTER + 1)
    assert [one.message.sequence for one in again.ground.store.messages()] == [1, 2, AFTER + 1]
    assert "disk" not in again.alarms()
    again.ground.close()


@pytest.mark.parametrize(
    "put", [nothing, a_half, all_but_the_end, a_beginning, no_database, a_foreign_one, a_later_one]
)
def test_for_anything_else_in_its_place_it_goes_on_answering_and_says_so(
    rig: Rig, tmp_path: Path, put: Callable[[Path, Path], None]
) -> None:
    put(tmp_path, tmp_path / "backup.sqlite")
    left = database_of(tmp_path).read_bytes() if database_of(tmp_path).exists() else None
    rig.drill(AFTER + 1, 2.0)
    assert "disk" in rig.alarms()
    assert (surveys(rig), rig.tube.mail.outbox_size) == (AFTER, 1)
    assert (database_of(tmp_path).read_bytes() if left is not None else None) == left
    rig.ground.close()


def test_a_copy_that_is_whole_later_is_gone_on_with_then(rig: Rig, tmp_path: Path) -> None:
    whole = (tmp_path / "backup.sqlite").read_bytes()
    a_half(tmp_path, tmp_path / "backup.sqlite")
    rig.drill(AFTER + 1, 2.0)
    database_of(tmp_path).write_bytes(whole)
    with pytest.raises(StoreError, match="another one lies in its place"):
        rig.run(4.0)
    rig.ground.close()


def test_its_own_file_that_was_moved_away_and_comes_back_is_no_other(rig: Rig, tmp_path: Path) -> None:
    shutil.move(database_of(tmp_path), tmp_path / "elsewhere.sqlite")
    rig.drill(AFTER + 1, 2.0)
    assert "disk" in rig.alarms()
    shutil.move(tmp_path / "elsewhere.sqlite", database_of(tmp_path))
    rig.run(60.0)
    assert surveys(rig) == AFTER + 1
    rig.ground.close()
