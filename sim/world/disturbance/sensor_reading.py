"""The one place where a reading is made: through the table, for a plain rig, a rough rig and a campaign."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from node.kernels.record.node_record import BEHIND, LATE, LATE_STD, SATURATED, SPLIT, TEMPERATURE
from node.kernels.sensors.correction import USUAL
from node.process.drivers.fifo_window import OFF
from sim.kernel import kernel, shared_body
from sim.world.disturbance.chain import chain_forms, count_drawn
from sim.world.disturbance.disturbance_table import TABLE
from sim.world.disturbance.eighths import borders_of, rates_of_eighths
from sim.world.disturbance.fifo import (
    clipped_by_cycle,
    frames_of,
    mean_between,
    means_of,
    read_fifo,
    stamps_of,
)
from sim.world.disturbance.frame_layout import FINER
from sim.world.disturbance.gyroscope import GYROSCOPE
from sim.world.disturbance.lanes import UNIFORM
from sim.world.disturbance.row import ActsOn, Array, Constants, CycleNow, Flags, ImuSamples, OneImu, TubeMotion
from sim.world.disturbance.warm_up import warm_fraction
from sim.world.disturbance.window import add_shaking, cut_window, set_felt, shaking_span, shown_of, sum_until

DRAWN: Final = count_drawn(TABLE)  # numbers of a node and cycle
LOSS: Final = DRAWN - UNIFORM  # place of the one that decides whether a hop loses an aiding
FEEL, READ, PART = (chain_forms(TABLE, form) for form in ("felt", "read", "parts"))  # kernels of all rows, in order


@dataclass(frozen=True, slots=True)
class Cycles:
    """Readings of one IMU: (cycles, 6) rad/s and m/s^2, (cycles,) C, bits, s that their windows were late by, its std.

    ``parts`` (cycles, 9) rad/s are as a driver tells them, see ``node.process.drivers.fifo_window``; NaN or None if
    not told.
    """

    readings: Array
    temperature: Array
    clipped: Flags
    late: Array
    late_std: Array
    parts: Array | None


def constants_of(imu: OneImu) -> Constants:
    """What the rows of the table draw once for an IMU, by their names."""
    return {row.name: None if row.draw is None else row.draw(imu) for row in TABLE}


def apply_rows(acts_on: ActsOn, samples: ImuSamples | TubeMotion, imu: OneImu, drawn: Constants) -> None:
    """Have every row of the table that acts there act, in its order."""
    for row in TABLE:
        if row.acts_on is acts_on and row.act is not None:
            row.act(samples, imu, drawn[row.name])


def disturb_samples(samples: ImuSamples, imu: OneImu, drawn: Constants) -> Array:
    """Samples (n, 6) of the sensor, with all its errors."""
    samples.felt_force = samples.force
    apply_rows(ActsOn.SAMPLES, samples, imu, drawn)
    return np.concatenate([samples.rate, samples.force], axis=1)


def read_means(samples: ImuSamples, imu: OneImu) -> Array:
    """Readings (n, 6) of a plain world: of what a perfect sensor in the axis of the tube reads as ``samples``."""
    drawn = constants_of(imu)
    apply_rows(ActsOn.FELT, samples, imu, drawn)
    return disturb_samples(samples, imu, drawn)


def read_grid(signal: ImuSamples, imu: OneImu) -> Cycles:
    """Readings of a rough world: of what a perfect sensor in the axis of the tube reads on the grid as ``signal``."""
    drawn, ends, sensor = constants_of(imu), signal.ends, imu.rough.sensor
    apply_rows(ActsOn.FELT, signal, imu, drawn)
    apply_rows(ActsOn.GRID, signal, imu, drawn)
    temperature = USUAL + sensor.warm_up_c * warm_fraction(imu, ends)
    hidden = clipped_by_cycle(signal)
    if sensor.frames_hz > 0.0:
        frames = frames_of(signal, imu)
        disturb_samples(frames, imu, drawn)
        found = read_fifo(frames, imu)
        return Cycles(found.readings, temperature, found.clipped | hidden, found.late, found.late_std, found.parts)
    stamps = stamps_of(imu, ends)
    readings = disturb_samples(means_of(signal, stamps), imu, drawn)
    parts = grid_eighths(signal, readings[:, 2], stamps, imu, drawn) if imu.file.gyroscope.increments else None
    return Cycles(readings, temperature, hidden, np.full(len(ends), sensor.delay), np.zeros(len(ends)), parts)


def grid_eighths(signal: ImuSamples, mean: Array, stamps: Array, imu: OneImu, drawn: Constants) -> Array:
    """What each eighth between two time stamps shows, of the ``signal`` on the grid: (m, 9) rad/s."""
    borders = stamps[:-1, None] + np.diff(stamps)[:, None] * (np.arange(PARTS) / PARTS)
    borders = np.append(borders.ravel(), stamps[-1])
    turned = (mean_between(signal.t, signal.rate[:, 2], borders) * np.diff(borders)).reshape(-1, PARTS)
    turned *= (PERIOD / np.diff(stamps))[:, None]
    return rates_of_eighths(mean, float(drawn[GYROSCOPE.name].matrix[2, 2]) * turned, imu)


def read_eighths(mean: Array, ends: Array, imu: OneImu, truth: Any, frame: Array) -> Array:
    """What each eighth of the cycles that end at ``ends`` (n,) shows in a plain world, (n, 9) rad/s.

    Parameters
    ----------
    mean : (n,) rad/s, readings of the cycles
    truth : perfect sensor of the tube
    frame : (3, 3) of the IMU in its tube
    """
    shown = float((constants_of(imu)[GYROSCOPE.name].matrix @ frame[:, 2])[2])  # of a turn about the axis
    borders = borders_of(ends)
    turned = truth.turned(borders.ravel())[0].reshape(borders.shape)
    return rates_of_eighths(mean, shown * np.diff(turned, axis=1), imu)


def move_tube(motion: TubeMotion, imu: OneImu) -> Array:
    """Angle (n,) rad of a tube that is disturbed in its motion."""
    apply_rows(ActsOn.MOTION, motion, imu, constants_of(imu))
    return motion.angle


def show_disc(motion: TubeMotion, head: OneImu) -> Array:
    """Angle (n,) rad that the encoder's disc shows, of what it turns by; ``head`` is of tube 0."""
    for row in TABLE:
        if row.acts_on is ActsOn.DISC and row.act is not None:
            row.act(motion, head, None if row.draw is None else row.draw(head))
    return motion.angle


