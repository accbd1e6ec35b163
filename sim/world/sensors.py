"""The sensors of a string's tubes: what they read in every cycle of a schedule, errors and all, in any order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.sensors.correction import USUAL
from sim.world.disturbance.bias_step import stepped_bias
from sim.world.disturbance.drift import Drift, draw_drift
from sim.world.disturbance.gyroscope import draw_gyroscope
from sim.world.disturbance.mount_tilt import draw_tilt
from sim.world.disturbance.row import ImuSamples, OneImu
from sim.world.disturbance.sensor_reading import Cycles, read_eighths, read_grid, read_means
from sim.world.disturbance.wander import wandering_bias
from sim.world.drill_string import DrillString
from sim.world.random_streams import RandomStream, random_stream
from sim.world.truth import imu_frame

Array = npt.NDArray[np.float64]


class Sensors:
    """The IMUs of a string; what one has read in the whole schedule is worked out once.

    Parameters
    ----------
    string : whose tubes they are in
    """

    def __init__(self, string: DrillString) -> None:
        self._string, self._file = string, string.scenario.file
        self.noises = self._file.node.imu_noise or (1.0,) * self._file.node.imus  # of each IMU, times that stated
        self._samples: dict[tuple[int, int], Array] = {}
        self._parts: dict[tuple[int, int], Array] = {}
        self._rough_cycles: dict[tuple[int, int], Cycles] = {}

    def sample(self, tube: int, cycle: int) -> list[Any]:
        """Three mean rates (rad/s) and three mean specific forces (m/s^2) of one cycle, errors and all.

        In a rough world temperature (C), bits of what was clipped, the lateness of the window and its standard
        deviation (s) follow, and of a sensor that tells increments nine rates about z (rad/s) of its inside. Of several
        IMUs a list of such lists.
        """
        one, *others = [self._sample(tube, cycle, imu) for imu in range(len(self.noises))]
        return [one, *others] if others else one

    def samples(self, tube: int, imu: int = 0) -> Array:
        """Samples (cycles, 6) of the whole schedule, see ``sample``."""
        if self._file.rough is not None:
            return self.rough_cycles(tube, imu).readings
        if (tube, imu) not in self._samples:
            self._samples[tube, imu] = self.readings(tube, self._ends(tube), PERIOD, imu)
        return self._samples[tube, imu]

    def parts(self, tube: int, imu: int = 0) -> Array | None:
        """What is told of the inside of the cycles (cycles, 9) rad/s; NaN where, and None if, nothing is."""
        file = self._file
        if file.rough is not None:
            return self.rough_cycles(tube, imu).parts
        if not file.gyroscope.increments or file.gyroscope.instantaneous:
            return None
        if (tube, imu) not in self._parts:
            self._parts[tube, imu] = self._eighths(tube, imu)
        return self._parts[tube, imu]

    def readings(self, tube: int, ends: Array, period: float, imu: int = 0) -> Array:
        """Readings (n, 6) of the means over ``period`` (s) that end at the rig times ``ends`` (n,), one after another.

        The noise of the accelerometer is stated for one cycle, and so is larger over less.
        """
        truth, motion = self._string.truth(tube), self._string.motion
        rate, force = truth.cycle_means(ends, period)
        if self._file.gyroscope.instantaneous:
            rate = truth.rate(ends)
        if (rack := self._string.rack) is not None:
            racked, mount = ends <= rack.end, self._string.marks.mounts[tube]
            random = random_stream(self._string.seed, RandomStream.RACK, tube)
            held = rack.truth(random, mount, self._file.accelerometer.gravity_mps2)
            rate[racked], force[racked] = held.cycle_means(ends[racked], period)
        turning = ((motion.drive(ends)[1] > 0.0) | (motion.drive(ends - period)[1] > 0.0)).astype(float)
        samples = ImuSamples(ends, rate, force, turning, truth, ends, period)
        return read_means(samples, self._imu(tube, imu))

    def rough_cycles(self, tube: int, imu: int = 0) -> Cycles:
        """Readings of a tube in a rough world, cycle by cycle, with temperature and what was clipped."""
        if (tube, imu) not in self._rough_cycles:
            moved, truth, ends = self._string.rough_run.moved, self._string.truth(tube), self._ends(tube)
            signal = ImuSamples(moved.t, *truth.rate_and_force(moved.t), moved.driven, truth, ends)
            signal.clipped = np.zeros(len(moved.t), np.int64)
            self._rough_cycles[tube, imu] = read_grid(signal, self._imu(tube, imu, cold_at=float(moved.t[0])))
        return self._rough_cycles[tube, imu]

    def gyro_bias(self, tube: int) -> Array:
        """True bias (cycles,) of a tube's z gyroscope, rad/s: what is constant, what wanders, and its step."""
        imu, limit = self._imu(tube), math.radians(self._file.gyroscope.range_dps)
        constant = draw_gyroscope(imu).bias[2]
        drawn = np.clip(constant + wandering_bias(imu, self._string.cycles, PERIOD)[:, 2], -limit, limit)
        return np.asarray(drawn + stepped_bias(imu, self._ends(tube)))

    def drift(self, tube: int, imu: int = 0) -> Drift | None:
        """What became of a tube's sensors since their calibration."""
        return draw_drift(self._imu(tube, imu))

    def frame(self, tube: int, imu: int = 0) -> Array:
        """R_imu_from_tube (3, 3): how an IMU (from 0) of a tube leans against the tube's axis."""
        return imu_frame(*self.tilt(tube, imu))

    def tilt(self, tube: int, imu: int = 0) -> tuple[float, float]:
        """Pitch and roll (rad) of that lean."""
        return draw_tilt(self._imu(tube, imu))

    def _sample(self, tube: int, cycle: int, imu: int) -> list[Any]:
        sample: list[Any] = self.samples(tube, imu)[cycle].tolist()
        parts = self.parts(tube, imu)
        known = parts is not None and bool(np.isfinite(parts[cycle]).all())
        if self._file.rough is not None:
            found = self.rough_cycles(tube, imu)
            sample += [float(found.temperature[cycle]), int(found.clipped[cycle])]
            sample += [float(found.late[cycle]), float(found.late_std[cycle])]
        elif known:
            sample += [USUAL, 0, 0.0, 0.0]
        return sample + parts[cycle].tolist() if parts is not None and known else sample

    def _eighths(self, tube: int, imu: int) -> Array:
        ends, mean, truth = self._ends(tube), self.samples(tube, imu)[:, 2], self._string.truth(tube)
        found = read_eighths(mean, ends, self._imu(tube, imu), truth, self.frame(tube, imu))
        if self._string.rack is not None:
            found[ends <= self._string.rack.end] = np.nan
        return found

    def _ends(self, tube: int) -> Array:
        """Rig times (cycles,) at which the cycles of a tube end."""
        return np.asarray(self._string.ends + self._string.phase(tube))

    def _imu(self, tube: int, imu: int = 0, *, cold_at: float = 0.0) -> OneImu:
        turns_from = next(phase.start for phase in self._string.phases if phase.kind == "drill")
        noise, seed = self.noises[imu], self._string.seed
        return OneImu(self._file, seed, tube, imu, noise=noise, turns_from=turns_from, cold_at=cold_at)
