"""The compiled firmware in the hands of other kernels: by its address.

A kernel that named ``node_step`` would hold a copy of it and take 14 times as long to compile
(``borechain bench by_address``); one that is given its address calls the very code that a rig runs.
"""

from __future__ import annotations

import functools
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.compiler import ByAddress
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import AIDING, MOMENT, READING, SETTINGS, new_node
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.node_step import node_aiding, node_step

BY_ADDRESS: Final = ("float64", "fixed")  # kernels


@functools.cache
def firmware_addresses(kernel: str = "float64") -> tuple[ByAddress, ByAddress]:
    """``node_step`` and ``node_aiding`` of one of ``BY_ADDRESS``; those in integers are loaded only when used."""
    if kernel == "float64":
        return _by_address(node_step, node_aiding)
    from node.kernels.record.integer_node import new_integers
    from node.kernels.step.fixed_step import fixed_aiding, fixed_step

    return _by_address(fixed_step, fixed_aiding, new_integers())


def _by_address(step: Any, aid: Any, *integers: Any) -> tuple[ByAddress, ByAddress]:
    nodes, settings = new_node(default_config()), np.zeros(1, SETTINGS)
    corrections = np.concatenate([identity_parameters()] * 2)
    return (
        ByAddress(step, nodes, settings, corrections, np.zeros((1, READING)), np.zeros(MOMENT), *integers),
        ByAddress(aid, nodes, settings, np.zeros(AIDING), *integers),
    )