@kernel
def read_sensors(
    shared: Any,
    tube: Any,
    is_first: bool,
    rates: Array,
    forces: Array,
    circle: Array,
    shaken: Array,
    drawn: Array,
    reading: Array,
    end: float,
    cycle: int,
    k: int,
) -> None:
    """Fill ``reading`` (1, READING) of tube ``k`` of a plain world in a cycle that ends at ``end`` (s).

    Parameters
    ----------
    shared, tube : of dtype ``SHARED`` and ``TUBE`` of ``sim.world.disturbance.records``
    is_first : what wanders begins anew
    rates, forces, circle, shaken : see ``sim.string.reading_suppliers.FeltTruth``
    drawn : see ``sim.world.disturbance.lanes``
    """
    c, s = tube.cos, tube.sin
    rate, force, row = rates[cycle, k], forces[cycle, k], reading[0]
    row[0], row[1], row[2] = c * rate[0] + s * rate[1], c * rate[1] - s * rate[0], rate[2]
    row[3] = c * force[0] + s * force[1] + circle[cycle, 0]
    row[4] = c * force[1] - s * force[0] + circle[cycle, 1]
    row[5] = force[2]
    felt_rate, felt_force = (row[0], row[1], row[2]), (row[3], row[4], row[5])
    now = CycleNow(end, is_first, shaken[cycle], felt_rate, felt_force, 1, PERIOD, 1.0, True, 0.0, 0.0)
    read_felt(shared, tube, now, drawn, row, 0.0)


