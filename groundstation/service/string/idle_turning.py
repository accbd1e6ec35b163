"""A string that turns and gets no deeper: a depth that sticks is told before the next tube shows it. No I/O."""

from __future__ import annotations

import math
from dataclasses import dataclass

from telemetry.messages import NodeMode, NodeState

TURNED_S = 60.0  # s of turning without a way, of one tube, after which it is told
WAY = 0.01  # m by which the bit has moved
LEAST_TURN = math.radians(5.0)  # rad between two states of a tube that turns
LONGEST_APART = 10.0  # s between two states, longer than which nothing is known of the time between
AT_REST = (NodeMode.STILL, NodeMode.SURVEY)


@dataclass(slots=True)
class Turning:
    """How long (s) a tube has turned while the bit stood at ``md`` (m), and its newest state."""

    newest: NodeState
    md: float
    turned: float = 0.0


class IdleTurning:
    """Looks whether the bit moves where the tubes turn.

    A turn of a whole number of times between two states is taken for none; then a neighbour's states, which come at
    other times, tell.
    """

    def __init__(self) -> None:
        self._tubes: dict[int, Turning] = {}

    def on_state(self, state: NodeState, bit: float | None) -> None:
        """A tube's newest state has come while the bit was believed to be at ``bit`` (m); None: not known."""
        known = self._tubes.get(state.tube)
        if bit is None or state.mode in AT_REST:
            self._tubes.pop(state.tube, None)
            return
        apart = math.nan if known is None else state.at - known.newest.at
        if known is None or state.epoch != known.newest.epoch or abs(bit - known.md) > WAY:
            self._tubes[state.tube] = Turning(state, bit)
        elif apart > 0.0:
            by = math.remainder(state.yaw - known.newest.yaw, math.tau)
            known.turned += apart if apart <= LONGEST_APART and abs(by) >= LEAST_TURN else 0.0
            known.newest = state

    def told(self, bit: float | None) -> str:
        """What the crew is told of it while the bit is at ``bit`` (m); empty where it moves or nothing turns."""
        idle = [one for one in self._tubes.values() if bit is not None and abs(bit - one.md) <= WAY]
        if bit is None or max((one.turned for one in idle), default=0.0) < TURNED_S:
            return ""
        return (
            f"the string turned for {TURNED_S:.0f} s and more while the bit stood at {bit:.2f} m; does the depth stick?"
        )
