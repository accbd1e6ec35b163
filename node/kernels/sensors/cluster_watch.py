"""Which IMUs of a cluster are used: judged one by one, and against the others.

An IMU is left out when its readings are no sane ones, or when it disagrees with the others; it comes back when both
have been well for some time.
"""

from __future__ import annotations

import math
from typing import Any, Final

from node.kernels.arithmetic.formats import DEG, Array
from node.kernels.arithmetic.jit import kernel, kernel_constant
from node.kernels.arithmetic.operations import as_number, half_of, quantity_ratio, times_factor
from node.kernels.arithmetic.quantity import NO_NUMBER, NONE, Constant, factor_quantity, force_quantity, rate_quantity
from node.kernels.record.events import Code, event_count, queue_event
from node.kernels.record.node_record import FX, SATURATED, WX
from node.kernels.sensors.sensor_watch import find_faults

DISAGREEING: Final = 4  # cycles in a row, until an IMU is left out
HEALTHY: Final = 20  # cycles in a row, until it is back
LEARNT: Final = 32  # cycles at rest, after which offsets show a disagreement
RATE_APART, FORCE_APART = rate_quantity(0.5 * DEG), force_quantity(0.3)  # rad/s, m/s^2, between IMUs that agree
SPIN_APART: Final = factor_quantity(0.02)  # of the spin, on each axis: what scale and mount may be off by
UNALIGNED_APART, UNALIGNED_SPIN = (
    force_quantity(1.0),
    factor_quantity(0.2),
)  # the same of mounts never aligned; along the axis the spin counts as above
CLEARLY: Final = 2  # times farther from what is expected: of two that disagree, the one to leave out
IMU_EXCLUDED, IMU_BACK = kernel_constant(Code.IMU_EXCLUDED), kernel_constant(Code.IMU_BACK)
INFINITE: Final = Constant(math.inf, NO_NUMBER)


@kernel
def watch_imus(cluster: Any, settings: Any, readings: Array) -> None:
    """Find the fault of each IMU in this cycle, 0 for none; ``readings`` as in ``node_step``."""
    for k in range(settings.imus):
        saturated = int(readings[k, SATURATED])
        turning, pull = readings[k, WX : WX + 3], readings[k, FX : FX + 3]
        gyro, accelerometer = find_faults(cluster.watches[k], settings, turning, pull, saturated)
        cluster.faults[k] = gyro if gyro != 0 else accelerometer


@kernel
def compare_imus(node: Any, settings: Any) -> None:
    """Which of the sane IMUs agree with the rest; of two apart the one clearly farther from what is expected is not."""
    cluster = node.cluster
    trusted = sane = 0
    for k in range(settings.imus):
        cluster.agrees[k] = 1
        if cluster.faults[k] == 0:
            sane += 1
            trusted += cluster.used[k]
    if trusted == 0 or sane < 2:
        return
    set_limits(cluster.limits, node.mount, abs(cluster.expects[2]))
    if not find_middle(cluster, settings.imus, trusted):
        return
    for k in range(settings.imus):
        if cluster.faults[k] == 0 and not is_near(cluster.readings[k], cluster.middle, cluster.limits):
            cluster.agrees[k] = 0


@kernel
def set_limits(limits: Array, mount: Any, spin: float) -> None:
    """Largest differences (6) of rate and force between IMUs that agree while they turn with ``spin`` (rad/s)."""
    aligned = mount.method != 0
    for i in range(3):
        turning = times_factor(spin, SPIN_APART) if aligned or i == 2 else times_factor(spin, UNALIGNED_SPIN)
        limits[i] = RATE_APART + turning if mount.rate_samples >= LEARNT else INFINITE
        if aligned:
            limits[3 + i] = FORCE_APART
        else:
            limits[3 + i] = UNALIGNED_APART


