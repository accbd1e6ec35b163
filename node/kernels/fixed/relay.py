"""What a node takes in as aiding, in integers; the arithmetic and its reasons are those of ``node.kernels.relay``."""

from __future__ import annotations

from typing import Any

from node.kernels.error_model import isolate
from node.kernels.fixed.layout import ANGLE_Q, CEILING
from node.kernels.fixed.trigonometry import TURN, counts, difference
from node.kernels.jit import constant, kernel
from node.kernels.layout import PENDING, Err, Status
from node.kernels.ring import make_room

PSI, D = constant(Err.YAW), constant(Err.STAMP)
REFERENCE_CHANGED = int(Status.REFERENCE_CHANGED)


@kernel
def offer_aiding(
    state: Any,
    config: Any,
    yaw: int,
    yaw_var: int,
    systematic_var: int,
    offset: int,
    valid_at: int,
    sequence: int,
    hops: int,
) -> int:
    """Queue one aiding for the filter; returns status bits.

    Parameters
    ----------
    yaw, offset : binary angles
    yaw_var, systematic_var : rad^2, Q56
    valid_at : s on the node's clock, Q28
    sequence, hops : as sent
    """
    if hops != state.reference_hops or abs(difference(offset, int(state.reference_offset))) > 1:
        status = change_reference(state, config, systematic_var, offset, hops)
    else:
        status = 0
        if sequence == state.last_sequence:
            if state.pending == 0 and state.yaw_known == 1:
                state.last_aided = max(state.last_aided, valid_at)
                return status
            if state.pending > 0:
                return status
    if state.pending == PENDING:
        return status
    slot = make_room(state, valid_at)
    state.pending_at[slot] = valid_at
    state.pending_yaw[slot] = (yaw + offset) & TURN
    state.pending_var[slot] = yaw_var + config.aiding_floor_var
    state.pending_sequence[slot] = sequence
    state.last_sequence = sequence
    state.systematic_var = systematic_var
    return status


@kernel
def take_offer(
    state: Any,
    config: Any,
    yaw: int,
    yaw_var: int,
    systematic_var: int,
    offset: int,
    valid_at: int,
    sequence: int,
    hops: int,
) -> int:
    """Queue one aiding as ``offer_aiding``, its angles in Q40 and its variances of any size."""
    turned, along = counts(yaw, ANGLE_Q) & TURN, counts(offset, ANGLE_Q) & TURN
    variances = (min(yaw_var, CEILING), min(systematic_var, CEILING))
    return offer_aiding(state, config, turned, variances[0], variances[1], along, valid_at, sequence, hops)


@kernel
def change_reference(state: Any, config: Any, systematic_var: int, offset: int, hops: int) -> int:
    """The chain above was made up anew: the yaw may step by the errors of the old and the new joints."""
    first = state.reference_hops < 0
    step_var = state.systematic_var + systematic_var
    state.reference_hops = hops
    state.reference_offset = offset & TURN
    state.systematic_var = systematic_var
    state.pending = 0
    if first or state.yaw_known == 0:
        return 0
    isolate(state.P, PSI, min(state.P[PSI, PSI] + step_var, CEILING))
    if config.stamp_on == 1:
        isolate(state.P, D, min(state.P[D, D] + config.stamp_var, CEILING))
    return REFERENCE_CHANGED
