"""The loop that a node runs, by the name of its kernel."""

from __future__ import annotations

from collections.abc import Callable

from node.firmware.settings import Kernel
from node.kernels.cycle import run_cycle
from node.kernels.relay import offer_aiding


def kernel_of(kernel: Kernel) -> tuple[Callable[..., int], Callable[..., int]]:
    """The cycle and the intake of aiding of the kernel chosen; all but the default are loaded only when used."""
    if kernel == "float64":
        return run_cycle, offer_aiding
    if kernel == "published":
        from node.kernels.published import cycle as published

        return published.run_cycle, published.offer_aiding
    from node.kernels.fixed.node import FixedNode

    fixed = FixedNode()
    return fixed.run_cycle, fixed.offer_aiding
