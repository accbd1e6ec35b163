"""Parameter blocks on disk: two slots, each replaced whole, so that the block in use is never written over.

A slot is written beside its place and moved there in one step; a cut at any instant leaves both old slots, or the new
one and the block in use. ``upload`` holds the segments of a block that has not come whole yet.
"""

from __future__ import annotations

import contextlib
import hashlib
import struct
from collections.abc import Callable
from pathlib import Path

from telemetry.errors import DecodeError
from telemetry.parameters import BLOCK_SIZE, ParameterBlock, unpack_block
from telemetry.runtime.disk import MACHINE, Disk, replace_file

HEADER = struct.Struct("<4sQ")  # magic, generation; then SHA-256 of all else, then the block
MAGIC = b"BCPS"
SLOT_SIZE = HEADER.size + 32 + BLOCK_SIZE


def pack_slot(block: ParameterBlock, generation: int) -> bytes:
    """Bytes of one slot."""
    head, body = HEADER.pack(MAGIC, generation), block.canonical()
    return head + hashlib.sha256(head + body).digest() + body


def unpack_slot(data: bytes) -> tuple[ParameterBlock, int]:
    """Block and generation of one slot.

    Raises
    ------
    DecodeError
        When the bytes are torn, damaged or of another format.
    """
    if len(data) != SLOT_SIZE:
        raise DecodeError(f"parameter slot: expected {SLOT_SIZE} bytes, got {len(data)}")
    head, digest, body = data[: HEADER.size], data[HEADER.size : HEADER.size + 32], data[HEADER.size + 32 :]
    if hashlib.sha256(head + body).digest() != digest:
        raise DecodeError("parameter slot: hash does not fit, the slot is damaged")
    magic, generation = HEADER.unpack(head)
    if magic != MAGIC:
        raise DecodeError(f"parameter slot: expected {MAGIC!r}, got {magic!r}")
    return unpack_block(body), generation


class BlockStore:
    """Two-slot store in ``folder``; the newest good slot wins."""

    def __init__(self, folder: Path, disk: Disk = MACHINE) -> None:
        self._disk = disk
        with contextlib.suppress(OSError):  # a block that is to be kept finds out
            disk.make_folder(folder)
        self._slots = (folder / "parameters-0", folder / "parameters-1")
        self._upload = folder / "upload"
        self._generation = 0
        self.faults: list[str] = []

    def load(self, unfit: Callable[[ParameterBlock], str]) -> ParameterBlock | None:
        """Newest block that is whole and not ``unfit``, or None; ``faults`` names every slot that was passed over."""
        found: list[tuple[int, Path, ParameterBlock]] = []
        self.faults = []
        for slot in self._slots:
            try:
                block, generation = unpack_slot(self._disk.read(slot))
                found.append((generation, slot, block))
            except FileNotFoundError:
                continue
            except (DecodeError, OSError) as error:
                self.faults.append(f"{slot.name}: {error}")
        for generation, slot, block in sorted(found, key=lambda one: one[0], reverse=True):
            if reason := unfit(block):
                self.faults.append(f"{slot.name}: version {block.version}: {reason}")
                continue
            self._generation = generation
            return block
        return None

    def keep_block(self, block: ParameterBlock) -> None:
        """Put a block in the slot that is not in use; on the disk before it returns.

        Raises
        ------
        OSError
            When the disk refuses; the block in use is untouched.
        """
        generation = self._generation + 1
        slot, data = self._slots[generation % 2], pack_slot(block, generation)
        try:
            replace_file(self._disk, slot, data)
        except OSError:
            with contextlib.suppress(OSError):
                if self._disk.read(slot) == data:  # in place but perhaps not on the disk: it must not win later
                    self._disk.remove(slot)
            raise
        self._generation = generation

    def keep_upload(self, data: bytes) -> None:
        """Keep the segments that have come.

        Raises
        ------
        OSError
            When the disk refuses; what was kept before is untouched.
        """
        replace_file(self._disk, self._upload, hashlib.sha256(data).digest() + data)

    def upload(self) -> bytes | None:
        """Segments kept before the restart; None when there are none or they are damaged."""
        try:
            whole = self._disk.read(self._upload)
        except OSError:
            return None
        return whole[32:] if hashlib.sha256(whole[32:]).digest() == whole[:32] else None

    def drop_upload(self) -> None:
        """Forget the segments."""
        with contextlib.suppress(OSError):
            self._disk.remove(self._upload)
