"""The cluster: several IMUs in one tube, judged one by one and fused by inverse variance.

An IMU is left out when its readings are no sane ones, or when it disagrees with the others; it comes back when both
have been well for some time. Every gyroscope has its own constant bias: what each reads at rest beside the mean of all
is learnt and taken off, so that the fused rate, and the bias that the filter knows, stay the same whoever is left out.
"""

from __future__ import annotations

import math
from typing import Final

import numpy as np

from node.firmware.imu_settings import ImuSettings
from node.firmware.pending_event import PendingEvent
from node.kernels.cluster import follow_offsets, fuse
from node.kernels.events import Fault
from node.kernels.layout import DEG, RING, Array
from node.kernels.record import FX, READINGS, SATURATED, WX
from node.kernels.resets import doubt_bias
from node.kernels.sensor_watch import find_faults
from telemetry.messages import ImuMean, Severity

DISAGREEING: Final = 4  # cycles in a row, until an IMU is left out
HEALTHY: Final = 20  # cycles in a row, until it is back
LEARNT: Final = 32  # cycles at rest, after which offsets show a disagreement
MEMORY: Final = 1000  # cycles at rest, of the running mean of an offset
RATE_APART, FORCE_APART = 0.5 * DEG, 0.3  # rad/s, m/s^2, between IMUs that agree
SPIN_APART: Final = np.array([0.02, 0.02, 0.02])  # of the spin, on each axis: what scale and mount may be off by
UNALIGNED_APART, UNALIGNED_SPIN = 1.0, np.array([0.2, 0.2, 0.02])  # the same of mounts never aligned
CLEARLY: Final = 2.0  # times farther from what is expected: of two that disagree, the one to leave out
SCALED: Final = ("gyro_noise", "bias_std", "force_std")  # of the configuration, with the noise of the cluster


