"""A disk in memory that keeps what was forced and decides of the rest as a test says; the power goes after any call.

Independent of the simulator's: nothing is drawn, so that every instant is tried with every outcome.
"""

from __future__ import annotations

import enum
import sqlite3
from dataclasses import dataclass, field
from pathlib import Path


class PowerCutError(Exception):
    """The power went."""


class Left(enum.Enum):
    """What is left of what was not forced."""

    NOTHING = enum.auto()  # neither bytes nor names
    NAMES = enum.auto()  # names, with the bytes that were forced
    BYTES = enum.auto()  # bytes, under the names that were forced
    HALF = enum.auto()  # names, with half of the bytes
    ALL = enum.auto()


@dataclass
class Content:
    """Bytes as read now, and as they are forced."""

    seen: bytearray = field(default_factory=bytearray)
    forced: bytes = b""

    def after_cut(self, left: Left) -> bytes:
        if left in (Left.NOTHING, Left.NAMES):
            return self.forced
        if left is Left.HALF and self.seen != self.forced:
            half = len(self.seen) // 2
            return bytes(self.seen[:half]) + self.forced[half:]
        return bytes(self.seen)


@dataclass
class StrictDisk:
    """See ``telemetry.runtime.disk.Disk``; ``calls_left`` changes are made, and then the power is gone."""

    calls_left: int = -1
    calls: int = 0
    seen: dict[str, Content] = field(default_factory=dict)
    forced: dict[str, Content] = field(default_factory=dict)

    def read(self, path: Path, offset: int = 0, size: int | None = None) -> bytes:
        if path.name not in self.seen:
            raise FileNotFoundError(path)
        found = self.seen[path.name].seen
        return bytes(found[offset:] if size is None else found[offset : offset + size])

    def reserve(self, path: Path, size: int) -> None:
        self._spend()
        content = self.seen.setdefault(path.name, Content())
        content.seen.extend(bytes(max(size - len(content.seen), 0)))

    def write(self, path: Path, data: bytes, offset: int = 0) -> None:
        self._spend()
        content = self.seen.setdefault(path.name, Content())
        content.seen.extend(bytes(max(offset - len(content.seen), 0)))
        content.seen[offset : offset + len(data)] = data

    def force(self, path: Path) -> None:
        self._spend()
        content = self.seen[path.name]
        content.forced = bytes(content.seen)

    def force_names(self, folder: Path) -> None:
        self._spend()
        self.forced = dict(self.seen)

    def rename(self, old: Path, new: Path) -> None:
        self._spend()
        self.seen[new.name] = self.seen.pop(old.name)

    def remove(self, path: Path) -> None:
        self._spend()
        del self.seen[path.name]

    def make_folder(self, folder: Path) -> None:
        pass

    def identity(self, path: Path) -> int:
        return id(self.seen[path.name]) if path.name in self.seen else 0

    def connect(self, path: Path) -> sqlite3.Connection:
        raise AssertionError("expected files alone on this disk, got a database")

    def after_cut(self, left: Left) -> StrictDisk:
        """The disk that is found when the power is back."""
        names = self.forced if left in (Left.NOTHING, Left.BYTES) else self.seen
        found = {name: content.after_cut(left) for name, content in names.items()}
        kept = {name: Content(bytearray(data), data) for name, data in found.items()}
        return StrictDisk(seen=dict(kept), forced=dict(kept))

    def _spend(self) -> None:
        if self.calls_left == 0:
            raise PowerCutError
        self.calls_left -= 1
        self.calls += 1
