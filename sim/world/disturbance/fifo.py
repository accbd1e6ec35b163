"""How a sensor's samples become the reading of a cycle: the frames of its FIFO, its crystal, jitter, the eighths.

What has passed the filter is taken at the frames of the sensor's own crystal, and a cycle's reading is the mean of the
frames that a read finds in the FIFO, as a driver makes it. A sensor without a FIFO gives the exact mean of every cycle.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from node.process.drivers.fifo_window import parts_of, window_std
from node.process.drivers.frame_clock import FrameClock
from sim.world.disturbance.converter import AT_RANGE, FORCE_CLIPPED, GYRO_CLIPPED
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, Flags, ImuSamples, Mask, OneImu
from sim.world.random_streams import RandomStream
from sim.world.scenario_file import ScenarioFile


@dataclass(frozen=True, slots=True)
class FifoReads:
    """What the reads of a FIFO find, cycle by cycle.

    Attributes
    ----------
    readings : (cycles, 6) rad/s and m/s^2
    clipped : (cycles,) bits
    late, late_std : (cycles,) s, by which windows end before their cycles by the filter and the FIFO
    parts : (cycles, 9) rad/s, see ``node.process.drivers.fifo_window``; NaN where none is told
    """

    readings: Array
    clipped: Flags
    late: Array
    late_std: Array
    parts: Array


def frame_times(imu: OneImu, t: Array) -> Array:
    """Rig times (n,) of the frames of an IMU on the grid ``t``, s."""
    sensor = imu.rough.sensor
    step = 1.0 / (sensor.frames_hz * (1.0 + sensor.crystal))
    first = float(t[0]) + step * float(imu.random(RandomStream.ROUGH_FRAMES).random())
    return np.arange(first, float(t[-1]), step)


def frames_of(signal: ImuSamples, imu: OneImu) -> ImuSamples:
    """Frames of the ``signal`` on the grid, still without the errors of the sensor."""
    times = frame_times(imu, signal.t)
    taken = np.stack([np.interp(times, signal.t, c) for c in (*signal.rate.T, *signal.force.T)], axis=1)
    return ImuSamples(
        times,
        taken[:, :3],
        taken[:, 3:],
        np.zeros(len(times)),
        signal.truth,
        signal.ends,
        period=1.0 / imu.rough.sensor.frames_hz,
        is_frame=True,
    )


def means_of(signal: ImuSamples, stamps: Array) -> ImuSamples:
    """Means of the ``signal`` on the grid from each of the ``stamps`` (cycles + 1,) s to the next."""
    mean = np.stack([mean_between(signal.t, c, stamps) for c in (*signal.rate.T, *signal.force.T)], axis=1)
    ends = signal.ends
    return ImuSamples(ends, mean[:, :3], mean[:, 3:], np.zeros(len(ends)), signal.truth, ends)


def mean_between(t: Array, values: Array, stamps: Array) -> Array:
    """Mean (m,) of the ``values`` (n,) on the grid ``t``, linear between its samples, from each stamp to the next."""
    step = float(t[1] - t[0])
    integral = np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])
    at = np.interp(stamps, t, integral)
    return np.asarray(np.diff(at) / np.diff(stamps))


def stamps_of(imu: OneImu, ends: Array) -> Array:
    """When each reading was really taken (m + 1,), s: the node believes the begin and the ``ends`` of cycles."""
    sensor = imu.rough.sensor
    jitter = 1e-3 * sensor.jitter_ms
    stamps = np.concatenate([[ends[0] - PERIOD], ends])
    stamps += np.where(stamps > imu.file.schedule.begin_s + sensor.stamp_step_s, 1e-3 * sensor.stamp_step_ms, 0.0)
    if jitter == 0.0:
        return stamps
    return np.asarray(stamps + jitter * imu.random(RandomStream.ROUGH_JITTER).standard_normal(len(stamps)))


def read_fifo(frames: ImuSamples, imu: OneImu) -> FifoReads:
    """Mean of the frames that each read finds, bits of the cycles of which one stood at the range, and lateness.

    The last is what a driver makes of the frames it counts, and so are the parts of the window.
    """
    sensor, ends, count = imu.rough.sensor, frames.ends, len(frames.ends)
    cuts = np.searchsorted(frames.t, stamps_of(imu, ends))
    rows = np.concatenate([frames.rate, frames.force], axis=1)
    sums = np.concatenate([np.zeros((1, 6)), np.cumsum(rows, axis=0)])
    mean = (sums[cuts[1:]] - sums[cuts[:-1]]) / np.maximum(np.diff(cuts), 1)[:, None]
    limit = AT_RANGE * math.radians(imu.file.gyroscope.range_dps)
    at_range = np.any(np.abs(frames.rate) >= limit, axis=1)
    clock, late, std = FrameClock(sensor.frames_hz), np.zeros(count), np.zeros(count)
    parts = np.full((count, PARTS + 1), np.nan)
    for k, (end, found) in enumerate(zip(ends.tolist(), np.diff(cuts).tolist(), strict=True)):
        clock.on_read(end, found)
        late[k], std[k] = end - clock.end, window_std(clock.std, sensor.delay)
        window = (clock.end - sensor.delay - found * clock.period, clock.end - sensor.delay)
        if k > 0 and (told := parts_of(frames.rate[cuts[k] : cuts[k + 1], 2], window, end - PERIOD, end)):
            parts[k] = told
    return FifoReads(mean, GYRO_CLIPPED * any_between(at_range, cuts), late + sensor.delay, std, parts)


def any_between(flags: Mask, cuts: Flags) -> Flags:
    """1 where any of the ``flags`` (n,) is set from one cut (m + 1,) to the next, (m,)."""
    sums = np.concatenate([[0], np.cumsum(flags)])
    return np.asarray(sums[cuts[1:]] > sums[cuts[:-1]], np.int64)


def clipped_by_cycle(signal: ImuSamples) -> Flags:
    """Bits (cycles,) of the samples of the grid in every cycle together."""
    cuts = np.searchsorted(signal.t, np.concatenate([[signal.ends[0] - PERIOD], signal.ends]))
    found = [bit * any_between((signal.clipped & bit) > 0, cuts) for bit in (GYRO_CLIPPED, FORCE_CLIPPED)]
    return np.asarray(found[0] | found[1])


def needs_frames(file: ScenarioFile) -> dict[str, bool]:
    """A campaign reads frames; jitter makes every window another one, which its driver's clock then follows."""
    sensor = None if file.rough is None else file.rough.sensor
    return {"rough.sensor.frames_hz = 0": sensor is not None and sensor.frames_hz == 0.0}


FRAMES = Disturbance(
    "frames",
    ("rough.sensor.frames_hz", "rough.sensor.crystal"),
    ActsOn.TAKING,
    compiled=Compiled(),
    beyond=needs_frames,
)
JITTER = Disturbance(
    "jitter",
    ("rough.sensor.jitter_ms", "rough.sensor.stamp_step_ms", "rough.sensor.stamp_step_s"),
    ActsOn.TAKING,
)
