"""The newest state of every node, when its tube spoke last, and which states have come before. No I/O."""

from __future__ import annotations

import math
from collections import deque

from groundstation.service.string.rig_time import EPOCHS_KEPT, RigTime
from telemetry.messages import EPOCH_UNKNOWN, NodeFlag, NodeState

UNDATED_KEPT = 64  # states of a tube before it knows rig time


class NodeStates:
    """What the nodes say of themselves.

    Parameters
    ----------
    time : by which a state has an age
    stale_after : s of silence after which a node is stale

    Attributes
    ----------
    newest : state by tube
    """

    def __init__(self, time: RigTime, stale_after: float) -> None:
        self._time = time
        self._stale_after = stale_after
        self.newest: dict[int, NodeState] = {}
        self._known: dict[int, dict[int, tuple[float, int]]] = {}  # newest time and cycle by tube and epoch
        self._numbered: dict[int, int] = {}  # newest number given, by tube, as its newest state with a time tells
        self._undated: dict[int, deque[tuple[int, float, int]]] = {}  # epochs, times and cycles by tube
        self._heard_at: dict[int, float] = {}  # s, own clock, of each tube's newest state

    def on_state(self, state: NodeState, now: float) -> bool | None:
        """Handle a state that came at ``now`` (s, own clock): whether it is the newest; None of one that is no news.

        One that has come before is no sign of life, it may have been recorded. Nor is one that was on its way for long:
        it tells that the node spoke then, which is all that a ground station knows after its start.
        """
        known = self.newest.get(state.tube)
        if self._is_repeated(state) or (known is not None and self._is_of_before(state, known)):
            return None
        spoke_at = now - self._time.time_on_its_way(state)
        self._heard_at[state.tube] = max(self._heard_at.get(state.tube, -math.inf), spoke_at)
        if known is not None and state.epoch == known.epoch and state.at < known.at:
            return False
        self.newest[state.tube] = state
        if self._time.is_dated(state):
            self._numbered[state.tube] = state.numbered
        return True

    def on_new_epoch(self) -> None:
        """An epoch of rig time is heard first: states that came before have an age by it."""
        for tube, state in self.newest.items():
            self._heard_at[tube] = min(self._heard_at[tube], self._time.now - self._time.time_on_its_way(state))

    def age(self, tube: int) -> float:
        """Seconds of the own clock since a node's newest state came; infinite for one never heard."""
        return self._time.now - self._heard_at.get(tube, -math.inf)

    def is_stale(self, tube: int) -> bool:
        """Whether a node has been silent for too long."""
        return not self.age(tube) <= self._stale_after

    def _is_repeated(self, state: NodeState) -> bool:
        """Whether a state has come before, or a newer one of its epoch; a clock or a count may go back, not both.

        Without an epoch there is no newer: a board that starts again counts from the beginning. And as clock and count
        may go back in turn, those whose clock says nothing are known one by one: their time does not betray their age.
        The number that was given last does, for a start goes on with larger ones.
        """
        now = state.at, state.cycles
        if state.epoch == EPOCH_UNKNOWN or NodeFlag.CLOCK_UNSYNCHRONISED in state.flags:
            undated = self._undated.setdefault(state.tube, deque(maxlen=UNDATED_KEPT))
            if (state.epoch, *now) in undated or 0 < state.numbered < self._numbered.get(state.tube, 0):
                return True
            undated.append((state.epoch, *now))
        if state.epoch == EPOCH_UNKNOWN:
            return False
        newest = self._known.setdefault(state.tube, {})
        known = newest.get(state.epoch)
        if known is not None and state.at <= known[0] and state.cycles <= known[1]:
            return True
        newest[state.epoch] = now
        while len(newest) > EPOCHS_KEPT:
            del newest[next(iter(newest))]
        return False

    def _is_of_before(self, state: NodeState, known: NodeState) -> bool:
        """Whether a state leaves its tube's epoch for one that the encoder is not in: it was recorded."""
        epoch = self._time.epoch
        return epoch != EPOCH_UNKNOWN and state.epoch not in (known.epoch, epoch, EPOCH_UNKNOWN)
