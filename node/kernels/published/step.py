"""One node with the published, feed-forward form, compiled whole: ``node_step`` with another filter inside."""

from __future__ import annotations

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.published.cycle import offer_aiding, run_cycle
from node.kernels.step.node_step import aiding_around, step_around


@kernel
def published_step(nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
    """One cycle of one node as ``node.kernels.step.node_step.node_step``; returns what there is to say."""
    return int(step_around(run_cycle, nodes, settings, parameters, readings, moment))


@kernel
def published_aiding(nodes: Array, settings: Array, aiding: Array) -> int:
    """Take one aiding into a node as ``node.kernels.step.node_step.node_aiding``."""
    return int(aiding_around(offer_aiding, nodes, settings, aiding))
