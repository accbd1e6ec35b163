"""The compiled firmware in the hands of other kernels: by its address.

A kernel that named ``node_step`` would hold a copy of it, which takes a minute to compile; one that is given its
address calls the very code that a rig runs.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import numba
import numpy as np

from node.kernels.calibration import identity_parameters
from node.kernels.layout import default_config
from node.kernels.record import AIDING, MOMENT, READING, SETTINGS, new_node
from node.kernels.step import node_aiding, node_step


def call_with_firmware(kernel: Callable[..., int], *arguments: Any) -> int:
    """Call a kernel that takes ``node_step`` and ``node_aiding`` first, compiled for their addresses."""
    compiled, firmware = cast("Any", kernel), (cast("Any", node_step), cast("Any", node_aiding))
    if not compiled.signatures:
        nodes, crews = new_node(default_config()), np.zeros(1, SETTINGS)
        corrections = np.concatenate([identity_parameters()] * 2)
        given = (
            (nodes, crews, corrections, np.zeros((1, READING)), np.zeros(MOMENT)),
            (nodes, crews, np.zeros(AIDING)),
        )
        for function, taken in zip(firmware, given, strict=True):
            function.compile(tuple(map(numba.typeof, taken)))
        called = [numba.types.FunctionType(function.nopython_signatures[0]) for function in firmware]
        compiled.compile((*called, *map(numba.typeof, arguments)))
        compiled.disable_compile()
    return int(compiled(*firmware, *arguments))
