"""One node with the integer loop, compiled whole: ``node.kernels.step`` with other arithmetic in its middle."""

from __future__ import annotations

import numpy as np

from node.kernels.fixed.beside import STATE_WORDS, fixed_cycle, fixed_offer
from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.record import END, JOINED, START
from node.kernels.step import ONWARD, REFUSED, USED, enter, hand_down, leave, own_systematic, say_events, take_aiding


@kernel
def fixed_step(
    nodes: Array,
    configs: Array,
    settings: Array,
    parameters: Array,
    readings: Array,
    moment: Array,
    integers: Array,
) -> int:
    """One cycle of one node as ``node.kernels.step.node_step``; returns what there is to say.

    Parameters
    ----------
    nodes, configs, settings, parameters, readings, moment : as ``node_step``
    integers : one-element array of dtype ``INTEGERS``
    """
    waits = enter(nodes, configs, settings, parameters, readings, moment)
    node = nodes[0]
    if waits == REFUSED:
        return say_events(node)
    status = fixed_cycle(
        integers[0],
        node.filter,
        configs[0],
        nodes.view(np.int64)[:STATE_WORDS],  # the filter stands first in the record
        configs.view(np.int64),
        node.rate,
        node.force,
        moment[START],
        moment[END],
        1 if moment[JOINED] != 0.0 else 0,
    )
    return leave(nodes, configs, settings, moment, status, waits)


@kernel
def fixed_aiding(nodes: Array, configs: Array, settings: Array, aiding: Array, integers: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_aiding``; ``integers`` as ``fixed_step``."""
    node = nodes[0]
    gates = take_aiding(nodes, configs, settings, aiding)
    if gates & USED:
        node.noticed |= fixed_offer(
            integers[0],
            node.filter,
            configs[0],
            nodes.view(np.int64)[:STATE_WORDS],
            configs.view(np.int64),
            aiding[0],
            aiding[1],
            own_systematic(node),
            node.down_offset,
            aiding[5],
            int(aiding[6]),
            int(aiding[7]),
        )
    if gates & ONWARD:
        hand_down(nodes, settings)
    return int(gates)
