"""Twist of the string between the drive head and one node, as the aiding reports it.

The twist of the tubes passed adds up, for the torque is one and the same: ``sigma = |T| sum L / (G J)``, and its square
is handed down. It is constant while the torque is, so no filter may average it away. Between two torques the yaw turns
against the drive by what the one and the other may be wrong: the filter's yaw is opened by that, its cross terms stay
true.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import ANGLE_Q, TORQUE_Q, Array
from node.kernels.arithmetic.integers import quotient_q30
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import angular_root, angular_square, as_number, by_type
from node.kernels.arithmetic.quantity import NONE, variance_quantity
from node.kernels.filter.resets import open_yaw
from node.kernels.record.events import Code, event_degrees, event_number, queue_event
from node.kernels.record.node_record import A_HELD, A_TORQUE, A_VALID, A_YAW_VAR

UNKNOWN_VAR: Final = variance_quantity(10.0)  # rad^2, of a twist of which nothing is known but for whole turns
STRING_UNDER_TORQUE, STRING_RELEASED = kernel_constant(Code.STRING_UNDER_TORQUE), kernel_constant(Code.STRING_RELEASED)


@by_type(lambda torque, stiffness: quotient_q30(torque, max(stiffness, 1)))
def twist_angle(torque: float, stiffness: float) -> float:
    """The angle by which a torque winds a tube."""
    return torque / stiffness


@kernel
def twist_var(twist: Any) -> float:
    """Variance (rad^2) of the twist in the last aiding used; ``twist`` is a record of dtype ``TWIST``."""
    return angular_square(twist.std) if twist.known == 1 else 0


@kernel
def reaching_var(torsion_var: float, torque: float, stiffness: float) -> float:
    """Variance (rad^2) of the twist between the drive head and the lower end of a tube (N m, N m/rad)."""
    std = angular_root(torsion_var) + twist_angle(torque, stiffness)
    return as_number(min(angular_square(std), UNKNOWN_VAR))


@kernel
def gate_twist(node: Any, settings: Any, aiding: Array) -> bool:
    """Whether an ``aiding`` is for the filter; opens the filter's yaw where the twist has changed.

    The twist that reaches this node with it is ``node.down_torsion``.
    """
    twist, state = node.twist, node.filter
    torque, under_torque = aiding[A_TORQUE], int(aiding[A_HELD])
    twist.heard_at, twist.torque, twist.holding = aiding[A_VALID], torque, under_torque
    if under_torque == 1 and settings.torsion_gate == 1:
        twist.wound = 1
        return False
    std = angular_root(node.down_torsion)
    before = twist.std if twist.known == 1 else std  # after a start anything may have been
    held = twist.held == 1 or twist.known == 0
    change: float = 0
    if under_torque == 1 and held:
        change = std - before
        if twist.known == 1 and angular_square(change) <= aiding[A_YAW_VAR]:
            return True  # a change waits until it has grown: a rest is not to be used again and again
    elif under_torque == 1 or held or twist.wound == 1:
        change = angular_root(angular_square(std) + angular_square(before))
        if torque != 0 and twist.known == 1:
            code = STRING_UNDER_TORQUE if under_torque == 1 else STRING_RELEASED
            queue_event(node, code, event_number(torque, TORQUE_Q), event_degrees(std, ANGLE_Q), NONE, NONE)
    if change != 0 and state.yaw_known == 1:
        open_yaw(state, angular_square(change))
        state.last_sequence = -1
    twist.known, twist.std, twist.held, twist.wound = 1, std, under_torque, 0
    return True


@kernel
def holds_survey(node: Any, settings: Any, now: float) -> bool:
    """Whether at ``now`` (s, own clock) the survey waits: the yaw that counts is that of a released string.

    A drive that is no longer reported is not waited for: the survey goes by what the node itself knows.
    """
    twist = node.twist
    told = now - twist.heard_at <= settings.aiding_old_after
    return bool(twist.holding == 1 and told and node.filter.still_cycles > 0)
