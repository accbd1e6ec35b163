"""Seal of the encoder's measurement: what no relay changes of an aiding, under a key of the rig.

A relay writes the path of an aiding anew (offset, variances of joints and twist, hops) and hands the rest on with its
seal. Everybody on the string has the key, since everybody has to judge it; what keeps a stolen tube from speaking for
the encoder on other joints are their own keys.
"""

from __future__ import annotations

import struct
from collections import Counter
from collections.abc import Callable

from telemetry.frozen import replace
from telemetry.messages import Aiding
from telemetry.transport.key_ring import KeyRing
from telemetry.transport.seal import TAG_SIZE

FIELDS = struct.Struct("<4dQd?I")  # yaw, its variance, rate, time, number, torque, under torque, epoch
SEAL_SIZE = 1 + TAG_SIZE  # bytes: generation of the key, tag
OLDEST = 5.0  # s of rig time, after which a measurement counts as a recording


class MeasurementSeal:
    """Makes seals at the encoder and judges them at every tube.

    Parameters
    ----------
    ring : gives the keys; they may change
    """

    def __init__(self, ring: Callable[[], KeyRing]) -> None:
        self.counters: Counter[str] = Counter()
        self._ring = ring
        self._newest = (0, -1)  # epoch and number of the newest measurement believed

    def close(self, aiding: Aiding) -> Aiding:
        """Return the aiding with its seal, under the oldest keys, which all tubes below have."""
        ring = self._ring()
        key = ring.seal_key(ring.oldest, "measurement")
        if key is None:
            return aiding
        generation = bytes([ring.oldest])
        return replace(aiding, seal=generation + key.tag(generation, _measurement(aiding)))

    def admits(self, aiding: Aiding, epoch: int, rig_now: float) -> bool:
        """Return whether an aiding is believed at ``rig_now`` (s) of ``epoch``, as the sealed joints tell it.

        A number that was believed is the same measurement again; a smaller one is an old one. One of another epoch is
        for the process to drop.
        """
        if len(aiding.seal) != SEAL_SIZE:
            return self._refuse("unsealed")
        key = self._ring().seal_key(aiding.seal[0], "measurement")
        if key is None or not key.fits(aiding.seal[1:], aiding.seal[:1], _measurement(aiding)):
            return self._refuse("wrong_tag")
        if aiding.epoch != epoch:
            return True
        if (
            aiding.epoch == self._newest[0] and aiding.sequence < self._newest[1]
        ) or aiding.valid_at < rig_now - OLDEST:
            return self._refuse("repeated")
        self._newest = aiding.epoch, aiding.sequence
        return True

    def _refuse(self, reason: str) -> bool:
        self.counters[f"seal_measurement_{reason}"] += 1
        return False


def _measurement(aiding: Aiding) -> bytes:
    a = aiding
    return FIELDS.pack(a.yaw, a.yaw_var, a.rate, a.valid_at, a.sequence, a.torque, a.under_torque, a.epoch)
