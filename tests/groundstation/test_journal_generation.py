"""A journal is read into the file that it was begun on, and into no other; real files of SQLite, killed and copied."""

from __future__ import annotations

import contextlib
import os
import shutil
import sqlite3
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
import sqlalchemy as sa
from hand_fed import Rig
from test_store import survey

from groundstation.errors import StoreError
from groundstation.service.disk import guarded_file
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.journal_generation import (
    JOURNAL_LIMIT,
    JournalGeneration,
    generation_alone,
    is_of_another,
    journal_of,
)

NAME = "ground.sqlite"


def killed(folder: Path, to: Path) -> Path:
    """The files of a running ground station as they are, which is what a killed one leaves."""
    to.mkdir()
    for path in (folder / NAME, journal_of(folder / NAME)):
        shutil.copyfile(path, to / path.name)
    return to / NAME


def opened(file: Path) -> Store:
    return Store(f"sqlite:///{file}")


def numbers(store: Store) -> list[int]:
    return [one.message.sequence for one in store.messages()]


def fill(store: Store, first: int, last: int) -> None:
    for number in range(first, last + 1):
        assert store.add_message(survey(1, number), None)


def backup(file: Path, to: Path) -> Path:
    """A copy as SQLite makes it of a database that is written to."""
    with contextlib.closing(sqlite3.connect(file)) as source, contextlib.closing(sqlite3.connect(to)) as copy:
        source.backup(copy)
    return to


def vacuumed(file: Path, to: Path) -> Path:
    """The same rows in other pages."""
    with contextlib.closing(sqlite3.connect(file)) as source:
        source.execute("VACUUM INTO ?", [str(to)])
    return to


def is_whole(file: Path) -> bool:
    with contextlib.closing(sqlite3.connect(file)) as connection:
        return bool(connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)])


@pytest.fixture
def store(tmp_path: Path) -> Iterator[Store]:
    (tmp_path / "rig").mkdir()
    with contextlib.closing(opened(tmp_path / "rig" / NAME)) as store:
        yield store


def put_by_copy(copy: Path, file: Path) -> None:
    shutil.copyfile(copy, file)


def put_by_name(copy: Path, file: Path) -> None:
    copy.replace(file)


@pytest.mark.parametrize("put", [put_by_copy, put_by_name])
def test_a_backup_of_an_earlier_run_is_started_on_without_the_journal_of_the_later(
    tmp_path: Path, put: Callable[[Path, Path], None]
) -> None:
    """As a crew restores one: the ground station was killed, the journal lies there."""
    folder = tmp_path / "rig"
    folder.mkdir()
    with contextlib.closing(opened(folder / NAME)) as store:
        fill(store, 1, 3)
    copy = backup(folder / NAME, tmp_path / "copy")
    with contextlib.closing(opened(folder / NAME)) as store:
        fill(store, 4, 9)
        left = killed(folder, tmp_path / "left")
    put(copy, left)
    journal, earlier = journal_of(left).read_bytes(), left.parent / f"{NAME}-wal-parted-1"
    earlier.write_bytes(b"of an earlier time")
    assert is_of_another(left)
    with contextlib.closing(opened(left)) as store:
        assert store.parted == f"{NAME}-wal was another file's, and is kept as {NAME}-wal-parted-2"
        assert numbers(store) == [1, 2, 3]
        fill(store, 4, 5)
    assert (left.parent / f"{NAME}-wal-parted-2").read_bytes() == journal
    assert earlier.read_bytes() == b"of an earlier time"
    assert is_whole(left)
    with contextlib.closing(opened(left)) as store:
        assert (numbers(store), store.parted) == ([1, 2, 3, 4, 5], "")


def test_a_killed_ground_station_goes_on_with_its_own_journal(store: Store, tmp_path: Path) -> None:
    fill(store, 1, 7)
    left = killed(tmp_path / "rig", tmp_path / "left")
    assert journal_of(left).stat().st_size > 0
    with contextlib.closing(opened(left)) as again:
        assert (numbers(again), again.parted) == ([1, 2, 3, 4, 5, 6, 7], "")
    assert list(tmp_path.glob("left/*parted*")) == []


