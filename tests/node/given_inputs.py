"""What the nodes of a rig were given, once more through the compiled functions that a campaign calls."""

from __future__ import annotations

from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.step.node_step import SAY_EVENTS

CYCLE, HEARD = 0, 1
GIVEN: Final = np.dtype(
    [
        ("kind", "i8"),  # CYCLE or HEARD
        ("place", "i8"),  # of the node, from 0
        ("answer", "i8"),  # what the step or the aiding returned
    ],
    align=True,
)


@kernel
def count_other_answers(
    step: Any,
    aid: Any,
    nodes: Array,
    settings: Array,
    corrections: Array,
    given: Array,
    readings: Array,
    moments: Array,
    aidings: Array,
) -> int:
    """Give every node what it was given, in the order of it; returns how many answers were others than in ``given``.

    Parameters
    ----------
    step, aid : ``node_step`` and ``node_aiding``, see ``node.kernels.step.address``
    nodes, settings : (tubes,) of dtype ``NODE``, as they were at first, and ``SETTINGS``
    corrections : (tubes, 2) of dtype ``PARAMETERS``
    given : (n,) of dtype ``GIVEN``
    readings, moments, aidings : (n, 1, READING), (n, MOMENT), (n, AIDING) of a cycle, and of what was heard
    """
    others = 0
    for n in range(given.shape[0]):
        row = given[n]
        k = row.place
        one = slice(k, k + 1)
        if row.kind == CYCLE:
            answer = step(nodes[one], settings[one], corrections[k], readings[n], moments[n])
            if answer & SAY_EVENTS:  # its firmware takes them out at once
                nodes[k].events.said = nodes[k].events.told
        else:
            answer = aid(nodes[one], settings[one], aidings[n])
        if answer != row.answer:
            others += 1
    return others
