"""What a node keeps over a loss of power, as bytes: its record and a blob of the telemetry."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from node.errors import SavedStateError
from node.kernels.layout import Array
from node.kernels.record import NODE, NODE_LAYOUT, forget_session
from node.kernels.resets import resume as resume_filter

HEADER = struct.Struct("<4sHHQII")  # magic, layout, reserved, generation, state bytes, blob bytes
CHECKSUM = struct.Struct("<I")  # crc32 of header and body, between the two
MAGIC = b"BCSS"


def pack(state: Array, blob: bytes, generation: int) -> bytes:
    """Bytes of one slot: header, checksum, record, blob."""
    head = HEADER.pack(MAGIC, NODE_LAYOUT, 0, generation, NODE.itemsize, len(blob))
    body = state.tobytes() + blob
    return head + CHECKSUM.pack(zlib.crc32(body, zlib.crc32(head))) + body


def unpack(data: bytes) -> tuple[Array, bytes, int]:
    """State, blob and generation of one slot.

    Raises
    ------
    SavedStateError
        When the bytes are torn, damaged or of another layout; the message says which.
    """
    begin = HEADER.size + CHECKSUM.size
    if len(data) < begin:
        raise SavedStateError(f"saved state: expected at least {begin} bytes, got {len(data)}")
    magic, layout, _, generation, state_size, blob_size = HEADER.unpack_from(data)
    if magic != MAGIC or layout != NODE_LAYOUT or state_size != NODE.itemsize:
        raise SavedStateError(
            f"saved state: expected layout {NODE_LAYOUT} of {NODE.itemsize} bytes, got {layout} of {state_size}"
        )
    (crc,) = CHECKSUM.unpack_from(data, HEADER.size)
    body = data[begin : begin + state_size + blob_size]
    if len(body) != state_size + blob_size or zlib.crc32(body, zlib.crc32(data[: HEADER.size])) != crc:
        raise SavedStateError("saved state: checksum does not fit, the slot is torn or damaged")
    return np.frombuffer(bytearray(body[:state_size]), NODE), body[state_size:], generation


def resume(nodes: Array) -> bool:
    """Make a saved node ready for its first cycle after an outage of unknown length; whether it cut an alignment.

    What is learnt stays: constants, mounts, trust in the sensors, the twist. What belongs to the session goes, and
    nobody knows what torque there was meanwhile.
    """
    forget_session(nodes)
    node = nodes[0]
    resume_filter(node["filter"])
    node["twist"]["wound"] = 1
    was_cut = bool(node["mount"]["aligning"])
    node["mount"]["aligning"] = 0
    return was_cut
