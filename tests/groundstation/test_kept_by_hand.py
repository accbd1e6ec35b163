"""What is kept, table by table and field by field, and a calibration in the field step by step, each step twice."""

from __future__ import annotations

import contextlib
import sqlite3
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa
from sqlalchemy.dialects import postgresql
from sqlalchemy.schema import CreateTable
from test_store import survey, url

from groundstation.errors import ConfigurationError, StoreError
from groundstation.service.disk import database as database_room
from groundstation.service.disk import database_tables as tables
from groundstation.service.disk import merged_database as merge_room
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.merged_database import merge_databases
from telemetry.messages import Stand

# tables

SERVER: Any = postgresql.dialect()  # type: ignore[no-untyped-call]

SCHEMA = {  # by table: columns, * of the primary key, ? that may be empty
    "meta": "*name:VARCHAR(32) value:VARCHAR(64)",
    "messages": "*id:SERIAL tube:INTEGER sequence:BIGINT content:VARCHAR(32) kind:VARCHAR(16) ?md:FLOAT ?below:FLOAT "
    "payload:BYTEA",
    "stands": "*epoch:BIGINT *begun_at:FLOAT ended_at:FLOAT md:FLOAT ?digest:VARCHAR(32)",
    "string": "*place:INTEGER tube:INTEGER",
    "blocks": "*sha256:VARCHAR(64) content:BYTEA",
    "recalibration": "*id:INTEGER progress:TEXT",
    "joints": "*upper:INTEGER *lower:INTEGER angle:FLOAT var:FLOAT ?digest:VARCHAR(32)",
    "alarms": "*number:INTEGER content:TEXT",
    "setup": "*number:INTEGER content:TEXT ?digest:VARCHAR(32)",
    "moments": "*number:INTEGER basis:VARCHAR(64) content:BYTEA",
}


def test_tables_are_those_that_every_released_version_reads() -> None:
    """As a server makes them, which counts a key by itself where it is not told that the number is given."""
    found = {}
    for table in tables.METADATA.sorted_tables:
        made = str(CreateTable(table).compile(dialect=SERVER))
        columns = []
        for column in table.columns:
            mark = "*" if column.primary_key else "?" if column.nullable else ""
            kind = next(line.split()[1] for line in made.splitlines() if line.split()[:1] == [column.name])
            columns.append(f"{mark}{column.name}:{kind.rstrip(',')}")
        found[table.name] = " ".join(columns)
    assert found == SCHEMA
    unique = [c for c in tables.MESSAGES.constraints if isinstance(c, sa.UniqueConstraint)]
    assert [[column.name for column in one.columns] for one in unique] == [["tube", "sequence", "content"]]
    assert (tables.SCHEMA, tables.READABLE) == (5, (2, 3, 4, 5))
    assert [table.name for table in tables.DIGESTED] == ["stands", "joints", "setup"]
    conflict = {name: str(tables.add_new(name).compile(dialect=SERVER)) for name in ("postgresql",)}
    assert conflict["postgresql"].endswith("ON CONFLICT DO NOTHING")


@pytest.fixture
def made() -> Any:
    engine = sa.create_engine("sqlite://")
    tables.METADATA.create_all(engine)
    with engine.begin() as connection:
        yield connection
    engine.dispose()


def test_what_is_asked_comes_in_its_order_whatever_the_order_of_coming(made: sa.Connection) -> None:
    stands = [(2, 5.0, 9.0, 3.0), (1, 50.0, 60.0, 2.0), (2, 1.0, 2.0, 1.0), (1, 5.0, 9.0, 4.0)]
    made.execute(
        tables.ADD_STAND, [dict(zip(("epoch", "begun_at", "ended_at", "md"), row, strict=True)) for row in stands]
    )
    assert [tuple(row)[:4] for row in made.execute(tables.ALL_STANDS)] == sorted(stands)
    for number in (3, 1, 2):
        made.execute(tables.ADD_SETUP, {"number": number, "content": f"told {number}"})
        made.execute(tables.ADD_ALARM, {"number": number, "content": f"alarm {number}"})
        made.execute(sa.insert(tables.STRING), {"place": number, "tube": 10 - number})
        made.execute(sa.insert(tables.BLOCKS), {"sha256": f"{5 - number}", "content": b"%d" % number})
        basis = "other" if number == 2 else "this"
        made.execute(tables.ADD_MOMENT, {"number": number, "basis": basis, "content": b"%d" % number})
    assert [row.content for row in made.execute(tables.ALL_SETUP)] == ["told 1", "told 2", "told 3"]
    assert [row.content for row in made.execute(tables.ALL_ALARMS)] == ["alarm 1", "alarm 2", "alarm 3"]
    assert [row.tube for row in made.execute(tables.WHOLE_STRING)] == [9, 8, 7]
    assert [row.sha256 for row in made.execute(tables.ALL_BLOCKS)] == ["2", "3", "4"]
    assert [row.number for row in made.execute(tables.ALL_MOMENTS, {"its_basis": "this"})] == [1, 3]
    for drop, asked in (
        (tables.DROP_SETUP, tables.ALL_SETUP), (tables.DROP_ALARM, tables.ALL_ALARMS),
        (tables.DROP_MOMENT, tables.MOMENT_NUMBERS),
    ):  # fmt: skip
        made.execute(drop, {"its_number": 2})
        assert sorted(row.number for row in made.execute(asked)) == [1, 3]


