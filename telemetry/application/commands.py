"""What an operator may order: one line a command, read by the node, the ground station and the documentation.

To add a command, add its line to ``COMMANDS`` and a method of its name: to ``node.process.command_handlers`` for one
that a tube obeys, to ``groundstation.service.process.operator_access`` for one that the ground station obeys itself.
Values are SI and radians; an operator reads and writes them with the unit in the name (``pitch_deg``).
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Any

from telemetry.errors import CommandError
from telemetry.messages import MAX_TUBE, Scalar
from telemetry.parameters import MAX_VERSION
from telemetry.quantities import Quantity, ValueKind
from telemetry.schema import U53

SHORTEST_RECORD, LONGEST_RECORD = 5.0, 3600.0  # s
FEWEST_TURNS, MOST_TURNS = 1.0, 20.0
FINEST_DEG = 1e-4  # standard deviation of an angle that can be told; a sigma of zero is none
SHELVED_AT_MOST = 720.0  # min, a shift
STAGES = ("synchronise", "start", "aiding", "frame", "read", "filter", "report", "save", "send", "cycle")


class ObeyedBy(enum.Enum):
    """Process that obeys a command."""

    TUBE = "tube"
    GROUND = "ground station"


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument: its range, whether it is required, and its default."""

    quantity: Quantity
    needed: bool = False
    default: Scalar = None


@dataclass(frozen=True, slots=True)
class CommandSpec:
    """One command.

    ``action`` distinguishes the steps of a command that has several. ``goes_on``: the work begins when the tube
    answers, and its result, a static record, carries the number of the order.
    """

    name: str
    by: ObeyedBy
    meaning: str
    arguments: tuple[Argument, ...] = ()
    reply: tuple[Quantity, ...] = ()
    action: str = ""
    goes_on: bool = False


def _argument(name: str, kind: ValueKind, meaning: str, **more: Any) -> Argument:
    needed, default = more.pop("needed", False), more.pop("default", None)
    return Argument(Quantity(name, kind, meaning, **more), needed, default)


def _result(name: str, kind: ValueKind, meaning: str, unit: str = "") -> Quantity:
    return Quantity(name, kind, meaning, unit)


def _angle(name: str, meaning: str, most: float) -> Argument:
    return _argument(name, ValueKind.NUMBER, meaning, unit="rad", low=-most, high=most, needed=True)


NUMBER, INTEGER, TEXT = ValueKind.NUMBER, ValueKind.INTEGER, ValueKind.TEXT
SECONDS = _argument(
    "seconds", NUMBER, "length of the record", unit="s", low=SHORTEST_RECORD, high=LONGEST_RECORD, needed=True
)
METHOD = _argument(
    "method",
    TEXT,
    "how the mount is found; none drops what was found",
    choices=("circle", "extremes", "none"),
    default="circle",
)
TURNS = _argument(
    "turns", NUMBER, "slow turns of the string to use", unit="1", low=FEWEST_TURNS, high=MOST_TURNS, default=2.0
)
VERSION = _argument(
    "version",
    INTEGER,
    "of the new block; one more than that of the tube's last state when left out",
    unit="1",
    low=1,
    high=MAX_VERSION,
)
ALARM_NUMBER = _argument("number", INTEGER, "of the alarm", unit="1", low=1, high=U53, needed=True)
SIGMA = _argument(
    "sigma", NUMBER, "standard deviation", unit="rad", low=math.radians(FINEST_DEG), high=math.pi, needed=True
)
SIGMA_M = _argument("sigma", NUMBER, "standard deviation", unit="m", low=1e-4, high=10.0, needed=True)
FILE = "file of the folder `calibrations` without its `.json`, or `identity`"
SHA256 = _result("sha256", TEXT, "hash of the parameter block in use")
ONE_AN_IMU = "one an IMU"
LONGEST_FINDING = 128  # characters of a part of a board, so that all of them are one payload
BOARD_PARTS = (
    ("sensor", "what it is"),
    ("readings", "how many of the last cycles came"),
    ("rate", "of its samples, counted beside set"),
    ("noise", "at rest"),
    ("bias", "at rest"),
    ("gravity", "at rest"),
    ("ranges", "readings at their range"),
    ("temperature", "of the sensor"),
    ("upper", "CAN controller of the upper end"),
    ("lower", "CAN controller of the lower end"),
    ("clock", "of the board"),
    ("disk", "of its state, and the room left"),
    ("keys", "generation, and until when it holds"),
    ("kernels", "whether they are compiled"),
)

