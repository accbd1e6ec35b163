"""The own clock beside rig time: what time it is, and when each epoch of rig time began. No I/O."""

from __future__ import annotations

import math

from telemetry.messages import EPOCH_UNKNOWN, NodeFlag, NodeState

EPOCHS_KEPT = 8


class RigTime:
    """Time of a ground station.

    Attributes
    ----------
    now : s, own clock; NaN before the first event
    rig_now : s, rig time; NaN before it is known
    epoch : of rig time, that was heard last or kept from before the start
    """

    def __init__(self) -> None:
        self.now = math.nan
        self.rig_now = math.nan
        self.epoch = EPOCH_UNKNOWN
        self._begun_at: dict[int, float] = {}  # s, own clock, of rig time 0 of each epoch that was heard

    @property
    def is_known(self) -> bool:
        """Whether rig time is known."""
        return math.isfinite(self.rig_now)

    def follow_rig_time(self, rig_now: float, epoch: int) -> bool:
        """Follow rig time (s) of an epoch; whether that is heard first."""
        self.rig_now, self.epoch = rig_now, epoch
        begins = epoch not in self._begun_at
        self._begun_at[epoch] = self.now - rig_now
        if begins:
            while len(self._begun_at) > EPOCHS_KEPT:
                del self._begun_at[next(iter(self._begun_at))]
        return begins

    def is_dated(self, state: NodeState) -> bool:
        """Whether the time of a state can be compared with the own clock: of an epoch heard since the start."""
        return state.epoch in self._begun_at and NodeFlag.CLOCK_UNSYNCHRONISED not in state.flags

    def time_on_its_way(self, state: NodeState) -> float:
        """Seconds for which a state has been on its way; 0 where its time cannot be compared with the own clock."""
        return max(self.now - self._begun_at[state.epoch] - state.at, 0.0) if self.is_dated(state) else 0.0