@pytest.mark.parametrize("copied", [backup, vacuumed])
def test_of_a_copy_that_was_made_since_the_journal_was_begun_nothing_is_lost_and_nothing_is_mixed(
    store: Store, tmp_path: Path, copied: Callable[[Path, Path], Path]
) -> None:
    fill(store, 1, 3)
    copy = copied(tmp_path / "rig" / NAME, tmp_path / "copy")
    fill(store, 4, 9)
    left = killed(tmp_path / "rig", tmp_path / "left")
    put_by_copy(copy, left)
    with contextlib.closing(opened(left)) as again:
        assert numbers(again) == ([1, 2, 3] if again.parted else list(range(1, 10)))
        assert copied is vacuumed or not again.parted
    assert is_whole(left)


def test_each_moment_at_which_the_power_may_go_leaves_a_journal_that_fits(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Killed after every statement, with pages that go over every few surveys; nothing of what was stored is lost."""
    monkeypatch.setattr(guarded_file, "JOURNAL_LIMIT", 40_000)
    folder, lives, begun = tmp_path / "rig", 0, set()
    folder.mkdir()
    with contextlib.closing(opened(folder / NAME)) as store:
        stored = 0

        def look(*_: object) -> None:
            nonlocal lives
            lives += 1
            left = killed(folder, tmp_path / f"left-{lives}")
            begun.add(generation_alone(left).own)
            assert not is_of_another(left)
            with contextlib.closing(sqlite3.connect(left)) as connection:
                (found,) = connection.execute("SELECT count(*) FROM messages").fetchone()
            assert found in (stored, stored + 1)

        for event in ("after_cursor_execute", "commit"):
            sa.event.listen(store._engine, event, look)
        for number in range(1, 25):
            fill(store, number, number)
            stored = number
    assert lives > 100
    assert len(begun) >= 3


def test_a_journal_that_grows_long_goes_into_the_file_once_nobody_reads(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(guarded_file, "JOURNAL_LIMIT", 40_000)
    file = tmp_path / "rig" / NAME
    file.parent.mkdir()
    with contextlib.closing(opened(file)) as store:
        fill(store, 1, 1)
        begun = generation_alone(file).own
        with contextlib.closing(sqlite3.connect(file)) as reader:
            reader.execute("BEGIN")
            assert reader.execute("SELECT count(*) FROM messages").fetchone() == (1,)
            fill(store, 2, 60)
            longest = journal_of(file).stat().st_size
            assert longest > 120_000
            left = killed(file.parent, tmp_path / "left")
            assert not is_of_another(left)
            with store._engine.connect() as connection:
                assert connection.exec_driver_sql("PRAGMA busy_timeout").scalar() == 5000
                meta = dict(map(tuple, connection.exec_driver_sql("SELECT name, value FROM meta")))
            assert meta["generation_before"] in (begun, generation_alone(file).own)
        fill(store, 61, 90)
        assert journal_of(file).stat().st_size < longest
        assert generation_alone(file).own != begun
        assert numbers(store) == list(range(1, 91))
    with contextlib.closing(opened(left)) as again:
        assert numbers(again) == list(range(1, 61))
        with again._engine.connect() as connection:
            meta = dict(map(tuple, connection.exec_driver_sql("SELECT name, value FROM meta")))
        assert "generation_before" not in meta


def test_the_pages_go_over_at_a_few_megabytes() -> None:
    assert JOURNAL_LIMIT == 4_194_304


def test_the_crew_is_told_of_a_journal_that_was_parted(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.drill(1, 2.0)
    rig.ground.close()
    copy, now, rig = backup(tmp_path / NAME, tmp_path / "copy"), rig.now, Rig(tmp_path)
    rig.now = now
    rig.drill(2, 2.0)
    left = killed(tmp_path, tmp_path / "left")
    put_by_copy(copy, left)
    again = Rig(left.parent)
    again.now = rig.now
    again.run(4.0)
    rows = [row for row in again.ask("alarms")["rig"] if row["code"] == "database"]
    assert [row["subject"] for row in rows] == ["journal"]
    assert f"{NAME}-wal-parted-1" in rows[0]["detail"]
    rig.ground.close()
    again.ground.close()


def test_a_file_that_is_written_over_under_a_running_ground_station_ends_it_and_is_started_on(tmp_path: Path) -> None:
    rig = Rig(tmp_path)
    rig.drill(1, 2.0)
    rig.ground.close()
    copy = backup(tmp_path / NAME, tmp_path / "copy")
    now, rig = rig.now, Rig(tmp_path)
    rig.now = now
    rig.drill(2, 2.0)
    put_by_copy(copy, tmp_path / NAME)
    with pytest.raises(StoreError, match="another one lies in its place; start the ground station again on it"):
        rig.drill(3, 2.0)
    rig.ground.close()
    assert (tmp_path / NAME).read_bytes() == copy.read_bytes()
    assert (tmp_path / f"{NAME}-wal-parted-1").stat().st_size > 0
    again = Rig(tmp_path)
    assert len(again.ask("measurements")["measurements"]) == 1
    again.ground.close()
    assert is_whole(tmp_path / NAME)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5])
def test_for_a_copy_over_it_that_is_not_whole_yet_it_takes_nothing_until_it_is(tmp_path: Path, share: float) -> None:
    file = tmp_path / "rig" / NAME
    file.parent.mkdir()
    with contextlib.closing(opened(file)) as first:
        fill(first, 1, 30)
    whole = file.read_bytes()
    with contextlib.closing(opened(file)) as store:
        fill(store, 31, 33)
        with file.open("r+b") as over:
            over.truncate(0)
            over.write(whole[: int(share * len(whole))])
        with pytest.raises(StoreError, match="was removed or replaced while the ground station ran"):
            store.add_message(survey(1, 34), None)
        store.check_place()
        assert file.read_bytes() == whole[: int(share * len(whole))]
        file.write_bytes(whole)
        with pytest.raises(StoreError, match="was removed or replaced"):
            store.add_message(survey(1, 34), None)
        with pytest.raises(StoreError, match="another one lies in its place"):
            store.check_place()
    assert file.read_bytes() == whole
    with contextlib.closing(opened(file)) as again:
        assert numbers(again) == list(range(1, 31))


def test_a_file_that_is_touched_is_written_on(store: Store, tmp_path: Path) -> None:
    fill(store, 1, 2)
    os.utime(tmp_path / "rig" / NAME)
    fill(store, 3, 4)
    assert (numbers(store), store.refusal) == ([1, 2, 3, 4], "")


def test_a_second_ground_station_in_the_folder_leaves_the_file_and_its_journal_to_the_first(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "rig" / NAME
    monkeypatch.setattr(guarded_file, "is_of_another", lambda _file: True)  # as a copy may look that is made meanwhile
    fill(store, 1, 3)
    begun = generation_alone(file)
    with contextlib.closing(opened(file)) as second:
        assert (numbers(second), second.parted) == ([1, 2, 3], "")
        fill(second, 4, 6)
        fill(store, 7, 9)
        assert numbers(second) == list(range(1, 10))
        fill(store, 10, 10)
        assert generation_alone(file) == begun
        assert store.refusal == ""
        store.close()
        fill(second, 11, 11)  # which is the first from now on
        assert generation_alone(file).own != begun.own
    monkeypatch.undo()
    with contextlib.closing(opened(file)) as again:
        assert (numbers(again), again.parted) == (list(range(1, 12)), "")


def test_of_a_file_that_is_damaged_by_itself_the_journal_is_left_where_it_is(store: Store, tmp_path: Path) -> None:
    fill(store, 1, 40)
    left = killed(tmp_path / "rig", tmp_path / "left")
    with left.open("r+b") as damaged:
        damaged.seek(4096)
        damaged.write(b"\xff" * 4096)
    assert not is_of_another(left)
    left.write_bytes(b"")
    assert not is_of_another(left)


def test_without_room_for_a_look_the_journal_is_left_where_it_is(
    store: Store, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    fill(store, 1, 2)
    left = killed(tmp_path / "rig", tmp_path / "left")

    def no_room(_file: Path) -> bool:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(guarded_file, "is_of_another", no_room)
    with contextlib.closing(opened(left)) as again:
        assert (numbers(again), again.parted) == ([1, 2], "")


@pytest.mark.parametrize(
    ("journal", "file", "fits"),
    [
        (JournalGeneration(), JournalGeneration("a"), True),  # of a release that enters none
        (JournalGeneration(), JournalGeneration(), True),
        (JournalGeneration("a"), JournalGeneration("a"), True),
        (JournalGeneration("a"), JournalGeneration("b"), False),
        (JournalGeneration("a"), JournalGeneration(), False),  # a backup of such a release
        (JournalGeneration("b", "a"), JournalGeneration("a"), True),
        (JournalGeneration("b", "a"), JournalGeneration("b", "a"), True),
        (JournalGeneration("b", "a"), JournalGeneration("c"), False),
        (JournalGeneration("b", ""), JournalGeneration(), True),  # a first start
        (JournalGeneration("b"), JournalGeneration("a", "b"), False),
    ],
)
def test_a_journal_fits_the_file_of_its_generation(
    journal: JournalGeneration, file: JournalGeneration, fits: bool
) -> None:
    assert journal.fits(file) == fits
