"""The increments of the last cycles and the measurements that wait for theirs, for either arithmetic of the loop.

Nothing is computed here, so the same functions serve the floats and the integers: numbers are copied and compared.
"""

from __future__ import annotations

from typing import Any, TypeAlias

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_record import BEGAN_STILL, ENDED_STILL, RECENT, RING

Number: TypeAlias = float  # or an integer in the format of the state given


@kernel
def push_increments(state: Any, start: Number, end: Number, rate: Array, force: Array, quiet: int) -> None:
    """Write one cycle's increments: times on the node's clock, mean rate (3) and mean specific force (3)."""
    slot = state.cycles % RING
    state.ring_start[slot] = start
    state.ring_end[slot] = end
    state.ring_quiet[slot] = quiet
    for k in range(3):
        state.ring_rate[slot, k] = rate[k]
        state.ring_force[slot, k] = force[k]
    state.cycles += 1
    if state.cycles == 1:
        state.epoch = start


@kernel
def is_split(state: Any, cycle: int) -> bool:
    """Whether the parts of ``cycle`` are known; those of the oldest kept may be the coming cycle's already."""
    return bool(max(state.cycles - RECENT, -1) < cycle < state.cycles and state.ring_split[cycle % RECENT] != 0)


@kernel
def was_quiet(state: Any, cycle: int, where: int) -> bool:
    """Whether ``cycle`` was quiet, or at least at the end that counts, ``BEGAN_STILL`` or ``ENDED_STILL``."""
    if state.ring_quiet[cycle % RING] != 0:
        return True
    return bool(is_split(state, cycle) and state.ring_split[cycle % RECENT] & where != 0)


@kernel
def stood_still(state: Any, cycle: int) -> bool:
    """Whether the string stood still in ``cycle``: it was quiet, and so were its neighbours where they touch it."""
    if state.ring_quiet[cycle % RING] == 0 or cycle == 0 or not was_quiet(state, cycle - 1, ENDED_STILL):
        return False
    return bool(cycle + 1 >= state.cycles or was_quiet(state, cycle + 1, BEGAN_STILL))


@kernel
def make_room(state: Any, valid_at: Number) -> int:
    """Place in the queue, which is ordered by time, for a measurement valid at ``valid_at``."""
    slot = state.pending
    while slot > 0 and state.pending_at[slot - 1] > valid_at:
        state.pending_at[slot] = state.pending_at[slot - 1]
        state.pending_yaw[slot] = state.pending_yaw[slot - 1]
        state.pending_var[slot] = state.pending_var[slot - 1]
        state.pending_sequence[slot] = state.pending_sequence[slot - 1]
        slot -= 1
    state.pending += 1
    return int(slot)


@kernel
def drop_first_pending(state: Any) -> None:
    """Shift the queue of waiting measurements by one."""
    state.pending -= 1
    for k in range(state.pending):
        state.pending_at[k] = state.pending_at[k + 1]
        state.pending_yaw[k] = state.pending_yaw[k + 1]
        state.pending_var[k] = state.pending_var[k + 1]
        state.pending_sequence[k] = state.pending_sequence[k + 1]


@kernel
def drop_repetitions(state: Any) -> None:
    """Leave in the queue one of its first measurement and of those behind that are the same again."""
    while (
        state.pending > 1
        and state.pending_sequence[1] == state.pending_sequence[0]
        and state.pending_yaw[1] == state.pending_yaw[0]
    ):
        drop_first_pending(state)