COMMANDS: tuple[CommandSpec, ...] = (
    CommandSpec("take_survey", ObeyedBy.TUBE, "measures its station again at the next settled cycle"),
    CommandSpec(
        "static_record",
        ObeyedBy.TUBE,
        "averages its raw readings at rest; the record appears under `ground/static_records` with the order's number",
        (SECONDS,),
        (_result("seconds", NUMBER, "length of the record", "s"),),
        goes_on=True,
    ),
    CommandSpec(
        "parameters",
        ObeyedBy.TUBE,
        "reports the parameter block in use",
        reply=(_result("version", INTEGER, "of the block in use, 0 is the identity", "1"), SHA256),
    ),
    CommandSpec(
        "check_board",
        ObeyedBy.TUBE,
        "says of each part of its board whether it is as it should be, as `borechain board check` does; a part that it "
        "does not have is left out",
        reply=(
            _result("good", ValueKind.BOOLEAN, "whether every part is"),
            _result("wrong", TEXT, "names of the parts that are not, with commas"),
            *(_result(part, TEXT, text) for part, text in BOARD_PARTS),
        ),
    ),
    CommandSpec(
        "resend",
        ObeyedBy.TUBE,
        "sends the surveys and static records of these numbers again; the ground station orders it by itself for a gap",
        (
            _argument("first", INTEGER, "number", unit="1", low=1, high=U53, needed=True),
            _argument("last", INTEGER, "number", unit="1", low=1, high=U53, needed=True),
        ),
        (
            _result("sent", INTEGER, "messages found and sent", "1"),
            _result("complete_from", INTEGER, "number from which on the tube has kept every survey", "1"),
        ),
    ),
    CommandSpec(
        "align",
        ObeyedBy.TUBE,
        "finds the mount of its IMUs in the coming slow turns, or drops it ([operating](operate.md#alignment))",
        (METHOD, TURNS),
        (_result("method", TEXT, "in use"), _result("turns", NUMBER, "slow turns to come", "1")),
    ),
    CommandSpec(
        "alignment",
        ObeyedBy.TUBE,
        "reports the alignment in use",
        reply=(
            _result("method", TEXT, "circle, extremes or none"),
            _result("pitch", ValueKind.NUMBERS, ONE_AN_IMU, "rad"),
            _result("pitch_std", ValueKind.NUMBERS, ONE_AN_IMU, "rad"),
            _result("roll", ValueKind.NUMBERS, ONE_AN_IMU, "rad"),
            _result("roll_std", ValueKind.NUMBERS, ONE_AN_IMU, "rad"),
        ),
    ),
    CommandSpec(
        "timing",
        ObeyedBy.TUBE,
        f"reports its cycles' start delays and the durations of their stages, with an own clock: {', '.join(STAGES)}",
        reply=(
            _result("cycles", INTEGER, "since the start", "1"),
            _result("overruns", INTEGER, "cycles that ended too late", "1"),
            *(
                _result(f"{stage}_{which}", NUMBER, f"of {stage}, {text}; left out where nothing was measured", "s")
                for stage in STAGES
                for which, text in (("p99", "99th percentile"), ("max", "largest"))
            ),
        ),
    ),
    CommandSpec(
        "upload_parameters",
        ObeyedBy.GROUND,
        "sends the tube a new parameter block until the tube has judged it",
        (_argument("gyroscope", TEXT, FILE, needed=True), _argument("accelerometer", TEXT, FILE, needed=True), VERSION),
        (
            _result("phase", TEXT, "applied, refused or untrusted"),
            _result("version", INTEGER, "of the block in use", "1"),
            SHA256,
        ),
    ),
    CommandSpec(
        "accept_depth",
        ObeyedBy.GROUND,
        "accepts the present depth, after it jumped and the crew has measured it again",
        action="confirm",
    ),
    CommandSpec(
        "accept_joints",
        ObeyedBy.GROUND,
        "accepts the present angles of the joints, after a joint was made up anew or its yaws were checked",
        action="confirm",
    ),
    CommandSpec(
        "alarm",
        ObeyedBy.GROUND,
        "confirms that the sender knows of the alarm; a later sender is told who was first",
        (ALARM_NUMBER,),
        action="acknowledge",
    ),
    CommandSpec(
        "alarm",
        ObeyedBy.GROUND,
        "shelves the alarm for a time",
        (
            ALARM_NUMBER,
            _argument("minutes", NUMBER, "until it is back", unit="min", low=1.0, high=SHELVED_AT_MOST, default=30.0),
        ),
        action="shelve",
    ),
    CommandSpec("alarm", ObeyedBy.GROUND, "takes a shelved alarm back", (ALARM_NUMBER,), action="unshelve"),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "starts a calibration in the field and asks the tubes for their blocks in use",
        (_argument("tubes", ValueKind.INTEGERS, "as 1,2,3; those of the string when left out", low=1, high=MAX_TUBE),),
        action="begin",
    ),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "the tubes now rest at this attitude: asks each for a static record",
        (
            _argument("pitch", NUMBER, "of the tubes' axis", unit="rad", low=-math.pi, high=math.pi, needed=True),
            _argument("roll", NUMBER, "about the tubes' axis", unit="rad", low=-math.pi, high=math.pi, needed=True),
            SECONDS,
        ),
        action="attitude",
    ),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "solves what has come; the reply shows the proposed blocks and their `proposal`",
        action="solve",
    ),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "uploads the proposed blocks, if they are those that were shown",
        (_argument("proposal", TEXT, "hash that the solution showed", needed=True),),
        action="confirm",
    ),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "ends the calibration; a block that a tube has stays there",
        action="cancel",
    ),
    CommandSpec(
        "recalibrate",
        ObeyedBy.GROUND,
        "proposes the accelerometer biases that the surveys of the hole show, in place of attitudes and `solve`",
        action="surveys",
    ),
    CommandSpec(
        "north",
        ObeyedBy.GROUND,
        "tells where the encoder's zero points; the surveys of before are adjusted to it",
        (_angle("angle", "of the encoder's zero, from site north, clockwise", math.tau), SIGMA),
        action="tell",
    ),
    CommandSpec(
        "north",
        ObeyedBy.GROUND,
        "checks what was told of north by a second bearing, taken by itself; it does not take the place of the first",
        (_angle("angle", "of the encoder's zero, from site north, clockwise", math.tau), SIGMA),
        action="check",
    ),
    CommandSpec(
        "collar",
        ObeyedBy.GROUND,
        "tells the direction of the hole at the collar; what the first station says against it is told back",
        (
            _argument("inclination", NUMBER, "from vertical", unit="rad", low=0.0, high=math.pi, needed=True),
            _angle("azimuth", "of the lean, from site north", math.tau),
            SIGMA,
        ),
        action="tell",
    ),
    CommandSpec(
        "joint",
        ObeyedBy.GROUND,
        "tells the angle of the joint at the upper end of a tube, of which its node was told none or another",
        (
            _angle("angle", "read from the scribe marks, the part above to this tube", math.tau),
            SIGMA,
            _argument(
                "used",
                NUMBER,
                "angle that the node was told; left out where it was told none",
                unit="rad",
                low=-math.tau,
                high=math.tau,
            ),
            _argument(
                "upper",
                INTEGER,
                "the part above: the tube there when left out; 0 is the drive head, from which each tube hung once",
                unit="1",
                low=0,
                high=MAX_TUBE,
            ),
        ),
    ),
    CommandSpec(
        "length",
        ObeyedBy.GROUND,
        "tells the measured length of a tube",
        (_argument("length", NUMBER, "from shoulder to shoulder", unit="m", low=0.1, high=20.0, needed=True), SIGMA_M),
    ),
    CommandSpec(
        "stick_up",
        ObeyedBy.GROUND,
        "tells how far the zero of the depth is over the collar",
        (_argument("height", NUMBER, "over the collar", unit="m", low=-20.0, high=20.0, needed=True), SIGMA_M),
        action="tell",
    ),
    CommandSpec(
        "stick_up",
        ObeyedBy.GROUND,
        "checks what was told of the stick-up by a second reading, as with the bit at the collar's edge",
        (_argument("height", NUMBER, "over the collar", unit="m", low=-20.0, high=20.0, needed=True), SIGMA_M),
        action="check",
    ),
    CommandSpec(
        "same_number",
        ObeyedBy.GROUND,
        "tells which of two tubes that give themselves one number is the tube; the other one is not used",
        (_argument("which", TEXT, "of both", choices=("upper", "lower"), needed=True),),
    ),
    CommandSpec(
        "setup",
        ObeyedBy.GROUND,
        "takes back what was told last and stands: north, collar, joint, length, stick-up, same number, or a check",
        action="undo",
    ),
)
NAMES = tuple(dict.fromkeys(spec.name for spec in COMMANDS))


def find_command(name: str, action: str = "") -> CommandSpec:
    """Return the table's line of a command.

    Raises
    ------
    CommandError
        When there is no such command; the message lists the known ones.
    """
    lines = [spec for spec in COMMANDS if spec.name == name]
    if not lines:
        raise CommandError(f"expected cmd/{'|'.join(NAMES)}, got {name!r:.40}")
    for spec in lines:
        if spec.action == action:
            return spec
    if not any(spec.action for spec in lines):
        raise CommandError(f"cmd/{name}: expected no action, got {action!r:.40}")
    raise CommandError(f"expected cmd/{name}?action={'|'.join(spec.action for spec in lines)}, got {action!r:.40}")
