"""A string of nodes in one call: a cycle of each, and an aiding from hop to hop, for whoever simulates thousands.

What a node does is ``node.kernels.step.node_step``, or ``node.kernels.step.fixed_step``, called by its address; nothing
is added but the loop over them.
"""

from __future__ import annotations

from typing import Any

from numba import types

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import taken_where
from node.kernels.record.node_record import A_HOPS, A_OFFSET, A_SYSTEMATIC, A_TORSION, A_VALID
from node.kernels.step.node_step import ONWARD


def has_integers(*kinds: Any) -> bool:
    """Whether the last of some arguments is the memory of nodes in integers, and not None."""
    return isinstance(kinds[-1], types.Array)


def step_integers(step: Any, nodes: Array, settings: Array, inputs: tuple[Any, ...], one: slice, integers: Any) -> int:
    """One cycle of a node in integers."""
    parameters, reading, moment = inputs
    return int(step(nodes[one], settings[one], parameters, reading, moment, integers[one]))


@taken_where(has_integers, step_integers)
def step_one(step: Any, nodes: Array, settings: Array, inputs: tuple[Any, ...], one: slice, _: Any) -> int:
    """One cycle of ``one`` node, with the parameters, readings and moment of it alone."""
    parameters, reading, moment = inputs
    return int(step(nodes[one], settings[one], parameters, reading, moment))


def aid_integers(aid: Any, nodes: Array, settings: Array, aiding: Array, one: slice, integers: Any) -> int:
    """One aiding of a node in integers."""
    return int(aid(nodes[one], settings[one], aiding, integers[one]))


@taken_where(has_integers, aid_integers)
def aid_one(aid: Any, nodes: Array, settings: Array, aiding: Array, one: slice, _: Any) -> int:
    """One aiding of ``one`` node."""
    return int(aid(nodes[one], settings[one], aiding))


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
    integers: Any = None,
) -> None:
    """One cycle of every node of ``mask`` (n,); what each has to say is left in ``says`` (n,).

    Parameters
    ----------
    step : ``node_step`` of ``node.kernels.step.address.firmware_addresses``; with ``integers`` that of the kernel
    ``fixed``
    nodes, settings : (n,) of dtype ``NODE`` and ``SETTINGS``
    parameters, readings, moments : (n, ...) as ``node_step`` takes them
    integers : (n,) of dtype ``INTEGERS``; None of nodes in floats, for which the loop is compiled without it
    """
    for k in range(nodes.shape[0]):
        says[k] = 0
        if mask[k]:
            one = slice(k, k + 1)
            inputs = parameters[k], readings[k], moments[k]
            says[k] = step_one(step, nodes, settings, inputs, one, integers)


@kernel
def string_aiding(
    aid: Any,
    nodes: Array,
    settings: Array,
    string: Array,
    hops: int,
    valid_locals: Array,
    aiding: Array,
    integers: Any = None,
) -> None:
    """Hand an aiding down the first ``hops`` nodes of a string whose scheme is ``forward``.

    Parameters
    ----------
    aid : ``node_aiding`` of ``node.kernels.step.address.firmware_addresses``; with ``integers`` that of the kernel
    ``fixed``
    nodes, settings : (n,) of dtype ``NODE`` and ``SETTINGS``
    string : (hops or more,) indices of the nodes, from the top down
    valid_locals : (hops or more,) time of validity by the clock of each node, s
    aiding : (12,) as ``node_aiding`` takes it; it holds in the end what the last node hands down
    integers : see ``string_step``
    """
    for hop in range(hops):
        k = string[hop]
        one = slice(k, k + 1)
        aiding[A_VALID] = valid_locals[hop]
        if not aid_one(aid, nodes, settings, aiding, one, integers) & ONWARD:
            return
        node = nodes[k]
        aiding[A_OFFSET], aiding[A_SYSTEMATIC] = node.down_offset, node.down_systematic
        aiding[A_TORSION] = node.down_torsion
        aiding[A_HOPS] += 1.0
