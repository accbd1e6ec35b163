"""A recording as a file: MCAP, with a JSON schema for every answer, in chunks so small that a cut loses little.

The metadata ``borechain`` names the version and the rig. Topics are keys of the bus; times are UTC, ns. All of the
file is under checksums: damage is skipped, counted and told with its time, and what lies behind it is read.
"""

from __future__ import annotations

import mmap
import re
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from datetime import UTC, datetime
from pathlib import Path
from typing import IO

from mcap.records import Channel, Message, Metadata
from mcap.writer import CompressionType, Writer

from groundstation.recording.checked_records import MAGIC, DamagedBytes, FileEnd, channels_at_end, read_checked
from telemetry import keys
from telemetry.errors import InputError

VERSION = "1"
NAME = "borechain"
CHUNK_SIZE = 8192  # bytes; larger ones lose more where a recording is cut
NUMBER = re.compile(r"(?<=/)[0-9]+(?=/|$)")
RIG_IN_KEY = re.compile(r"borechain/([^/]+)/")


class RecordingError(InputError, ValueError):
    """The file is not a readable recording."""


@dataclass(frozen=True, slots=True)
class RecordedSample:
    """One payload on a key, at a time (UTC, ns)."""

    key: str
    at: int
    payload: bytes


class RecordingWriter:
    """Writes samples as they come; what is in a full chunk is in the file at once.

    Parameters
    ----------
    path : new file
    rig : name
    schemas : JSON schema of each path below ``ground/``, as bytes

    Raises
    ------
    RecordingError
        When the file cannot be made, or is there already.
    """

    def __init__(self, path: Path, rig: str, schemas: dict[str, bytes]) -> None:
        try:
            self._file: IO[bytes] = path.open("xb")
        except OSError as error:
            raise RecordingError(
                f"{path}: {error.strerror}; choose a new file in a folder that can be written"
            ) from error
        self._writer = Writer(
            self._file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD, enable_data_crcs=True
        )
        self._writer.start(profile=NAME, library=NAME)
        self._writer.add_metadata(NAME, {"version": VERSION, "rig": rig})
        self._schemas, self._ids = schemas, dict[str, int]()
        self._channels: dict[str, int] = {}
        self.samples = 0

    def __enter__(self) -> RecordingWriter:
        return self

    def __exit__(self, *_ended_by: object) -> None:
        self._writer.finish()  # type: ignore[no-untyped-call]
        self._file.close()

    def write(self, sample: RecordedSample) -> None:
        """Add a sample."""
        if sample.key not in self._channels:
            self._channels[sample.key] = self._channel(sample.key)
        self.samples += 1
        self._writer.add_message(self._channels[sample.key], sample.at, sample.payload, sample.at, self.samples)
        self._file.flush()  # a chunk that is full; before it is there is nothing to flush

    def _channel(self, key: str) -> int:
        path = key.partition("/ground/")[2]
        pattern = NUMBER.sub("{tube}" if path.startswith("nodes/") else "{n}", path)
        if pattern not in self._schemas:
            return self._writer.register_channel(key, "msgpack", 0)
        if pattern not in self._ids:
            name = f"{NAME}.{pattern.replace('/', '.')}"
            self._ids[pattern] = self._writer.register_schema(name, "jsonschema", self._schemas[pattern])
        return self._writer.register_channel(key, "json", self._ids[pattern])


@dataclass(frozen=True, slots=True)
class RecordingDamage:
    """A part of a recording that could not be read: between the times (UTC, ns) of the samples around it."""

    position: int
    expected: str
    after: int | None
    before: int | None = None

    @property
    def line(self) -> str:
        """What is damaged, for its reader."""
        after, before = utc_text(self.after, "the begin"), utc_text(self.before, "the end")
        return f"damaged at byte {self.position}, between {after} and {before}: expected {self.expected}"


def utc_text(at: int | None, otherwise: str) -> str:
    """A time of a recording (UTC, ns) as text; ``otherwise`` without one."""
    return otherwise if at is None else datetime.fromtimestamp(at / 1e9, UTC).isoformat(" ", "seconds")


@dataclass(slots=True)
class Recording:
    """A recording that is read once, from its begin to its end or to where it is cut.

    ``whole`` is true once the end was found and nothing on the way was damaged; ``damage`` names the parts that were.
    """

    path: Path
    rig: str = ""
    whole: bool = False
    damage: list[RecordingDamage] = field(default_factory=list)
    _channels: dict[int, Channel] = field(default_factory=dict)
    _last: int | None = None

    def samples(self) -> Iterator[RecordedSample]:
        """Samples in the order in which they were written.

        Raises
        ------
        RecordingError
            When it is not a recording of this version.
        """
        try:
            with self.path.open("rb") as file:
                if file.read(len(MAGIC)) != MAGIC:
                    raise RecordingError(f"{self.path}: expected a recording (MCAP), got another file or a part of one")
                with mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as content:
                    yield from self._samples_of(content)
        except OSError as error:
            raise RecordingError(f"{self.path}: {error.strerror}") from error

    def _samples_of(self, content: mmap.mmap) -> Iterator[RecordedSample]:
        for record in read_checked(content):
            if isinstance(record, DamagedBytes):
                self._note_damage(record, content)
            elif isinstance(record, Metadata) and record.name == NAME:
                self._check(record)
            elif isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, Message) and record.channel_id in self._channels:
                yield self._sample_of(record)
            elif isinstance(record, FileEnd):
                self.whole = not self.damage

    def _sample_of(self, message: Message) -> RecordedSample:
        """The sample of a message; the damage before it ends here."""
        key = self._channels[message.channel_id].topic
        if self._last is None:
            self.rig = self._rig_of(key)
        self._last = message.log_time
        if self.damage and self.damage[-1].before is None:
            self.damage[-1] = replace(self.damage[-1], before=message.log_time)
        return RecordedSample(key, message.log_time, message.data)

    def _rig_of(self, key: str) -> str:
        """The rig by a key, which is under a checksum; the metadata that name it are not until the end of the file."""
        found = RIG_IN_KEY.match(key)
        if not self.rig and not self.damage:
            raise RecordingError(f"{self.path}: expected a recording of borechain, got one of something else")
        return found[1] if found else self.rig

    def _note_damage(self, damaged: DamagedBytes, content: mmap.mmap) -> None:
        """Keep where it is; keys that it may have named are looked for at the end of the file."""
        if not self.damage:
            self._channels = channels_at_end(content) | self._channels
        self.damage.append(RecordingDamage(damaged.position, damaged.expected, self._last))

    def _check(self, metadata: Metadata) -> None:
        version = metadata.metadata.get("version")
        if version != VERSION:
            raise RecordingError(f"{self.path}: expected a recording of version {VERSION}, got version {version}")
        self.rig = metadata.metadata.get("rig", keys.DEFAULT_RIG)
