"""A string without a link in one call: cycle after cycle of every node, and aiding from hop to hop.

What a node does is ``node.kernels.step.node_step``, or the same in integers, called by its address. Everything that
does not depend on what the nodes do is worked out before: schedule, readings, what the encoder measures and what
becomes of it on its way.
"""

from __future__ import annotations

from typing import Any, Final, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.angles import from_binary
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_record import Err
from node.kernels.record.node_record import AIDING, CLOCK_VAR, END, HOPS, JOINED, MOMENT, START, SYNCHRONISED
from node.kernels.step.node_step import ADMITTED
from node.kernels.step.string_step import string_aiding, string_step

YAW: Final = int(Err.YAW)


class StringCourse(NamedTuple):
    """What comes to the nodes of one seed, tube 1 first; hops are counted from the drive head."""

    begins: Array  # (cycles,) s, rig time
    ends: Array  # (cycles,) s, rig time
    phases: Array  # (tubes,) s, by which the cycles of a tube end later
    powered: npt.NDArray[np.int64]  # (cycles,) tubes in the string
    joined: Array  # (cycles, tubes) 1 where a tube's upper joint is closed for all it knows
    clock_var: Array  # (hops,) s^2
    readings: Array  # (cycles, tubes, 1, READING)
    measured: Array  # (cycles, AIDING) by the encoder
    arrivals: Array  # (cycles, hops) s, when each node takes the aiding to be valid
    reach: npt.NDArray[np.int64]  # (cycles,) nodes that an aiding reaches before it is lost; 0: none is sent
    locked: bool  # an aiding arrives after the cycles that end with the encoder's, else before


class Desk(NamedTuple):
    """Work space of a cycle."""

    moments: Array  # (tubes, MOMENT)
    mask: npt.NDArray[np.bool_]  # (tubes,)
    places: npt.NDArray[np.int64]  # (tubes,)
    aiding: Array  # (AIDING,)
    valid: Array  # (tubes,) s
    says: npt.NDArray[np.int64]  # (tubes,) what each node has to say


class Kept(NamedTuple):
    """What the nodes know at the end of their cycles, (cycles, tubes) each."""

    yaw: Array  # rad
    var: Array  # rad^2
    systematic_var: Array  # rad^2
    bias: Array  # rad/s, of the gyroscope's z axis


def new_desk(tubes: int) -> Desk:
    """Work space of a string."""
    return Desk(
        np.zeros((tubes, MOMENT)),
        np.ones(tubes, np.bool_),
        np.zeros(tubes, np.int64),
        np.zeros(AIDING),
        np.zeros(tubes),
        np.zeros(tubes, np.int64),
    )


@kernel
def run_string(
    step: Any,
    aid: Any,
    nodes: Array,
    crews: Array,
    corrections: Array,
    course: Any,
    shifts: Array,
    desk: Any,
    kept: Any,
    first: int,
    last: int,
    integers: Any,
) -> int:
    """Take the string through the cycles ``first``..``last`` - 1; returns the cycle before which it stopped.

    That is ``last``, or the first after a cycle in which a node had something to say (``desk.says``). The aiding that
    arrives after such a cycle is then still to be handed down.

    Parameters
    ----------
    step, aid, integers : see ``node.kernels.step.string_step``
    nodes, crews : (tubes,) of dtype ``NODE`` and ``SETTINGS``
    corrections : (tubes, imus + 1) of dtype ``PARAMETERS``
    shifts : (tubes,) s, of the nodes' clocks
    """
    for cycle in range(first, last):
        tubes = course.powered[cycle]
        if not course.locked:
            hand_down(aid, nodes, crews, course, shifts, desk, cycle, integers)
        set_moments(course, shifts, desk.moments, cycle)
        readings = course.readings[cycle]
        string_step(step, nodes[:tubes], crews, corrections, readings, desk.moments, desk.mask, desk.says, integers)
        keep(nodes, tubes, kept, cycle)
        for k in range(tubes):
            if desk.says[k] & ~ADMITTED != 0:
                return cycle + 1
        if course.locked:
            hand_down(aid, nodes, crews, course, shifts, desk, cycle, integers)
    return last


@kernel
def hand_down(
    aid: Any, nodes: Array, crews: Array, course: Any, shifts: Array, desk: Any, cycle: int, integers: Any
) -> None:
    """Hand the aiding of a cycle down the string as far as it is not lost."""
    reach, tubes = course.reach[cycle], course.powered[cycle]
    if reach == 0:
        return
    for hop in range(tubes):
        k = tubes - 1 - hop
        desk.places[hop] = k
        desk.valid[hop] = course.arrivals[cycle, hop] + shifts[k]
    desk.aiding[:] = course.measured[cycle]
    string_aiding(aid, nodes, crews, desk.places, reach, desk.valid, desk.aiding, integers)


@kernel
def set_moments(course: Any, shifts: Array, moments: Array, cycle: int) -> None:
    """Times of a cycle by the clock of each node, and what its link would tell it."""
    tubes = course.powered[cycle]
    for k in range(tubes):
        moment, later = moments[k], course.phases[k] + shifts[k]
        moment[START] = course.begins[cycle] + later
        moment[END] = course.ends[cycle] + later
        moment[JOINED] = course.joined[cycle, k]
        moment[HOPS] = tubes - k
        moment[CLOCK_VAR] = course.clock_var[tubes - 1 - k]
        moment[SYNCHRONISED] = 1.0


@kernel
def keep(nodes: Array, tubes: int, kept: Any, cycle: int) -> None:
    """Read off what every filter knows."""
    for k in range(tubes):
        state = nodes[k].filter
        kept.yaw[cycle, k] = from_binary(state.now_yaw)
        kept.var[cycle, k] = state.now_P[YAW, YAW]
        kept.systematic_var[cycle, k] = state.systematic_var
        kept.bias[cycle, k] = state.static_bias[2] + state.bias[2]
