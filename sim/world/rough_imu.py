"""An IMU in the field: vibration, clipping, the sensor's filter and FIFO, its crystal, its warming up.

On the grid of the motion the forces vibrate and either sensor clips where its converter does. What has passed the
sensor's filter is taken at the frames of its own crystal, each with its noise, and a cycle's reading is the mean of the
frames that a read finds in the FIFO, as a driver makes it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from node.kernels.sensors.correction import USUAL
from node.process.drivers.fifo_window import parts_of
from node.process.drivers.frame_clock import FrameClock
from sim.world.imu_errors import ImuErrors
from sim.world.increments import eighths
from sim.world.rough_section import RoughSection, RoughSensorSection, RoughVibrationSection
from sim.world.streams import Stream, stream

Array = npt.NDArray[np.float64]
Flags = npt.NDArray[np.int64]
G = 9.80665  # m/s^2, of a range and of a vibration
GYRO_CLIPPED, FORCE_CLIPPED = 1, 2  # bits of a cycle
AT_RANGE = 0.999  # of a range, from where a sample stands at it
FRAME_STEPS = 32768.0  # of a range


@dataclass(frozen=True, slots=True)
class Cycles:
    """Readings of one IMU: (cycles, 6) rad/s and m/s^2, (cycles,) C, bits, s that their windows were late by, its std.

    ``parts`` (cycles, 9) rad/s are as a driver tells them, see ``node.process.drivers.fifo_window``; NaN or None if not
    told.
    """

    readings: Array
    temperature: Array
    clipped: Flags
    late: Array
    late_std: Array
    parts: Array | None


def band_noise(random: np.random.Generator, count: int, rate: float, lowest: float, highest: float) -> Array:
    """Noise (count,) of rms 1 whose spectrum is flat from ``lowest`` to ``highest`` (Hz), at ``rate`` samples/s."""
    padded = 1 << (count - 1).bit_length()
    spectrum = np.fft.rfft(random.standard_normal(padded))
    hertz = np.fft.rfftfreq(padded, 1.0 / rate)
    inside = (hertz >= lowest) & (hertz <= highest)
    spectrum[~inside] = 0.0
    return np.asarray(np.fft.irfft(spectrum, padded)[:count] * math.sqrt((padded / 2.0) / max(inside.sum(), 1)))


def butterworth(low_pass: float, hertz: float) -> tuple[Array, Array]:
    """Coefficients (3,) of the numerator and denominator of a low-pass of two poles at ``low_pass`` Hz."""
    from scipy.signal import butter  # a second that only a world with a filter pays

    b, a = butter(2, min(low_pass / (0.5 * hertz), 0.99))
    return b, a


def low_passed(values: Array, low_pass: float, hertz: float) -> Array:
    """What a filter at ``low_pass`` Hz, at rest before the first, makes of ``values`` (n, m) at ``hertz`` samples/s."""
    from scipy.signal import lfilter, lfilter_zi

    b, a = butterworth(low_pass, hertz)
    before = lfilter_zi(b, a)[:, None] * values[0]
    return np.asarray(lfilter(b, a, values, axis=0, zi=before)[0])


def pull_of(sensor: RoughSensorSection, seed: int, *imu: int) -> Array:
    """What the forces do to the axes of a gyroscope (3, 3), rad/s by m/s^2."""
    drawn = stream(seed, Stream.ROUGH_PULL, *imu).standard_normal((3, 3))
    return np.asarray(math.radians(sensor.g_sensitivity_dps_per_g) / G * drawn)


def shaken_angle(section: RoughVibrationSection, seed: int, tube: int, t: Array, driven: Array) -> Array:
    """Angle (n,) rad of a tube's torsional vibration at the grid ``t`` (n,) s, while it is ``driven``."""
    if section.torsional_dps == 0.0:
        return np.zeros_like(t)
    step = float(t[1] - t[0])
    random = stream(seed, Stream.ROUGH_VIBRATION, tube, 0)
    rate = band_noise(random, len(t), 1.0 / step, section.lowest_hz, section.highest_hz)
    angle = np.cumsum(rate) * step
    return np.asarray(math.radians(section.torsional_dps) * driven * (angle - angle.mean()))


