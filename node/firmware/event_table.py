"""Events of the compiled step: what every code is called, how grave it is, and what its numbers are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

from node.firmware.pending_event import PendingEvent
from node.kernels.events import Code, Fault
from node.kernels.make_up import MOVING, STARTED_ANEW, UNKNOWN
from node.kernels.record import EVENTS_KEPT
from telemetry.messages import Scalar, Severity

JOINT_REASONS: Final = {
    STARTED_ANEW: "the node was started anew meanwhile",
    UNKNOWN: "the saved yaw is not known",
    MOVING: "the string does not stand still",
}
NAMES_OF_FAULTS: Final = {fault: fault.name.lower() for fault in Fault}


@dataclass(frozen=True, slots=True)
class Told:
    """One line of the table: name of the event, its severity, and its arguments with how each is made of its number."""

    name: str
    severity: Severity
    arguments: tuple[tuple[str, Callable[[float], Scalar]], ...] = ()


def fault_name(number: float) -> str:
    """Name of a fault."""
    return NAMES_OF_FAULTS[Fault(int(number))]


def joint_reason(number: float) -> str:
    """Why a joint was not solved."""
    return JOINT_REASONS[int(number)]


YAW: Final = (("yaw_deg", float),)
MISMATCH: Final = (("mismatch_dps", float), ("spin_dps", float))
JOINT: Final = (("angle_deg", float), ("sigma_deg", float), ("marks_deg", float), ("turned", bool))
TWISTED: Final = (("torque_nm", float), ("twist_sigma_deg", float))
EVENT_TABLE: Final[dict[Code, Told]] = {
    Code.BAD_SAMPLE: Told("bad_sample", Severity.ERROR),
    Code.GYRO_SATURATED: Told("gyro_saturated", Severity.ERROR),
    Code.GYRO_STUCK: Told("gyro_stuck", Severity.ERROR),
    Code.GYRO_STEP: Told("gyro_step", Severity.ERROR, MISMATCH),
    Code.GYRO_SCALE: Told("gyro_scale", Severity.ERROR, MISMATCH),
    Code.FORCE_SATURATED: Told("force_saturated", Severity.ERROR),
    Code.FORCE_STUCK: Told("force_stuck", Severity.ERROR),
    Code.SENSOR_RECOVERED: Told("sensor_recovered", Severity.WARNING, (("after", fault_name), ("cycles", int))),
    Code.CLOCK_JUMPED: Told("clock_jumped", Severity.ERROR, (("by_s", float),)),
    Code.AIDING_UNTIMELY: Told("aiding_untimely", Severity.ERROR),
    Code.STRING_UNDER_TORQUE: Told("string_under_torque", Severity.INFO, TWISTED),
    Code.STRING_RELEASED: Told("string_released", Severity.INFO, TWISTED),
    Code.JOINT_SOLVED: Told("joint_solved", Severity.INFO, JOINT),
    Code.JOINT_CONTRADICTS_MARKS: Told("joint_contradicts_marks", Severity.WARNING, JOINT),
    Code.JOINT_NOT_SOLVED: Told("joint_not_solved", Severity.WARNING, (("reason", joint_reason), ("hops", int))),
    Code.STOPPED: Told("stopped", Severity.INFO, YAW),
    Code.STARTED: Told("started", Severity.INFO, YAW),
    Code.JOINT_OPENED: Told("joint_opened", Severity.INFO, YAW),
    Code.JOINT_CLOSED: Told("joint_closed", Severity.INFO, YAW),
    Code.BIAS_KNOWN: Told("bias_known", Severity.INFO, YAW),
    Code.REFERENCE_CHANGED: Told("reference_changed", Severity.INFO, YAW),
    Code.YAW_RESET: Told("yaw_reset", Severity.WARNING, YAW),
    Code.RATE_EXCEEDED: Told("rate_exceeded", Severity.ERROR, YAW),
    Code.RATE_RECOVERED: Told("rate_recovered", Severity.WARNING, YAW),
    Code.UNREADABLE: Told("bad_sample", Severity.ERROR, YAW),
    Code.FILTER_FAULT: Told("filter_fault", Severity.ERROR, YAW),
    Code.AIDING_REJECTED: Told("aiding_rejected", Severity.WARNING, (("sigmas", float),)),
}


def take_events(events: Any) -> Iterator[PendingEvent]:
    """Take what a node has told since the last call out of its ``events`` (one record of dtype ``EVENTS``)."""
    told, said = int(events["told"]), int(events["said"])
    events["said"] = told
    for number in range(max(said, told - EVENTS_KEPT), told):
        event = events["ring"][number % EVENTS_KEPT]
        line = EVENT_TABLE[Code(int(event["code"]))]
        values = zip(line.arguments, event["numbers"].tolist(), strict=False)
        yield line.name, line.severity, {name: made(value) for (name, made), value in values if not math.isnan(value)}
