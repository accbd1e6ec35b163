"""The compiled forms of the rows of a table as one kernel, so that a campaign goes through it at the cost of its sums.

Each link is a kernel that calls the one before it and one row; the compiler makes one piece of code of them. They are
kept with the kernels that call them and not by themselves.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from sim.kernel import compile_function
from sim.world.disturbance.lanes import FREE, WIDTH, Lane, count_numbers
from sim.world.disturbance.row import Compiled, Disturbance

FORMS: Final = ("felt", "read", "parts")  # of ``Compiled``


def lane_starts(rows: Sequence[Disturbance]) -> dict[str, int]:
    """First number of the lane of every row that takes one, by its name."""
    starts, free = {}, FREE
    for row in rows:
        lane = None if row.compiled is None else row.compiled.lane
        if lane == Lane.NEXT:
            starts[row.name], free = free, free + WIDTH
        elif lane is not None:
            starts[row.name] = WIDTH * lane
    return starts


def count_drawn(rows: Sequence[Disturbance]) -> int:
    """Numbers that are drawn for a node and cycle."""
    return count_numbers(sum(start >= FREE for start in lane_starts(rows).values()))


def chain_forms(rows: Sequence[Disturbance], form: str) -> Any:
    """One kernel that calls one of ``FORMS`` of every row that has it, in their order."""
    starts = lane_starts(rows)
    chain = compile_function(do_nothing_apart if form == "parts" else do_nothing, cache=False, inline="always")
    for row in rows:
        act = getattr(row.compiled or Compiled(), form)
        if act is not None:
            link = after_parts if form == "parts" else chain_row
            chain = link(chain, act, starts.get(row.name, 0))
    return chain


def do_nothing(shared: Any, tube: Any, now: Any, drawn: Array, row: Array) -> None:
    """Begin a chain of ``felt`` or ``read``."""


def do_nothing_apart(
    shared: Any, tube: Any, now: Any, drawn: Array, further: Array, borders: Array, pieces: int, parts: Array
) -> None:
    """Begin a chain of ``parts``."""


def chain_row(before: Any, act: Any, start: int) -> Any:
    """Kernel of those ``before`` and one row more, whose lane begins at ``start``."""

    def act_in_order(shared: Any, tube: Any, now: Any, drawn: Array, row: Array) -> None:
        before(shared, tube, now, drawn, row)
        act(shared, tube, now, drawn, start, row)

    return compile_function(act_in_order, cache=False, inline="always")


def after_parts(before: Any, act: Any, start: int) -> Any:
    """Likewise of what adds to the parts of a window."""

    def act_in_order(
        shared: Any, tube: Any, now: Any, drawn: Array, further: Array, borders: Array, pieces: int, parts: Array
    ) -> None:
        before(shared, tube, now, drawn, further, borders, pieces, parts)
        act(shared, tube, now, drawn, start, further, borders, pieces, parts)

    return compile_function(act_in_order, cache=False, inline="always")
