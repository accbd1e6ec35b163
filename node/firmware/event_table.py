"""Events of the compiled step: what every code is called, how grave it is, and what its numbers are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

from node.firmware.alignment_orders import NAMES_OF_METHODS
from node.firmware.pending_event import PendingEvent
from node.kernels.arithmetic.formats import DEG
from node.kernels.record.events import Code, Fault
from node.kernels.record.node_record import EVENTS_KEPT
from node.kernels.sensors.aligner import FASTEST, LARGEST_OFFSET, MOST_LEAN, PATIENCE, Reason
from node.kernels.string.make_up import MOVING, STARTED_ANEW, UNKNOWN
from telemetry.messages import Scalar, Severity

JOINT_REASONS: Final = {
    STARTED_ANEW: "the node was started anew meanwhile",
    UNKNOWN: "the saved yaw is not known",
    MOVING: "the string does not stand still",
}
NAMES_OF_FAULTS: Final = {fault: fault.name.lower() for fault in Fault}


@dataclass(frozen=True, slots=True)
class EventSpec:
    """One line of the table: the event's name, severity and meaning, and how each argument is made of its number.

    Where an argument is made of several numbers, ``words`` makes all of them.
    """

    name: str
    severity: Severity
    meaning: str
    arguments: tuple[tuple[str, Callable[[float], Scalar]], ...] = ()
    words: Callable[[Sequence[float]], dict[str, Scalar]] | None = None


def fault_name(number: float) -> str:
    """Name of a fault."""
    return NAMES_OF_FAULTS[Fault(int(number))]


def exclusion_reason(number: float) -> str:
    """Why an IMU was left out: its fault, or none and the others disagree with it."""
    return fault_name(number) if number else "disagrees"


def joint_reason(number: float) -> str:
    """Why a joint was not solved."""
    return JOINT_REASONS[int(number)]


def method_name(number: float) -> str:
    """Name of a method of alignment."""
    return NAMES_OF_METHODS[int(number)]


def alignment_refused(numbers: Sequence[float]) -> dict[str, Scalar]:
    """Why an alignment ended without an offset: reason, turns, IMU (0: all), and two numbers of the reason."""
    number, turns, imu, a, b = numbers[:5]
    text = alignment_reason(number, turns, a, b)
    return {"reason": f"IMU {int(imu)}: {text}" if imu else text, "turns": turns}


def alignment_dropped(numbers: Sequence[float]) -> dict[str, Scalar]:
    """Why the offset in use was forgotten."""
    return {"reason": alignment_reason(numbers[0], 0.0, math.nan, math.nan)}


def alignment_reason(number: float, turns: float, a: float, b: float) -> str:
    """Text of a reason; ``a`` and ``b`` are its numbers, angles in degrees."""
    return {
        Reason.CYCLES_LOST: "cycles were lost",
        Reason.SENSOR_FAULTY: "a sensor is faulty",
        Reason.TOO_FAST: f"too fast: {a:.3g} deg/s, expected at most {FASTEST / DEG:g}",
        Reason.TURNED_BACK: "the string turned back",
        Reason.NEVER_TURNED: f"timed out: the string stood still for {PATIENCE:g} s",
        Reason.TOO_FEW_TURNS: f"too few turns: the string stood still after {turns:.2f} of {a:g}",
        Reason.TOO_LONG: f"timed out after {turns:.2f} of {a:g} turns",
        Reason.NO_CIRCLE: "the turn determines no circle",
        Reason.SHAKES: f"the string shakes: {a:.3g} deg, expected at most {b:.3g}",
        Reason.LITTLE_LEAN: f"too little lean: {a:.3g} deg, expected at least {b:.3g}",
        Reason.MUCH_LEAN: f"too much lean: {a:.3g} deg, expected at most {MOST_LEAN / DEG:g}",
        Reason.LARGE_OFFSET: f"offset of {a:.3g} deg, expected at most {LARGEST_OFFSET / DEG:g}",
        Reason.ORDERED: "ordered",
        Reason.OTHER_ACCELEROMETER: "another block for the accelerometer",
        Reason.OTHER_GYROSCOPE: "another block for the gyroscope",
    }[Reason(int(number))]


YAW: Final = (("yaw_deg", float),)
MISMATCH: Final = (("mismatch_dps", float), ("spin_dps", float))
JOINT: Final = (("angle_deg", float), ("sigma_deg", float), ("marks_deg", float), ("turned", bool))
TWISTED: Final = (("torque_nm", float), ("twist_sigma_deg", float))
MOUNTED: Final = (
    ("imu", int),
    ("method", method_name),
    ("turns", float),
    ("pitch_deg", float),
    ("roll_deg", float),
    ("pitch_std_deg", float),
    ("roll_std_deg", float),
    ("lean_deg", float),
    ("noise_deg", float),
    ("samples", int),
)
EVENT_TABLE: Final[dict[Code, EventSpec]] = {
    Code.BAD_SAMPLE: EventSpec("bad_sample", Severity.ERROR, "a reading was not finite; neither sensor is used"),
    Code.GYRO_SATURATED: EventSpec(
        "gyro_saturated", Severity.ERROR, "the gyroscope was at its range; the encoder's rate stands for its own"
    ),
    Code.GYRO_STUCK: EventSpec(
        "gyro_stuck", Severity.ERROR, "the gyroscope repeats itself bit for bit; the encoder's rate stands for its own"
    ),
    Code.GYRO_STEP: EventSpec(
        "gyro_step", Severity.ERROR, "the gyroscope's bias took a step; the constant bias takes it", MISMATCH
    ),
    Code.GYRO_SCALE: EventSpec(
        "gyro_scale", Severity.ERROR, "the gyroscope's scale changed; its variance is opened", MISMATCH
    ),
    Code.FORCE_SATURATED: EventSpec(
        "force_saturated", Severity.ERROR, "the accelerometer was at its range; no levelling and no survey by it"
    ),
    Code.FORCE_STUCK: EventSpec(
        "force_stuck", Severity.ERROR, "the accelerometer repeats itself bit for bit; no levelling and no survey by it"
    ),
    Code.SENSOR_RECOVERED: EventSpec(
        "sensor_recovered",
        Severity.WARNING,
        "a flagged sensor has proved itself and is used again",
        (("after", fault_name), ("cycles", int)),
    ),
    Code.CLOCK_JUMPED: EventSpec(
        "clock_jumped",
        Severity.ERROR,
        "the node's clock jumped; what was timed before is dropped and the yaw is unknown",
        (("by_s", float),),
    ),
    Code.AIDING_UNTIMELY: EventSpec(
        "aiding_untimely", Severity.ERROR, "an aiding's time is invalid or in the future; it is not used"
    ),
    Code.STRING_UNDER_TORQUE: EventSpec(
        "string_under_torque", Severity.INFO, "the string came under torque, which may turn this tube", TWISTED
    ),
    Code.STRING_RELEASED: EventSpec(
        "string_released", Severity.INFO, "the drive let the string go; what twist may be trapped is told", TWISTED
    ),
    Code.JOINT_SOLVED: EventSpec(
        "joint_solved", Severity.INFO, "the yaw below a new joint is that of the string that stood still", JOINT
    ),
    Code.JOINT_CONTRADICTS_MARKS: EventSpec(
        "joint_contradicts_marks",
        Severity.WARNING,
        "the solved joint and its scribe marks differ by more than 4 sigmas; read the marks again",
        JOINT,
    ),
    Code.JOINT_NOT_SOLVED: EventSpec(
        "joint_not_solved",
        Severity.WARNING,
        "a new joint was not solved; its marks are used",
        (("reason", joint_reason), ("hops", int)),
    ),
    Code.STOPPED: EventSpec("stopped", Severity.INFO, "the string came to rest", YAW),
    Code.STARTED: EventSpec("started", Severity.INFO, "the string turns", YAW),
    Code.JOINT_OPENED: EventSpec("joint_opened", Severity.INFO, "the tube above is gone; the node holds its yaw", YAW),
    Code.JOINT_CLOSED: EventSpec("joint_closed", Severity.INFO, "a tube is above again", YAW),
    Code.BIAS_KNOWN: EventSpec("bias_known", Severity.INFO, "the gyroscope's constant bias is learnt", YAW),
    Code.REFERENCE_CHANGED: EventSpec(
        "reference_changed", Severity.INFO, "the aiding comes over other joints than before", YAW
    ),
    Code.YAW_RESET: EventSpec(
        "yaw_reset", Severity.WARNING, "five aidings in a row contradicted the yaw; it starts anew from the aiding", YAW
    ),
    Code.RATE_EXCEEDED: EventSpec(
        "rate_exceeded", Severity.ERROR, "the string turns too fast to be followed; the yaw is unknown", YAW
    ),
    Code.RATE_RECOVERED: EventSpec("rate_recovered", Severity.WARNING, "the string is slow enough again", YAW),
    Code.UNREADABLE: EventSpec("bad_sample", Severity.ERROR, "the filter was given a reading that is not finite", YAW),
    Code.FILTER_FAULT: EventSpec(
        "filter_fault",
        Severity.ERROR,
        "the filter's covariance was invalid; it starts over with its constant bias",
        YAW,
    ),
    Code.AIDING_REJECTED: EventSpec(
        "aiding_rejected",
        Severity.WARNING,
        "an aiding is farther from the yaw than its gate allows",
        (("sigmas", float),),
    ),
    Code.ALIGNMENT_BEGUN: EventSpec(
        "alignment_begun",
        Severity.INFO,
        "an alignment was ordered; the node waits for the string to turn slowly",
        (("method", method_name), ("turns", float)),
    ),
    Code.ALIGNMENT_TURNING: EventSpec(
        "alignment_turning",
        Severity.INFO,
        "the string turns steadily; the alignment takes it in",
        (("rate_dps", float),),
    ),
    Code.ALIGNED: EventSpec("aligned", Severity.INFO, "the mount of an IMU was found and is in use", MOUNTED),
    Code.ALIGNMENT_REFUSED: EventSpec(
        "alignment_refused",
        Severity.WARNING,
        "the alignment ended without a mount; the one before stays in use",
        words=alignment_refused,
    ),
    Code.ALIGNMENT_DROPPED: EventSpec(
        "alignment_dropped", Severity.WARNING, "the mounts in use were forgotten", words=alignment_dropped
    ),
    Code.IMU_EXCLUDED: EventSpec(
        "imu_excluded",
        Severity.ERROR,
        "an IMU of the cluster is left out of the fused reading",
        (("imu", int), ("reason", exclusion_reason)),
    ),
    Code.IMU_BACK: EventSpec("imu_back", Severity.WARNING, "an IMU left out is used again", (("imu", int),)),
    Code.BIAS_MOVED: EventSpec(
        "bias_moved",
        Severity.WARNING,
        "at rest the gyroscope's bias was another one than the one in use, and is learnt again",
        (("moved_dps", float),),
    ),
    Code.AIDING_DOUBTED: EventSpec(
        "aiding_doubted",
        Severity.WARNING,
        "gyroscope and aiding differ by more than their noise, again and again; the yaw's variance says so",
        (("times", float), ("sigma_deg", float)),
    ),
    Code.ENCODER_REVERSED: EventSpec(
        "encoder_reversed",
        Severity.ERROR,
        "the encoder counts against the gyroscope, as fast; while the head turns its aidings are not used",
        (("encoder_dps", float), ("spin_dps", float)),
    ),
    Code.ENCODER_STANDS: EventSpec(
        "encoder_stands",
        Severity.ERROR,
        "the encoder tells of a head at rest while the gyroscope goes on turning; until it counts again it is not used",
        (("spin_dps", float),),
    ),
    Code.AXES_EXCHANGED: EventSpec(
        "axes_exchanged",
        Severity.ERROR,
        "gravity goes around against the gyroscope: x and y of the sensors are exchanged; the node exchanges them back",
    ),
    Code.STRING_TURNED: EventSpec(
        "string_turned",
        Severity.WARNING,
        "the string turned below a head at rest: it ran on, unwinds or creeps; the yaw's variance says so",
        (("sigmas", float), ("turned_deg", float)),
    ),
    Code.ENCODER_RATIO: EventSpec(
        "encoder_ratio",
        Severity.ERROR,
        "encoder and gyroscope turn in a constant ratio that is not one: another number of lines, or a wrong scale; "
        "nothing is known of the yaw until the node starts as new",
        (("ratio", float),),
    ),
}


def take_events(events: Any) -> Iterator[PendingEvent]:
    """Take what a node has told since the last call out of its ``events`` (one record of dtype ``EVENTS``)."""
    told, said = int(events["told"]), int(events["said"])
    events["said"] = told
    for number in range(max(said, told - EVENTS_KEPT), told):
        event = events["ring"][number % EVENTS_KEPT]
        line = EVENT_TABLE[Code(int(event["code"]))]
        numbers = event["numbers"].tolist()
        yield line.name, line.severity, line.words(numbers) if line.words else arguments_of(line, numbers)


def arguments_of(line: EventSpec, numbers: Sequence[float]) -> dict[str, Scalar]:
    """Arguments of an event, each made of its number; without those whose number is none."""
    values = zip(line.arguments, numbers, strict=False)
    return {name: made(value) for (name, made), value in values if not math.isnan(value)}
