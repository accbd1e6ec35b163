"""The compiled firmware in the hands of other kernels: by its address.

A kernel that named ``node_step`` would hold a copy of it, which takes a minute to compile; one that is given its
address calls the very code that a rig runs.
"""

from __future__ import annotations

import functools
from typing import Any, Final, cast

import numba
import numpy as np
from numba.core.types import FunctionType, WrapperAddressProtocol
from numba.extending import typeof_impl

from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import AIDING, MOMENT, READING, SETTINGS, new_node
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.node_step import node_aiding, node_step

BY_ADDRESS: Final = ("float64", "fixed")  # kernels


class ByAddress(WrapperAddressProtocol):
    """An ``entry`` compiled for the types of ``arguments``, as a value that a kernel takes and calls."""

    def __init__(self, function: Any, *arguments: Any) -> None:
        kinds = tuple(map(numba.typeof, arguments))
        function.compile(kinds)
        compiled = function.overloads[kinds]
        self._signature = compiled.signature
        self.kind = FunctionType(compiled.signature)
        self._address = compiled.library.get_pointer_to_function(compiled.fndesc.llvm_cfunc_wrapper_name)

    def __wrapper_address__(self) -> int:
        """Where the code is."""
        return cast("int", self._address)

    def signature(self) -> Any:
        """What it takes and returns, as numba says it."""
        return self._signature


@typeof_impl.register(ByAddress)
def _kind_of(value: ByAddress, _: Any) -> FunctionType:
    """Its type, made once: numba would make it anew in every call, which takes longer than the call."""
    return value.kind


@functools.cache
def firmware(kernel: str = "float64") -> tuple[ByAddress, ByAddress]:
    """``node_step`` and ``node_aiding`` of one of ``BY_ADDRESS``; those in integers are loaded only when used."""
    if kernel == "float64":
        return _by_address(node_step, node_aiding)
    from node.kernels.record.integer_node import new_integers
    from node.kernels.step.fixed_step import fixed_aiding, fixed_step

    return _by_address(fixed_step, fixed_aiding, new_integers())


def _by_address(step: Any, aid: Any, *integers: Any) -> tuple[ByAddress, ByAddress]:
    nodes, crews = new_node(default_config()), np.zeros(1, SETTINGS)
    corrections = np.concatenate([identity_parameters()] * 2)
    return (
        ByAddress(step, nodes, crews, corrections, np.zeros((1, READING)), np.zeros(MOMENT), *integers),
        ByAddress(aid, nodes, crews, np.zeros(AIDING), *integers),
    )
