"""What the process of a tube is given as its cycle's data, as a reading."""

from __future__ import annotations

import math
from typing import Any

from node.firmware.inputs import ImuReading
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import PARTS
from node.kernels.sensors.correction import USUAL
from node.process.drivers.source import NOTHING, ImuSample
from telemetry.frozen import replace

LEAST, MOST = 6, 10  # numbers of an IMU that does not tell the parts of its cycle


def reading_from(sample: ImuSample, start: float, end: float) -> ImuReading:
    """What a sensor of the node's own gave for the cycle from ``start`` to ``end`` (s, own clock)."""
    s = sample
    return ImuReading(start, end, s.rate, s.force, s.temperature, s.saturated, s.late, s.late_std, s.parts)


def reading_of(data: Any, now: float) -> ImuReading:
    """Reading of a cycle that ended at ``now`` (s, own clock); invalid data give a reading of NaN.

    ``data`` is the start and the numbers of the IMU, or the start and a list of numbers for each IMU of a cluster.
    """
    try:
        start, *items = data
        begin = float(start)
        rows = items if items and all(isinstance(item, list | tuple) for item in items) else [items]
    except (TypeError, ValueError, OverflowError):
        return ImuReading(now - PERIOD, now, NOTHING, NOTHING)
    first, *others = [imu_reading(row, begin, now) for row in rows]
    return replace(first, others=tuple(others)) if others else first


def imu_reading(items: Any, start: float, end: float) -> ImuReading:
    """Reading of one IMU from ``start`` to ``end`` (s, own clock): three rates, three forces.

    Perhaps a temperature follows, bits of what was at its range within the cycle, by how much its window was late and
    the standard deviation of that, and mean rates about z: of what the window shows of the cycle before, and of the
    eighths of this one.
    """
    try:
        numbers = list(map(float, items))
    except (TypeError, ValueError, OverflowError):
        numbers = []
    if not (LEAST <= len(numbers) <= MOST or len(numbers) == MOST + 1 + PARTS):
        return ImuReading(start, end, NOTHING, NOTHING)
    wx, wy, wz, fx, fy, fz, *rest = numbers
    clipped = int(rest[1]) if len(rest) > 1 and math.isfinite(rest[1]) else 0
    temperature = rest[0] if rest else USUAL
    late = rest[2] if len(rest) > 2 and math.isfinite(rest[2]) else 0.0
    late_std = rest[3] if len(rest) > 3 and math.isfinite(rest[3]) else 0.0
    return ImuReading(start, end, (wx, wy, wz), (fx, fy, fz), temperature, clipped, late, late_std, tuple(rest[4:]))
