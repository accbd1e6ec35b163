"""One node with the published, feed-forward form, compiled whole: ``node_step`` with another filter inside.

It knows no ramps: what an aiding contradicts while the rate changes is not judged.
"""

from __future__ import annotations

from node.firmware.kernel_choice import Loop
from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import entry_kernel, kernel
from node.kernels.record.node_record import END, JOINED, START
from node.kernels.step.node_step import REFUSED, aiding_around, begin_step, conclude_cycle, say_events, take_status
from node.kernels.turns.guard import judge_cycle
from node.kernels.turns.swings import follow_swing
from sim.studies.published_form.feed_forward import offer_aiding, run_cycle


@entry_kernel
def published_step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
    """One cycle of one node as ``node.kernels.step.node_step.node_step``; returns what there is to say."""
    node = nodes[0]
    waits = begin_step(nodes, settings, parameters, readings, moment)
    if waits == REFUSED:
        return int(say_events(node))
    joined = 1 if moment[JOINED] != 0 else 0
    status = run_cycle(node.filter, node.config, node.rate, node.force, moment[START], moment[END], joined)
    return leave_published(nodes, settings, moment, status, waits)


@kernel
def leave_published(nodes: Array, settings: Array, moment: Array, status: int, waits: int) -> int:
    """What comes after the loop, as ``node.kernels.step.node_step.end_step`` but for the ramps."""
    node = nodes[0]
    take_status(node, status, waits)
    follow_swing(node)
    judge_cycle(node, node.status, moment[END])
    return int(conclude_cycle(nodes, settings, moment))


@entry_kernel
def published_aiding(nodes: Array, settings: Array, aiding: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_step.node_aiding``."""
    return int(aiding_around(offer_aiding, nodes, settings, aiding))


def published_loop(_: Array | None = None) -> Loop:
    """The published form for ``node.firmware.kernel_choice``."""
    return Loop(run_cycle, offer_aiding, published_step, published_aiding)
