"""Is the sensor sane? What the raw readings of one IMU show by themselves.

========== ======================================================================= =================
fault      evidence                                                                flagged after
========== ======================================================================= =================
bad sample a number that is not finite                                             1 cycle
saturated  a reading at the configured range (3 cycles for the accelerometer)      1 cycle
stuck      three axes, or one, that repeat bit for bit                             4, 8 repeats
========== ======================================================================= =================
"""

from __future__ import annotations

from typing import Any, Final

from node.kernels.arithmetic.formats import Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import are_numbers, as_number, times_factor
from node.kernels.arithmetic.quantity import factor_quantity
from node.kernels.record.events import Fault

NEAR_RANGE: Final = factor_quantity(0.999)  # of the range, from where a reading counts as saturated
FORCE_CYCLES: Final = 3  # in a row at the range: one knock is not a fault of the accelerometer
BAD_SAMPLE = kernel_constant(Fault.BAD_SAMPLE)
GYRO_SATURATED, GYRO_STUCK = kernel_constant(Fault.GYRO_SATURATED), kernel_constant(Fault.GYRO_STUCK)
FORCE_SATURATED, FORCE_STUCK = kernel_constant(Fault.FORCE_SATURATED), kernel_constant(Fault.FORCE_STUCK)


@kernel
def largest_magnitude(vector: Array) -> float:
    """Largest magnitude of three numbers."""
    return as_number(max(abs(vector[0]), abs(vector[1]), abs(vector[2])))


@kernel
def is_stuck(repeats: Any, reading: Array, together: int, alone: int) -> bool:
    """Take one raw reading (3); whether so many values have repeated bit for bit, of all axes or of one."""
    fewest, most = 1 << 60, 0
    for k in range(3):
        repeats.counts[k] = repeats.counts[k] + 1 if reading[k] == repeats.last[k] else 0
        repeats.last[k] = reading[k]
        fewest, most = min(fewest, repeats.counts[k]), max(most, repeats.counts[k])
    return bool((together > 0 and fewest >= together) or (alone > 0 and most >= alone))


@kernel
def find_faults(watch: Any, settings: Any, rate: Array, force: Array, saturated: int) -> tuple[int, int]:
    """Faults of gyroscope and accelerometer in this cycle, of raw ``rate`` (3, rad/s) and ``force`` (3, m/s^2).

    Parameters
    ----------
    watch : record of dtype ``READINGS``
    settings : record of dtype ``SETTINGS``
    saturated : bits of what was at its range within the cycle, as the driver saw it: 1 gyroscope, 2 accelerometer
    """
    if not are_numbers(rate, force):
        return BAD_SAMPLE, BAD_SAMPLE
    together, alone = settings.repeats_together, settings.repeats_alone
    still_rate = is_stuck(watch.rates, rate, together, alone)
    still_force = is_stuck(watch.forces, force, together, alone)
    clipped = saturated & 2 != 0 or largest_magnitude(force) >= times_factor(settings.force_range, NEAR_RANGE)
    watch.clipped = watch.clipped + 1 if clipped else 0
    gyro = accelerometer = 0
    if saturated & 1 != 0 or largest_magnitude(rate) >= times_factor(settings.rate_range, NEAR_RANGE):
        gyro = GYRO_SATURATED
    elif still_rate:
        gyro = GYRO_STUCK
    if watch.clipped >= FORCE_CYCLES:
        accelerometer = FORCE_SATURATED
    elif still_force:
        accelerometer = FORCE_STUCK
    return gyro, accelerometer
