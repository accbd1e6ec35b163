"""A row of which a bit has changed is not read as another, is counted, and stands in the way of nothing new."""

from __future__ import annotations

import contextlib
import math
import sqlite3
import struct
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from test_store import survey, url

from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.merged_database import merge_databases
from groundstation.service.setup.told_value import SetupKind, ToldValue
from groundstation.survey.fusion.joint_angles import JointAngle
from telemetry.messages import Stand

STANDS = [Stand(7, 10.0, 20.5, 2.25), Stand(7, 30.0, 41.0, 4.25)]
JOINTS = {(3, 2): JointAngle(0.5, 1e-4), (2, 1): JointAngle(-1.25, 4e-4)}
TOLD = [
    ToldValue(1, SetupKind.NORTH, "", (0.25,), 0.01, "anna", "2026-11-27T10:00:00Z"),
    ToldValue(2, SetupKind.LENGTH, "3", (2.04,), 0.002, "bert", "2026-11-27T11:00:00Z"),
]
READ: dict[str, tuple[Callable[[Store], Any], Any, Any]] = {  # how a table is read, all of it, all but the first row
    "stands": (Store.stands, STANDS, STANDS[1:]),
    "joints": (Store.joints, JOINTS, {(2, 1): JOINTS[2, 1]}),
    "setup": (Store.told, TOLD, TOLD[1:]),
}
COLUMNS = [
    ("stands", "begun_at"), ("stands", "ended_at"), ("stands", "md"), ("joints", "angle"), ("joints", "var"),
    ("setup", "content"), ("stands", "digest"), ("joints", "digest"), ("setup", "digest"),
]  # fmt: skip


def fill(store: Store) -> None:
    """What a ground station keeps beside messages."""
    for stand in STANDS:
        store.keep_stand(stand)
    store.keep_joints(JOINTS)
    for told in TOLD:
        store.keep_told(told)


@contextlib.contextmanager
def changed(folder: Path) -> Iterator[sqlite3.Connection]:
    """The database of a folder, changed from outside."""
    with contextlib.closing(sqlite3.connect(folder / "ground.sqlite")) as database:
        yield database
        database.commit()


