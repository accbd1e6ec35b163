"""What a tube of a rough world reads in a cycle of a campaign: the mean of the frames that its driver finds.

The driver also tells what its window shows of the cycle before and of the eighths of its own, as
``node.process.drivers.fifo_window`` makes it of frames; here it is made of sums over frames.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import PERIOD, Array
from node.kernels.arithmetic.jit import kernel
from node.kernels.record.filter_record import PARTS
from node.kernels.record.node_record import BEHIND, LATE, LATE_STD, SATURATED, SPLIT, TEMPERATURE
from node.kernels.sensors.correction import USUAL
from node.process.drivers.fifo_window import LEAST
from sim.campaign.field import FELT, FINER, MOVED, SAME, SUMS
from sim.campaign.philox import normals, uniforms
from sim.campaign.sensors import cross_hop, wander_on

CIRCLE, SLACK_RATE, SLACK_ANGLE, TORSIONAL = FELT, FELT + 2, FELT + 3, FELT + MOVED


@kernel
def draw_parts(counter: Array, key: Array, words: Array, drawn: Array, cycle: int, k: int) -> None:
    """Fill ``drawn`` (2 PARTS,) for a tube and a cycle with standard normal numbers, see ``set_noise``."""
    counter[0], counter[1], counter[2] = np.uint64(cycle), np.uint64(k), np.uint64(1)
    uniforms(counter, key, words, drawn)
    normals(drawn)


@kernel
def read_frames(
    noise: Any,
    tube: Any,
    is_first: bool,
    above: float,
    field: Any,
    drawn: Array,
    reading: Array,
    end: float,
    cycle: int,
    k: int,
) -> None:
    """Fill ``reading`` (1, READING) of tube ``k`` in a cycle that ends at ``end`` (s), and the tube's hop.

    Parameters
    ----------
    noise, tube, is_first, above, drawn : see ``sim.campaign.sensors.read_sensors``
    field : ``sim.campaign.field.Field``, with what ``draw_parts`` has left in its desk
    """
    front, fifo, row, desk = field.front_end[0], field.fifos[k], reading[0], field.desk
    borders, same, noise_z = desk.borders, desk.same, desk.noise
    place = fifo.place
    first = fifo.frame + field.times.cuts[place, cycle]
    found = field.times.cuts[place, cycle + 1] - field.times.cuts[place, cycle]
    late = field.times.late[place, cycle] + front.delay
    pieces = cut_window(borders, first, found, late, field.times.frame[place, cycle], cycle > 0)
    since = front.frame * (fifo.row + fifo.share) / FINER  # of frame 0, from that of phase 0
    begin, stop = field.driven[cycle, 0] - front.first - since, field.driven[cycle, 1] - front.first - since
    shaken_from, shaken_to = math.ceil(begin / front.frame), math.ceil(stop / front.frame)
    wander_on(noise, tube, is_first, drawn)
    set_same(same, noise, tube, front, fifo, field.shaken, drawn, first, found, shaken_from, shaken_to)
    middle = first + 0.5 * (found - 1)
    cold = math.exp(-(since + front.frame * middle) / front.warm_up_s)
    drift, drift_on = front.warm_up * (1.0 - cold), front.warm_up * cold * front.frame / front.warm_up_s
    set_noise(noise_z, borders, pieces, front.rate[2], drawn[2], desk.drawn)
    kind, felt, shows = field.sums[field.kinds[k]], desk.felt, desk.shows
    drifts = set_shows(shows, noise, tube, fifo)
    sum_until(felt, kind, field.moved, field.torsional, fifo, borders[pieces], shaken_from, shaken_to)
    last = shown_of(shows, felt)
    sum_until(desk.before, kind, field.moved, field.torsional, fifo, borders[0], shaken_from, shaken_to)
    before = shown_of(shows, desk.before)
    slack = set_means(row, noise, tube, fifo, desk.before, felt, drift, found)
    row[3], row[4] = row[3] + slack * row[4], row[4] - slack * row[3]
    for piece in range(pieces):
        after = last
        if piece < pieces - 1:
            sum_until(felt, kind, field.moved, field.torsional, fifo, borders[piece + 1], shaken_from, shaken_to)
            after = shown_of(shows, felt)
        length = borders[piece + 1] - borders[piece]
        centre = 0.5 * (borders[piece + 1] + borders[piece] - 1.0)
        drifted = drifts * (drift + drift_on * (centre - middle)) * length
        row[2] += noise_z[piece] / found
        row[BEHIND + piece] = (after - before + drifted + noise_z[piece]) / length + same[2] if length > 0.0 else 0.0
        before = after
    for i in range(SAME):
        row[i] += same[i]
    for i in range(3):
        row[i] = min(max(row[i], -noise.limit), noise.limit)
    warm = 1.0 - math.exp(-(end - front.first) / front.warm_up_s)
    row[TEMPERATURE], row[SATURATED] = USUAL + front.warm_up_c * warm, 0.0
    row[LATE], row[LATE_STD] = late, field.times.late_std[place, cycle]
    row[SPLIT] = 1.0 if pieces > 1 else 0.0
    cross_hop(noise, tube, is_first, above, drawn)


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
def set_noise(noise: Array, borders: Array, pieces: int, size: float, first: float, drawn: Array) -> None:
    """Set the noise (PARTS + 1,) of the parts of a window, a sum over frames of ``size`` each.

    A frame that a border divides gives either part its share of one noise.

    Parameters
    ----------
    borders, pieces : see ``cut_window``
    first, drawn : normal, of the whole frames of the first part and of the others, then of the frames that are divided
    """
    left, begin = 0.0, math.floor(borders[0])
    for piece in range(pieces):
        end = math.floor(borders[piece + 1])
        of_whole = first if piece == 0 else drawn[piece - 1]
        noise[piece] = left + size * math.sqrt(float(max(end - begin, 0))) * of_whole
        if piece < pieces - 1:
            share, divided = borders[piece + 1] - end, size * drawn[PARTS + piece]
            noise[piece] += share * divided
            left, begin = (1.0 - share) * divided, end + 1


@kernel
def set_same(
    same: Array,
    noise: Any,
    tube: Any,
    front: Any,
    fifo: Any,
    shaken: Array,
    drawn: Array,
    first: int,
    found: int,
    shaken_from: int,
    shaken_to: int,
) -> None:
    """Set what the mean of a window has beside its frames of a perfect sensor, (SAME,) rad/s and m/s^2.

    That is biases, noise but that of the z gyroscope, and the vibration of the forces with what it pulls the
    gyroscopes by, evenly over the window: with 0.5 g and 0.02 deg/s/g a twentieth of the noise of a frame.
    """
    low = min(max(first, shaken_from), shaken_to)
    high = min(max(first + found, shaken_from), shaken_to)
    share = 1.0 / math.sqrt(float(found))
    for i in range(3):
        same[3 + i] = (shaken[fifo.shaken[i] + high] - shaken[fifo.shaken[i] + low]) / found
    for i in range(3):
        same[i] = tube.rate_bias[i] + tube.wander[i] + noise.pull * same[3 + i]
        for j in range(3):
            pulled = fifo.pull[j, 0] * same[3] + fifo.pull[j, 1] * same[4] + fifo.pull[j, 2] * same[5]
            same[i] += tube.spread[i, j] * pulled
    for i in range(3):
        same[3 + i] += tube.force_bias[i] + front.force * share * drawn[6 + i]
    same[0] += front.rate[0] * share * drawn[0]
    same[1] += front.rate[1] * share * drawn[1]


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
def set_shows(shows: Array, noise: Any, tube: Any, fifo: Any) -> float:
    """Set what the z gyroscope shows of each sum (SUMS,), and return what it shows of a drift of all three."""
    c, s, spread = tube.cos, tube.sin, tube.spread
    by_force = (
        spread[2, 0] * fifo.pull[0, 0] + spread[2, 1] * fifo.pull[1, 0] + spread[2, 2] * fifo.pull[2, 0],
        spread[2, 0] * fifo.pull[0, 1] + spread[2, 1] * fifo.pull[1, 1] + spread[2, 2] * fifo.pull[2, 1],
        spread[2, 0] * fifo.pull[0, 2] + spread[2, 1] * fifo.pull[1, 2] + spread[2, 2] * fifo.pull[2, 2] + noise.pull,
    )
    shows[0], shows[1] = c * spread[2, 0] - s * spread[2, 1], s * spread[2, 0] + c * spread[2, 1]
    shows[2] = shows[SLACK_RATE] = shows[TORSIONAL] = spread[2, 2]
    shows[3], shows[4], shows[5] = c * by_force[0] - s * by_force[1], s * by_force[0] + c * by_force[1], by_force[2]
    shows[CIRCLE], shows[CIRCLE + 1], shows[SLACK_ANGLE] = by_force[0], by_force[1], 0.0
    return float(spread[2, 0] + spread[2, 1] + spread[2, 2])


@kernel
def shown_of(shows: Array, felt: Array) -> float:
    """What the z gyroscope shows of sums (SUMS,), rad/s."""
    shown = 0.0
    for j in range(SUMS):
        shown += shows[j] * felt[j]
    return shown


@kernel
def set_means(
    row: Array, noise: Any, tube: Any, fifo: Any, before: Array, after: Array, drift: float, found: int
) -> float:
    """Set ``row`` (SAME,) to the mean of the ``found`` frames between two sums; returns that of the slack, rad.

    ``drift`` (rad/s) is that of each gyroscope, as a mean over these frames.
    """
    c, s = tube.cos, tube.sin
    x, y = after[0] - before[0], after[1] - before[1]
    z = after[2] - before[2] + after[SLACK_RATE] - before[SLACK_RATE] + after[TORSIONAL] - before[TORSIONAL]
    across, along = after[3] - before[3], after[4] - before[4]
    force = (
        (c * across + s * along + after[CIRCLE] - before[CIRCLE]) / found,
        (c * along - s * across + after[CIRCLE + 1] - before[CIRCLE + 1]) / found,
        (after[5] - before[5]) / found,
    )
    rate = ((c * x + s * y) / found, (c * y - s * x) / found, z / found)
    for i in range(3):
        row[i], row[3 + i] = noise.pull * force[i], force[i]
        for j in range(3):
            pulled = fifo.pull[j, 0] * force[0] + fifo.pull[j, 1] * force[1] + fifo.pull[j, 2] * force[2]
            row[i] += tube.spread[i, j] * (rate[j] + pulled + drift)
    return float(after[SLACK_ANGLE] - before[SLACK_ANGLE]) / found
