"""The sensors of a string's tubes: what they read in every cycle of a schedule, errors and all, in any order."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.sensors.correction import USUAL
from sim.world.drill_string import DrillString
from sim.world.imu_errors import Drift, ImuErrors, single_samples
from sim.world.increments import borders_of, eighths
from sim.world.rough_imu import Cycles
from sim.world.streams import Stream, stream
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
        truth, file = self._string.truth(tube), self._file
        rate, force = truth.cycle_means(ends, period)
        gyroscope, accelerometer = file.gyroscope, file.accelerometer
        if gyroscope.instantaneous:
            rate, gyroscope = truth.rate(ends), single_samples(gyroscope, period)
        if period != PERIOD:
            noise_deg = accelerometer.noise_deg * math.sqrt(PERIOD / period)
            accelerometer = accelerometer.model_copy(update={"noise_deg": noise_deg})
        if (rack := self._string.rack) is not None:
            racked, mount = ends <= rack.end, self._string.marks.mounts[tube]
            held = rack.truth(self._random(Stream.RACK, tube), mount, accelerometer.gravity_mps2)
            rate[racked], force[racked] = held.cycle_means(ends[racked], period)
        frame = self.frame(tube, imu)
        rate, force = rate @ frame.T, force @ frame.T
        turning = (self._string.motion.drive(ends)[1] > 0.0) | (self._string.motion.drive(ends - period)[1] > 0.0)
        rate[:, 2] += self._bias_step(ends)
        felt = force
        if (drift := self.drift(tube, imu)) is not None:
            rate, felt = rate + drift.rate, force @ drift.matrix.T + drift.bias
        errors = ImuErrors(gyroscope, accelerometer).times(self.noises[imu])
        measured_rate = errors.gyro(self._random(Stream.GYRO, tube, imu), rate, force, period)
        measured_force = errors.accelerations(
            self._random(Stream.ACCELEROMETER, tube, imu), felt, turning.astype(float)
        )
        return np.concatenate([measured_rate, measured_force], axis=1)

    def rough_cycles(self, tube: int, imu: int = 0) -> Cycles:
        """Readings of a tube in a rough world, cycle by cycle, with temperature and what was clipped."""
        rough = self._string.rough_run
        if (tube, imu) not in self._rough_cycles:
            file, ends = self._file, self._ends(tube)
            rate, force = rough.perfect(self._string.truth(tube), self.frame(tube, imu))
            bias = np.zeros((len(ends), 3))
            bias[:, 2] = self._bias_step(ends)
            if (drift := self.drift(tube, imu)) is not None:
                bias, force = bias + drift.rate, force @ drift.matrix.T + drift.bias
            errors = ImuErrors(file.gyroscope, file.accelerometer).times(self.noises[imu])
            self._rough_cycles[tube, imu] = rough.imu(errors, tube, imu).cycles(rate, force, ends, bias)
        return self._rough_cycles[tube, imu]

    def gyro_bias(self, tube: int) -> Array:
        """True bias (cycles,) of a tube's z gyroscope, rad/s: the draws of its readings without noise and scale."""
        clean = {"noise_dps_rthz": (0.0, 0.0, 0.0), "scale_factor_std": 0.0, "resolution_dps": 0.0}
        section = self._file.gyroscope.model_copy(update=clean)
        still = np.zeros((self._string.cycles, 3))
        errors = ImuErrors(section, self._file.accelerometer)
        drawn = errors.gyro(self._random(Stream.GYRO, tube), still, still, PERIOD)[:, 2]
        return np.asarray(drawn + self._bias_step(self._ends(tube)))

    def drift(self, tube: int, imu: int = 0) -> Drift | None:
        """What became of a tube's sensors since their calibration."""
        section = self._file.drift
        return None if section is None else Drift.draw(section, self._random(Stream.DRIFT, tube, imu))

    def frame(self, tube: int, imu: int = 0) -> Array:
        """R_imu_from_tube (3, 3): how an IMU (from 0) of a tube leans against the tube's axis."""
        return imu_frame(*self.tilt(tube, imu))

    def tilt(self, tube: int, imu: int = 0) -> tuple[float, float]:
        """Pitch and roll (rad) of that lean."""
        std = math.radians(self._file.joints.mount_tilt_std_deg)
        pitch, roll = (std * self._random(Stream.MOUNTS, tube, imu).standard_normal(2)).tolist()
        return pitch, roll

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
        ends, random = self._ends(tube), self._random(Stream.GYRO, tube, imu)
        errors = ImuErrors(self._file.gyroscope, self._file.accelerometer).times(self.noises[imu])
        shown = float((errors.constants(random)[1] @ self.frame(tube, imu)[:, 2])[2])  # of a turn about the axis
        borders = borders_of(ends)
        turned = self._string.truth(tube).turned(borders.ravel())[0].reshape(borders.shape)
        noise = self._random(Stream.INCREMENTS, tube, imu)
        found = eighths(self.samples(tube, imu)[:, 2], shown * np.diff(turned, axis=1), errors.gyroscope, noise)
        if self._string.rack is not None:
            found[ends <= self._string.rack.end] = np.nan
        return found

    def _ends(self, tube: int) -> Array:
        """Rig times (cycles,) at which the cycles of a tube end."""
        return np.asarray(self._string.ends + self._string.phase(tube))

    def _bias_step(self, ends: Array) -> Array:
        turns_from = next(phase.start for phase in self._string.phases if phase.kind == "drill")
        return np.asarray(math.radians(self._file.gyroscope.bias_step_dps) * (ends > turns_from))

    def _random(self, purpose: Stream, tube: int, imu: int = 0) -> np.random.Generator:
        further = [imu] if imu else []  # the first IMU of a tube draws what it draws alone
        return stream(self._string.seed, purpose, tube, *further)
