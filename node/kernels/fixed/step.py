"""One node with the integer loop, compiled whole: ``node.kernels.step`` with other arithmetic in its middle."""

from __future__ import annotations

from typing import Final

import numpy as np

from node.kernels.doubts import noise_var
from node.kernels.fixed.beside import CONFIG_WORDS, STATE_WORDS, fixed_cycle, fixed_offer
from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.record import A_HOPS, A_SEQUENCE, A_VALID, A_YAW, A_YAW_VAR, END, JOINED, NODE, START
from node.kernels.step import ONWARD, REFUSED, USED, enter, hand_down, leave, own_systematic, say_events, take_aiding

# where the filter and the configuration lie in the record, in words of 64 bits
FILTER_AT: Final = NODE.fields["filter"][1] // 8 if NODE.fields else 0
CONFIG_AT: Final = NODE.fields["config"][1] // 8 if NODE.fields else 0


@kernel
def fixed_step(
    nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array, integers: Array
) -> int:
    """One cycle of one node as ``node.kernels.step.node_step``; returns what there is to say.

    Parameters
    ----------
    nodes, settings, parameters, readings, moment : as ``node_step``
    integers : one-element array of dtype ``INTEGERS``
    """
    waits = enter(nodes, settings, parameters, readings, moment)
    node = nodes[0]
    if waits == REFUSED:
        return say_events(node)
    words = nodes.view(np.int64)
    status = fixed_cycle(
        integers[0],
        node.filter,
        node.config,
        words[FILTER_AT : FILTER_AT + STATE_WORDS],
        words[CONFIG_AT : CONFIG_AT + CONFIG_WORDS],
        node.rate,
        node.force,
        moment[START],
        moment[END],
        1 if moment[JOINED] != 0.0 else 0,
    )
    return int(leave(nodes, settings, moment, status, waits))


@kernel
def fixed_aiding(nodes: Array, settings: Array, aiding: Array, integers: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_aiding``; ``integers`` as ``fixed_step``."""
    node, words = nodes[0], nodes.view(np.int64)
    gates = take_aiding(nodes, settings, aiding)
    if gates & USED:
        node.noticed |= fixed_offer(
            integers[0],
            node.filter,
            node.config,
            words[FILTER_AT : FILTER_AT + STATE_WORDS],
            words[CONFIG_AT : CONFIG_AT + CONFIG_WORDS],
            aiding[A_YAW],
            aiding[A_YAW_VAR] + noise_var(node),
            own_systematic(node),
            node.down_offset,
            aiding[A_VALID],
            int(aiding[A_SEQUENCE]),
            int(aiding[A_HOPS]),
        )
    if gates & ONWARD:
        hand_down(nodes, settings)
    return int(gates)