@kernel
def read_frames(
    shared: Any,
    tube: Any,
    is_first: bool,
    field: Any,
    drawn: Array,
    reading: Array,
    end: float,
    cycle: int,
    k: int,
) -> None:
    """Fill ``reading`` (1, READING) of tube ``k`` of a rough world in a cycle that ends at ``end`` (s).

    The driver tells the mean of the frames that it finds, and what its window shows of the cycle before and of the
    eighths of its own, as ``node.process.drivers.fifo_window`` makes it of frames; here it is made of sums over frames.

    Parameters
    ----------
    shared, tube, is_first, drawn : see ``read_sensors``
    field : ``sim.world.disturbance.frame_sums.FrameField``, with what ``draw_further`` has left in its desk
    """
    front, fifo, row, desk = field.front_end[0], field.fifos[k], reading[0], field.desk
    place, borders, parts, moved, torsional = fifo.place, desk.borders, desk.noise, field.moved, field.torsional
    first = fifo.frame + field.times.cuts[place, cycle]
    found = field.times.cuts[place, cycle + 1] - field.times.cuts[place, cycle]
    late = field.times.late[place, cycle] + front.delay
    pieces = cut_window(borders, first, found, late, field.times.frame[place, cycle], cycle > 0)
    shaken_from, shaken_to = shaking_span(field, fifo, cycle)
    sums, felt = field.sums[field.kinds[k]], desk.felt
    sum_until(felt, sums, moved, torsional, fifo, borders[pieces], shaken_from, shaken_to)
    sum_until(desk.before, sums, moved, torsional, fifo, borders[0], shaken_from, shaken_to)
    last, before = shown_of(tube.shows, felt), shown_of(tube.shows, desk.before)
    set_felt(row, tube, desk.before, felt, found)
    add_shaking(row, field.shaken, fifo, first, found, shaken_from, shaken_to)
    since = front.frame * ((fifo.row + fifo.share) / FINER + first + 0.5 * (found - 1))
    felt_rate, felt_force = (row[0], row[1], row[2]), (row[3], row[4], row[5])
    share, age = 1.0 / math.sqrt(float(found)), end - front.first
    now = CycleNow(end, is_first, 0.0, felt_rate, felt_force, found, front.frame, share, False, since, age)
    parts[:] = 0.0
    PART(shared, tube, now, drawn, desk.drawn, borders, pieces, parts)
    apart = 0.0
    for piece in range(pieces):
        apart += parts[piece]
    read_felt(shared, tube, now, drawn, row, apart / found)
    even = row[2] - (last - before + apart) / found  # beside what is summed over frames, the same in every part
    for piece in range(pieces):
        after = last
        if piece < pieces - 1:
            sum_until(felt, sums, moved, torsional, fifo, borders[piece + 1], shaken_from, shaken_to)
            after = shown_of(tube.shows, felt)
        length = borders[piece + 1] - borders[piece]
        row[BEHIND + piece] = (after - before + parts[piece]) / length + even if length > 0.0 else 0.0
        before = after
    row[LATE] = late
    row[LATE_STD] = math.hypot(field.times.late_std[place, cycle], OFF * front.delay)
    row[SPLIT] = 1.0 if pieces > 1 else 0.0


@shared_body
def read_felt(shared: Any, tube: Any, now: Any, drawn: Array, row: Array, apart: float) -> None:
    """Turn the rates and forces of a ``row`` (READING,) from what is felt into what is read.

    ``apart`` (rad/s) is what comes to the mean about z by the parts of a window.
    """
    FEEL(shared, tube, now, drawn, row)
    x, y, z, u, v, w = row[0], row[1], row[2], row[3], row[4], row[5]
    for i in range(3):
        row[i] = tube.gains[i, 0] * x + tube.gains[i, 1] * y + tube.gains[i, 2] * z
        row[i] += tube.gains[i, 3] * u + tube.gains[i, 4] * v + tube.gains[i, 5] * w
        row[3 + i] = tube.force_gains[i, 0] * u + tube.force_gains[i, 1] * v + tube.force_gains[i, 2] * w
    row[2] += apart
    row[TEMPERATURE], row[SATURATED] = USUAL, 0.0
    READ(shared, tube, now, drawn, row)
