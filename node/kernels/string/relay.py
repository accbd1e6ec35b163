"""Relay arithmetic: what a node takes in as aiding and what it hands down. Source: thesis 3.6 and node chapter 5.

The measured yaw and its random variance stay what the encoder made them (scheme ``forward``); the make-up angles of
the joints add to an offset, and their constant errors to a systematic variance that no filter averages away: it is
treated as a consider parameter, so the filter's own variance is that of the yaw relative to the marks.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle, wrap_positive
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import bounded_variance, kept_angle, offset_angle
from node.kernels.arithmetic.quantity import Constant, angle_quantity
from node.kernels.filter.covariance import set_apart
from node.kernels.filter.priors import stamp_var
from node.kernels.record.filter_record import PENDING, CycleStatus, Err
from node.kernels.record.ring import make_room

SAME: Final = Constant(
    1e-9, angle_quantity(2e-9).fixed
)  # rad, between two offsets of one string; a binary angle is coarser
PSI, D = kernel_constant(Err.YAW), kernel_constant(Err.STAMP)
REFERENCE_CHANGED = int(CycleStatus.REFERENCE_CHANGED)


@kernel
def offer_aiding(
    state: Any,
    config: Any,
    yaw: float,
    yaw_var: float,
    systematic_var: float,
    offset: float,
    valid_at: float,
    sequence: int,
    hops: int,
) -> int:
    """Queue one aiding for the filter (angles rad, ``valid_at`` on the node's clock, s); returns status bits.

    ``offset`` and ``systematic_var`` are those of this node: the sender's plus the joint between the two. A sequence
    number already used is the same measurement again (at rest the encoder's quantisation is constant, not white), so
    it refreshes the age and nothing else.
    """
    status = 0
    if hops != state.reference_hops or abs(wrap_angle(offset - offset_angle(state.reference_offset))) > SAME:
        status = change_reference(state, config, systematic_var, offset, hops)
    elif sequence == state.last_sequence:
        if state.pending == 0 and state.yaw_known == 1:
            state.last_aided = max(state.last_aided, valid_at)
            return status
        if state.pending > 0:
            return status
    if state.pending == PENDING:
        return status
    slot = make_room(state, valid_at)
    state.pending_at[slot] = valid_at
    state.pending_yaw[slot] = kept_angle(wrap_positive(yaw + offset))
    state.pending_var[slot] = bounded_variance(yaw_var) + config.aiding_floor_var
    state.pending_sequence[slot] = sequence
    state.last_sequence = sequence
    state.systematic_var = bounded_variance(systematic_var)
    return status


@kernel
def change_reference(state: Any, config: Any, systematic_var: float, offset: float, hops: int) -> int:
    """The chain above was made up anew: the yaw may step by the errors of the old and the new joints."""
    first = state.reference_hops < 0
    step_var = state.systematic_var + bounded_variance(systematic_var)
    state.reference_hops = hops
    state.reference_offset = kept_angle(offset)
    state.systematic_var = bounded_variance(systematic_var)
    state.pending = 0
    if first or state.yaw_known == 0:
        return 0
    set_apart(state, PSI, bounded_variance(state.P[PSI, PSI] + step_var))
    if stamp_var(config) > 0:
        set_apart(state, D, bounded_variance(state.P[D, D] + stamp_var(config)))
    return REFERENCE_CHANGED
