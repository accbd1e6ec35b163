"""Keys that tests of a chip's seals share, and the names of what it refuses, in the order of its C."""

from __future__ import annotations

import datetime

from telemetry.transport.key_ring import Generation, KeyRing, keys_of

AT = datetime.datetime(2026, 5, 4, tzinfo=datetime.UTC)
SECRETS = {number: bytes([number]) * 32 for number in range(1, 5)}
REASONS = (
    "unsealed", "wrong_tag", "wrong_joint", "repeated", "old_session", "end_unsealed", "end_wrong_tag",
    "end_old_session", "end_old_order", "measurement_unsealed", "measurement_wrong_tag", "measurement_repeated",
    "duplicate", "late", "before_joined",
)  # fmt: skip


def ring_of(address: int, *numbers: int, revoked: frozenset[int] = frozenset()) -> KeyRing:
    generations = tuple(Generation(k, keys_of(SECRETS[k], address, revoked), AT) for k in numbers)
    return KeyRing("rig-1", address, generations, revoked)
