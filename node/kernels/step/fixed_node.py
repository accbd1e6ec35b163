"""The integer loop behind the interface of the float64 kernels: one object a node, which owns its integers."""

from __future__ import annotations

from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.record.integer_node import new_integers
from node.kernels.step.fixed_step import fixed_aiding, fixed_step
from node.kernels.step.precompile import warm_loop, warm_step
from node.kernels.step.shadow_record import fixed_cycle, fixed_offer


class FixedNode:
    """Integers of one node; every method but the properties has the signature of a float64 kernel.

    Parameters
    ----------
    integers : one-element array of dtype ``INTEGERS``, new, owned by the caller; None: by the node
    """

    def __init__(self, integers: Array | None = None) -> None:
        self._integers = new_integers() if integers is None else integers

    @property
    def overflows(self) -> int:
        """Numbers that did not fit since the start."""
        return int(self.state["overflows"])

    @property
    def state(self) -> Any:
        """The integers, one record of dtype ``FIXED_STATE``."""
        return self._integers[0]["node"]["filter"]

    def step(self, nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        """One cycle as ``node.kernels.step.node_step.node_step``."""
        return fixed_step(nodes, settings, parameters, readings, moment, self._integers)

    def aiding(self, nodes: Array, settings: Array, aiding: Array) -> int:
        """One aiding as ``node.kernels.step.node_step.node_aiding``."""
        return fixed_aiding(nodes, settings, aiding, self._integers)

    def run_cycle(
        self, state: Any, config: Any, rate: Array, force: Array, start: float, end: float, joined: int
    ) -> int:
        """One execution cycle as ``node.kernels.filter.float64.cycle.run_cycle``."""
        words = (words_of(state), words_of(config))
        return fixed_cycle(self._integers[0], state, config, *words, rate, force, start, end, joined)

    def offer_aiding(
        self,
        state: Any,
        config: Any,
        yaw: float,
        yaw_var: float,
        systematic_var: float,
        offset: float,
        valid_at: float,
        sequence: int,
        hops: int,
    ) -> int:
        """Queue one aiding as ``node.kernels.string.relay.offer_aiding``."""
        taken = (yaw, yaw_var, systematic_var, offset, valid_at, sequence, hops)
        return fixed_offer(self._integers[0], state, config, words_of(state), words_of(config), *taken)


def words_of(record: Any) -> Array:
    """Bytes of a record as 64-bit integers, (n,): a view, and one that cannot be written to."""
    return np.frombuffer(record, np.int64)


def warm_up() -> None:
    """Compile the integer step and its loop, or load them from the cache, on a node that is thrown away."""
    node = FixedNode()
    warm_step(node.step, node.aiding)
    warm_loop(FixedNode().run_cycle, FixedNode().offer_aiding)
