"""One node in integers, compiled whole: ``node_step`` over the record of integers, and what is beside it.

``integer_step`` and ``integer_aiding`` hold no float. Around them the float64 record is read where it was changed
from outside, and shown: reports and the saved state are taken from it.
"""

from __future__ import annotations

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import entry_kernel, kernel
from node.kernels.filter.fixed.cycle import run_cycle
from node.kernels.step.node_step import aiding_around, step_around
from node.kernels.step.shadow_words import learn_aiding, learn_inputs, learn_node, show_node
from node.kernels.string.relay import offer_aiding


@kernel
def integer_step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
    """One cycle as ``node_step``, all of it integers (``node.kernels.record.integer_node``)."""
    return int(step_around(run_cycle, nodes, settings, parameters, readings, moment))


@kernel
def integer_aiding(nodes: Array, settings: Array, aiding: Array) -> int:
    """One aiding as ``node.kernels.step.node_step.node_aiding``, all of it integers."""
    return int(aiding_around(offer_aiding, nodes, settings, aiding))


@entry_kernel
def fixed_step(
    nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array, integers: Array
) -> int:
    """One cycle of one node as ``node.kernels.step.node_step.node_step``; returns what there is to say.

    Parameters
    ----------
    nodes, settings, parameters, readings, moment : as ``node_step``
    integers : one-element array of dtype ``INTEGERS``
    """
    own = integers[0]
    learn_node(nodes, settings, integers)
    learn_inputs(parameters, readings, moment, integers)
    says = integer_step(integers["node"], integers["settings"], own.parameters, own.readings, own.moment)
    show_node(nodes, settings, integers, True)
    return says


@entry_kernel
def fixed_aiding(nodes: Array, settings: Array, aiding: Array, integers: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_step.node_aiding``; ``integers`` as ``fixed_step``."""
    learn_node(nodes, settings, integers)
    learn_aiding(aiding, integers)
    gates = integer_aiding(integers["node"], integers["settings"], integers[0].aiding)
    show_node(nodes, settings, integers, False)
    return gates