def test_a_message_is_found_placed_and_dropped_by_tube_number_and_content(made: sa.Connection) -> None:
    rows = [(1, 5, "a"), (1, 5, "b"), (2, 5, "a"), (1, 6, "a")]
    for tube, sequence, content in rows:
        payload = f"{tube}{sequence}{content}".encode()
        values = {"tube": tube, "sequence": sequence, "content": content, "kind": "Event", "payload": payload}
        for _ in range(2):  # again it does nothing
            made.execute(tables.add_new("sqlite"), values)
    assert [row.payload for row in made.execute(tables.ALL_MESSAGES)] == [b"15a", b"15b", b"25a", b"16a"]
    for k, (tube, sequence, content) in enumerate(rows):
        which = {"its_tube": tube, "its_sequence": sequence, "its_content": content}
        assert [row.payload for row in made.execute(tables.FIND, which)] == [f"{tube}{sequence}{content}".encode()]
        made.execute(tables.PLACE, which | {"depth": 2.5 + k})
    assert [row.md for row in made.execute(tables.ALL_MESSAGES)] == [2.5, 3.5, 4.5, 5.5]
    made.execute(tables.DROP, {"its_tube": 1, "its_sequence": 5, "its_content": "b"})
    assert [row.payload for row in made.execute(tables.ALL_MESSAGES)] == [b"15a", b"25a", b"16a"]


@pytest.mark.parametrize(
    ("epoch", "begun", "ended", "md", "gone"),
    [
        (1, 60.0, 80.0, 3.0, True), (1, 60.001, 80.0, 3.0, False), (1, 10.0, 50.0, 3.0, True),
        (1, 10.0, 49.999, 3.0, False), (1, 52.0, 55.0, 3.0, True), (1, 55.0, 58.0, 3.1, False),
        (2, 52.0, 55.0, 3.0, False), (1, 50.0, 50.5, 7.0, True),
    ],
)  # fmt: skip
def test_a_stand_drops_what_it_touches_at_its_depth_and_what_has_its_key(
    made: sa.Connection, epoch: int, begun: float, ended: float, md: float, gone: bool
) -> None:
    made.execute(tables.ADD_STAND, {"epoch": 1, "begun_at": 50.0, "ended_at": 60.0, "md": 3.0})
    made.execute(
        tables.DROP_OVERLAPS, {"its_epoch": epoch, "its_begin": begun, "its_end": ended, "its_md": md}
    )  # fmt: skip
    assert len(list(made.execute(tables.ALL_STANDS))) == (not gone)


