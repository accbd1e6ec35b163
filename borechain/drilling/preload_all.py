"""What the fork server imports and compiles for nodes that run another kernel than the default one.

It stands apart from ``preload``: to compile every kernel takes a fresh machine half a minute, which the usual rig
saves.
"""

from __future__ import annotations

from borechain.drilling import preload
from node.firmware.kernel_choice import kernel_of
from node.firmware.tube_settings import KERNELS
from node.kernels.step.precompile import warm_step

for kernel in KERNELS:
    loop = kernel_of(kernel)
    warm_step(loop.step, loop.aiding)

__all__ = ["preload"]
