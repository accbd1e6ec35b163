"""Which journal belongs to which file: SQLite reads whatever lies beside a file under the name of its journal.

A journal (``-wal``) holds pages for the file that it was begun on. Beside another one, a backup that was put in its
place while nothing ran, it would make one database of two. So the file and the first pages of each journal name a
generation. Before the pages of a journal go into the file, the next generation is entered beside the present one; once
they are there, the next journal begins by entering that there is one alone. At each moment the file has a generation
that the journal names, or is another. A copy of the file that was made since may stand for it: the journal has all that
has changed.
"""

from __future__ import annotations

import contextlib
import shutil
import sqlite3
import tempfile
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Final

OWN, BEFORE = "generation", "generation_before"  # names of the table ``meta``
JOURNAL_LIMIT: Final = 4 << 20  # bytes, from which on its pages go into the file
SOUND: Final = "ok"


@dataclass(frozen=True, slots=True)
class JournalGeneration:
    """What a database says of its journal: empty before a first one; ``before`` while the pages of one go over."""

    own: str = ""
    before: str | None = None

    @classmethod
    def of_meta(cls, meta: Mapping[str, str]) -> JournalGeneration:
        """As the table ``meta`` has it."""
        return cls(meta.get(OWN, ""), meta.get(BEFORE))

    def fits(self, file: JournalGeneration) -> bool:
        """Whether a journal that says this was begun on a file that says that, or says nothing of any."""
        return not self.own or file.own in (self.own, self.before)


def journal_of(file: Path) -> Path:
    """Where SQLite keeps the journal of a file."""
    return file.with_name(f"{file.name}-wal")


def generation_alone(file: Path) -> JournalGeneration:
    """What a file says by itself, without a journal.

    Raises
    ------
    sqlite3.Error
        When it is no sound database.
    """
    return _checked_generation(f"{file.absolute().as_uri()}?mode=ro&immutable=1")


def is_of_another(file: Path) -> bool:
    """Whether the journal beside a file was begun on another; False where the file is not sound by itself either.

    Both are read as a copy: SQLite writes into the file whose journal it reads.

    Raises
    ------
    OSError
        When there is no room for the copy.
    """
    try:
        alone = generation_alone(file)
    except sqlite3.Error:
        return False
    with tempfile.TemporaryDirectory(prefix="journal-", dir=file.parent) as folder:
        copy = Path(folder) / file.name
        shutil.copyfile(file, copy)
        shutil.copyfile(journal_of(file), journal_of(copy))
        try:
            return not _checked_generation(copy.as_uri()).fits(alone)
        except sqlite3.Error:
            return True


def _checked_generation(address: str) -> JournalGeneration:
    """What a database says that SQLite finds sound; sqlite3.Error of another."""
    with contextlib.closing(sqlite3.connect(address, uri=True)) as connection:
        (found,) = connection.execute("PRAGMA quick_check(1)").fetchone()
        if found != SOUND:
            raise sqlite3.DatabaseError(found)
        if not connection.execute("SELECT 1 FROM sqlite_master WHERE name = 'meta'").fetchone():
            return JournalGeneration()
        return JournalGeneration.of_meta(dict(connection.execute("SELECT name, value FROM meta")))
