"""What a node keeps over a loss of power, as bytes: its record and a blob of the telemetry.

Layout of a slot: header, checksum, what of the record is kept, blob. The header names the layout of the record by the
version of ``node.kernels.record.node_record`` and a checksum of what its fields are, so that neither a forgotten
version nor a changed meaning is taken for the present one.
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from node.errors import SavedStateError
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.resets import resume_filter
from node.kernels.record.node_record import KEPT, KEPT_SIZE, NODE, NODE_LAYOUT, forget_session

# magic, version and format, checksum of the fields, generation, bytes of state and blob, when it was saved (s)
HEADER: Final = struct.Struct("<4sHHIQIId")
CHECKSUM: Final = struct.Struct("<I")  # crc32 of header and body, between the two
MAGIC: Final = b"BCSS"
FORMAT: Final = 1  # of the header; 0 had the version alone, in the same place


@dataclass(frozen=True, slots=True, eq=False)
class Saved:
    """One slot.

    Attributes
    ----------
    nodes : the node's record, one-element array of dtype ``NODE``
    blob : of the telemetry
    generation : number in the sequence of saves
    saved_at : s, the node's own clock, end of the newest cycle in the record; no clock runs while the power is off
    """

    nodes: Array
    blob: bytes
    generation: int
    saved_at: float


def dtype_description(dtype: np.dtype[Any]) -> str:
    """All that fixes the bytes of a record: names, places, types and shapes of its fields, and its size."""
    if dtype.subdtype is not None:
        base, shape = dtype.subdtype
        return f"{dtype_description(base)}{list(shape)}"
    if dtype.fields is None:
        return dtype.str
    fields = (
        f"{name}@{dtype.fields[name][1]}:{dtype_description(dtype.fields[name][0])}" for name in dtype.names or ()
    )
    return f"{{{','.join(fields)}}}{dtype.itemsize}"


FIELDS: Final = zlib.crc32("".join(dtype_description(NODE[name]) for name in KEPT).encode())


def layout_name(version: int = NODE_LAYOUT, fields: int = FIELDS) -> str:
    """Name of a layout: version, and checksum of what the fields are."""
    return f"{version}-{fields:08x}"


def pack_state_slot(state: Array, blob: bytes, generation: int) -> bytes:
    """Bytes of one slot."""
    saved_at = float(state[0]["filter"]["now"])
    head = HEADER.pack(MAGIC, NODE_LAYOUT, FORMAT, FIELDS, generation, KEPT_SIZE, len(blob), saved_at)
    body = state.tobytes()[:KEPT_SIZE] + blob
    return head + CHECKSUM.pack(zlib.crc32(body, zlib.crc32(head))) + body


def unpack_state_slot(data: bytes) -> Saved:
    """Contents of one slot; what stands behind them, left by a longer save, is not looked at.

    Raises
    ------
    SavedStateError
        When the bytes are torn, damaged or of another layout; the message says which.
    """
    begin = HEADER.size + CHECKSUM.size
    if len(data) < begin:
        raise SavedStateError(f"saved state: expected at least {begin} bytes, got {len(data)}")
    magic, version, form, fields, generation, state_size, blob_size, saved_at = HEADER.unpack_from(data)
    if magic != MAGIC:
        raise SavedStateError(f"saved state: expected {MAGIC!r} first, got {magic!r}")
    if (version, form, fields) != (NODE_LAYOUT, FORMAT, FIELDS):
        got = f"{version} without a checksum of its fields" if form == 0 else layout_name(version, fields)
        raise SavedStateError(f"saved state: expected layout {layout_name()}, got {got}")
    (crc,) = CHECKSUM.unpack_from(data, HEADER.size)
    body = data[begin : begin + state_size + blob_size]
    is_whole = state_size == KEPT_SIZE and len(body) == state_size + blob_size
    if not is_whole or zlib.crc32(body, zlib.crc32(data[: HEADER.size])) != crc:
        raise SavedStateError("saved state: checksum does not fit, the slot is torn or damaged")
    record = bytearray(body[:state_size]) + bytearray(NODE.itemsize - KEPT_SIZE)
    return Saved(np.frombuffer(record, NODE), body[state_size:], generation, saved_at)


def resume_node(nodes: Array, configs: Array) -> bool:
    """Make a saved node ready for its first cycle after an outage of unknown length; whether it cut an alignment.

    What is learnt stays: constants, mounts, trust in the sensors, the twist. What belongs to the session goes, and
    the torque meanwhile is unknown. The configuration in use is again the one given, ``configs`` (1).
    """
    forget_session(nodes)
    nodes["config"] = configs
    node = nodes[0]
    resume_filter(node["filter"])
    node["twist"]["wound"] = 1
    was_cut = bool(node["mount"]["aligning"])
    node["mount"]["aligning"] = 0
    return was_cut