def test_a_database_is_durable_patient_and_small_and_leaves_nothing_open(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with contextlib.closing(Store(url(tmp_path))) as store, store._engine.connect() as connection:
        asked = {
            name: connection.exec_driver_sql(f"PRAGMA {name}").scalar()
            for name in ("journal_mode", "synchronous", "busy_timeout", "cache_size")
        }
        assert connection.exec_driver_sql("SELECT CAST(x'41ff42' AS TEXT)").scalar() == "A\ufffdB"
    assert asked == {"journal_mode": "wal", "synchronous": 2, "busy_timeout": 5000, "cache_size": -256}
    opened: list[sqlite3.Connection] = []
    database_room._sqlite_dialect.cache_clear()
    real: Any = sqlite3.connect

    def connect(*given: Any, **named: Any) -> sqlite3.Connection:
        opened.append(real(*given, **named))
        return opened[-1]

    monkeypatch.setattr("sqlite3.dbapi2.connect", connect)
    assert database_room._sqlite_dialect() is database_room._sqlite_dialect()
    for one in opened:
        with pytest.raises(sqlite3.ProgrammingError, match="closed"):
            one.execute("SELECT 1")
    assert len(opened) == 1


def test_a_database_that_refused_is_opened_anew(tmp_path: Path) -> None:
    """A connection of a file that could not be written stays so."""
    with contextlib.closing(Store(url(tmp_path))) as store:
        for turn in range(2):
            before = store._engine.pool
            with pytest.raises(StoreError, match="cannot"), store._writing():
                raise OSError("cannot")
            assert store._engine.pool is not before
            assert "cannot" in store.refusal
            store.add_message(survey(1, 1 + turn), None)
            assert store.refusal == ""


@pytest.mark.parametrize("address", ["nonsense", "mysql://u:secret@h/d", "sqlite+nothing:///FILE", "sqlite+nothing://"])
def test_a_database_that_cannot_be_named_is_refused_without_its_password(address: str, tmp_path: Path) -> None:
    address = address.replace("FILE", str(tmp_path / "ground.sqlite"))
    with pytest.raises(StoreError, match="database URL: expected one such as sqlite:///FILE whose driver") as refused:
        Store(address)
    assert "secret" not in str(refused.value)
    assert "\n" not in str(refused.value)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("driver", ["sqlite", "sqlite+pysqlite"])
def test_a_file_is_kept_durably_by_either_name_of_its_driver(driver: str, tmp_path: Path) -> None:
    with contextlib.closing(Store(f"{driver}:///{tmp_path / 'ground.sqlite'}")) as store:
        assert store.add_message(survey(1, 1), None)
        with store._engine.connect() as connection:
            assert connection.exec_driver_sql("PRAGMA journal_mode").scalar() == "wal"


# databases that parted


def stored(folder: Path, *rows: tuple[int, float | None], epoch: int = 0, stands: tuple[Stand, ...] = ()) -> Path:
    folder.mkdir()
    with contextlib.closing(Store(url(folder))) as store:
        for sequence, md in rows:
            store.add_message(survey(1, sequence), md)
        for stand in stands:
            store.keep_stand(stand)
        if epoch:
            store.keep_epoch(epoch)
    return folder


def test_a_merge_counts_what_both_and_each_have_and_leaves_one_file(tmp_path: Path) -> None:
    a, b, c = Stand(1, 10.0, 50.0, 2.0), Stand(1, 60.0, 90.0, 4.0), Stand(2, 5.0, 40.0, 4.0)
    first = stored(tmp_path / "a", (1, 2.0), (2, None), (3, 4.0), (9, None), epoch=3, stands=(a, b))
    second = stored(tmp_path / "b", (1, 9.0), (2, 3.0), (4, 5.0), (9, None), (5, None), epoch=2, stands=(b, c))
    for name, one, other, counts, epoch in (
        ("ab", first, second, (3, 1, 2, 1), 3), ("ba", second, first, (3, 2, 1, 1), 3),
    ):  # fmt: skip
        into = tmp_path / name
        done = merge_databases(one, other, into)
        assert (done.shared, done.first_alone, done.second_alone, done.stands) == counts
        assert (done.damaged, done.twice) == (0, ())
        assert sorted(path.name for path in into.iterdir()) == ["ground.sqlite"]
        with contextlib.closing(Store(url(into))) as store:
            depths = {one.message.sequence: one.md for one in store.messages()}
            assert depths == {1: 2.0 if name == "ab" else 9.0, 2: 3.0, 3: 4.0, 4: 5.0, 5: None, 9: None}
            assert (store.epoch(), sorted(store.stands(), key=lambda s: (s.epoch, s.begun_at))) == (epoch, [a, b, c])


def test_a_merge_that_fails_leaves_nothing_of_its_own_and_all_that_was_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    first, second, into = stored(tmp_path / "a", (1, 2.0)), stored(tmp_path / "b", (2, 2.0)), tmp_path / "c"
    into.mkdir()
    (into / "notes").write_text("of the crew")
    (second / "ground.sqlite").write_bytes(b"no database at all, but long enough to be looked at as one" * 20)
    with pytest.raises(StoreError, match=r"ground\.sqlite: file is not a database"):
        merge_databases(first, second, into)
    assert [path.name for path in into.iterdir()] == ["notes"]
    monkeypatch.setattr(merge_room, "_merge", lambda *_: (_ for _ in ()).throw(StoreError("full")))
    with pytest.raises(StoreError, match="full"):
        merge_databases(first, first, into)
    assert [path.name for path in into.iterdir()] == ["notes"]
    for one, other in ((first, tmp_path / "nowhere"), (tmp_path / "nowhere", first)):
        with pytest.raises(ConfigurationError, match=r"nowhere: expected the folder of a ground station"):
            merge_databases(one, other, into)
    (into / "ground.sqlite").write_text("another")
    with pytest.raises(ConfigurationError, match="it would be written over"):
        merge_databases(first, first, into)
    assert (into / "ground.sqlite").read_text() == "another"
