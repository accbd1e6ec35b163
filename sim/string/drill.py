"""The kernel of a string: readings in, aiding from hop to hop, every node stepped, what they know kept.

One for a study, whose readings are worked out before and which stops where a node has something to say, and for a run
of a campaign. What a node does is ``node.kernels.step.node_step``, or the same in integers, called by its address.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import Array
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
from sim.string.reading_suppliers import supply_readings
from sim.string.result import LOGGED, log_epoch, log_node, trace_node


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
    integers: Any,
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
    estimates: Any = None,
    trace: Any = None,
    log: Any = None,
) -> int:
    """Take a string through the cycles ``first``..``last`` - 1; returns the cycle before which it stopped.

    That is ``last``, or with a ``trace`` the first after a cycle in which a node had something to say. The aiding that
    arrives after such a cycle is then still to be handed down. What is None is not compiled.

    Parameters
    ----------
    step, aid, integers : ``sim.string.nodes.FirmwareLoop``
    nodes : ``sim.string.nodes.StringNodes``
    schedule : ``sim.string.schedule.StringSchedule``
    hops : (tubes,) of dtype ``sim.string.hops.HOP``
    shifts : (tubes,) s, of the nodes' clocks
    memory : ``CycleMemory``
    recorded, drawn, field : see ``sim.string.reading_suppliers.supply_readings``
    estimates : ``SaidEstimates``; None where nodes hand on what came
    trace, log : ``NodeTrace`` and ``StationLog`` of ``sim.string.result``
    """
    records, settings, corrections = nodes.records, nodes.settings, nodes.corrections
    powered, moment = schedule.powered, memory.moment
    for cycle in range(first, last):
        readings = supply_readings(recorded, drawn, field, schedule, hops, cycle)
        if not schedule.locked:
            hand_down(aid, integers, nodes, schedule, hops, shifts, memory.aiding, cycle, estimates)
        is_told, top = False, powered[cycle]
        for k in range(top if schedule.is_run[cycle] else 0):
            set_moment(schedule, shifts, moment, cycle, k)
            says = step_node(step, integers, records, settings, corrections[k], readings[k], moment, k)
            if estimates is not None:
                estimates.told[k] = False
            if trace is not None:
                is_told = trace_node(trace, records[k], says, cycle, k) or is_told
            if log is not None:  # noqa: SIM102  joined by "and" it would not be left out where there is no log
                if says & LOGGED:
                    log_node(log, records[k], says, top, cycle, k)
        if is_told:
            return cycle + 1
        if schedule.locked:
            hand_down(aid, integers, nodes, schedule, hops, shifts, memory.aiding, cycle, estimates)
        if log is not None:
            log_epoch(log, records, top, cycle)
    return last


@kernel
def hand_down(
    aid: Any,
    integers: Any,
    nodes: Any,
    schedule: Any,
    hops: Array,
    shifts: Array,
    aiding: Array,
    cycle: int,
    estimates: Any,
) -> None:
    """Hand the aiding of a cycle down the string: what came until a hop loses it, or what each node said by itself.

    Parameters
    ----------
    aiding : (AIDING,) memory
    others : see ``drill_string``
    """
    top, is_there, dated_late = schedule.powered[cycle], schedule.is_sent[cycle], schedule.dated_late
    records, settings = nodes.records, nodes.settings
    copy_aiding(schedule.measured[cycle], aiding)
    valid = aiding[A_VALID]
    for hop in range(top):
        k, is_taken = top - 1 - hop, False
        if is_there and hops[hop].loses == 0:
            aiding[A_VALID] = valid + dated_late[hop] + hops[hop].error + shifts[k]
            is_taken = aid_node(aid, integers, records, settings, aiding, k) & ONWARD != 0
        if estimates is None:
            if not is_taken:
                return
            pass_on(records[k], aiding)
        else:
            is_there = estimates.told[k]
            copy_aiding(estimates.said[k], aiding)
            valid = aiding[A_VALID]


@shared_body
def copy_aiding(said: Array, aiding: Array) -> None:
    """Copy what was ``said`` (AIDING,) into an ``aiding``: number by number, for a slice is copied by way of memory."""
    for field in range(aiding.shape[0]):
        aiding[field] = said[field]


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


@shared_body
def step_node(
    step: Any, integers: Any, nodes: Array, settings: Array, corrections: Array, readings: Array, moment: Array, k: int
) -> int:
    """One cycle of a node; returns what it has to say."""
    one = slice(k, k + 1)
    if step is not None:
        says: int = step(nodes[one], settings[one], corrections, readings, moment)
    if integers is not None:
        says = integers.step(nodes[one], settings[one], corrections, readings, moment, integers.memory[one])
    return says


@shared_body
def aid_node(aid: Any, integers: Any, nodes: Array, settings: Array, aiding: Array, k: int) -> int:
    """One aiding of a node; returns what it makes of it."""
    one = slice(k, k + 1)
    if aid is not None:
        answer: int = aid(nodes[one], settings[one], aiding)
    if integers is not None:
        answer = integers.aid(nodes[one], settings[one], aiding, integers.memory[one])
    return answer
