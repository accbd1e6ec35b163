"""The kernel of a string: readings in, aiding from hop to hop, every node stepped, what they know kept.

One for a study, whose readings are worked out before and which stops where a node has something to say, and for a run
of a campaign. What a node does is ``node.kernels.step.node_step``, or the same in integers, called by its address.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from numba import types

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.operations import taken_where
from node.kernels.record.node_record import (
    A_HOPS,
    A_OFFSET,
    A_SYSTEMATIC,
    A_TORSION,
    A_VALID,
    AIDING,
    CLOCK_VAR,
    END,
    HOPS,
    JOINED,
    MOMENT,
    START,
    SYNCHRONISED,
)
from node.kernels.step.node_step import ONWARD
from sim.kernel import kernel, shared_body
from sim.string.readings import supply_readings
from sim.string.result import log_epoch, log_node, trace_node


class CycleMemory(NamedTuple):
    """What a cycle is worked out in."""

    moment: Array  # (MOMENT,)
    aiding: Array  # (AIDING,)


class SaidEstimates(NamedTuple):
    """What each node hands down where that is not what came to it: what it said of its own yaw in its cycle."""

    said: Array  # (tubes, AIDING)
    told: npt.NDArray[np.bool_]  # (tubes,) whether it said so


def new_memory() -> CycleMemory:
    """Memory of a cycle."""
    return CycleMemory(np.zeros(MOMENT), np.zeros(AIDING))


def no_estimates(tubes: int) -> SaidEstimates:
    """Before a node has said anything."""
    return SaidEstimates(np.zeros((tubes, AIDING)), np.zeros(tubes, np.bool_))


@kernel
def drill_string(
    step: Any,
    aid: Any,
    nodes: Any,
    schedule: Any,
    hops: Array,
    shifts: Array,
    memory: Any,
    first: int,
    last: int,
    recorded: Any = None,
    drawn: Any = None,
    field: Any = None,
    integers: Any = None,
    estimates: Any = None,
    trace: Any = None,
    log: Any = None,
) -> int:
    """Take a string through the cycles ``first``..``last`` - 1; returns the cycle before which it stopped.

    That is ``last``, or with a ``trace`` the first after a cycle in which a node had something to say. The aiding that
    arrives after such a cycle is then still to be handed down. What is None is not compiled.

    Parameters
    ----------
    step, aid : see ``sim.string.nodes.loop_of``
    nodes : ``sim.string.nodes.StringNodes``
    schedule : ``sim.string.schedule.StringSchedule``
    hops : (tubes,) of dtype ``sim.string.hops.HOP``
    shifts : (tubes,) s, of the nodes' clocks
    memory : ``CycleMemory``
    recorded, drawn, field : see ``sim.string.readings.supply_readings``
    integers : (tubes,) of dtype ``INTEGERS`` of nodes in integers
    estimates : ``SaidEstimates``; None where nodes hand on what came
    trace, log : ``NodeTrace`` and ``StationLog`` of ``sim.string.result``
    """
    for cycle in range(first, last):
        readings = supply_readings(recorded, drawn, field, schedule, hops, cycle)
        if not schedule.locked:
            hand_down(aid, nodes, schedule, hops, shifts, memory.aiding, cycle, integers, estimates)
        is_told = False
        for k in range(schedule.powered[cycle]):
            set_moment(schedule, shifts, memory.moment, cycle, k)
            says = step_node(step, nodes, readings, memory.moment, k, integers)
            if estimates is not None:
                estimates.told[k] = False
            if trace is not None:
                is_told = trace_node(trace, nodes.records[k], says, cycle, k) or is_told
            if log is not None:
                log_node(log, nodes.records[k], says, schedule.powered[cycle], cycle, k)
        if is_told:
            return cycle + 1
        if schedule.locked:
            hand_down(aid, nodes, schedule, hops, shifts, memory.aiding, cycle, integers, estimates)
        if log is not None:
            log_epoch(log, nodes.records, schedule.powered[cycle], cycle)
    return last


@kernel
def hand_down(
    aid: Any,
    nodes: Any,
    schedule: Any,
    hops: Array,
    shifts: Array,
    aiding: Array,
    cycle: int,
    integers: Any,
    estimates: Any,
) -> None:
    """Hand the aiding of a cycle down the string: what came until a hop loses it, or what each node said by itself.

    Parameters
    ----------
    aiding : (AIDING,) memory
    others : see ``drill_string``
    """
    top, is_there = schedule.powered[cycle], schedule.is_sent[cycle]
    aiding[:] = schedule.measured[cycle]
    valid = aiding[A_VALID]
    for hop in range(top):
        k, is_taken = top - 1 - hop, False
        if is_there and hops[hop].loses == 0:
            aiding[A_VALID] = valid + schedule.dated_late[hop] + hops[hop].error + shifts[k]
            is_taken = aid_node(aid, nodes, aiding, k, integers) & ONWARD != 0
        if estimates is None:
            if not is_taken:
                return
            pass_on(nodes.records[k], aiding)
        else:
            is_there = estimates.told[k]
            aiding[:] = estimates.said[k]
            valid = aiding[A_VALID]


@shared_body
def pass_on(node: Any, aiding: Array) -> None:
    """Change an ``aiding`` (AIDING,) to what a node hands down of it."""
    aiding[A_OFFSET], aiding[A_SYSTEMATIC] = node.down_offset, node.down_systematic
    aiding[A_TORSION] = node.down_torsion
    aiding[A_HOPS] += 1.0


@shared_body
def set_moment(schedule: Any, shifts: Array, moment: Array, cycle: int, k: int) -> None:
    """Times of a tube's cycle by its own clock, and what its link would tell it."""
    below = schedule.powered[cycle] - 1 - k  # hops from the head, less one
    later = schedule.later[k] + shifts[k]
    moment[START] = schedule.begins[cycle] + later
    moment[END] = schedule.ends[cycle] + later
    moment[JOINED] = schedule.joined[cycle, k]
    moment[HOPS] = below + 1
    moment[CLOCK_VAR] = schedule.clock_var[below]
    moment[SYNCHRONISED] = 1.0


def has_integers(*kinds: Any) -> bool:
    """Whether the last of some arguments is the memory of nodes in integers, and not None."""
    return isinstance(kinds[-1], types.Array)


def step_integers(step: Any, nodes: Any, readings: Array, moment: Array, k: int, integers: Any) -> int:
    """One cycle of a node in integers."""
    one = slice(k, k + 1)
    corrections = nodes.corrections[k]
    return int(step(nodes.records[one], nodes.settings[one], corrections, readings[k], moment, integers[one]))


@taken_where(has_integers, step_integers)
def step_node(step: Any, nodes: Any, readings: Array, moment: Array, k: int, _: Any) -> int:
    """One cycle of a node; returns what it has to say."""
    one = slice(k, k + 1)
    return int(step(nodes.records[one], nodes.settings[one], nodes.corrections[k], readings[k], moment))


def aid_integers(aid: Any, nodes: Any, aiding: Array, k: int, integers: Any) -> int:
    """One aiding of a node in integers."""
    one = slice(k, k + 1)
    return int(aid(nodes.records[one], nodes.settings[one], aiding, integers[one]))


@taken_where(has_integers, aid_integers)
def aid_node(aid: Any, nodes: Any, aiding: Array, k: int, _: Any) -> int:
    """One aiding of a node; returns what it makes of it."""
    one = slice(k, k + 1)
    return int(aid(nodes.records[one], nodes.settings[one], aiding))
