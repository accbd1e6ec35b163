"""The loop that a node runs, by the name of its kernel."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from node.firmware.settings import Kernel


class Loop(NamedTuple):
    """The cycle and the intake of aiding of a kernel, with the signatures of ``node.kernels``."""

    run_cycle: Callable[..., int]
    offer_aiding: Callable[..., int]


def kernel_of(kernel: Kernel) -> Loop | None:
    """The loop of the kernel chosen; None is that of float64, which the step holds compiled in.

    All but the default are loaded only when used.
    """
    if kernel == "float64":
        return None
    if kernel == "published":
        from node.kernels.published import cycle as published

        return Loop(published.run_cycle, published.offer_aiding)
    from node.kernels.fixed.node import FixedNode

    fixed = FixedNode()
    return Loop(fixed.run_cycle, fixed.offer_aiding)