def with_bit_changed(before: float | str, bit: int) -> bytes | float:
    """A number or the bytes of a text with one bit changed."""
    raw = bytearray(before.encode() if isinstance(before, str) else struct.pack("<d", before))
    raw[bit // 8] ^= 1 << bit % 8
    found: float = math.nan if isinstance(before, str) else struct.unpack("<d", raw)[0]
    return bytes(raw) if isinstance(before, str) else found


@pytest.mark.parametrize(("table", "column"), COLUMNS)
def test_no_bit_of_a_row_changes_unnoticed(tmp_path: Path, table: str, column: str) -> None:
    read, whole, without_first = READ[table]
    with contextlib.closing(Store(url(tmp_path))) as store, changed(tmp_path) as database:
        fill(store)
        assert (read(store), store.damaged) == (whole, 0)
        (first,) = database.execute(f"SELECT rowid FROM {table} ORDER BY rowid LIMIT 1").fetchone()
        (sound,) = database.execute(f"SELECT {column} FROM {table} WHERE rowid = ?", [first]).fetchone()
        cast = "CAST(? AS TEXT)" if isinstance(sound, str) else "?"
        bits = range(0, 8 * len(sound), 5) if isinstance(sound, str) else range(64)
        for bit in bits:
            rotten = with_bit_changed(sound, bit)
            if isinstance(rotten, float) and math.isnan(rotten):
                continue  # a database has none
            database.execute(f"UPDATE {table} SET {column} = {cast} WHERE rowid = ?", (rotten, first))
            database.commit()
            store.damaged = 0
            assert (read(store), store.damaged) == (without_first, 1), bit


def test_a_row_of_a_version_without_hashes_is_read(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store, changed(tmp_path) as database:
        fill(store)
        for table in READ:
            database.execute(f"UPDATE {table} SET digest = NULL")
        database.commit()
        for read, whole, _ in READ.values():
            assert read(store) == whole
        assert store.damaged == 0


def test_a_database_of_before_gets_room_for_hashes_where_it_can_be_written(tmp_path: Path) -> None:
    """What a version without hashes made: the same tables without their column."""
    Store(url(tmp_path)).close()
    with contextlib.closing(Store(url(tmp_path))) as store:
        fill(store)
    with changed(tmp_path) as database:
        for table in READ:
            database.execute(f"ALTER TABLE {table} DROP COLUMN digest")
    for where, is_written in (
        (f"sqlite:///file:{tmp_path}/ground.sqlite?mode=ro&uri=true", False),
        (url(tmp_path), True),
    ):
        with contextlib.closing(Store(where)) as store:
            assert bool(store.refusal) is not is_written
            for read, whole, _ in READ.values():
                assert (read(store), store.damaged) == (whole, 0)
        with changed(tmp_path) as database:
            for table in READ:
                names = [row[1] for row in database.execute(f"PRAGMA table_info({table})")]
                assert ("digest" in names) is is_written
    with contextlib.closing(Store(url(tmp_path))) as store, changed(tmp_path) as database:
        store.keep_told(TOLD[0])
        assert [digest is None for (digest,) in database.execute("SELECT digest FROM setup ORDER BY number")] == [
            False,
            True,
        ]


def test_numbers_of_any_type_come_back_as_what_was_kept(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store:
        store.keep_stand(Stand(7, np.float64(-0.0), 3, np.float32(0.5)))  # type: ignore[arg-type]
        store.keep_joints({(2, 1): JointAngle(np.float64(-0.0), 1)})
        assert store.stands() == [Stand(7, 0.0, 3.0, 0.5)]
        assert store.joints() == {(2, 1): JointAngle(0.0, 1.0)}
        assert store.damaged == 0


def test_what_is_damaged_stands_in_the_way_of_nothing_new(tmp_path: Path) -> None:
    """The newest told value has the number that the next one gets, and a stand the time that its repetition has."""
    with contextlib.closing(Store(url(tmp_path))) as store, changed(tmp_path) as database:
        fill(store)
        database.execute("UPDATE setup SET content = 'x' || content WHERE number = 2")
        database.execute("UPDATE stands SET md = 99.0 WHERE begun_at = 30.0")
        database.execute("UPDATE joints SET angle = 3.0 WHERE upper = 3")
        database.commit()
        assert (store.told(), store.stands(), set(store.joints())) == (TOLD[:1], STANDS[:1], {(2, 1)})
        assert store.damaged == 3
        fill_again = ToldValue(2, SetupKind.LENGTH, "4", (2.1,), 0.002, "cora", "2026-11-27T12:00:00Z")
        store.keep_told(fill_again)
        store.keep_stand(STANDS[1])
        store.keep_joints(JOINTS)
        store.damaged = 0
        assert (store.told(), store.stands(), store.joints()) == ([TOLD[0], fill_again], STANDS, JOINTS)
        assert store.damaged == 0


def test_a_text_that_is_none_any_more_refuses_no_other_row(tmp_path: Path) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store, changed(tmp_path) as database:
        for number in (1, 2, 3):
            store.add_message(survey(1, number), 1.0)
        database.execute("UPDATE messages SET content = CAST(? AS TEXT) WHERE sequence = 2", [b"\xff" * 32])
        database.execute("INSERT INTO alarms VALUES (1, CAST(? AS TEXT))", [b"{\xff}"])
        database.commit()
        assert [one.message.sequence for one in store.messages()] == [1, 3]
        assert store.alarms() == []
        assert store.damaged == 2


def test_a_damaged_stand_comes_whole_from_the_other_database_of_a_merge(tmp_path: Path) -> None:
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        with contextlib.closing(Store(url(tmp_path / name))) as store:
            fill(store)
    with changed(tmp_path / "a") as database:
        database.execute("UPDATE stands SET md = 99.0 WHERE begun_at = 30.0")
    done = merge_databases(tmp_path / "a", tmp_path / "b", tmp_path / "c")
    assert (done.stands, done.damaged) == (1, 1)
    with contextlib.closing(Store(url(tmp_path / "c"))) as merged:
        assert (merged.stands(), merged.damaged) == (STANDS, 0)
