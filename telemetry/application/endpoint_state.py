"""What an endpoint goes on with after a restart, as bytes; read with the same care as what comes from the wire."""

from __future__ import annotations

from dataclasses import dataclass

import msgpack

from telemetry.errors import DecodeError
from telemetry.messages import HOPS_UNKNOWN, MAX_TUBE, Event, Message, Severity
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.schema import U53

STATE_LAYOUT = "endpoint-2"  # of what is saved; counted up when it changes
UNOWNED = "endpoint-1"  # the layout before, which does not name its process


def layout_of(saved: bytes) -> str:
    """Name of the layout of an exported state; "unnamed" if it has none."""
    try:
        name = msgpack.unpackb(saved)[0]
    except (ValueError, TypeError, LookupError, msgpack.UnpackException):
        return "unnamed"
    return name if isinstance(name, str) else "unnamed"


def owner_of(saved: bytes) -> int | None:
    """Address of the process whose exported state it is; None where it does not name one."""
    try:
        owner = msgpack.unpackb(saved)[5]
    except (ValueError, TypeError, LookupError, msgpack.UnpackException):
        return None
    return owner if type(owner) is int else None


@dataclass(frozen=True, slots=True)
class SavedState:
    """Numbers, messages without a receipt (and whether each must be kept), answers to commands, place in the string."""

    next_sequence: int
    parcels: list[tuple[int, bytes, bool]]
    answered: list[tuple[int, bytes]]
    hops: int


def pack_state(
    next_sequence: int, parcels: list[list[int | bytes]], answered: list[tuple[int, bytes]], hops: int, owner: int
) -> bytes:
    """Bytes of a state of the process with the address ``owner``."""
    return bytes(msgpack.packb([STATE_LAYOUT, next_sequence, parcels, answered, hops, owner]))


def parse_state(saved: bytes) -> SavedState:
    """State of its bytes.

    Raises
    ------
    DecodeError
        When they are not a state, or hold an invalid message; the process then starts without one.
    """
    try:
        layout, next_sequence, parcels, answered, hops, *owner = msgpack.unpackb(saved, max_ext_len=0)
        kept, answers = [_parcel(row) for row in parcels], [_parcel(row) for row in answered]
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise DecodeError(f"saved state: {error}") from error
    if (layout, len(owner)) not in ((STATE_LAYOUT, 1), (UNOWNED, 0)):
        raise DecodeError(f"saved state: expected layout {STATE_LAYOUT}, got {layout!r:.40}")
    if type(next_sequence) is not int or not 1 <= next_sequence <= U53:
        raise DecodeError(f"saved state: next number: expected 1..2^53, got {next_sequence!r:.40}")
    if type(hops) is not int or not HOPS_UNKNOWN <= hops <= MAX_TUBE:
        raise DecodeError(f"saved state: hops: expected {HOPS_UNKNOWN}..{MAX_TUBE}, got {hops!r:.40}")
    return SavedState(next_sequence, kept, [(number, payload) for number, payload, _ in answers], hops)


def is_needed(message: Message) -> bool:
    """Return whether a kept message must not be lost; an event may be, for want of room."""
    return not isinstance(message, Event) or message.severity is Severity.ERROR


def _parcel(row: object) -> tuple[int, bytes, bool]:
    if not isinstance(row, list | tuple) or len(row) != 2 or type(row[0]) is not int or not 0 <= row[0] <= U53:
        raise ValueError(f"expected a number and a payload, got {row!r:.40}")
    if not isinstance(row[1], bytes):
        raise ValueError(f"payload {row[0]}: expected bytes, got {row[1]!r:.40}")
    return row[0], row[1], is_needed(decode_message(row[1]))
