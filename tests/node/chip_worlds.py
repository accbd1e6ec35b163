"""What the step in C is tried on: rough strings, every event, alignments, static records."""

from collections.abc import Callable, Iterator

import numpy as np
from one_node import node_of
from rough_node import RoughNode
from string_of_one import StringOfOne
from test_every_event import CASES, FAST, LEARN, SLOW, TWO, Bench, Numbers, held, known, warmed
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


def tilted(across: float, along: float) -> Callable[[Numbers, Numbers], tuple[Numbers, Numbers]]:
    """Readings of a node whose gravity has so much more across its axis, and so much along it."""
    return lambda w, f: (w, (across * f[0], across * f[1], along * f[2]))


def offset(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    """Readings of an IMU that is mounted askew by some ten degrees."""
    return w, (f[0] + 0.2 * f[2], f[1], 0.98 * f[2])


def shaken(w: Numbers, f: Numbers) -> tuple[Numbers, Numbers]:
    """Readings of a node that swings, its own last numbers decide which way."""
    swing = 0.2 if int(f[0] * 1e7) % 2 else -0.2
    return w, (f[0] + swing, f[1] - swing, f[2])


def refused_alignments() -> Iterator[Callable[[], object]]:
    """Turns of which no alignment comes: each reason once."""

    def begun(
        spoil: Callable[[Numbers, Numbers], tuple[Numbers, Numbers]] = lambda w, f: (w, f), two: bool = False
    ) -> Bench:
        bench = Bench(TWO if two else None).cycles(LEARN, spoil=spoil)
        assert bench.tube.align("circle", 1.0) == ""
        return bench.cycles(1, spoil=spoil)

    for spoil in (tilted(0.02, 1.0), tilted(28.0, 0.2), offset, shaken):
        yield lambda spoil=spoil: begun(spoil).cycles(120, SLOW, spoil).cycles(3)
    yield lambda: begun().cycles(10, SLOW).cycles(4, -SLOW)
    yield lambda: begun().cycles(10, SLOW).cycles(20)
    yield lambda: begun().cycles(400)
    yield lambda: begun(two=True).cycles(10, SLOW).cycles(8, SLOW, held)
    yield lambda: begun().cycles(10, SLOW, aided=False).cycles(4, 0.2 * SLOW)


def alone() -> None:
    """Nodes that hear of no head: at rest, warmed, at rest; and from the first cycle on."""
    known().cycles(130, aided=False).cycles(130, spoil=warmed, aided=False).cycles(20, FAST, aided=False)
    Bench().cycles(130, spoil=warmed, aided=False).cycles(130, aided=False).cycles(20, FAST)


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
