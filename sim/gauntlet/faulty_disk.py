"""A disk in memory that behaves like one whose cache is lost with the power, and that fails when it is told to.

A file holds what a reader sees and what would be left after a cut. Between two forces a cut leaves of every sector the
old bytes or the new ones, and of the names that were changed a first part. The database is SQLite in memory, whose
image is kept at every commit that SQLite would force to the disk.
"""

from __future__ import annotations

import errno
import os
import sqlite3
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path

import numpy as np

SECTOR = 512  # bytes that are written as one
FULL = 2  # value of SQLite's ``synchronous`` from which on a commit is forced
KEPT_BACKUPS = 8


class PowerCutError(Exception):
    """The power went while the disk was being written."""


@dataclass(slots=True)
class File:
    """Bytes of one file: as read now, and as they would be after a cut, where they differ at all."""

    seen: bytearray
    kept: bytes = b""
    number: int = 0


@dataclass(frozen=True, slots=True)
class NameChange:
    """A name that was given to a file, or taken from one (None), and is not forced yet; two of a rename are one."""

    names: tuple[tuple[str, File | None], ...]


@dataclass(slots=True)
class FaultyDisk:
    """Disk of one process, with one folder; see ``telemetry.runtime.disk.Disk``.

    Attributes
    ----------
    refusal : errno with which every change is refused, 0 for none
    writes_left : changes until the power goes in the middle of one; negative for never
    """

    random: np.random.Generator
    refusal: int = 0
    writes_left: int = -1
    files: dict[str, File] = field(default_factory=dict)
    backups: list[bytes] = field(default_factory=list)  # images of the database, the newest last
    handled: int = 0  # changes of a file from outside the process
    _kept_names: dict[str, File] = field(default_factory=dict)
    _changes: list[NameChange] = field(default_factory=list)
    _numbers: int = 0
    _open: MemoryDatabase | None = None

    def read(self, path: Path, offset: int = 0, size: int | None = None) -> bytes:
        """Bytes of a file."""
        found = self._found(path).seen
        return bytes(found[offset:] if size is None else found[offset : offset + size])

    def reserve(self, path: Path, size: int) -> None:
        """Reserve room: more zeros at the end."""
        self._spend(path)
        file = self._made(path)
        file.seen.extend(bytes(max(size - len(file.seen), 0)))

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        """Write in place; the power may go in the middle."""
        is_cut = self._spend(path, torn=True)
        file = self._made(path)
        part = data[: int(self.random.integers(len(data) + 1))] if is_cut else data
        file.seen.extend(bytes(max(offset - len(file.seen), 0)))
        file.seen[offset : offset + len(part)] = part
        if is_cut:
            raise PowerCutError

    def force(self, path: Path) -> None:
        """Force bytes."""
        self._spend(path)
        file = self._found(path)
        file.kept = bytes(file.seen)

    def force_names(self, folder: Path) -> None:
        """Force every name of a folder."""
        self._spend(folder)
        for change in self._changes:
            self._apply(change)
        self._changes = []

    def rename(self, old: Path, new: Path) -> None:
        """Rename in one step."""
        self._spend(new)
        file = self._found(old)
        del self.files[old.name]
        self.files[new.name] = file
        self._changes.append(NameChange(((old.name, None), (new.name, file))))

    def remove(self, path: Path) -> None:
        """Remove a file."""
        self._spend(path)
        self._found(path)
        del self.files[path.name]
        self._changes.append(NameChange(((path.name, None),)))

    def make_folder(self, folder: Path) -> None:
        """Do nothing: every folder is there, even on a disk that refuses."""

    def identity(self, path: Path) -> int:
        """Number of the file that has this name; 0 where there is none."""
        return self.files[path.name].number if path.name in self.files else 0

    def stamp(self, path: Path) -> tuple[int, ...]:
        """Its number alone: no file of this disk is written over from outside."""
        return (self.files[path.name].number,) if path.name in self.files else ()

    def connect(self, path: Path) -> sqlite3.Connection:
        """Open a database; one at a time, as each has its own image of the file."""
        if self._open is not None:
            raise sqlite3.OperationalError("expected one connection at a time, got a second")
        connection = sqlite3.connect(":memory:", check_same_thread=False, factory=MemoryDatabase)
        connection.begin_on(self, path.name)
        self._open = connection
        return connection

    def cut(self) -> None:
        """Cut the power: what was not forced is lost, kept in part, or kept."""
        self.writes_left = -1
        if self._open is not None:
            self._open.abandon()
            self._open = None
        for change in self._changes[: int(self.random.integers(len(self._changes) + 1))]:
            self._apply(change)
        self._changes = []
        self.files = dict(self._kept_names)
        for file in self.files.values():
            if file.seen != file.kept:
                file.seen = bytearray(self._torn(file))
                file.kept = bytes(file.seen)

    def replace(self, name: str, data: bytes | None) -> None:
        """Replace a file's bytes from outside the process; None removes the file."""
        self.handled += 1
        if data is None:
            self.files.pop(name, None)
            self._kept_names.pop(name, None)
        else:
            self.files[name] = self._kept_names[name] = self._new(data)

    def held(self, *patterns: str) -> dict[str, bytes]:
        """Bytes of the files whose names fit one of the patterns."""
        names = sorted(name for name in self.files if any(fnmatch(name, pattern) for pattern in patterns))
        return {name: bytes(self.files[name].seen) for name in names}

    def copied(self, random: np.random.Generator) -> FaultyDisk:
        """Return the disk as it is after a cut, with a random stream of its own."""
        disk = FaultyDisk(random)
        for name, file in self._kept_names.items():
            disk.replace(name, file.kept)
        disk.handled = 0
        return disk

    @property
    def size(self) -> int:
        """Bytes held: of every file what is read and what is kept, and the backups."""
        files = {id(file): file for file in (*self.files.values(), *self._kept_names.values())}
        return sum(len(file.seen) + len(file.kept) for file in files.values()) + sum(map(len, self.backups))

    def make_empty(self, name: str) -> None:
        """Make a file whose name is kept."""
        self.files[name] = self._kept_names[name] = self._new(b"")

    def kept(self, name: str) -> bytes:
        """Bytes of a file that would be left after a cut; none where it would not be there."""
        return self._kept_names[name].kept if name in self._kept_names else b""

    def keep_image(self, name: str, image: bytes) -> None:
        """Keep the image of the database that a commit wrote."""
        if self.files[name].kept:
            self.backups = [*self.backups[1 - KEPT_BACKUPS :], self.files[name].kept]
        self.files[name].seen[:] = image
        self.files[name].kept = image
        self._kept_names[name] = self.files[name]

    def closed(self) -> None:
        """Note that the database was closed."""
        self._open = None

    def refuse_database(self) -> None:
        """Refuse a change of the database where the disk does."""
        if self.refusal:
            full = self.refusal == errno.ENOSPC
            raise sqlite3.OperationalError(
                "database or disk is full" if full else "attempt to write a readonly database"
            )

    def _found(self, path: Path) -> File:
        if path.name not in self.files:
            raise FileNotFoundError(errno.ENOENT, os.strerror(errno.ENOENT), str(path))
        return self.files[path.name]

    def _made(self, path: Path) -> File:
        if path.name not in self.files:
            self.files[path.name] = self._new(b"")
            self._changes.append(NameChange(((path.name, self.files[path.name]),)))
        return self.files[path.name]

    def _new(self, data: bytes) -> File:
        self._numbers += 1
        return File(bytearray(data), data, self._numbers)

    def _spend(self, path: Path, *, torn: bool = False) -> bool:
        """Count a change; returns whether the power goes in the middle of it; raises where it cannot be ``torn``."""
        if self.refusal:
            raise OSError(self.refusal, os.strerror(self.refusal), str(path))
        if self.writes_left < 0:
            return False
        self.writes_left -= 1
        if self.writes_left < 0 and not torn:
            raise PowerCutError
        return self.writes_left < 0

    def _apply(self, change: NameChange) -> None:
        for name, file in change.names:
            if file is None:
                self._kept_names.pop(name, None)
            else:
                self._kept_names[name] = file

    def _torn(self, file: File) -> bytes:
        """Return the bytes after a cut: each sector old or new, and a first part of what was added."""
        if self.random.random() < 0.3:
            return bytes(file.seen)
        size = int(self.random.integers(len(file.kept), max(len(file.seen), len(file.kept)) + 1))
        image = bytearray(file.kept[:size].ljust(size, b"\0"))
        for begin in range(0, size, SECTOR):
            if self.random.random() < 0.5:
                part = file.seen[begin : min(begin + SECTOR, size)]
                image[begin : begin + len(part)] = part
        return bytes(image)


