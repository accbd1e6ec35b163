"""What a node runs, by the name of its kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from node.firmware.settings import Kernel
from node.kernels.arithmetic.formats import Array
from node.kernels.filter.float64.cycle import run_cycle
from node.kernels.step.node_step import node_aiding, node_step
from node.kernels.string.relay import offer_aiding


class Loop(NamedTuple):
    """The cycle and the intake of aiding of a kernel, and the step of a node that holds both compiled in.

    The signatures are those of ``node.kernels.filter.float64.cycle``, ``relay`` and ``step``.
    """

    run_cycle: Callable[..., int]
    offer_aiding: Callable[..., int]
    step: Callable[..., int]
    aiding: Callable[..., int]


def kernel_of(kernel: Kernel, integers: Array | None = None) -> Loop:
    """What a node with the kernel chosen runs; all but the default are loaded only when used.

    ``integers`` is the memory of a node in integers, see ``node.kernels.step.fixed_node.FixedNode``.
    """
    if kernel == "float64":
        return Loop(run_cycle, offer_aiding, node_step, node_aiding)
    if kernel == "published":
        from node.kernels.published import cycle as published
        from node.kernels.published.step import published_aiding, published_step

        return Loop(published.run_cycle, published.offer_aiding, published_step, published_aiding)
    from node.kernels.step.fixed_node import FixedNode

    fixed = FixedNode(integers)
    return Loop(fixed.run_cycle, fixed.offer_aiding, fixed.step, fixed.aiding)
