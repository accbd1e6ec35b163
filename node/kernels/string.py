"""A string of nodes in one call: a cycle of each, and an aiding from hop to hop, for whoever simulates thousands.

What a node does is ``node.kernels.step``, called by its address; nothing is added but the loop over them.
"""

from __future__ import annotations

from typing import Any

from node.kernels.jit import kernel
from node.kernels.layout import Array
from node.kernels.record import A_HOPS, A_OFFSET, A_SYSTEMATIC, A_TORSION, A_VALID
from node.kernels.step import ONWARD


@kernel
def string_step(
    step: Any,
    nodes: Array,
    settings: Array,
    parameters: Array,
    readings: Array,
    moments: Array,
    mask: Array,
    says: Array,
) -> None:
    """One cycle of every node of ``mask`` (n,); what each has to say is left in ``says`` (n,).

    Parameters
    ----------
    step : ``node_step`` of ``node.kernels.address.firmware``
    nodes, settings : (n,) of dtype ``NODE`` and ``SETTINGS``
    parameters, readings, moments : (n, ...) as ``node_step`` takes them
    """
    for k in range(nodes.shape[0]):
        says[k] = 0
        if mask[k]:
            one = slice(k, k + 1)
            says[k] = step(nodes[one], settings[one], parameters[k], readings[k], moments[k])


@kernel
def string_aiding(
    aid: Any, nodes: Array, settings: Array, string: Array, hops: int, valid_locals: Array, aiding: Array
) -> None:
    """Hand an aiding down the first ``hops`` nodes of a string whose scheme is ``forward``.

    Parameters
    ----------
    aid : ``node_aiding`` of ``node.kernels.address.firmware``
    nodes, settings : (n,) of dtype ``NODE`` and ``SETTINGS``
    string : (hops or more,) indices of the nodes, from the top down
    valid_locals : (hops or more,) time of validity by the clock of each node, s
    aiding : (12,) as ``node_aiding`` takes it; it holds in the end what the last node hands down
    """
    for hop in range(hops):
        k = string[hop]
        one = slice(k, k + 1)
        aiding[A_VALID] = valid_locals[hop]
        if not aid(nodes[one], settings[one], aiding) & ONWARD:
            return
        node = nodes[k]
        aiding[A_OFFSET], aiding[A_SYSTEMATIC] = node.down_offset, node.down_systematic
        aiding[A_TORSION] = node.down_torsion
        aiding[A_HOPS] += 1.0
