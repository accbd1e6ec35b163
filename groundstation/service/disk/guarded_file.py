"""The file of a database while a ground station writes: what happens to it from outside, and the journal beside it."""

from __future__ import annotations

import contextlib
import fcntl
import itertools
import os
import secrets
import sqlite3
from pathlib import Path

import sqlalchemy as sa

from groundstation.service.disk.database_tables import ALL_META, replace_meta
from groundstation.service.disk.journal_generation import (
    BEFORE,
    JOURNAL_LIMIT,
    OWN,
    JournalGeneration,
    generation_alone,
    is_of_another,
    journal_of,
)
from telemetry.runtime.disk import Disk


class GuardedFile:
    """One database file and its journal.

    The first process that opens a file guards it. Another one, a second ground station in the same folder by mistake,
    leaves the file and its journal to that one: what it would look at changes meanwhile.

    Parameters
    ----------
    file : of the database
    disk : that holds it

    Attributes
    ----------
    parted : what lay beside the file at the start and was begun on another, and where it is now, or empty
    """

    def __init__(self, file: Path, disk: Disk) -> None:
        self.file, self._disk = file, disk
        self._journal_file = journal_of(file)
        self.parted = ""
        self._generation = JournalGeneration()
        self._guard: sqlite3.Connection | None = None
        self._locked: int | None = None  # descriptor
        self._is_overwritten = False
        self._stamp: tuple[int, ...] = ()
        self._limit = JOURNAL_LIMIT
        self._journal: tuple[int, ...] = ()  # identity of the journal beside the file; empty where there is none

    def part_foreign_journal(self) -> None:
        """Give a journal another name that lies beside the file and was begun on another one."""
        journal = self._journal_file
        if self._disk.identity(self.file) and self._disk.identity(journal):
            with contextlib.suppress(OSError):  # without room for a look the journal is read, as is usual
                if self._is_first() and is_of_another(self.file):
                    self.parted = f"{journal.name} was another file's, and is kept as {self._part(journal)}"

    def begin(self, engine: sa.Engine) -> None:
        """Where there is a journal, begin a generation, and hold the file by a connection that does not write.

        While that one is open, no other one that is closed puts the journal into the file.
        """
        with engine.connect() as connection:
            if connection.exec_driver_sql("PRAGMA journal_mode").scalar() != "wal" or not self._is_first():
                return
            self._generation = JournalGeneration.of_meta({row.name: row.value for row in connection.execute(ALL_META)})
        if self._generation.before is not None:
            self._begin_generation(engine)  # a cut came before the pages of a journal had gone over
        self._begin_generation(engine)
        self._guard = sqlite3.connect(f"{self.file.absolute().as_uri()}?mode=ro", uri=True, check_same_thread=False)
        self._guard.execute("SELECT 1 FROM sqlite_master").fetchall()

    def close(self) -> None:
        """Let the file go; the last connection that is closed after this puts the journal into it."""
        if self._guard is not None:
            self._guard.close()
            self._guard = None

    def release(self) -> None:
        """Let another process guard the file; after every connection is closed, whose locks end with it."""
        if self._locked is not None:
            os.close(self._locked)
            self._locked = None

    @property
    def is_another(self) -> bool:
        """Whether what has the name of the file is another one, or was written over."""
        return self._is_overwritten or self._disk.identity(self.file) not in (0, *self._stamp[:1])

    def is_as_left(self, engine: sa.Engine) -> bool:
        """Whether the file is ours and as we left it; no page of ours goes into one that is not."""
        found = self._disk.stamp(self.file)
        if self._is_overwritten or found[:1] != self._stamp[:1]:
            return False
        if self._guard is not None and found != self._stamp:
            if not self._is_own_still():
                self._leave(engine)
                return False
            self._stamp = found
        return True

    def is_generation_due(self) -> bool:
        """Whether the journal has grown long, or is another since connections were opened anew."""
        journal = self._disk.stamp(self._journal_file)
        return bool(journal) and (self._guard is None or journal[:1] != self._journal or journal[1] > self._limit)

    def follow_journal(self, engine: sa.Engine) -> None:
        """Begin the generation that is due.

        A file that could not be guarded at the start, as on a disk that refused, is from now on.
        """
        if self._guard is None:
            self.begin(engine)
        else:
            self._begin_generation(engine)
        self.note_stamps()

    def note_stamps(self) -> None:
        """Remember how the file was left, and which journal is beside it."""
        self._stamp = self._disk.stamp(self.file)
        self._journal = self._disk.stamp(self._journal_file)[:1]

    def part_own_journal(self) -> None:
        """Give our journal another name: SQLite would read it into whatever file has the name of ours."""
        journal = self._journal_file
        if self._journal and self._disk.stamp(journal)[:1] == self._journal:
            self._part(journal)

    def _is_first(self) -> bool:
        """Whether no other process guards the file; it is ours to guard then."""
        if self._locked is None:
            self._locked = os.open(self.file, os.O_RDONLY | os.O_CLOEXEC)
        try:
            fcntl.flock(self._locked, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            return False
        return True

    def _part(self, journal: Path) -> str:
        """Rename a journal to a name that is free, and return that."""
        names = (journal.with_name(f"{journal.name}-parted-{number}") for number in itertools.count(1))
        free = next(name for name in names if not self._disk.identity(name))
        self._disk.rename(journal, free)
        return free.name

    def _is_own_still(self) -> bool:
        """Whether a file that was written to is ours by itself: touched, or by a copy that our journal completes."""
        with contextlib.suppress(sqlite3.Error):
            return generation_alone(self.file).own in (self._generation.own, self._generation.before)
        return False

    def _leave(self, engine: sa.Engine) -> None:
        """Let go of a file that was written over; the last connection to it is one that may not write."""
        self._is_overwritten = True
        engine.dispose()
        self.close()
        self.part_own_journal()

    def _begin_generation(self, engine: sa.Engine) -> None:
        """Put the journal's pages into the file, and begin the next journal by entering its generation.

        Where another process reads meanwhile the pages may not have gone over whole: both generations stay entered, and
        it is tried again once as much has come again.
        """
        was = self._generation
        fresh = was if was.before is not None else JournalGeneration(secrets.token_hex(8), was.own)
        self._enter(engine, fresh)
        with engine.connect() as connection:
            (patience,) = connection.exec_driver_sql("PRAGMA busy_timeout").one()
            connection.exec_driver_sql("PRAGMA busy_timeout=0")  # nothing that is to be kept waits for a reader
            busy, *_ = connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)").one()
            connection.exec_driver_sql(f"PRAGMA busy_timeout={patience}")
        self._enter(engine, fresh if busy else JournalGeneration(fresh.own))
        size = self._disk.stamp(self._journal_file)[1]
        self._limit = JOURNAL_LIMIT + (size if busy else 0)

    def _enter(self, engine: sa.Engine, generation: JournalGeneration) -> None:
        names = {OWN: generation.own} | ({} if generation.before is None else {BEFORE: generation.before})
        with engine.begin() as connection:
            replace_meta(connection, names, without=[BEFORE])
        self._generation = generation
