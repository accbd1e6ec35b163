"""Seal of the depth's readings: one direction, so their freshness is their number and their rig time."""

from __future__ import annotations

from collections.abc import Callable

from telemetry.application.end_seal import UP, Pair, close_payload, open_sealed
from telemetry.media.credentials import DEPTH_SOURCE
from telemetry.transport.key_ring import KeyRing

NO_SESSION = Pair(0, 0)  # one direction has no session


def seal_depth(ring: KeyRing, payload: bytes) -> bytes:
    """Return a reading's payload with its seal, under the oldest keys, which the ground station has."""
    key = ring.seal_key(ring.oldest, "depth")
    if key is None:
        return payload
    return close_payload(key, UP, payload, NO_SESSION, ring.oldest, ring.newest, DEPTH_SOURCE)


def open_depth(ring: Callable[[], KeyRing], payload: bytes) -> bytes | None:
    """Return the reading's payload; None where its seal does not fit."""
    sealed = open_sealed(ring(), "depth", UP, payload, DEPTH_SOURCE)
    return None if sealed is None else sealed.content
