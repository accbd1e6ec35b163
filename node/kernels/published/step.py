"""One node with the published, feed-forward form, compiled whole: ``node.kernels.step`` with another filter inside."""

from __future__ import annotations

from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.published.cycle import offer_aiding, run_cycle
from node.kernels.record import END, JOINED, START
from node.kernels.step import ONWARD, REFUSED, USED, enter, hand_down, leave, own_systematic, say_events, take_aiding


@kernel
def published_step(
    nodes: Array, configs: Array, settings: Array, parameters: Array, readings: Array, moment: Array
) -> int:
    """One cycle of one node as ``node.kernels.step.node_step``; returns what there is to say."""
    node = nodes[0]
    waits = enter(nodes, configs, settings, parameters, readings, moment)
    if waits == REFUSED:
        return say_events(node)
    joined = 1 if moment[JOINED] != 0.0 else 0
    status = run_cycle(node.filter, configs[0], node.rate, node.force, moment[START], moment[END], joined)
    return leave(nodes, configs, settings, moment, status, waits)


@kernel
def published_aiding(nodes: Array, configs: Array, settings: Array, aiding: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_aiding``."""
    node = nodes[0]
    gates = take_aiding(nodes, configs, settings, aiding)
    if gates & USED:
        yaw, yaw_var, valid_at = aiding[0], aiding[1], aiding[5]
        sequence, hops = int(aiding[6]), int(aiding[7])
        node.noticed |= offer_aiding(
            node.filter, configs[0], yaw, yaw_var, own_systematic(node), node.down_offset, valid_at, sequence, hops
        )
    if gates & ONWARD:
        hand_down(nodes, settings)
    return int(gates)