class Cluster:
    """IMUs of one tube.

    Parameters
    ----------
    imus : at least two
    crew : settings of the tube, one-element array of dtype ``SETTINGS``
    nodes, configs : records of the node, one-element arrays; the configuration's noise is that of an IMU of factor 1,
        and is kept at that of the IMUs in use
    """

    def __init__(self, imus: tuple[ImuSettings, ...], crew: Array, nodes: Array, configs: Array) -> None:
        count = len(imus)
        self.used = np.ones(count, np.bool_)
        self.force = np.zeros(3)  # fused, of the last cycle
        self.rate = np.zeros(3)
        self._crew, self._mount = crew[0], nodes[0]["mount"]
        self._state, self._config = nodes[0]["filter"], configs[0]
        self._noise = np.array([imu.noise for imu in imus])
        self._plain = {name: np.copy(self._config[name]) for name in SCALED}
        self._watches = np.zeros(count, READINGS)
        for sensor in ("rates", "forces"):
            self._watches[sensor]["last"] = np.nan
        self._apart, self._well = np.zeros(count, np.int64), np.zeros(count, np.int64)
        self._ring, self._ring_used = np.zeros((count, RING, 3)), np.zeros((count, RING), np.bool_)
        self._cycles = 0
        self._faults = [Fault.NONE] * count
        self._expected = np.zeros(3)  # rad/s, before the IMUs were apart
        self._pending: list[PendingEvent] = []
        self._reweigh(self.used)

    def drain_events(self) -> list[PendingEvent]:
        """Code, severity and arguments of the events since the last call."""
        said, self._pending = self._pending, []
        return said

    @property
    def weights(self) -> Array:
        """Inverse variances (imus,) of the IMUs in use, 0 of the others; those of factor 1 have 1."""
        return np.where(self.used, self._noise**-2.0, 0.0)

    def fuse_readings(
        self,
        readings: Array,
        rates: Array,
        forces: Array,
        expected: Array,
        *,
        heard: bool,
    ) -> None:
        """Judge one cycle, and leave its fused rate and force in ``rate`` and ``force``; nan if none is sane.

        Parameters
        ----------
        readings : (imus, 8) raw, see ``node.kernels.step.node_step``
        rates, forces : (imus, 3) the same, corrected and in the tube's frame
        expected : (6,) rate and force that the node expects in this cycle
        heard : the encoder reported the expected rate; else it is what the cluster itself read
        """
        rates = rates - self._mount["rate_offset"][: len(rates)]
        sane = self._sane(readings)
        corrected = np.concatenate([rates, forces], axis=1)
        if not heard and self._apart.any():  # what was fused since is not evidence against one of them
            expected = np.concatenate([self._expected, expected[3:]])
        self._expected = expected[:3]
        agrees = self._agree(corrected, sane, expected)
        self._apart = np.where(sane & ~agrees, self._apart + 1, 0)
        self._well = np.where(sane & agrees, self._well + 1, 0)
        used = self.used & sane & (self._apart < DISAGREEING) | (~self.used & (self._well >= HEALTHY))
        if not used.any():
            used = sane  # apart or not, what is left is better than nothing
        self._tell(used, sane)
        if used.any() and not np.array_equal(used, self.used):
            self._reweigh(used)
        self.used = used
        fused = np.full(6, math.nan)
        if used.any():
            fuse(corrected, self.weights, fused)
        self.rate[:], self.force[:] = fused[:3], fused[3:]
        slot = self._cycles % RING
        self._ring[:, slot], self._ring_used[:, slot] = forces, used
        self._cycles += 1

    def learn_offsets(self, rates: Array) -> None:
        """Take a cycle at rest, all IMUs in use, into the offsets of their gyroscopes: ``rates`` (imus, 3), rad/s."""
        if not self.used.all():
            return
        samples = min(int(self._mount["rate_samples"]) + 1, MEMORY)
        mean = np.empty(3)
        fuse(rates, self.weights, mean)
        follow_offsets(rates, mean, samples, self._mount["rate_offset"])
        self._mount["rate_samples"] = samples

    def mean_raw(self, readings: Array) -> tuple[Array, Array]:
        """Fused raw rate and force: those of the one sensor that a block of parameters corrects."""
        fused = np.full(6, math.nan)
        if self.used.any():
            fuse(readings[:, : FX + 3], self.weights, fused)
        return fused[:3], fused[3:]

    def survey(self, samples: int) -> tuple[ImuMean, ...]:
        """Mean force of each IMU that was in use over the newest ``samples`` cycles, with the covariance of the mean.

        C = sum (f - m)(f - m)^T / (n (n - 1)), as ``node.kernels.moving_average.average_force``.
        """
        slots = np.arange(self._cycles - samples, self._cycles) % RING
        means = []
        for forces, used in zip(self._ring[:, slots], self._ring_used[:, slots], strict=True):
            if used.all():
                fx, fy, fz = forces.mean(axis=0).tolist()
                xx, xy, xz, yx, yy, yz, zx, zy, zz = (np.cov(forces.T) / samples).ravel().tolist()
                means.append(ImuMean((fx, fy, fz), ((xx, xy, xz), (yx, yy, yz), (zx, zy, zz))))
        return tuple(means)

    def _sane(self, readings: Array) -> Array:
        for k, row in enumerate(readings):
            saturated = int(row[SATURATED] != 0.0)
            rate, force = row[WX : WX + 3], row[FX : FX + 3]
            gyro, accelerometer = find_faults(self._watches[k], self._crew, rate, force, saturated)
            self._faults[k] = Fault(gyro or accelerometer)
        return np.array([fault is Fault.NONE for fault in self._faults])

    def _agree(self, readings: Array, sane: Array, expected: Array) -> Array:
        """Which of the sane IMUs agree with the rest; of two apart the one clearly farther from ``expected`` is not."""
        trusted = sane & self.used
        agrees = np.ones(len(readings), np.bool_)
        if trusted.sum() == 0 or sane.sum() < 2:
            return agrees
        limits = self._limits(float(expected[2]))
        if trusted.sum() >= 3:
            middle = np.median(readings[trusted], axis=0)
        elif trusted.sum() == 2:
            first, second = readings[trusted]
            middle = 0.5 * (first + second)
            if np.any(np.abs(first - second) > limits):
                sizes = [float(np.max(np.abs(one - expected) / limits)) for one in (first, second)]
                if max(sizes) < CLEARLY * min(sizes):
                    return agrees
                middle = first if sizes[0] < sizes[1] else second
        else:
            middle = readings[trusted][0]
        return np.where(sane, np.all(np.abs(np.where(sane[:, None], readings, 0.0) - middle) <= limits, axis=1), True)

    def _limits(self, spin: float) -> Array:
        """Largest differences (6,) of rate and force between IMUs that agree; ``spin`` in rad/s."""
        aligned = bool(self._mount["method"])
        rate = RATE_APART + abs(spin) * (SPIN_APART if aligned else UNALIGNED_SPIN)
        if int(self._mount["rate_samples"]) < LEARNT:
            rate = np.full(3, math.inf)
        return np.concatenate([rate, np.full(3, FORCE_APART if aligned else UNALIGNED_APART)])

    def _tell(self, used: Array, sane: Array) -> None:
        for k in np.flatnonzero(used != self.used).tolist():
            if used[k]:
                self._pending.append(("imu_back", Severity.WARNING, {"imu": k + 1}))
            else:
                fault = self._faults[k]
                reason = "disagrees" if sane[k] or fault is Fault.NONE else fault.name.lower()
                self._pending.append(("imu_excluded", Severity.ERROR, {"imu": k + 1, "reason": reason}))

    def _reweigh(self, used: Array) -> None:
        """Noise of the configuration for the IMUs ``used``, and the doubt in a bias that is now another mean.

        var(b' - b) = sigma_b^2 sum (w'_i - w_i)^2 noise_i^2: every gyroscope wanders by itself.
        """
        before, weights = self.weights, np.where(used, self._noise**-2.0, 0.0)
        factor = 1.0 / math.sqrt(float(weights.sum()))
        for name, plain in self._plain.items():
            self._config[name] = plain * factor
        moved = weights / weights.sum() - (before / before.sum() if before.any() else 0.0)
        share = float(np.sum((moved * self._noise) ** 2))
        for k in range(3):
            doubt = share * float(self._plain["bias_std"][k]) ** 2
            doubt_bias(self._state, k, doubt)
