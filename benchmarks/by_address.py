"""What a kernel that calls a node's step costs to compile: with a copy of the step in it, and given its address.

Run it as ``borechain bench by_address``. Both loops do the same over the same step, which is compiled, or loaded from
the cache, before the clock starts. A figure is the processor's time of this thread, once: the copy takes long.
"""

from __future__ import annotations

import json
import time
from typing import Any

import numpy as np
from numba import njit, typeof

from borechain.cli.faults import EnvironmentFault
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import MOMENT, READING, SETTINGS, new_node
from node.kernels.sensors.correction import identity_parameters
from node.kernels.step.address import firmware_addresses
from node.kernels.step.node_step import node_step
from node.kernels.step.precompile import warm_up

LEAST = 2.0  # times, below which an address is not worth its code


def given_address(step: Any, nodes: Any, settings: Any, parameters: Any, readings: Any, moments: Any) -> int:
    """Cycles of a node whose step is given; returns how many had something to say."""
    said = 0
    for k in range(moments.shape[0]):
        said += 1 if step(nodes, settings, parameters, readings[k], moments[k]) > 0 else 0
    return said


def holding_copy(nodes: Any, settings: Any, parameters: Any, readings: Any, moments: Any) -> int:
    """The same, with the step named in it."""
    said = 0
    for k in range(moments.shape[0]):
        said += 1 if node_step(nodes, settings, parameters, readings[k], moments[k]) > 0 else 0
    return said


def compile_time(function: Any, *arguments: Any) -> float:
    """Time (s) to compile ``function`` for the types of ``arguments``."""
    made = njit(error_model="numpy", no_cfunc_wrapper=True)(function)  # type: ignore[call-overload]  # not told of
    begun = time.thread_time()
    made.compile(tuple(map(typeof, arguments)))
    return time.thread_time() - begun


def run() -> dict[str, Any]:
    """Both compilations.

    Returns
    -------
    dict
        ``ratios``: the loop that is given the address beside the one that holds a copy.

    Raises
    ------
    EnvironmentFault
        When the address makes it less than ``LEAST`` times faster.
    """
    warm_up()
    step, _ = firmware_addresses()
    nodes, settings = new_node(default_config()), np.zeros(1, SETTINGS)
    parameters = np.concatenate([identity_parameters()] * 2)
    taken = nodes, settings, parameters, np.zeros((1, 1, READING)), np.zeros((1, MOMENT))
    compile_time(lambda a: a, 1.0)  # what numba loads for its first
    ours, peer = compile_time(given_address, step, *taken), compile_time(holding_copy, *taken)
    if peer < LEAST * ours:
        raise EnvironmentFault(f"by_address: expected {LEAST:g} times faster to compile, got {peer / ours:.2f}")
    row = {"ours": ours, "peer": peer, "ratio": peer / ours, "slower": ours / peer}
    return {"bench": "by_address", "ratios": {"a loop around the step": row}}


if __name__ == "__main__":
    print(json.dumps(run(), indent=1))
