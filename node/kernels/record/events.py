"""Events of a node: codes with arguments in a ring of its record, until they are taken out."""

from __future__ import annotations

import enum
from typing import Any, Final

from node.kernels.arithmetic.formats import DEG
from node.kernels.arithmetic.integers import multiply_q31, rounded_shift
from node.kernels.arithmetic.jit import kernel
from node.kernels.arithmetic.operations import by_type
from node.kernels.record.node_record import EVENTS_KEPT

TOLD_Q: Final = 24  # of the numbers of an event
TO_DEGREES: Final = round(2.0**25 / DEG)


class Fault(enum.IntEnum):
    """What is wrong with a sensor; the number is the code of its event."""

    NONE = 0
    BAD_SAMPLE = 1
    GYRO_SATURATED = 2
    GYRO_STUCK = 3
    GYRO_STEP = 4
    GYRO_SCALE = 5
    FORCE_SATURATED = 6
    FORCE_STUCK = 7


class Code(enum.IntEnum):
    """Events of the step; ``node.firmware.event_table`` has their names, severities and texts."""

    BAD_SAMPLE = 1
    GYRO_SATURATED = 2
    GYRO_STUCK = 3
    GYRO_STEP = 4
    GYRO_SCALE = 5
    FORCE_SATURATED = 6
    FORCE_STUCK = 7
    SENSOR_RECOVERED = 8
    CLOCK_JUMPED = 9
    AIDING_UNTIMELY = 10
    STRING_UNDER_TORQUE = 11
    STRING_RELEASED = 12
    JOINT_SOLVED = 13
    JOINT_CONTRADICTS_MARKS = 14
    JOINT_NOT_SOLVED = 15
    STOPPED = 16
    STARTED = 17
    JOINT_OPENED = 18
    JOINT_CLOSED = 19
    BIAS_KNOWN = 20
    REFERENCE_CHANGED = 21
    YAW_RESET = 22
    RATE_EXCEEDED = 23
    RATE_RECOVERED = 24
    UNREADABLE = 25
    FILTER_FAULT = 26
    AIDING_REJECTED = 27
    ALIGNMENT_BEGUN = 28
    ALIGNMENT_TURNING = 29
    ALIGNED = 30
    ALIGNMENT_REFUSED = 31
    ALIGNMENT_DROPPED = 32
    IMU_EXCLUDED = 33
    IMU_BACK = 34
    BIAS_MOVED = 35
    AIDING_DOUBTED = 36
    ENCODER_REVERSED = 37
    ENCODER_STANDS = 38
    AXES_EXCHANGED = 39
    STRING_TURNED = 40
    ENCODER_RATIO = 41


@by_type(lambda like, count: count << TOLD_Q)
def event_count(like: float, count: int) -> float:
    """A count as a number of an event, in the form of ``like``."""
    return float(count)


@by_type(lambda a, q: rounded_shift(a, q - TOLD_Q))
def event_number(a: float, q: int) -> float:
    """A quantity in Q``q`` as a number of an event."""
    return a


@by_type(lambda a, q: rounded_shift(multiply_q31(a, TO_DEGREES), q - 6 - TOLD_Q))
def event_degrees(a: float, q: int) -> float:
    """An angle or rate in Q``q`` as a number of an event, deg or deg/s."""
    return a / DEG


@kernel
def queue_event(node: Any, code: int, a: float, b: float, c: float, d: float) -> None:
    """Put an event with up to four numbers (``NONE``: none) into the ring; where it is full the oldest is lost.

    In integers the numbers are in Q24. Further numbers are those of ``extend_event``.
    """
    events = node.events
    event = events.ring[events.told % EVENTS_KEPT]
    event.code = code
    event.numbers[0] = a
    event.numbers[1] = b
    event.numbers[2] = c
    event.numbers[3] = d
    events.told += 1


@kernel
def extend_event(node: Any, first: int, a: float, b: float, c: float) -> None:
    """Give the event told last three numbers more, from place ``first`` on."""
    events = node.events
    numbers = events.ring[(events.told - 1) % EVENTS_KEPT].numbers
    numbers[first] = a
    numbers[first + 1] = b
    numbers[first + 2] = c
