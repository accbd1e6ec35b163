"""A recording as a file: MCAP, with a JSON schema for every answer, in chunks so small that a cut loses little.

The metadata ``borechain`` names the version and the rig. Topics are keys of the bus; times are UTC, ns.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO

from mcap.records import Channel, McapRecord, Message, Metadata
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from telemetry import keys
from telemetry.errors import InputError

VERSION = "1"
NAME = "borechain"
CHUNK_SIZE = 8192  # bytes; larger ones lose more where a recording is cut
MAGIC = b"\x89MCAP0\r\n"
LARGEST_RECORD = 1 << 26  # bytes
NUMBER = re.compile(r"(?<=/)[0-9]+(?=/|$)")


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
        self._writer = Writer(self._file, chunk_size=CHUNK_SIZE, compression=CompressionType.ZSTD)
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


@dataclass(slots=True)
class Recording:
    """A recording that is read once, from its begin to its end or to where it is cut.

    ``whole`` is true once the end was found.
    """

    path: Path
    rig: str = ""
    whole: bool = False
    _channels: dict[int, Channel] = field(default_factory=dict)

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
                yield from self._samples_of(StreamReader(file, skip_magic=True, record_size_limit=LARGEST_RECORD))
        except OSError as error:
            raise RecordingError(f"{self.path}: {error.strerror}") from error

    def _samples_of(self, reader: StreamReader) -> Iterator[RecordedSample]:
        records = reader.records
        while (record := self._next(records)) is not None:
            if isinstance(record, Metadata) and record.name == NAME:
                self._check(record)
            elif isinstance(record, Channel):
                self._channels[record.id] = record
            elif isinstance(record, Message) and record.channel_id in self._channels:
                if not self.rig:
                    raise RecordingError(f"{self.path}: expected a recording of borechain, got one of something else")
                yield RecordedSample(self._channels[record.channel_id].topic, record.log_time, record.data)

    def _next(self, records: Iterator[McapRecord]) -> McapRecord | None:
        """The next record; None at the end, and where the file is cut or damaged."""
        try:
            return next(records)
        except StopIteration:
            self.whole = True
        except Exception:
            return None
        return None

    def _check(self, metadata: Metadata) -> None:
        version = metadata.metadata.get("version")
        if version != VERSION:
            raise RecordingError(f"{self.path}: expected a recording of version {VERSION}, got version {version}")
        self.rig = metadata.metadata.get("rig", keys.DEFAULT_RIG)
