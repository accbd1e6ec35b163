"""The window of a read in a campaign: which frames it has, how they part into eighths, and sums over them."""

from __future__ import annotations

import math
from typing import Any

from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.record.filter_record import PARTS
from node.process.drivers.fifo_window import LEAST
from sim.kernel import kernel
from sim.world.disturbance.frame_layout import CIRCLE, FELT, FINER, MOVED, SLACK_ANGLE, SLACK_RATE, SUMS, TORSIONAL


@kernel
def cut_window(borders: Array, first: int, found: int, late: float, frame: float, is_told: bool) -> int:
    """Set the ``borders`` (PARTS + 2,) of the parts of a window, counted in frames, and return how many parts it has.

    Its ``found`` frames from ``first`` on end ``late`` s before the cycle and are ``frame`` s long, all as its driver
    takes them; a window that does not reach over its cycle is one part.
    """
    before = found * frame + late - PERIOD  # s, that it begins before the cycle
    borders[0], borders[1] = float(first), float(first + found)
    if not (is_told and found >= LEAST and before >= 0.0 and 0.0 <= late < PERIOD / PARTS):
        return 1
    for part in range(PARTS):
        borders[part + 1] = first + (before + PERIOD * part / PARTS) / frame
    borders[PARTS + 1] = float(first + found)
    return PARTS + 1


@kernel
def sum_until(
    kept: Array,
    sums: Array,
    moved: Array,
    torsional: Array,
    fifo: Any,
    frame: float,
    shaken_from: int,
    shaken_to: int,
) -> None:
    """Set the sums (SUMS,) over all frames of a tube before one, a part of which counts as such."""
    whole = math.floor(frame)
    part, share = frame - whole, fifo.share
    row = FINER * whole + fifo.row
    a, b, c, d = (1.0 - part) * (1.0 - share), (1.0 - part) * share, part * (1.0 - share), part * share
    for j in range(FELT):
        kept[j] = a * sums[row, j] + b * sums[row + 1, j] + c * sums[row + FINER, j] + d * sums[row + FINER + 1, j]
    for j in range(MOVED):
        kept[FELT + j] = (
            a * moved[row, j] + b * moved[row + 1, j] + c * moved[row + FINER, j] + d * moved[row + FINER + 1, j]
        )
    within = min(max(frame, float(shaken_from)), float(shaken_to))
    whole = math.floor(within)
    part, at = within - whole, fifo.torsional + whole
    kept[TORSIONAL] = (1.0 - part) * torsional[at] + part * torsional[at + 1]


@kernel
def shown_of(shows: Array, felt: Array) -> float:
    """What the z gyroscope shows of sums (SUMS,), rad/s."""
    shown = 0.0
    for j in range(SUMS):
        shown += shows[j] * felt[j]
    return shown


@kernel
def shaking_span(field: Any, fifo: Any, cycle: int) -> tuple[int, int]:
    """Frames of a tube from the first to the last of which vibration passes in a cycle."""
    front = field.front_end[0]
    since = front.frame * (fifo.row + fifo.share) / FINER  # of frame 0, from that of phase 0
    begin, stop = field.driven[cycle, 0] - front.first - since, field.driven[cycle, 1] - front.first - since
    return math.ceil(begin / front.frame), math.ceil(stop / front.frame)


@kernel
def set_felt(row: Array, tube: Any, before: Array, after: Array, found: int) -> None:
    """Set what is felt in a window, (6,) rad/s and m/s^2, to the mean of the ``found`` frames between two sums."""
    c, s = tube.cos, tube.sin
    x, y = after[0] - before[0], after[1] - before[1]
    z = after[2] - before[2] + after[SLACK_RATE] - before[SLACK_RATE] + after[TORSIONAL] - before[TORSIONAL]
    across, along = after[3] - before[3], after[4] - before[4]
    row[0], row[1], row[2] = (c * x + s * y) / found, (c * y - s * x) / found, z / found
    row[3] = (c * across + s * along + after[CIRCLE] - before[CIRCLE]) / found
    row[4] = (c * along - s * across + after[CIRCLE + 1] - before[CIRCLE + 1]) / found
    row[5] = (after[5] - before[5]) / found
    slack = (after[SLACK_ANGLE] - before[SLACK_ANGLE]) / found
    row[3], row[4] = row[3] + slack * row[4], row[4] - slack * row[3]


@kernel
def add_shaking(row: Array, shaken: Array, fifo: Any, first: int, found: int, shaken_from: int, shaken_to: int) -> None:
    """Add the vibration of the forces, evenly over the window: at 0.5 g a twentieth of the noise of a frame."""
    low = min(max(first, shaken_from), shaken_to)
    high = min(max(first + found, shaken_from), shaken_to)
    for i in range(3):
        row[3 + i] += (shaken[fifo.shaken[i] + high] - shaken[fifo.shaken[i] + low]) / found
