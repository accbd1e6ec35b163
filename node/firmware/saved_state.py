"""What a node keeps over a loss of power, as bytes: its state record and a blob of the telemetry."""

from __future__ import annotations

import struct
import zlib

import numpy as np

from node.errors import SavedStateError
from node.kernels.error_model import isolate
from node.kernels.layout import LAYOUT_VERSION, STATE, UNKNOWN_YAW_VAR, Array, Err

HEADER = struct.Struct("<4sHHQII")  # magic, layout, reserved, generation, state bytes, blob bytes
CHECKSUM = struct.Struct("<I")  # crc32 of header and body, between the two
MAGIC = b"BCSS"


def pack(state: Array, blob: bytes, generation: int) -> bytes:
    """Bytes of one slot: header, checksum, state record, blob."""
    head = HEADER.pack(MAGIC, LAYOUT_VERSION, 0, generation, STATE.itemsize, len(blob))
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
    if magic != MAGIC or layout != LAYOUT_VERSION or state_size != STATE.itemsize:
        raise SavedStateError(
            f"saved state: expected layout {LAYOUT_VERSION} of {STATE.itemsize} bytes, got {layout} of {state_size}"
        )
    (crc,) = CHECKSUM.unpack_from(data, HEADER.size)
    body = data[begin : begin + state_size + blob_size]
    if len(body) != state_size + blob_size or zlib.crc32(body, zlib.crc32(data[: HEADER.size])) != crc:
        raise SavedStateError("saved state: checksum does not fit, the slot is torn or damaged")
    return np.frombuffer(body[:state_size], STATE).copy(), body[state_size:], generation


def resume(state: Array) -> None:
    """Make a saved record ready for its first cycle after an outage of unknown length.

    The constants (bias, scale, offset) are kept. The yaw is kept as the best guess; if the string was turning when
    the state was saved nothing is known of it, so its variance says so and the first aiding decides.
    """
    record = state[0]
    was_turning = int(record["still_cycles"]) == 0
    for name in ("cycles", "consumed", "pending", "still_cycles", "rejected", "bias_count"):
        record[name] = 0
    record["bias_sum"] = 0.0
    record["yaw"] = record["now_yaw"]
    if was_turning:
        record["last_sequence"] = -1
        isolate(record["P"], int(Err.YAW), UNKNOWN_YAW_VAR)
    record["now_P"] = record["P"]
