"""The database of a ground station, a file or a server: opened, checked, written to durably, named where it refuses.

A disk that refuses leaves what is there readable: a database that cannot be written is opened all the same, and a file
that was deleted or written over under the running program is noticed before the next commit, which would be lost with
it. Where a whole database lies in its place, a backup that was restored, a ground station that starts anew goes on with
that one. A journal is never read into a file that it was not begun on (``guarded_file``).
"""

from __future__ import annotations

import contextlib
import functools
import sqlite3
import struct
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

import sqlalchemy as sa

from groundstation.errors import StoreError
from groundstation.service.disk.database_tables import (
    ALL_META,
    DIGESTED,
    META,
    METADATA,
    READABLE,
    SCHEMA,
    replace_meta,
)
from groundstation.service.disk.guarded_file import GuardedFile
from groundstation.service.disk.row_digest import DIGEST
from telemetry.runtime.disk import MACHINE, Disk

CACHE_KB = 256  # of pages that a connection keeps: rows come at the end, and the usual 2 MB fill within an hour
SHOWN = 5  # tables named of a database that is not ours
HEAD = struct.Struct(">16s H 10x I")  # of a file of SQLite: its name, bytes of a page (1 for 65536), pages
SQLITE = b"SQLite format 3\0"
FILE_DRIVERS: Final = ("sqlite", "sqlite+pysqlite")  # of a file that is opened by ``Disk``
COMPILED: Final[dict[Any, Any]] = {}  # statements for SQLite by their keys; as many as the sources have


class Database:
    """Database of one rig.

    Parameters
    ----------
    url : SQLAlchemy URL; SQLite runs in WAL mode with every commit forced to the disk
    disk : that holds a database which is a file

    Attributes
    ----------
    refusal : why the database takes nothing, or empty
    boots : starts of the ground station upon it, this one included

    Raises
    ------
    StoreError
        When the database cannot be opened, is no database, or belongs to another version.
    """

    def __init__(self, url: str, disk: Disk = MACHINE) -> None:
        self._disk = disk
        self._engine = _engine_of(url, disk)
        address = self._engine.url
        self._where = address.database or address.render_as_string(hide_password=True)
        self._file = Path(address.database) if self._engine.dialect.name == "sqlite" and address.database else None
        self.refusal = ""
        self.boots = 0
        self._guarded = None if self._file is None else GuardedFile(self._file, disk)
        self._tables: set[str] = set()
        self._undigested: set[str] = set()  # tables of before without hashes, in a database that cannot be written
        try:
            with self._refusing("; choose a writable --folder or another database"):
                if self._guarded is not None:
                    disk.make_folder(self._guarded.file.parent)
                    self._guarded.part_foreign_journal()
                self._begin(self._check_schema(self._engine))
        except StoreError:
            self.close()
            raise
        if self._guarded is not None:
            self._guarded.note_stamps()

    def _has(self, table: sa.Table) -> bool:
        """Whether there is a table; a database of before that cannot be written lacks the later ones."""
        return table.name in self._tables

    def _known_columns(self, statement: sa.Select[Any]) -> sa.Select[Any]:
        """A selection without the hashes where a database of before lacks them."""
        columns = list(statement.selected_columns)
        if columns[0].table.name not in self._undigested:
            return statement
        return statement.with_only_columns(*(column for column in columns if column.name != DIGEST))

    def close(self) -> None:
        """Close every connection; the last one puts the journal into the file."""
        if self._guarded is not None:
            self._guarded.close()
        self._engine.dispose()
        if self._guarded is not None:
            self._guarded.release()

    @property
    def parted(self) -> str:
        """What lay beside the file at the start and was another's; empty where nothing was."""
        return "" if self._guarded is None else self._guarded.parted

    @contextlib.contextmanager
    def _writing(self) -> Iterator[sa.Connection]:
        """A transaction, committed to a file that still has its name."""
        try:
            with self._refusing():
                if self._guarded is not None and not self._guarded.is_as_left(self._engine):
                    raise StoreError(f"database {self._where}: was removed or replaced while the ground station ran")
                with self._engine.begin() as connection:
                    yield connection
        except StoreError as error:
            self.refusal = str(error)
            self._engine.dispose()  # a file that was opened while it could not be written stays so
            raise
        self.refusal = ""
        if self._guarded is not None and self._guarded.is_generation_due():
            with self._refusing():
                self._guarded.follow_journal(self._engine)

    def check_place(self) -> None:
        """See that no other database lies in the place of one that takes nothing any more.

        Raises
        ------
        StoreError
            When a whole one of a ground station does: the process has to start anew, to go on with what is there.
        """
        if self.refusal and self._guarded is not None and self._guarded.is_another and self._is_another_whole():
            raise StoreError(
                f"database {self._where}: another one lies in its place; start the ground station again on it"
            )

    def _is_another_whole(self) -> bool:
        """Whether the file that has the name of ours now is a database of a ground station, none that is still copied.

        One that is shorter than its head says is not opened: nothing of ours is to be written into it.
        """
        if self._guarded is None or self._file is None:
            return False
        self._engine.dispose()
        looking = _engine_of_file(self._engine.url, self._disk)  # ours would make it durable, which is a change
        try:
            name, page, pages = HEAD.unpack(self._disk.read(self._file, 0, HEAD.size))
            last = (page if page > 1 else 65536) * pages - 1
            if name != SQLITE or last < 0 or not self._disk.read(self._file, last, 1):
                return False
            self._guarded.part_own_journal()
            return bool(self._check_schema(looking))
        except (struct.error, OSError, sa.exc.SQLAlchemyError):  # a refusal of its schema is an OSError too
            return False
        finally:
            looking.dispose()

    @contextlib.contextmanager
    def _refusing(self, remedy: str = "") -> Iterator[None]:
        """Name the database and the reason in whatever it refuses."""
        try:
            yield
        except StoreError:
            raise
        except (sa.exc.SQLAlchemyError, OSError) as error:
            reason = str(getattr(error, "orig", None) or getattr(error, "strerror", None) or error)
            raise StoreError(f"database {self._where}: {reason}{remedy}") from error

    def _check_schema(self, engine: sa.Engine) -> list[str]:
        """Look without a change whether the database is one of ours; its tables, none of a new one."""
        tables = sorted(sa.inspect(engine).get_table_names())
        if tables and META.name not in tables:
            raise StoreError(
                f"database {self._where}: expected an empty one or that of a ground station, "
                f"got tables {', '.join(tables[:SHOWN])}; choose another --folder or database"
            )
        found = _meta_of(engine) if tables else {}
        if found and found.get("schema") not in [str(schema) for schema in READABLE]:
            wanted = " or ".join(map(str, READABLE))
            raise StoreError(
                f"database {self._where}: expected schema {wanted}, got {found.get('schema')}; "
                "one of a later version is read by that version"
            )
        return tables if found else []

    def _meta(self) -> dict[str, str]:
        return _meta_of(self._engine)

    def _begin(self, tables: list[str]) -> None:
        """Make ready for writing and count this start; a database of ours that refuses is read all the same."""
        if self._engine.dialect.name == "sqlite":
            self._engine.dispose()  # the connection that only looked is not durable
            sa.event.listen(self._engine, "connect", _make_durable)
        self._tables = set(tables)
        self._undigested = {table.name for table in DIGESTED if table.name in tables and not self._is_digested(table)}
        try:
            with self._refusing():
                if lacking := [table for table in METADATA.sorted_tables if table.name not in tables]:
                    METADATA.create_all(self._engine, lacking)
                self._tables.update(METADATA.tables)
                self._add_digests()
                self._count_start()
                if self._guarded is not None:
                    self._guarded.begin(self._engine)
        except StoreError as error:
            if not tables:
                raise
            self.refusal = str(error)

    def _is_digested(self, table: sa.Table) -> bool:
        """Whether a table has room for hashes."""
        try:
            with self._engine.connect() as connection:
                connection.execute(sa.select(table.c[DIGEST]).limit(0))
        except (sa.exc.OperationalError, sa.exc.ProgrammingError):
            return False
        return True

    def _add_digests(self) -> None:
        """Give the tables of before room for hashes; their rows have none."""
        with self._engine.begin() as connection:
            for name in sorted(self._undigested):
                connection.execute(sa.text(f"ALTER TABLE {name} ADD COLUMN {DIGEST} VARCHAR(32)"))
        self._undigested.clear()

    def _count_start(self) -> None:
        boots = int(self._meta().get("boots", "0")) + 1
        self.boots = boots
        with self._engine.begin() as connection:
            replace_meta(connection, {"schema": str(SCHEMA), "boots": str(boots)})


