"""The one place where a reading is made: through the table, for a plain rig, a rough rig and a campaign."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from node.kernels.sensors.correction import USUAL
from sim.world.disturbance.eighths import borders_of, eighths
from sim.world.disturbance.fifo import (
    clipped_by_cycle,
    frames_of,
    mean_between,
    means_of,
    read_fifo,
    stamps_of,
)
from sim.world.disturbance.gyroscope import GYROSCOPE
from sim.world.disturbance.row import ActsOn, Array, Constants, Flags, ImuSamples, OneImu, TubeMotion
from sim.world.disturbance.table import TABLE, Disturbance
from sim.world.disturbance.warm_up import warmth


@dataclass(frozen=True, slots=True)
class Cycles:
    """Readings of one IMU: (cycles, 6) rad/s and m/s^2, (cycles,) C, bits, s that their windows were late by, its std.

    ``parts`` (cycles, 9) rad/s are as a driver tells them, see ``node.process.drivers.parts``; NaN or None if not told.
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


def disturb(acts_on: ActsOn, samples: ImuSamples | TubeMotion, imu: OneImu, drawn: Constants) -> None:
    """Have every row of the table that acts there act, in its order."""
    for row in TABLE:
        if row.acts_on is acts_on and row.act is not None:
            row.act(samples, imu, drawn[row.name])


def disturb_samples(samples: ImuSamples, imu: OneImu, drawn: Constants) -> Array:
    """Samples (n, 6) of the sensor, with all its errors."""
    samples.felt_force = samples.force
    disturb(ActsOn.SAMPLES, samples, imu, drawn)
    return np.concatenate([samples.rate, samples.force], axis=1)


def read_means(samples: ImuSamples, imu: OneImu) -> Array:
    """Readings (n, 6) of a plain world: of what a perfect sensor in the axis of the tube reads as ``samples``."""
    drawn = constants_of(imu)
    disturb(ActsOn.FELT, samples, imu, drawn)
    return disturb_samples(samples, imu, drawn)


def read_grid(signal: ImuSamples, imu: OneImu) -> Cycles:
    """Readings of a rough world: of what a perfect sensor in the axis of the tube reads on the grid as ``signal``."""
    drawn, ends, sensor = constants_of(imu), signal.ends, imu.rough.sensor
    disturb(ActsOn.FELT, signal, imu, drawn)
    disturb(ActsOn.GRID, signal, imu, drawn)
    temperature = USUAL + sensor.warm_up_c * warmth(imu, ends)
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
    return eighths(mean, float(drawn[GYROSCOPE.name].matrix[2, 2]) * turned, imu)


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
    return eighths(mean, shown * np.diff(turned, axis=1), imu)


def move_tube(motion: TubeMotion, imu: OneImu) -> Array:
    """Angle (n,) rad of a tube that is disturbed in its motion."""
    disturb(ActsOn.MOTION, motion, imu, constants_of(imu))
    return motion.angle


def rows_with(key: str) -> list[Disturbance]:
    """Rows of the table that own a key of a scenario."""
    return [row for row in TABLE if row.owns(key)]
