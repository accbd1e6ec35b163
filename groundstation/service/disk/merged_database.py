"""One database of two that parted: two ground stations were at work on a rig, and each has what the other lacks.

Messages are numbered by their tubes and known by their content, so what both have is there once. Order of the tubes,
joints, setup and alarms are those of the first database; where the bit stood is known from both.
"""

from __future__ import annotations

import contextlib
import sqlite3
from dataclasses import dataclass
from pathlib import Path

from groundstation.errors import ConfigurationError, StoreError
from groundstation.service.disk.ground_store import Store
from groundstation.service.string.stored import Stored
from telemetry.messages import Kept
from telemetry.presentation.msgpack_codec import encode_message

FILE = "ground.sqlite"


@dataclass(frozen=True, slots=True)
class DatabaseMerge:
    """What came of a merge: messages of both, of the first and of the second alone, and stands that came with it.

    ``twice`` are tube and number of messages of which the two have another content: both are kept.
    """

    shared: int
    first_alone: int
    second_alone: int
    stands: int
    damaged: int
    twice: tuple[tuple[int, int], ...]


def merge_databases(first: Path, second: Path, into: Path) -> DatabaseMerge:
    """Write the database of the folder ``into`` from those of two folders, which stay as they are.

    Raises
    ------
    ConfigurationError
        When ``into`` has a database already, or one of the two has none.
    StoreError
        When one of them is no database of a ground station.
    """
    for folder in (first, second):
        if not (folder / FILE).is_file():
            raise ConfigurationError(f"{folder}: expected the folder of a ground station with {FILE}, found none")
    if (into / FILE).exists():
        raise ConfigurationError(f"{into / FILE}: expected a folder without a database; it would be written over")
    into.mkdir(parents=True, exist_ok=True)
    work = into / f".{FILE}.second"
    try:
        copy_database(first / FILE, into / FILE)
        copy_database(second / FILE, work)
        with contextlib.closing(store_at(into / FILE)) as merged, contextlib.closing(store_at(work)) as other:
            return _merge(merged, other)
    except BaseException:
        for path in into.glob(f"{FILE}*"):
            path.unlink(missing_ok=True)
        raise
    finally:
        for path in into.glob(f"{work.name}*"):
            path.unlink(missing_ok=True)


def copy_database(source: Path, target: Path) -> None:
    """Copy a database whole, with what its journal holds, without a change to it.

    Raises
    ------
    StoreError
        When it is no database.
    """
    try:
        with (
            contextlib.closing(sqlite3.connect(f"file:{source}?mode=ro", uri=True)) as read,
            contextlib.closing(sqlite3.connect(target)) as written,
        ):
            read.backup(written)
    except sqlite3.Error as error:
        raise StoreError(f"database {source}: {error}") from error


def store_at(file: Path) -> Store:
    """The database of a file."""
    return Store(f"sqlite:///{file}")


def _merge(merged: Store, other: Store) -> DatabaseMerge:
    own = {encode_message(one.message): one for one in merged.messages()}
    named = {(one.message.tube, one.message.sequence) for one in own.values()}
    arrived = list(other.messages())
    fresh = [one for one in arrived if encode_message(one.message) not in own]
    placed: list[tuple[Kept, float | None]] = []
    for one in arrived:
        known: Stored[Kept] | None = own.get(encode_message(one.message))
        if known is not None and known.md is None and one.md is not None:
            placed.append((one.message, one.md))
    merged.add_messages(fresh)
    if placed:
        merged.place_messages(placed)
    known_stands = merged.stands()
    stands = [stand for stand in other.stands() if stand not in known_stands]
    for stand in stands:
        merged.keep_stand(stand)
    if other.epoch() > merged.epoch():
        merged.keep_epoch(other.epoch())
    names = ((one.message.tube, one.message.sequence) for one in fresh)
    twice = tuple(sorted(name for name in names if name in named))
    shared = len(arrived) - len(fresh)
    return DatabaseMerge(shared, len(own) - shared, len(fresh), len(stands), merged.damaged + other.damaged, twice)