def _meta_of(engine: sa.Engine) -> dict[str, str]:
    with engine.connect() as connection:
        return {row.name: row.value for row in connection.execute(ALL_META)}


def _engine_of(url: str, disk: Disk) -> sa.Engine:
    """Engine of a URL, a file by ``disk``; a refusal does not repeat the URL, which may hold a password."""
    try:
        address = sa.make_url(url)
        if address.drivername in FILE_DRIVERS and address.database and not address.query:
            return _engine_of_file(address, disk)
        if address.drivername == "postgresql":
            address = address.set(drivername="postgresql+psycopg")
        return sa.create_engine(address)
    except (sa.exc.SQLAlchemyError, ImportError) as error:
        raise StoreError(
            f"database URL: expected one such as sqlite:///FILE whose driver is installed: {error}"
        ) from error


def _engine_of_file(address: sa.URL, disk: Disk) -> sa.Engine:
    """Engine of a file: statements are compiled once a process for all of them, which costs more than a whole start."""
    file, dialect = Path(address.database or ""), _sqlite_dialect()

    def connect() -> Any:
        connection = disk.connect(file)
        # a text of which a bit has changed is damaged, and refuses no other
        connection.text_factory = functools.partial(str, encoding="utf-8", errors="replace")
        return connection

    pool = sa.QueuePool(connect, dialect=dialect)
    return sa.Engine(pool, dialect, address, execution_options={"compiled_cache": COMPILED})


@functools.cache
def _sqlite_dialect() -> sa.Dialect:
    """SQLAlchemy's dialect of SQLite, which has seen a connection."""
    engine = sa.create_engine("sqlite://")
    engine.connect().close()
    engine.dispose()
    return engine.dialect


def _make_durable(connection: sa.engine.interfaces.DBAPIConnection, _record: object) -> None:
    cursor = connection.cursor()
    with contextlib.suppress(sqlite3.OperationalError):  # a file that cannot be written can be read
        cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute("PRAGMA synchronous=FULL")
    cursor.execute("PRAGMA busy_timeout=5000")
    cursor.execute("PRAGMA wal_autocheckpoint=0")  # ``GuardedFile`` does so, with a generation
    cursor.execute(f"PRAGMA cache_size=-{CACHE_KB}")
    cursor.close()
