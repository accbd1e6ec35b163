"""What a node keeps over a loss of power, as bytes: its record and a blob of the telemetry.

Layout of a slot: header, checksum, what of the record is kept, blob. The header names the layout of the record by the
version of ``node.kernels.record.node_record`` and a checksum of what its fields are, so that neither a forgotten
version nor a changed meaning is taken for the present one. Of an earlier layout what both know is carried over
(``saved_layouts``).
"""

from __future__ import annotations

import struct
import zlib
from dataclasses import dataclass
from typing import Final

import numpy as np

from node.errors import SavedStateError
from node.firmware.saved_layouts import CarriedState, carry_over, dtype_description, known_layouts
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.resets import resume_filter
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import KEPT, KEPT_SIZE, NODE, NODE_LAYOUT, forget_session, new_node

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
    carried : how much of it was carried over from another layout; None where it is of the present one
    """

    nodes: Array
    blob: bytes
    generation: int
    saved_at: float
    carried: CarriedState | None = None


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
    name, is_present = layout_name(version, fields), (version, fields) == (NODE_LAYOUT, FIELDS)
    if form != FORMAT or not (is_present or name in known_layouts()):
        got = f"{version} without a checksum of its fields" if form == 0 else name
        later = ", which a later version wrote" if version > NODE_LAYOUT else ""
        raise SavedStateError(f"saved state: expected layout {layout_name()}, got {got}{later}")
    (crc,) = CHECKSUM.unpack_from(data, HEADER.size)
    body = data[begin : begin + state_size + blob_size]
    expected = KEPT_SIZE if is_present else known_layouts()[name].itemsize
    is_whole = state_size == expected and len(body) == state_size + blob_size
    if not is_whole or zlib.crc32(body, zlib.crc32(data[: HEADER.size])) != crc:
        raise SavedStateError("saved state: checksum does not fit, the slot is torn or damaged")
    kept, carried = body[:state_size], None
    if not is_present:
        kept, carried = carried_state(name, kept)
    record = bytearray(kept) + bytearray(NODE.itemsize - KEPT_SIZE)
    return Saved(np.frombuffer(record, NODE), body[state_size:], generation, saved_at, carried)


def carried_state(name: str, kept: bytes) -> tuple[bytes, CarriedState]:
    """What of a record is kept, carried over from the layout ``name``; the rest is that of a node that is new."""
    nodes = new_node(default_config())
    carried, fresh = carry_over(np.frombuffer(kept, known_layouts()[name]), nodes[list(KEPT)])
    return nodes.tobytes()[:KEPT_SIZE], CarriedState(name, carried, fresh)


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
