"""Is the sensor sane? What its raw readings show by themselves, and what the filter's innovations show of them.

========== ======================================================================= =================
fault      evidence                                                                flagged after
========== ======================================================================= =================
bad sample a number that is not finite                                             1 cycle
saturated  a reading at the configured range (3 cycles for the accelerometer)      1 cycle
stuck      three axes, or one, that repeat bit for bit                             4, 8 repeats
step       innovations beyond the gate that grow, while the readings look sane     3 aidings in a row
scale      the same, in proportion to the rate                                     3 aidings in a row
========== ======================================================================= =================

A wrong aiding makes one large innovation that then stays; a wrong gyroscope makes it grow with every cycle. That is
how the two are distinguished. A string that unwinds below a standing drive head looks like a step.
"""

from __future__ import annotations

import enum
import math
from collections import deque
from dataclasses import dataclass

from node.errors import ConfigurationError
from telemetry.messages import Vector3

NEAR_RANGE = 0.999  # of the range, from where a reading counts as saturated
FORCE_CYCLES = 3  # in a row at the range: one knock is not a fault of the accelerometer
DISAGREEMENTS = 3  # aidings in a row
GROWTH = 1.5  # sigmas from one aiding to the next, in one direction
SMALLEST_STEP = math.radians(0.03)  # rad/s
STEADY = 0.3  # of a mismatch, what two in a row may differ by to be one step
SLOWEST_SCALE = math.radians(5.0)  # rad/s, from where a mismatch may be one of scale


class Fault(enum.Enum):
    """What is wrong with a sensor; the value is the code of its event."""

    BAD_SAMPLE = "bad_sample"
    GYRO_SATURATED = "gyro_saturated"
    GYRO_STUCK = "gyro_stuck"
    GYRO_STEP = "gyro_step"
    GYRO_SCALE = "gyro_scale"
    FORCE_SATURATED = "force_saturated"
    FORCE_STUCK = "force_stuck"


