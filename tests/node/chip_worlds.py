"""What the step in C is tried on: rough strings, every event, alignments, static records."""

from collections.abc import Callable, Iterator

import numpy as np
from one_node import node_of
from rough_node import RoughNode
from string_of_one import StringOfOne
from test_every_event import CASES, known
from test_smoothing import OUTAGES

from node.kernels.arithmetic.formats import DEG
from node.kernels.step import fixed_node


def rough_node(seed: int, imus: int, joints: int, cycles: int, lean: float = 0.3) -> Callable[[], None]:
    """A node of a rough string: faults of its sensors, jumps of its clock, other joints."""

    def drill() -> None:
        rig, records = (
            RoughNode(imus, np.random.default_rng(seed), lean),
            node_of(imus, joints, np.random.default_rng(seed)),
        )
        node = fixed_node.FixedNode()
        for k in range(cycles):
            node.step(*records, *rig.step(k))
            if rig.random.random() < 0.7 and k % 900 < 800:
                node.aiding(*records[:2], rig.aiding(k))

    return drill


def aligned(method: str) -> None:
    """A node that is aligned, and drops it."""
    bench = known()
    assert bench.tube.align(method, 1.0) == ""
    bench.cycles(1).cycles(120, 7.0 * DEG).cycles(60)


def failed() -> None:
    """A filter whose covariance is none: it starts over."""
    bench = known()
    bench.tube.state["P"][3, 3] = -1e-4
    bench.cycles(3).cycles(20, 71.0 * DEG)


def recorded() -> None:
    """A node that takes a static record."""
    bench = known()
    assert bench.tube.start_record(10.0, 1) == ""
    bench.cycles(40)


def every_world(cycles: int) -> Iterator[Callable[[], object]]:
    """All of them, with so many cycles of each rough node."""
    for seed, imus, joints in ((2, 3, 2), (6, 1, 0), (7, 1, 1), (8, 2, 2)):
        yield rough_node(seed, imus, joints, cycles)
    yield from CASES.values()
    yield lambda: aligned("circle")
    yield lambda: aligned("extremes")
    yield recorded
    yield failed
    yield rough_node(9, 1, 0, cycles, lean=1.45)
    yield rough_node(10, 2, 1, cycles, lean=2.6)


def smoothed_strings() -> Iterator[Callable[[], object]]:
    """Tubes with outages of the aiding, whose surveys are said again by what came later."""
    for seed in (5, 6):
        yield lambda seed=seed: StringOfOne(seed, node={"kernel": "fixed"}, **OUTAGES).run()
