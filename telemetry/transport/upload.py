"""A block in segments: the sender that repeats what is missing and the receiver that gathers. Pure state machines."""

from __future__ import annotations

import hashlib

import msgpack

from telemetry.messages import MAX_SEGMENTS, SEGMENT_SIZE, BlockSegment, BlockStatus, UploadPhase
from telemetry.transport.authentication import sealed_segment

FIRST_RETRY = 10.0  # s
LAST_RETRY = 60.0  # s
UNTRUSTED_LIMIT = 3  # tags that the node found wrong, before the sender takes its key for the wrong one


def split_block(block: bytes, tube: int, sequence: int, version: int, key: bytes) -> tuple[BlockSegment, ...]:
    """Sealed segments of a block's bytes for ``tube``; ``sequence`` numbers the upload.

    Raises
    ------
    ValueError
        When the block is empty or needs more than ``MAX_SEGMENTS``.
    """
    parts = [block[k : k + SEGMENT_SIZE] for k in range(0, len(block), SEGMENT_SIZE)]
    if not 1 <= len(parts) <= MAX_SEGMENTS:
        raise ValueError(f"block: expected 1..{MAX_SEGMENTS * SEGMENT_SIZE} bytes, got {len(block)}")
    digest = hashlib.sha256(block).digest()
    return tuple(
        sealed_segment(BlockSegment(tube, sequence, version, digest, len(parts), index, part, b"\0" * 32), key)
        for index, part in enumerate(parts)
    )


class Upload:
    """The sender: sends all segments once, then those that the node lacks, until the node has judged the block."""

    def __init__(self, segments: tuple[BlockSegment, ...], now: float) -> None:
        self.segments = segments
        self.next_due = now
        self._wait = FIRST_RETRY
        self._received = 0
        self._untrusted = 0

    def due_segments(self, now: float) -> list[BlockSegment]:
        """Segments to send now; if none is missing the first one, whose answer tells the state."""
        if now < self.next_due:
            return []
        self.next_due = now + self._wait
        self._wait = min(2.0 * self._wait, LAST_RETRY)
        missing = [segment for segment in self.segments if not self._received >> segment.index & 1]
        return missing or [self.segments[0]]

    def on_status(self, status: BlockStatus) -> bool:
        """Take the node's account of an upload; returns whether it is the last one on this block."""
        first = self.segments[0]
        if (status.tube, status.sequence, status.digest) != (first.tube, first.sequence, first.digest):
            return False
        if status.phase is UploadPhase.UNTRUSTED:
            self._untrusted += 1
            return self._untrusted >= UNTRUSTED_LIMIT
        self._received = status.received
        return status.phase in (UploadPhase.APPLIED, UploadPhase.REFUSED)


class Assembly:
    """The receiver: the segments of one block that have come so far. It takes authentic segments only."""

    def __init__(self, version: int, digest: bytes, count: int) -> None:
        self.version = version
        self.digest = digest
        self.count = count
        self._parts: dict[int, bytes] = {}

    def belongs(self, segment: BlockSegment) -> bool:
        """Whether a segment is part of this block."""
        return (segment.version, segment.digest, segment.count) == (self.version, self.digest, self.count)

    def add_segment(self, segment: BlockSegment) -> bool:
        """Keep a segment; False when it was there."""
        if segment.index in self._parts:
            return False
        self._parts[segment.index] = segment.data
        return True

    @property
    def received(self) -> int:
        """Bit k is set when segment k has come."""
        return sum(1 << index for index in self._parts)

    @property
    def complete(self) -> bool:
        """Whether every segment has come."""
        return len(self._parts) == self.count

    def block(self) -> bytes | None:
        """Bytes of a complete block; None if they do not fit the hash."""
        data = b"".join(self._parts[index] for index in range(self.count))
        return data if hashlib.sha256(data).digest() == self.digest else None

    def export(self) -> bytes:
        """Pack what a restart needs."""
        return bytes(msgpack.packb([self.version, self.digest, self.count, sorted(self._parts.items())]))

    @classmethod
    def restore(cls, saved: bytes) -> Assembly | None:
        """Return the assembly of saved bytes; None if they are invalid."""
        try:
            version, digest, count, parts = msgpack.unpackb(saved)
            assembly = cls(int(version), bytes(digest), int(count))
            assembly._parts = {int(index): bytes(part) for index, part in parts}
        except (ValueError, TypeError, msgpack.UnpackException):
            return None
        if not 1 <= assembly.count <= MAX_SEGMENTS or any(not 0 <= k < assembly.count for k in assembly._parts):
            return None
        return assembly