@dataclass(frozen=True, slots=True)
class SensorLimits:
    """What a sane reading of one IMU is."""

    rate_range: float = math.radians(500.0)  # rad/s
    force_range: float = 8.0 * 9.80665  # m/s^2
    repeats_together: int = 4  # of all axes of a sensor; 0 switches it off
    repeats_alone: int = 8  # of one axis; 0 switches it off, for a sensor whose noise is below its resolution

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        ConfigurationError
            With the field, its range and what was given.
        """
        for name, value in (("rate_range", self.rate_range), ("force_range", self.force_range)):
            if not (math.isfinite(value) and value > 0.0):
                raise ConfigurationError(f"limits.{name}: expected a range above 0, got {value}")
        for name, count in (("repeats_together", self.repeats_together), ("repeats_alone", self.repeats_alone)):
            if count < 0:
                raise ConfigurationError(f"limits.{name}: expected 0 or more cycles, got {count}")


USUAL_LIMITS = SensorLimits()


class Repeats:
    """How often in a row the axes of one sensor have repeated their raw value."""

    def __init__(self, together: int, alone: int) -> None:
        self._together, self._alone = together, alone
        self._last: Vector3 | None = None
        self._counts = [0, 0, 0]

    def stuck(self, reading: Vector3) -> bool:
        """Take one raw reading; whether the sensor is stuck."""
        before = self._last or (math.nan, math.nan, math.nan)
        self._last = reading
        self._counts = [n + 1 if now == old else 0 for n, now, old in zip(self._counts, reading, before, strict=True)]
        return 0 < self._together <= min(self._counts) or 0 < self._alone <= max(self._counts)


class ReadingWatch:
    """Judges every raw reading of one IMU by itself."""

    def __init__(self, limits: SensorLimits) -> None:
        self._limits = limits
        self._rates = Repeats(limits.repeats_together, limits.repeats_alone)
        self._forces = Repeats(limits.repeats_together, limits.repeats_alone)
        self._clipped = 0

    def find_faults(self, rate: Vector3, force: Vector3, *, saturated: bool) -> tuple[Fault | None, Fault | None]:
        """Faults of gyroscope and accelerometer in this cycle; rad/s, m/s^2.

        ``saturated`` is the driver's word that a sample within the cycle was at the gyroscope's range.
        """
        if not all(map(math.isfinite, (*rate, *force))):
            return Fault.BAD_SAMPLE, Fault.BAD_SAMPLE
        still_rate, still_force = self._rates.stuck(rate), self._forces.stuck(force)
        clipped = max(map(abs, force)) >= NEAR_RANGE * self._limits.force_range
        self._clipped = self._clipped + 1 if clipped else 0
        gyro = accelerometer = None
        if saturated or max(map(abs, rate)) >= NEAR_RANGE * self._limits.rate_range:
            gyro = Fault.GYRO_SATURATED
        elif still_rate:
            gyro = Fault.GYRO_STUCK
        if self._clipped >= FORCE_CYCLES:
            accelerometer = Fault.FORCE_SATURATED
        elif still_force:
            accelerometer = Fault.FORCE_STUCK
        return gyro, accelerometer


@dataclass(frozen=True, slots=True)
class Mismatch:
    """A gyroscope that disagrees with the aiding."""

    fault: Fault
    rate: float  # rad/s, true minus measured
    spin: float  # rad/s, true, at the same time
    steady: bool  # the last two aidings show the same mismatch


class AidingWatch:
    """Judges the gyroscope by the growth of the innovations."""

    def __init__(self) -> None:
        self._left = 0.0  # rad, of the last innovation, not corrected
        self._at: float | None = None
        self._seen: deque[tuple[float, float]] = deque(maxlen=DISAGREEMENTS + 1)  # mismatch and true spin, rad/s

    def forget(self) -> None:
        """Begin again: the yaw was set, or the reference is another one."""
        self._left, self._at = 0.0, None
        self._seen.clear()

    def find_mismatch(
        self, innovation: float, sigma: float, spin: float, now: float, *, rejected: bool, reset: bool
    ) -> Mismatch | None:
        """Take one judged aiding (rad, sigmas, rad/s, s); what it shows after enough of them."""
        grown = math.remainder(innovation - self._left, 2.0 * math.pi)
        elapsed = now - self._at if self._at is not None else 0.0
        self._left, self._at = (0.0 if reset or not rejected else innovation), now
        if not rejected:
            self._seen.clear()
            return None
        mismatch = grown / elapsed if elapsed > 0.0 else 0.0
        if abs(grown) <= GROWTH * sigma or abs(mismatch) < SMALLEST_STEP:
            self._seen.clear()
            return None
        if self._seen and self._seen[-1][0] * mismatch < 0.0:
            self._seen.clear()
        self._seen.append((mismatch, spin + mismatch))
        return self._conclude() if len(self._seen) >= DISAGREEMENTS else None

    def _conclude(self) -> Mismatch:
        (before, _), (mismatch, spin) = self._seen[-2], self._seen[-1]
        steady = abs(mismatch - before) <= STEADY * abs(mismatch)
        fault = Fault.GYRO_SCALE if is_proportional(list(self._seen)) else Fault.GYRO_STEP
        self._seen.clear()
        return Mismatch(fault, 0.5 * (mismatch + before) if steady else mismatch, spin, steady)


def is_proportional(seen: list[tuple[float, float]]) -> bool:
    """Whether mismatches m follow the spins w as m = k w clearly better than as m = constant (both rad/s)."""
    spins = [w for _, w in seen]
    fastest = max(map(abs, spins))
    if fastest < SLOWEST_SCALE or max(spins) - min(spins) < STEADY * fastest:
        return False
    k = sum(m * w for m, w in seen) / sum(w * w for w in spins)
    mean = sum(m for m, _ in seen) / len(seen)
    return 4.0 * sum((m - k * w) ** 2 for m, w in seen) < sum((m - mean) ** 2 for m, _ in seen)
