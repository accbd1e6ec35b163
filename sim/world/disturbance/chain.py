"""The compiled forms of the rows of a table as one kernel, so that a campaign goes through it at the cost of its sums.

Each link is a kernel that calls the one before it and one row; the compiler makes one piece of code of them. They are
kept with the kernels that call them and not by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from sim.kernel import compiled
from sim.world.disturbance.lanes import WIDTH, Lane
from sim.world.disturbance.row import Compiled, Disturbance

FORMS: Final = ("felt", "read", "parts")  # of ``Compiled``


def lane_starts(rows: Sequence[Disturbance]) -> dict[str, int]:
    """First number of the lane of every row that takes one, by its name."""
    starts, free = {}, len(Lane) - 1
    for row in rows:
        if row.compiled is not None and row.compiled.lane is not None:
            lane = free if row.compiled.lane == Lane.NEXT else row.compiled.lane
            free += row.compiled.lane == Lane.NEXT
            starts[row.name] = WIDTH * lane
    return starts


def lanes_of(rows: Sequence[Disturbance]) -> int:
    """Lanes that are drawn for a node and cycle."""
    return max(len(Lane) - 1, *(start // WIDTH + 1 for start in lane_starts(rows).values()))


def chain_forms(rows: Sequence[Disturbance], form: str) -> Any:
    """One kernel that calls one of ``FORMS`` of every row that has it, in their order."""
    starts = lane_starts(rows)
    chain = compiled(do_nothing_apart if form == "parts" else do_nothing, cache=False)
    for row in rows:
        act = getattr(row.compiled or Compiled(), form)
        if act is not None:
            link = after_parts if form == "parts" else after
            chain = link(chain, act, starts.get(row.name, 0))
    return chain


def do_nothing(shared: Any, tube: Any, now: Any, drawn: Array, row: Array) -> None:
    """Begin a chain of ``felt`` or ``read``."""


def do_nothing_apart(
    shared: Any, tube: Any, now: Any, drawn: Array, further: Array, borders: Array, pieces: int, parts: Array
) -> None:
    """Begin a chain of ``parts``."""


def after(before: Any, act: Any, start: int) -> Any:
    """Kernel of those ``before`` and one row more, whose lane begins at ``start``."""
    end = start + WIDTH

    def act_in_order(shared: Any, tube: Any, now: Any, drawn: Array, row: Array) -> None:
        before(shared, tube, now, drawn, row)
        act(shared, tube, now, drawn[start:end], row)

    return compiled(act_in_order, cache=False)


def after_parts(before: Any, act: Any, start: int) -> Any:
    """Likewise of what adds to the parts of a window."""
    end = start + WIDTH

    def act_in_order(
        shared: Any, tube: Any, now: Any, drawn: Array, further: Array, borders: Array, pieces: int, parts: Array
    ) -> None:
        before(shared, tube, now, drawn, further, borders, pieces, parts)
        act(shared, tube, now, drawn[start:end], further, borders, pieces, parts)

    return compiled(act_in_order, cache=False)
