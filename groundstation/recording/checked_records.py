"""Records of an MCAP file, each checked: what is damaged is skipped and told, what lies behind it is read.

Layout and checksums: MCAP specification 1.0. A chunk has a checksum of its own; all that lies between the chunks
is covered by that of the data section, the tables at the end by that of the footer.
"""

from __future__ import annotations

import mmap
import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from io import BytesIO

import zstandard
from mcap import records as layout
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, Chunk, DataEnd, Footer, McapRecord
from mcap.stream_reader import breakup_chunk

MAGIC = b"\x89MCAP0\r\n"
LARGEST_RECORD = 1 << 26  # bytes, packed and unpacked
HEAD = struct.Struct("<BQ")  # of a record: opcode, bytes of its body
OF_CHUNK = b"\x04\x00\x00\x00zstd"  # what every chunk of ours has after its head and 28 bytes
TO_COMPRESSION = HEAD.size + 28
FOOTER_CHECKED = HEAD.size + 16  # bytes of the footer's record that its checksum covers
FOOTER_LENGTH = HEAD.size + 20
LAYOUTS = {
    opcode: getattr(layout, name)
    for opcode, name in (
        (Opcode.HEADER, "Header"),
        (Opcode.FOOTER, "Footer"),
        (Opcode.SCHEMA, "Schema"),
        (Opcode.CHANNEL, "Channel"),
        (Opcode.MESSAGE, "Message"),
        (Opcode.CHUNK, "Chunk"),
        (Opcode.MESSAGE_INDEX, "MessageIndex"),
        (Opcode.CHUNK_INDEX, "ChunkIndex"),
        (Opcode.ATTACHMENT, "Attachment"),
        (Opcode.ATTACHMENT_INDEX, "AttachmentIndex"),
        (Opcode.STATISTICS, "Statistics"),
        (Opcode.METADATA, "Metadata"),
        (Opcode.METADATA_INDEX, "MetadataIndex"),
        (Opcode.SUMMARY_OFFSET, "SummaryOffset"),
        (Opcode.DATA_END, "DataEnd"),
    )
}


@dataclass(frozen=True, slots=True)
class DamagedBytes:
    """Bytes that are not what was written: where they begin in the file, and what was expected there."""

    position: int
    expected: str


@dataclass(frozen=True, slots=True)
class FileEnd:
    """The last mark of a file that was closed, with nothing behind it."""


class DamagedRecordError(ValueError):
    """A record is not as it was written."""


def read_checked(content: mmap.mmap | bytes) -> Iterator[McapRecord | DamagedBytes | FileEnd]:
    """Records of a file in their order, those of chunks in place of the chunk.

    A file that is cut ends without ``FileEnd``.
    """
    position, is_damaged = len(MAGIC), False
    while position < len(content):
        try:
            record, behind = _record_at(content, position)
        except DamagedRecordError as error:
            found = _next_chunk(content, position + 1)
            if found is not None or not _is_cut(content, position):
                is_damaged = True
                yield DamagedBytes(position, str(error))
            if found is None:
                return
            position = found
            continue
        try:
            if isinstance(record, Chunk):
                yield from unpack_chunk(record)
            elif not (is_damaged and isinstance(record, DataEnd)):  # the whole section's checksum says nothing new
                _check_sums(content, position, record)
                yield record
        except DamagedRecordError as error:
            is_damaged = True
            yield DamagedBytes(position, str(error))
        position = behind
        if isinstance(record, Footer):
            yield _end_at(content, position)
            return


def unpack_chunk(chunk: Chunk) -> list[McapRecord]:
    """Records of a chunk, unpacked within bounds and compared with its checksum.

    Raises
    ------
    DamagedRecordError
    """
    size = chunk.uncompressed_size
    if size > LARGEST_RECORD:
        raise DamagedRecordError(f"a chunk of at most {LARGEST_RECORD} bytes, got one of {size}")
    if chunk.compression not in ("", "zstd"):
        raise DamagedRecordError(f"a chunk packed by zstd, got {chunk.compression!r:.40}")
    try:
        if chunk.compression == "zstd":
            with zstandard.ZstdDecompressor(max_window_size=LARGEST_RECORD).stream_reader(chunk.data) as reader:
                data = reader.read(size + 1)
        else:
            data = chunk.data
    except zstandard.ZstdError as error:
        raise DamagedRecordError("a chunk that can be unpacked") from error
    if len(data) != size or (chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc):
        raise DamagedRecordError("the chunk that its checksum is of")
    try:
        return breakup_chunk(Chunk("", data, chunk.message_end_time, chunk.message_start_time, 0, size))
    except Exception as error:
        raise DamagedRecordError("records in a chunk") from error


