"""The angle of a joint that was made up above, solved from the yaw that the string below kept.

While a tube is added the string below stands still. At the first aiding after it the angle from the drive head down to
this node is ``saved yaw - aiding``; the yaw goes on as before, and so do its constant errors. A rest is one measurement
of the encoder, with one error. Where the head turned meanwhile the aiding is another measurement, and its variance and
that of the saved yaw come to them. Where it did not, the saved yaw has that very error in it already: the difference is
what it was before, nothing is added, and the filter goes on undisturbed.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.angles import from_binary, wrap
from node.kernels.events import NONE, Code, tell
from node.kernels.jit import kernel
from node.kernels.layout import DEG, Err

MARKS, SOLVED, BOTH = 0, 1, 2  # source of the angles, ``settings.joints``
SAME: Final = 1e-8  # rad, between two offsets of one string
LARGEST_STD: Final = 1.0 * DEG  # of a saved yaw that can solve a joint
CONTRADICTION: Final = 4.0  # sigmas between marks and solution
STARTED_ANEW, UNKNOWN, MOVING = 1, 2, 3  # why the saved yaw cannot solve a joint
PSI = int(Err.YAW)
JOINT_SOLVED, JOINT_NOT_SOLVED = int(Code.JOINT_SOLVED), int(Code.JOINT_NOT_SOLVED)
JOINT_CONTRADICTS_MARKS = int(Code.JOINT_CONTRADICTS_MARKS)


@kernel
def follow_joints(
    node: Any,
    settings: Any,
    yaw: float,
    yaw_var: float,
    rate: float,
    sequence: int,
    hops: int,
    under_torque: int,
    marks: float,
    marks_var: float,
    torsion_var: float,
    reaching: float,
) -> tuple[float, float]:
    """Offset (rad) and systematic variance (rad^2) of this node, where the marks' are given.

    Of the node's present systematic variance ``torsion_var`` (rad^2) belongs to no joint; this aiding's part of it
    is ``reaching``. The others are the aiding's own.
    """
    if settings.joints == MARKS:
        return marks, marks_var
    joints = node.joints
    if joints.hops < 0:
        resume_joint(node, hops, under_torque, marks, reaching)
    elif hops != joints.hops or abs(wrap(marks - joints.marks)) > SAME:
        make_up(
            node,
            settings,
            yaw,
            yaw_var,
            rate,
            sequence,
            hops,
            under_torque,
            marks,
            marks_var,
            torsion_var,
            reaching,
        )
    joints.hops, joints.marks = hops, marks
    if joints.solved == 0:
        return marks, marks_var
    return float(joints.offset), float(joints.var)


@kernel
def resume_joint(node: Any, hops: int, under_torque: int, marks: float, reaching: float) -> None:
    """After a start the earlier solution stands, if the string is still the same."""
    state, joints = node.filter, node.joints
    if state.reference_hops >= 0 and state.reference_hops != hops:
        refuse_joint(node, STARTED_ANEW, hops)
    elif state.reference_hops >= 0 and abs(wrap(state.reference_offset - marks)) > SAME:
        joints.solved = 1
        joints.offset = state.reference_offset
        joints.var = max(state.systematic_var - (0.0 if under_torque == 1 else reaching), 0.0)


@kernel
def make_up(
    node: Any,
    settings: Any,
    yaw: float,
    yaw_var: float,
    rate: float,
    sequence: int,
    hops: int,
    under_torque: int,
    marks: float,
    marks_var: float,
    torsion_var: float,
    reaching: float,
) -> None:
    """The string above is another one: solve for its angle, or say why not."""
    state, joints = node.filter, node.joints
    P = state.now_P[PSI, PSI]
    if state.yaw_known == 0 or P > LARGEST_STD**2:
        refuse_joint(node, UNKNOWN, hops)
        return
    if rate != 0.0 or under_torque == 1 or state.still_cycles == 0:
        refuse_joint(node, MOVING, hops)
        return
    turned = state.stopped_at > state.last_aided
    same = sequence == state.last_sequence and not turned
    var = max(state.systematic_var - torsion_var, 0.0) + settings.unseen_var
    if same:
        solved = float(state.reference_offset)
    else:
        solved = wrap(from_binary(state.now_yaw) - yaw)
        var += P + yaw_var
    off = wrap(solved - marks)
    contradicts = abs(off) > CONTRADICTION * math.sqrt(var + marks_var)
    is_new = hops == 1 and joints.hops == 0
    share = 1.0
    if is_new and settings.joints == BOTH and not contradicts:
        # the marks of two new joints are independent of all before; farther down the chain they bring nothing new
        share = marks_var / (marks_var + var)
    joints.solved = 1
    joints.offset = solved if share == 1.0 else wrap(marks + share * off)
    joints.var = share * var
    if same and share == 1.0:  # the same reference, said by another neighbour
        state.reference_hops = hops
        state.systematic_var = var + reaching
    angle, sigma = joints.offset / DEG, math.sqrt(joints.var) / DEG
    if is_new:
        tell(node, JOINT_SOLVED, angle, sigma, marks / DEG, 1.0 if turned else 0.0)
    if contradicts:
        tell(node, JOINT_CONTRADICTS_MARKS, angle, sigma, marks / DEG, 1.0 if turned else 0.0)


@kernel
def refuse_joint(node: Any, reason: int, hops: int) -> None:
    """The marks stand."""
    node.joints.solved = 0
    tell(node, JOINT_NOT_SOLVED, float(reason), float(hops + 1), NONE, NONE)
