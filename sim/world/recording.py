"""A world recorded for every node of a string: what nodes with clocks of their own play by the clock."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from node.kernels.layout import PERIOD
from sim.world.world import World
from telemetry.messages import ENCODER

Array = npt.NDArray[np.float64]
ROWS_A_CYCLE = 4


def record(world: World, folder: Path) -> None:
    """Write ``encoder.npy`` and ``tube-N.npy`` for every tube, in the times of their own clocks (``timed:FILE``)."""
    step = PERIOD / ROWS_A_CYCLE
    ends = world.begin + step * np.arange(1.0, (world.end - world.begin) / step)
    np.save(folder / "encoder.npy", counts(world, ends))
    for tube in range(1, world.scenario.tubes + 1):
        clock = np.array([world.local_clock(tube, end) for end in ends.tolist()])
        np.save(folder / f"tube-{tube}.npy", np.column_stack([clock, world.readings(tube, ends, step)]))


def counts(world: World, ends: Array) -> Array:
    """Rows of the encoder's counter at rig times ``ends`` (n,): time, count, last edge, 1, the edges before."""
    rows = []
    for end in ends.tolist():
        count, edge_at, rising, _, earlier = world.encoder_sample(end)
        rows.append([world.local_clock(ENCODER, end), count, edge_at, rising, *earlier])
    return np.array(rows, float)
