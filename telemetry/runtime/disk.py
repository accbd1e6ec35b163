"""What a process needs of its disk, and the disk of the machine.

Saved state, count of starts, log of surveys, parameter blocks and database reach the disk through ``Disk`` alone, so
that a simulated rig can have disks that tear, lose what was not forced, fill up or refuse. The calls are as small as
what a cut of the power can come between: a caller that must keep something forces it, bytes and name.
"""

from __future__ import annotations

import os
import sqlite3
from pathlib import Path
from typing import Final, Protocol

CHUNK: Final = 1 << 16  # bytes of one read


class Disk(Protocol):
    """Files of one process; every call raises OSError where the disk refuses."""

    def read(self, path: Path, offset: int = 0, size: int | None = None) -> bytes:
        """Bytes of a file from ``offset`` on, fewer than ``size`` only at its end."""

    def reserve(self, path: Path, size: int) -> None:
        """Reserve room for ``size`` bytes of a file, perhaps a new one, before anything is written over."""

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        """Write in place, into a new file where there is none; kept over a cut only once it is forced."""

    def force(self, path: Path) -> None:
        """Force the bytes of a file to the disk; what is read next comes from there."""

    def force_names(self, folder: Path) -> None:
        """Force the names in a folder to the disk: a new file is not kept by forcing its bytes alone."""

    def rename(self, old: Path, new: Path) -> None:
        """Rename a file in one step; a file of the new name is replaced."""

    def remove(self, path: Path) -> None:
        """Remove a file."""

    def make_folder(self, folder: Path) -> None:
        """Make a folder and those above it, where they are absent."""

    def identity(self, path: Path) -> int:
        """Number of the file that has this name now; 0 where there is none."""

    def stamp(self, path: Path) -> tuple[int, ...]:
        """Identity of a file, and what a write to it changes where the disk says so; empty where there is none."""

    def connect(self, path: Path) -> sqlite3.Connection:
        """Open a database; sqlite3.Error where it refuses."""


class MachineDisk:
    """The disk of the machine this runs on."""

    def read(self, path: Path, offset: int = 0, size: int | None = None) -> bytes:
        """Bytes of a file."""
        descriptor = os.open(path, os.O_RDONLY)
        try:
            if size is not None:
                return os.pread(descriptor, size, offset)
            return b"".join(iter(lambda: os.read(descriptor, CHUNK), b""))[offset:]
        finally:
            os.close(descriptor)

    def reserve(self, path: Path, size: int) -> None:
        """Reserve room."""
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            os.posix_fallocate(descriptor, 0, size)
        finally:
            os.close(descriptor)

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        """Write in place."""
        descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o600)
        try:
            rest = memoryview(data)
            while rest:
                written = os.pwrite(descriptor, rest, offset)
                rest, offset = rest[written:], offset + written
        finally:
            os.close(descriptor)

    def force(self, path: Path) -> None:
        """Force bytes, and make the cache forget them."""
        descriptor = os.open(path, os.O_RDWR)
        try:
            os.fsync(descriptor)
            os.posix_fadvise(descriptor, 0, 0, os.POSIX_FADV_DONTNEED)
        finally:
            os.close(descriptor)

    def force_names(self, folder: Path) -> None:
        """Force names."""
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)

    def rename(self, old: Path, new: Path) -> None:
        """Rename in one step."""
        old.replace(new)

    def remove(self, path: Path) -> None:
        """Remove a file."""
        path.unlink()

    def make_folder(self, folder: Path) -> None:
        """Make a folder."""
        folder.mkdir(parents=True, exist_ok=True)

    def identity(self, path: Path) -> int:
        """Inode of the file; 0 where there is none."""
        try:
            return path.stat().st_ino
        except OSError:
            return 0

    def stamp(self, path: Path) -> tuple[int, ...]:
        """Inode, bytes and time of the last write (ns)."""
        try:
            found = path.stat()
        except OSError:
            return ()
        return found.st_ino, found.st_size, found.st_mtime_ns

    def connect(self, path: Path) -> sqlite3.Connection:
        """Open a database file; a connection may go from thread to thread, as a pool does with it."""
        return sqlite3.connect(path, check_same_thread=False)


MACHINE: Final = MachineDisk()


def replace_file(disk: Disk, path: Path, data: bytes) -> None:
    """Replace a file in one step, forced to the disk with its name: a cut leaves the old or the new one.

    Raises
    ------
    OSError
        When the disk refuses; the file is the old one, or the new one whose name may not be kept.
    """
    fresh = path.with_name(f"{path.name}.new")
    if disk.identity(fresh):
        disk.remove(fresh)  # a cut may have left a longer one
    disk.write(fresh, data)
    disk.force(fresh)
    disk.rename(fresh, path)
    disk.force_names(path.parent)
