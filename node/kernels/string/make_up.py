"""The angle of a joint that was made up above, solved from the yaw that the string below kept.

While a tube is added the string below stands still. At the first aiding after it the angle from the drive head down to
this node is ``saved yaw - aiding``; the yaw goes on as before, and so do its constant errors. A rest is one measurement
of the encoder, with one error. Where the head turned meanwhile the aiding is another measurement, and its variance and
that of the saved yaw come to them. Where it did not, the saved yaw has that very error in it already: the difference is
what it was before, nothing is added, and the filter goes on undisturbed.
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.angles import wrap_angle
from node.kernels.arithmetic.formats import ANGLE_Q, DEG, Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import (
    angle_of,
    angular_root,
    angular_square,
    bounded_ratio,
    offset_angle,
    times_factor,
)
from node.kernels.arithmetic.quantity import NONE, ONE, angle_quantity, variance_quantity
from node.kernels.record.events import Code, event_count, event_degrees, queue_event
from node.kernels.record.filter_record import Err
from node.kernels.record.node_record import A_HELD, A_HOPS, A_RATE, A_SEQUENCE, A_YAW, A_YAW_VAR
from node.kernels.string.twist import twist_var

MARKS, SOLVED, BOTH = 0, 1, 2  # source of the angles, ``settings.joints``
SAME: Final = angle_quantity(1e-8)  # rad, between two offsets of one string
LARGEST_VAR: Final = variance_quantity((1.0 * DEG) * (1.0 * DEG))  # rad^2, of a saved yaw that can solve a joint
CONTRADICTION: Final = 4  # sigmas between marks and solution
STARTED_ANEW, UNKNOWN, MOVING = (
    kernel_constant(1),
    kernel_constant(2),
    kernel_constant(3),
)  # why the saved yaw cannot solve a joint
PSI = kernel_constant(Err.YAW)
JOINT_SOLVED, JOINT_NOT_SOLVED = kernel_constant(Code.JOINT_SOLVED), kernel_constant(Code.JOINT_NOT_SOLVED)
JOINT_CONTRADICTS_MARKS = kernel_constant(Code.JOINT_CONTRADICTS_MARKS)


@kernel
def follow_joints(node: Any, settings: Any, aiding: Array) -> None:
    """Put the joints as solved in the place of those by their marks, in what the record hands down.

    ``node.down_offset`` (rad) and ``node.down_systematic`` (rad^2) are given by the marks, of the ``aiding`` and of the
    drive; the twist in the aiding is ``node.down_torsion`` (rad^2).
    """
    if settings.joints == MARKS:
        check_marks(node, settings, aiding)
        return
    joints, hops, marks = node.joints, int(aiding[A_HOPS]), node.down_offset
    if joints.hops < 0:
        resume_joint(node, aiding)
    elif hops != joints.hops or abs(wrap_angle(marks - joints.marks)) > SAME:
        make_up(node, settings, aiding)
    joints.hops, joints.marks = hops, marks
    if joints.solved == 1:
        node.down_offset, node.down_systematic = joints.offset, joints.var


@kernel
def check_marks(node: Any, settings: Any, aiding: Array) -> None:
    """The marks of a new joint stand, and what the saved yaw contradicts them by is part of their variance."""
    joints, hops, marks = node.joints, int(aiding[A_HOPS]), node.down_offset
    if joints.hops >= 0 and (hops != joints.hops or abs(wrap_angle(marks - joints.marks)) > SAME):
        state, known = node.filter, node.joints.var
        joints.var = 0
        sure = state.yaw_known == 1 and state.now_P[PSI, PSI] <= LARGEST_VAR and state.still_cycles > 0
        if sure and aiding[A_RATE] == 0 and aiding[A_HELD] == 0:
            solved = wrap_angle(angle_of(state.now_rate, state.now_yaw) - aiding[A_YAW])
            own = max(state.systematic_var - twist_var(node.twist) - known, 0) + settings.unseen_var
            off = wrap_angle(solved - marks)
            var = own + node.down_systematic + state.now_P[PSI, PSI] + aiding[A_YAW_VAR]
            if abs(off) > CONTRADICTION * angular_root(var):
                joints.var = angular_square(off)
                tell_solution(node, JOINT_CONTRADICTS_MARKS, solved, var, marks, state.stopped_at > state.last_aided)
    joints.hops, joints.marks = hops, marks
    node.down_systematic += joints.var


@kernel
def resume_joint(node: Any, aiding: Array) -> None:
    """After a start the earlier solution stands, if the string is still the same."""
    state, joints, hops = node.filter, node.joints, int(aiding[A_HOPS])
    if state.reference_hops >= 0 and state.reference_hops != hops:
        refuse_joint(node, STARTED_ANEW, hops)
    elif state.reference_hops >= 0 and abs(wrap_angle(offset_angle(state.reference_offset) - node.down_offset)) > SAME:
        joints.solved = 1
        joints.offset = offset_angle(state.reference_offset)
        joints.var = max(state.systematic_var - (0 if aiding[A_HELD] != 0 else node.down_torsion), 0)


@kernel
def make_up(node: Any, settings: Any, aiding: Array) -> None:
    """The string above is another one: solve for its angle, or say why not.

    Of the node's present systematic variance that of its twist belongs to no joint.
    """
    state, hops = node.filter, int(aiding[A_HOPS])
    if state.yaw_known == 0 or state.now_P[PSI, PSI] > LARGEST_VAR:
        refuse_joint(node, UNKNOWN, hops)
        return
    if aiding[A_RATE] != 0 or aiding[A_HELD] != 0 or state.still_cycles == 0:
        refuse_joint(node, MOVING, hops)
        return
    turned = state.stopped_at > state.last_aided
    same = int(aiding[A_SEQUENCE]) == state.last_sequence and not turned
    var = max(state.systematic_var - twist_var(node.twist), 0) + settings.unseen_var
    if same:
        solved = offset_angle(state.reference_offset)
    else:
        solved = wrap_angle(angle_of(state.now_rate, state.now_yaw) - aiding[A_YAW])
        var += state.now_P[PSI, PSI] + aiding[A_YAW_VAR]
    off = wrap_angle(solved - node.down_offset)
    contradicts = abs(off) > CONTRADICTION * angular_root(var + node.down_systematic)
    is_new = hops == 1 and node.joints.hops == 0
    # the marks of two new joints are independent of all before; farther down the chain they bring nothing new
    combines = is_new and settings.joints == BOTH and not contradicts
    part = bounded_ratio(node.down_systematic, node.down_systematic + var) if combines else ONE
    take_joint(
        node, solved if part == ONE else wrap_angle(node.down_offset + times_factor(off, part)), times_factor(var, part)
    )
    if same and part == ONE:  # the same reference, said by another neighbour
        state.reference_hops = hops
        state.systematic_var = var + node.down_torsion
    tell_joint(node, is_new, contradicts, turned)


@kernel
def take_joint(node: Any, offset: float, var: float) -> None:
    """The joints above are solved: ``offset`` (rad) and its variance (rad^2)."""
    joints = node.joints
    joints.solved, joints.offset, joints.var = 1, offset, var


@kernel
def tell_joint(node: Any, is_new: bool, contradicts: bool, turned: bool) -> None:
    """Tell of a joint just solved, if it ``is_new``, and if its marks contradict it; ``turned``: meanwhile."""
    joints = node.joints
    if is_new:
        tell_solution(node, JOINT_SOLVED, joints.offset, joints.var, node.down_offset, turned)
    if contradicts:
        tell_solution(node, JOINT_CONTRADICTS_MARKS, joints.offset, joints.var, node.down_offset, turned)


@kernel
def tell_solution(node: Any, code: int, solved: float, var: float, marks: float, turned: bool) -> None:
    """Tell of an angle that was solved (rad), its variance (rad^2) and what the marks say (rad)."""
    sigma, while_turning = event_degrees(angular_root(var), ANGLE_Q), event_count(var, 1 if turned else 0)
    queue_event(node, code, event_degrees(solved, ANGLE_Q), sigma, event_degrees(marks, ANGLE_Q), while_turning)


@kernel
def refuse_joint(node: Any, reason: int, hops: int) -> None:
    """The marks stand."""
    node.joints.solved = 0
    like = node.down_offset
    queue_event(node, JOINT_NOT_SOLVED, event_count(like, reason), event_count(like, hops + 1), NONE, NONE)