class MemoryDatabase(sqlite3.Connection):
    """SQLite in memory on a faulty disk; what it commits is kept where SQLite would force it."""

    _disk: FaultyDisk | None = None
    _name: str

    def begin_on(self, disk: FaultyDisk, name: str) -> None:
        """Load the image of the file that the disk has."""
        self._disk, self._name = disk, name
        image = bytes(disk.files[name].seen) if name in disk.files else b""
        if image:
            self.deserialize(image)
        elif name not in disk.files:
            disk.refuse_database()
            disk.make_empty(name)

    def abandon(self) -> None:
        """Abandon the connection at a power cut: nothing more of it reaches the disk."""
        self._disk = None

    def commit(self) -> None:
        """Commit; the disk may refuse, or take it into its cache only."""
        disk = self._disk
        if disk is not None and self.in_transaction:
            disk.refuse_database()
            if disk.writes_left >= 0:
                self._commit_in_the_cut(disk)
        super().commit()
        if disk is not None and self._name in disk.files:
            image = self.serialize()
            if int(self.execute("PRAGMA synchronous").fetchone()[0]) >= FULL:
                disk.keep_image(self._name, image)
            else:
                disk.files[self._name].seen[:] = image

    def close(self) -> None:
        """Close."""
        if self._disk is not None:
            self._disk.closed()
        super().close()

    def _commit_in_the_cut(self, disk: FaultyDisk) -> None:
        disk.writes_left -= 1
        if disk.writes_left < 0:
            raise PowerCutError
