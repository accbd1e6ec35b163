"""Sensors as the published node reads them: a counter without edge times, a gyroscope sampled once a cycle."""

from __future__ import annotations

import math
from typing import Final

from telemetry.messages import Aiding

LINES: Final = 1024  # of the encoder, counted once each. Source: thesis 4.2


class PlainEncoder:
    """An encoder whose count is read at the end of a cycle.

    The angle is the middle of the count and its variance that of the count, also while turning. A rest gives one
    measurement, repeated under one sequence number, as from the firmware's encoder.
    """

    def __init__(self, counts_per_turn: int) -> None:
        self._quantum = math.tau / counts_per_turn
        self._count: int | None = None
        self._at = 0.0
        self._resting = False
        self._sequence = 0

    def on_cycle(self, angle: float, now: float) -> Aiding:
        """Read the count of a drive head at ``angle`` (rad, unwrapped) at ``now`` (s, rig time)."""
        count = math.floor(angle / self._quantum + 1e-9)
        moved = 0 if self._count is None else count - self._count
        rate = moved * self._quantum / (now - self._at) if moved else 0.0
        self._sequence += int(moved != 0 or not self._resting)
        self._count, self._at, self._resting = count, now, not moved
        yaw = (count + 0.5) * self._quantum % math.tau
        return Aiding(
            yaw=yaw if yaw < math.tau else 0.0,
            yaw_var=self._quantum**2 / 12.0,
            systematic_var=0.0,
            offset=0.0,
            rate=rate,
            valid_at=now,
            sequence=self._sequence,
            hops=0,
        )