def channels_at_end(content: mmap.mmap | bytes) -> dict[int, Channel]:
    """Channels that the tables at the end of a closed file name again; none of a file without them."""
    footer_at = len(content) - len(MAGIC) - FOOTER_LENGTH
    found: dict[int, Channel] = {}
    try:
        footer, _ = _record_at(content, footer_at)
        _check_sums(content, footer_at, footer)
        position = footer.summary_start if isinstance(footer, Footer) else 0
        while 0 < position < footer_at:
            record, position = _record_at(content, position)
            if isinstance(record, Channel):
                found[record.id] = record
    except DamagedRecordError:
        return {}
    return found


def _record_at(content: mmap.mmap | bytes, position: int) -> tuple[McapRecord, int]:
    """The record at a position, and where the next one begins."""
    head = content[position : position + HEAD.size] if position >= 0 else b""
    if len(head) < HEAD.size:
        raise DamagedRecordError("a record")
    opcode, length = HEAD.unpack(head)
    if opcode not in LAYOUTS or length > LARGEST_RECORD:
        raise DamagedRecordError("a record of a known kind and length")
    behind = position + HEAD.size + length
    body = content[position + HEAD.size : behind]
    stream = ReadDataStream(BytesIO(body))
    kind = LAYOUTS[opcode]
    try:
        record = kind.read(stream, length) if opcode == Opcode.MESSAGE else kind.read(stream)
    except Exception as error:
        raise DamagedRecordError(f"a whole {kind.__name__}") from error
    if len(body) != length or stream.count != length:
        raise DamagedRecordError(f"a whole {kind.__name__}")
    return record, behind


def _check_sums(content: mmap.mmap | bytes, position: int, record: McapRecord) -> None:
    """Compare the checksum of the data section, or of the tables at the end, where one was written."""
    if isinstance(record, DataEnd) and record.data_section_crc:
        if _sum_of(content, 0, position) != record.data_section_crc:
            raise DamagedRecordError("the data section that its checksum is of")
    elif isinstance(record, Footer) and record.summary_crc:
        start = record.summary_start or position
        if _sum_of(content, start, position + FOOTER_CHECKED) != record.summary_crc:
            raise DamagedRecordError("the tables that the footer's checksum is of")


def _sum_of(content: mmap.mmap | bytes, start: int, end: int) -> int:
    """Checksum of some bytes (CRC-32), a part at a time."""
    checksum = 0
    for at in range(start, end, 1 << 20):
        checksum = zlib.crc32(content[at : min(at + (1 << 20), end)], checksum)
    return checksum


def _next_chunk(content: mmap.mmap | bytes, start: int) -> int | None:
    """Where the next chunk with the right checksum begins, at ``start`` or behind it."""
    at = start + TO_COMPRESSION
    while (at := content.find(OF_CHUNK, at)) >= 0:
        try:
            record, _ = _record_at(content, at - TO_COMPRESSION)
            if isinstance(record, Chunk):
                unpack_chunk(record)
                return at - TO_COMPRESSION
        except DamagedRecordError:
            pass
        at += 1
    return None


def _is_cut(content: mmap.mmap | bytes, position: int) -> bool:
    """Whether the record at a position is as far as it goes that of a file which ends too early."""
    head = content[position : position + HEAD.size]
    if len(head) < HEAD.size:
        return True
    opcode, length = HEAD.unpack(head)
    return opcode in LAYOUTS and length <= LARGEST_RECORD and position + HEAD.size + length > len(content)


def _end_at(content: mmap.mmap | bytes, position: int) -> FileEnd | DamagedBytes:
    """The mark at the end of a file."""
    if content[position : position + len(MAGIC) + 1] == MAGIC:
        return FileEnd()
    return DamagedBytes(position, "the mark at the end of a recording")
