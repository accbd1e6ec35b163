"""What a node runs, by the name of its kernel: one table, to which a study may add a form of the filter of its own."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Final, NamedTuple, TypeAlias

from node.errors import NodeConfigurationError
from node.kernels.arithmetic.formats import Array


class Loop(NamedTuple):
    """The cycle and the intake of aiding of a kernel, and the step of a node that holds both compiled in.

    The signatures are those of ``node.kernels.filter.float64.cycle.run_cycle``,
    ``node.kernels.string.relay.offer_aiding``, ``node.kernels.step.node_step.node_step`` and ``node_aiding``.
    """

    run_cycle: Callable[..., int]
    offer_aiding: Callable[..., int]
    step: Callable[..., int]
    aiding: Callable[..., int]


CHIP: Final = "chip"  # kernel of a tube that steps on an emulated chip: none of a whole string
LIBRARY: Final = "library"  # that of a board whose integers step in the C library, in a process without a compiler
MakeLoop: TypeAlias = "Callable[[Array | None], Loop]"


def float64_loop(_: Array | None = None) -> Loop:
    """The filter in floats."""
    from node.kernels.filter.float64.cycle import run_cycle
    from node.kernels.step.node_step import node_aiding, node_step
    from node.kernels.string.relay import offer_aiding

    return Loop(run_cycle, offer_aiding, node_step, node_aiding)


def fixed_loop(integers: Array | None = None) -> Loop:
    """The filter in integers of one node, whose memory they are; see ``node.kernels.step.fixed_node.FixedNode``."""
    from node.kernels.step.fixed_node import FixedNode

    fixed = FixedNode(integers)
    return Loop(fixed.run_cycle, fixed.offer_aiding, fixed.step, fixed.aiding)


def chip_loop(integers: Array | None = None) -> Loop:
    """The filter in integers on an emulated chip; see ``node.firmware.chip_node.ChipNode``."""
    from node.firmware.chip_node import ChipNode

    chip = ChipNode(integers)
    return Loop(chip.run_cycle, chip.offer_aiding, chip.step, chip.aiding)


def library_loop(integers: Array | None = None) -> Loop:
    """The filter in integers in the C library; see ``node.firmware.library_node.LibraryNode``."""
    from node.firmware.library_node import LibraryNode

    node = LibraryNode(integers)
    return Loop(node.run_cycle, node.offer_aiding, node.step, node.aiding)


# each is loaded only when used
LOOPS: Final[dict[str, MakeLoop]] = {
    "float64": float64_loop,
    "fixed": fixed_loop,
    CHIP: chip_loop,
    LIBRARY: library_loop,
}


def kernel_of(kernel: str, integers: Array | None = None) -> Loop:
    """What a node with the kernel chosen, one of ``LOOPS``, runs; ``integers`` is the memory of one in integers."""
    return LOOPS[kernel](integers)


@contextmanager
def added_loop(kernel: str, make: MakeLoop) -> Iterator[None]:
    """Let the nodes of this process run a further ``kernel`` meanwhile, as a study does.

    Raises
    ------
    ConfigurationError
        When there is a kernel of that name.
    """
    if kernel in LOOPS:
        raise NodeConfigurationError(f"kernel: expected another name than {', '.join(LOOPS)}, got {kernel}")
    LOOPS[kernel] = make
    try:
        yield
    finally:
        del LOOPS[kernel]
