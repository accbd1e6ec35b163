"""A node whose integers step in the C library, through its header: no compiler is in the process."""

from __future__ import annotations

from typing import Final

from node.kernels.arithmetic.formats import Array
from node.kernels.record.integer_node import INTEGERS
from node.kernels.step.fixed_node import FixedNode
from node.kernels.step.shadow_words import learn_aiding, learn_inputs, learn_node, show_node
from node.translation.step_library import load_step, step_library

OF_STEP: Final = ("node", "settings", "parameters", "readings", "moment")  # in the order of the header
OF_AIDING: Final = ("node", "settings", "aiding")


class LibraryNode(FixedNode):
    """A node in integers whose steps and aidings the library takes; methods as ``FixedNode``."""

    def __init__(self, integers: Array | None = None) -> None:
        super().__init__(integers)
        self._library = load_step(step_library())
        self._step_at, self._aiding_at = self._addresses(OF_STEP), self._addresses(OF_AIDING)

    def step(self, nodes: Array, settings: Array, parameters: Array, readings: Array, moment: Array) -> int:
        """One cycle in C."""
        learn_node(nodes, settings, self._integers)
        learn_inputs(parameters, readings, moment, self._integers)
        said = int(self._library.step(*self._step_at))
        show_node(nodes, settings, self._integers, True)
        return said

    def aiding(self, nodes: Array, settings: Array, aiding: Array) -> int:
        """One aiding in C."""
        learn_node(nodes, settings, self._integers)
        learn_aiding(aiding, self._integers)
        said = int(self._library.aiding(*self._aiding_at))
        show_node(nodes, settings, self._integers, False)
        return said

    def _addresses(self, names: tuple[str, ...]) -> tuple[int, ...]:
        """Where parts of the integers lie; these do not move."""
        fields = INTEGERS.fields
        assert fields is not None
        begin = self._integers.__array_interface__["data"][0]
        return tuple(begin + fields[name][1] for name in names)