class RoughImu:
    """One IMU of one tube.

    Parameters
    ----------
    section : the scenario's
    errors : its noise, biases and scale
    seed, tube, imu : of its streams
    t : (n,) s, the grid
    driven : (n,) 1 while the head is turned
    """

    def __init__(
        self, section: RoughSection, errors: ImuErrors, seed: int, tube: int, imu: int, t: Array, driven: Array
    ) -> None:
        self._section, self._errors = section, errors
        self._key = (tube, imu) if imu else (tube,)
        self._seed, self._t, self._driven = seed, t, driven

    def cycles(self, rate: Array, force: Array, ends: Array, bias: Array) -> Cycles:
        """Readings of cycles that end at the rig times ``ends`` (m,), one after another.

        Parameters
        ----------
        rate, force : (n, 3) rad/s and m/s^2 that a perfect sensor reads on the grid
        bias : (m, 3) rad/s that comes upon the gyroscope in each cycle
        """
        sensor = self._section.sensor
        rate, force, hidden = self._converted(rate, force)
        if sensor.low_pass_hz > 0.0:
            hertz = 1.0 / float(self._t[1] - self._t[0])
            rate, force = low_passed(rate, sensor.low_pass_hz, hertz), low_passed(force, sensor.low_pass_hz, hertz)
        # the warming up and a step of the bias are slow: of each frame they are those of its time
        times = self._frame_times(sensor) if sensor.frames_hz > 0.0 else ends
        slow = np.stack([np.interp(times, ends, bias[:, k]) for k in range(3)], axis=1)
        slow = slow + math.radians(sensor.warm_up_dps) * self._warmth(times)[:, None]
        if sensor.frames_hz > 0.0:
            measured = self._frames(rate, force, times, slow)
            parts: Array | None
            mean, flags, late, std, parts = self._means(measured, times, ends)
        else:
            mean = self._exact(rate, force, ends, slow)
            flags, late, std = np.zeros(len(ends), np.int64), np.zeros(len(ends)), np.zeros(len(ends))
            parts = self._eighths(rate[:, 2], mean[:, 2], ends) if self._errors.gyroscope.increments else None
        flags |= self._by_cycle(hidden, ends)
        temperature = USUAL + sensor.warm_up_c * self._warmth(ends)
        return Cycles(mean, temperature, flags, late + sensor.delay, std, parts)

    def _warmth(self, t: Array) -> Array:
        """How far (0..1) the sensor has warmed up by rig times ``t``."""
        since = np.maximum(t - self._t[0], 0.0)
        return np.asarray(1.0 - np.exp(-since / self._section.sensor.warm_up_s))

    def _converted(self, rate: Array, force: Array) -> tuple[Array, Array, Flags]:
        """With vibration, as far as the converters reach; bits of the samples that were cut."""
        section, sensor = self._section.vibration, self._section.sensor
        cut = np.zeros(len(self._t), np.int64)
        size = np.where(self._driven > 0.0, section.turning_g, section.resting_g)
        if np.any(size > 0.0):
            hertz = 1.0 / float(self._t[1] - self._t[0])
            random = stream(self._seed, Stream.ROUGH_VIBRATION, *self._key, 1)
            noise = [band_noise(random, len(size), hertz, section.lowest_hz, section.highest_hz) for _ in range(3)]
            shaken = size[:, None] * np.stack(noise, axis=1)  # g
            force = force + G * shaken
            rate = rate + math.radians(sensor.rectification_dps_per_g2) * np.sum(shaken**2, axis=1)[:, None]
        if sensor.g_sensitivity_dps_per_g > 0.0:
            rate = rate + force @ pull_of(sensor, self._seed, *self._key).T
        rate = rate + 0.5 * sensor.scale_asymmetry * np.abs(rate)
        limits = math.radians(self._errors.gyroscope.range_dps), G * sensor.force_range_g
        converted = []
        for values, limit, bit in ((rate, limits[0], GYRO_CLIPPED), (force, limits[1], FORCE_CLIPPED)):
            reaches = max(values.max(), -values.min()) >= AT_RANGE * limit
            if reaches:
                cut |= bit * np.any(np.abs(values) >= AT_RANGE * limit, axis=1)
            converted.append(np.clip(values, -limit, limit) if reaches else values)
        return converted[0], converted[1], cut

    def _frame_times(self, sensor: RoughSensorSection) -> Array:
        step = 1.0 / (sensor.frames_hz * (1.0 + sensor.crystal))
        first = float(self._t[0]) + step * float(stream(self._seed, Stream.ROUGH_FRAMES, *self._key).random())
        return np.arange(first, float(self._t[-1]), step)

    def _frames(self, rate: Array, force: Array, times: Array, slow: Array) -> Array:
        """Frames (f, 6) with the errors of the sensor, each with the noise of its own band."""
        sensor, errors = self._section.sensor, self._errors
        period = 1.0 / sensor.frames_hz
        true = np.stack([np.interp(times, self._t, c) for c in (*rate.T, *force.T)], axis=1)
        step = errors.gyroscope.range_dps / FRAME_STEPS if errors.gyroscope.resolution_dps > 0.0 else 0.0
        gyroscope = errors.gyroscope.model_copy(update={"resolution_dps": step})
        noise = errors.accelerometer.noise_deg * math.sqrt(PERIOD / period)
        accelerometer = errors.accelerometer.model_copy(update={"noise_deg": noise, "vibration_mps2": 0.0})
        return self._measured(ImuErrors(gyroscope, accelerometer), true[:, :3] + slow, true[:, 3:], period)

    def _exact(self, rate: Array, force: Array, ends: Array, slow: Array) -> Array:
        """Means of the samples of every cycle, as long as its time stamps say."""
        stamps = self._stamps(ends)
        mean = np.stack([self._mean_between(values, stamps) for values in (*rate.T, *force.T)], axis=1)
        accelerometer = self._errors.accelerometer.model_copy(update={"vibration_mps2": 0.0})
        return self._measured(ImuErrors(self._errors.gyroscope, accelerometer), mean[:, :3] + slow, mean[:, 3:], PERIOD)

    def _eighths(self, rate: Array, mean: Array, ends: Array) -> Array:
        """What each eighth between two time stamps shows, the ``rate`` (n,) on the grid about z: (m, 9) rad/s."""
        stamps = self._stamps(ends)
        borders = stamps[:-1, None] + np.diff(stamps)[:, None] * (np.arange(PARTS) / PARTS)
        borders = np.append(borders.ravel(), stamps[-1])
        turned = (self._mean_between(rate, borders) * np.diff(borders)).reshape(-1, PARTS)
        turned *= (PERIOD / np.diff(stamps))[:, None]
        shown = float(self._errors.constants(stream(self._seed, Stream.GYRO, *self._key))[1][2, 2])
        noise = stream(self._seed, Stream.INCREMENTS, *self._key)
        return eighths(mean, shown * turned, self._errors.gyroscope, noise)

    def _measured(self, errors: ImuErrors, rate: Array, force: Array, period: float) -> Array:
        gyro = errors.gyro(stream(self._seed, Stream.GYRO, *self._key), rate, force, period)
        random = stream(self._seed, Stream.ACCELEROMETER, *self._key)
        return np.concatenate([gyro, errors.accelerations(random, force, np.zeros(len(force)))], axis=1)

    def _stamps(self, ends: Array) -> Array:
        """When each reading was really taken (m + 1,), s: the node believes the begin and the ``ends`` of cycles."""
        jitter = 1e-3 * self._section.sensor.jitter_ms
        stamps = np.concatenate([[ends[0] - PERIOD], ends])
        if jitter == 0.0:
            return stamps
        return np.asarray(
            stamps + jitter * stream(self._seed, Stream.ROUGH_JITTER, *self._key).standard_normal(len(stamps))
        )

    def _mean_between(self, values: Array, stamps: Array) -> Array:
        """Mean (m,) of the grid's ``values`` (n,), linear between its samples, from each stamp to the next."""
        step = float(self._t[1] - self._t[0])
        integral = np.concatenate([[0.0], np.cumsum(0.5 * step * (values[1:] + values[:-1]))])
        at = np.interp(stamps, self._t, integral)
        return np.asarray(np.diff(at) / np.diff(stamps))

    def _means(self, frames: Array, times: Array, ends: Array) -> tuple[Array, Flags, Array, Array, Array]:
        """Mean of the frames that each read finds, bits of the cycles of which one stood at the range, and lateness.

        The last is what a driver makes of the frames it counts, and so are the eighths of the window.
        """
        cuts = np.searchsorted(times, self._stamps(ends))
        sums = np.concatenate([np.zeros((1, 6)), np.cumsum(frames, axis=0)])
        mean = (sums[cuts[1:]] - sums[cuts[:-1]]) / np.maximum(np.diff(cuts), 1)[:, None]
        limit = AT_RANGE * math.radians(self._errors.gyroscope.range_dps)
        high = np.concatenate([[0], np.cumsum(np.any(np.abs(frames[:, :3]) >= limit, axis=1))])
        clipped = np.asarray(GYRO_CLIPPED * (high[cuts[1:]] > high[cuts[:-1]]), np.int64)
        clock, late, std = FrameClock(self._section.sensor.frames_hz), np.zeros(len(ends)), np.zeros(len(ends))
        parts = np.full((len(ends), PARTS + 1), np.nan)
        delay = self._section.sensor.delay
        for k, (end, found) in enumerate(zip(ends.tolist(), np.diff(cuts).tolist(), strict=True)):
            clock.on_read(end, found)
            late[k], std[k] = end - clock.end, clock.std
            window = (clock.end - delay - found * clock.period, clock.end - delay)
            if k > 0 and (told := parts_of(frames[cuts[k] : cuts[k + 1], 2], window, end - PERIOD, end)):
                parts[k] = told
        return mean, clipped, late, std, parts

    def _by_cycle(self, cut: Flags, ends: Array) -> Flags:
        """Bits of the samples of every cycle together."""
        flags = np.zeros(len(ends), np.int64)
        cuts = np.searchsorted(self._t, np.concatenate([[ends[0] - PERIOD], ends]))
        for bit in (GYRO_CLIPPED, FORCE_CLIPPED):
            sums = np.concatenate([[0], np.cumsum((cut & bit) > 0)])
            flags |= bit * (sums[cuts[1:]] > sums[cuts[:-1]])
        return flags