@kernel
def find_middle(cluster: Any, imus: int, trusted: int) -> bool:
    """What the ``trusted`` IMUs read, into ``cluster.middle`` (6); False when two differ and either may be right."""
    for i in range(6):
        cluster.middle[i] = median_reading(cluster, imus, i)
    if trusted != 2:
        return True
    first = next_trusted(cluster, 0)
    second = next_trusted(cluster, first + 1)
    if is_near(cluster.readings[first], cluster.readings[second], cluster.limits):
        return True
    one = reading_distance(cluster.readings[first], cluster.expects, cluster.limits)
    other = reading_distance(cluster.readings[second], cluster.expects, cluster.limits)
    if max(one, other) < CLEARLY * min(one, other):
        return False
    nearer = first if one < other else second
    for i in range(6):
        cluster.middle[i] = cluster.readings[nearer, i]
    return True


@kernel
def next_trusted(cluster: Any, imu: int) -> int:
    """The first sane IMU in use from ``imu`` on; there must be one."""
    while cluster.used[imu] == 0 or cluster.faults[imu] != 0:
        imu += 1
    return imu


@kernel
def median_reading(cluster: Any, imus: int, axis: int) -> float:
    """Median of what the sane IMUs in use read on ``axis``; of an even number the mean of the two in the middle."""
    values, count = cluster.ordered, 0
    for k in range(imus):
        if cluster.used[k] == 0 or cluster.faults[k] != 0:
            continue
        value, place = cluster.readings[k, axis], count
        while place > 0 and values[place - 1] > value:
            values[place] = values[place - 1]
            place -= 1
        values[place] = value
        count += 1
    middle = count // 2
    return as_number(values[middle] if count % 2 == 1 else half_of(values[middle - 1] + values[middle]))


@kernel
def is_near(one: Array, other: Array, limits: Array) -> bool:
    """Whether two readings (6) differ by no more than ``limits`` on any axis."""
    near = 0
    for i in range(6):
        near += 1 if abs(one[i] - other[i]) <= limits[i] else 0
    return near == 6


@kernel
def reading_distance(one: Array, other: Array, limits: Array) -> float:
    """Largest difference of two readings (6), in units of ``limits``."""
    largest: float = 0
    for i in range(6):
        largest = max(largest, quantity_ratio(abs(one[i] - other[i]), limits[i]))
    return largest


@kernel
def choose_imus(cluster: Any, imus: int) -> int:
    """Which IMUs are used from now on, into ``cluster.chosen``; returns how many."""
    count = 0
    for k in range(imus):
        sane, agrees = cluster.faults[k] == 0, cluster.agrees[k] == 1
        cluster.apart[k] = cluster.apart[k] + 1 if sane and not agrees else 0
        cluster.well[k] = cluster.well[k] + 1 if sane and agrees else 0
        if cluster.used[k] == 1:
            cluster.chosen[k] = 1 if sane and cluster.apart[k] < DISAGREEING else 0
        else:
            cluster.chosen[k] = 1 if cluster.well[k] >= HEALTHY else 0
        count += cluster.chosen[k]
    if count > 0:
        return count
    for k in range(imus):  # apart or not, what is left is better than nothing
        cluster.chosen[k] = 1 if cluster.faults[k] == 0 else 0
        count += cluster.chosen[k]
    return count


@kernel
def tell_members(node: Any, imus: int) -> bool:
    """Tell which IMUs are left out from now on and which are back; whether there were any."""
    cluster, changed = node.cluster, False
    for k in range(imus):
        if cluster.chosen[k] == cluster.used[k]:
            continue
        changed = True
        if cluster.chosen[k] == 1:
            queue_event(node, IMU_BACK, event_count(node.temperature, k + 1), NONE, NONE, NONE)
        else:
            fault = event_count(node.temperature, cluster.faults[k])
            queue_event(node, IMU_EXCLUDED, event_count(node.temperature, k + 1), fault, NONE, NONE)
    return changed
