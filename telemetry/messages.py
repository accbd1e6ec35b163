"""What is said on the string: one frozen definition a message, SI units and radians.

Addresses are integers: ``ENCODER`` on the drive head, ``BASE`` the surface end, 1..``MAX_TUBE`` the tubes in
the order of their first use (the first one drilled is the lowest). Times named ``*_at`` are seconds of rig time, the
encoder node's clock, unless the field says that they are a node's own clock. An encoder that starts again may count
from another zero, so rig time is a pair: every message with such a time names the ``epoch``, the start of the encoder
that it counts from (``EPOCH_UNKNOWN`` where the sender is of an earlier schema).
"""

from __future__ import annotations

import enum
import math
from typing import TypeAlias

from telemetry.frozen import Frozen, field

SCHEMA_VERSION = 5  # the newest; a payload carries the earliest that can say it
ENCODER = 0
MAX_TUBE = 250
BASE = 251

Vector3: TypeAlias = tuple[float, float, float]
Matrix3: TypeAlias = tuple[Vector3, Vector3, Vector3]
Scalar: TypeAlias = bool | int | float | str | None
Value: TypeAlias = Scalar | tuple[float, ...]
HOPS_UNKNOWN = -1
EPOCH_UNKNOWN = 0
CONTENT_SIZE = 16  # bytes of the hash that a receipt names
SEGMENT_SIZE = 192  # bytes of a block in one message; eight such messages and their frame stay below 4 KiB
MAX_SEGMENTS = 32
UNKNOWN_YAW_STD = math.pi / math.sqrt(3.0)  # rad, of a yaw that may be any: uniform on the circle


def address_name(address: int) -> str:
    """Name of an address in key expressions: ``encoder``, ``base`` or the tube's number."""
    return {ENCODER: "encoder", BASE: "base"}.get(address, str(address))


class Side(enum.IntEnum):
    """The two ends of a tube: ``UPPER`` looks to the rig, ``LOWER`` to the bit."""

    UPPER = 0
    LOWER = 1


class NodeMode(enum.IntEnum):
    """State of a node (execution states, node specification section 2)."""

    BOOT = 0
    STATIC_BIAS = 1
    ALIGNMENT = 2
    TRACKING = 3
    STILL = 4
    SURVEY = 5
    HELD = 6
    FAULT = 7


class Severity(enum.IntEnum):
    """How much an event matters to the crew."""

    INFO = 0
    WARNING = 1
    ERROR = 2


class NodeFlag(enum.IntFlag):
    """What a node says of the trust in its own yaw."""

    NONE = 0
    YAW_UNTRUSTED = 1
    AIDING_OLD = 2
    INNOVATION_REJECTED = 4
    RATE_EXCEEDED = 8
    RESTORED = 16
    CLOCK_UNSYNCHRONISED = 32
    BIAS_UNKNOWN = 64
    SENSOR_FAULT = 128  # a sensor is faulty, or has not yet proved itself again
    NOT_SAVED = 256  # the node's disk refuses: a cut now loses what came since
    DRIVE_UNTOLD = 512  # it hangs from the drive head by a joint whose angle it was not told
    LOWER_UNTOLD = 1024  # nor was it told the angle of the joint to the tube below


class UploadPhase(enum.IntEnum):
    """How far the upload of a parameter block has come at the node."""

    PARTIAL = 0  # segments are missing
    WAITING = 1  # whole and checked, to be applied when the node stands still
    APPLIED = 2  # on the node's disk and in use
    REFUSED = 3  # the detail says why; the block before stays in use
    UNTRUSTED = 4  # this segment was not made with the key of the rig


class Aiding(Frozen):
    """The yaw reference on its way down. ``yaw`` is the measurement, passed on unchanged by the scheme ``forward``.

    The yaw of the receiver is ``yaw + offset`` (make-up angles of the joints passed so far), with the independent
    variances ``yaw_var`` (random), ``systematic_var`` (constant errors of joints; never averages away) and
    ``torsion_var`` (constant while the torque is). The last three fields came with schema version 2.
    """

    yaw: float  # rad, [0, 2 pi)
    yaw_var: float  # rad^2, > 0
    systematic_var: float  # rad^2, >= 0
    offset: float  # rad, (-pi, pi]
    rate: float  # rad/s about the tube axis
    valid_at: float  # s, rig time
    sequence: int  # number of the measurement: the same number is the same measurement, repeated
    hops: int  # of the sender, 0 is the encoder
    torque: float = 0.0  # N m >= 0, in the string: the drive's, or once released what may be trapped, 1 sigma
    torsion_var: float = 0.0  # rad^2, of the twist by it in the tubes passed, beside systematic_var
    under_torque: bool = False  # the drive holds the string twisted
    epoch: int = EPOCH_UNKNOWN
    seal: bytes = b""  # of the measurement, under a key of the rig; empty without keys


class Hello(Frozen):
    """Who is at the other end of this joint."""

    tube: int
    boot_count: int
    hops: int  # from the encoder, HOPS_UNKNOWN before an upper neighbour told
    mode: NodeMode
    link_quality: float  # 0..1, share of this side's frames lately acknowledged or expected and received


class TimeRequest(Frozen):
    """First half of a two-way time exchange over one joint."""

    asked_at: float  # s, clock of the asker


class TimeReply(Frozen):
    """Second half of the exchange: the neighbour tells its own clock, and what it knows of rig time."""

    asked_at: float  # s, clock of the asker, echoed
    received_at: float  # s, clock of the replier
    replied_at: float  # s, clock of the replier
    rig_at: float  # s, rig time at replied_at, as the replier knows it
    rig_rate: float  # rig seconds per second of the replier's clock
    clock_var: float  # s^2, variance of rig_at
    epoch: int = EPOCH_UNKNOWN  # of rig_at


class NodeState(Frozen):
    """A node's account of itself, best effort, latest wins."""

    tube: int
    at: float  # s, rig time
    hops: int
    mode: NodeMode
    yaw: float  # rad, [0, 2 pi)
    yaw_var: float  # rad^2, random part
    systematic_var: float  # rad^2
    gyro_bias: Vector3  # rad/s
    scale_factor: float  # 1, estimated error of the gyroscope's z scale
    innovation: float  # rad, of the last aiding
    innovation_var: float  # rad^2
    aiding_age: float  # s since the last aiding used, inf before the first
    clock_var: float  # s^2, of the node's rig time
    flags: NodeFlag
    cycles: int
    overruns: int
    parameters_version: int = 0  # of the block in use, 0 is the identity
    parameters_hash: bytes = bytes(8)  # first bytes of its SHA-256
    alignment: Vector3 = (0.0, 0.0, 0.0)  # rad: pitch, roll and their standard error, 0 if not aligned
    epoch: int = EPOCH_UNKNOWN
    numbered: int = 0  # newest number given to a survey, event or record; 0 if none, or not told
    upper_margin: float = math.inf  # dB, of the frames heard from above over the radio's threshold; inf: no radio
    lower_margin: float = math.inf  # dB, the same from below


class ImuMean(Frozen, array_like=True):
    """Mean specific force of one IMU over the moving average of a stop, body frame, calibrated; a list on the wire."""

    force: Vector3  # m/s^2
    force_cov: Matrix3  # (m/s^2)^2, covariance of the mean


class SurveyMeasurement(Frozen):
    """One cluster at one stop. ``(tube, sequence)`` is its identity; kept by the tube until a ``Receipt`` came."""

    tube: int
    sequence: int
    station_at: float  # s, rig time, end of the moving average
    hops: int
    imus: tuple[ImuMean, ...]
    yaw: float  # rad
    yaw_var: float  # rad^2, random
    systematic_var: float  # rad^2
    samples: int
    settle_time: float  # s between the stop and the end of the average
    flags: NodeFlag
    epoch: int = EPOCH_UNKNOWN


class Receipt(Frozen):
    """The ground station stored the message ``(tube, sequence)`` of this content; the tube may forget that one."""

    tube: int
    sequence: int
    content: bytes = b""  # hash of the payload, ``telemetry.presentation.content``


class Command(Frozen):
    """An order to one node, acknowledged by a ``Reply`` with the same ``sequence`` (unique per ground station)."""

    tube: int  # addressee
    sequence: int
    name: str  # one of telemetry.application.commands
    arguments: dict[str, Scalar] = field(default_factory=dict)


class Reply(Frozen):
    """Outcome of a command. ``values`` came with schema version 3."""

    tube: int  # who answers
    sequence: int  # of the command
    done: bool
    detail: str  # why it was refused, or what happens now; for people, never to be parsed
    values: dict[str, Value] = field(default_factory=dict)  # what the table of commands promises


class Event(Frozen):
    """Something that happened. Shares the sequence with survey measurements and is acknowledged the same way."""

    tube: int
    sequence: int
    at: float  # s, rig time
    severity: Severity
    code: str
    arguments: dict[str, Scalar] = field(default_factory=dict)
    epoch: int = EPOCH_UNKNOWN


class BlockSegment(Frozen):
    """One part of a parameter block on its way to a node, answered by a ``BlockStatus``."""

    tube: int  # addressee
    sequence: int  # of the upload, unique per ground station
    version: int  # of the block, >= 1
    digest: bytes  # SHA-256 of the whole block
    count: int  # segments of the block
    index: int  # of this one, from 0
    data: bytes
    tag: bytes  # HMAC-SHA256 under the rig's key of all the above


class BlockStatus(Frozen):
    """A node's account of an upload, and of the block that it uses meanwhile."""

    tube: int
    sequence: int  # of the upload
    digest: bytes  # of the block that is uploaded
    phase: UploadPhase
    received: int  # bit k: segment k is on the node's disk
    version: int  # of the block in use
    in_use: bytes  # SHA-256 of the block in use
    detail: str


class StaticRecord(Frozen):
    """Raw readings averaged at rest, before any correction. Kept and receipted like a survey measurement."""

    tube: int
    sequence: int
    command: int  # sequence of the command that asked for it
    begun_at: float  # s, rig time
    ended_at: float  # s, rig time
    samples: int
    rate: Vector3  # rad/s
    rate_cov: Matrix3  # (rad/s)^2, of one sample
    force: Vector3  # m/s^2
    force_cov: Matrix3  # (m/s^2)^2, of one sample
    temperature: float  # C, mean
    moved: bool  # it was not at rest all the time
    epoch: int = EPOCH_UNKNOWN


class Stand(Frozen, array_like=True):
    """The bit stood at one depth; a list on the wire."""

    epoch: int
    begun_at: float  # s, rig time
    ended_at: float  # s, rig time; of the last stand so far
    md: float  # m


class DepthReading(Frozen):
    """Depth of the bit, from the rig to the ground station on a key of its own.

    Every reading repeats the last stands of the bit, so a ground station that was off can place what came meanwhile.
    """

    sequence: int  # counted up by the source
    at: float  # s, rig time
    md: float  # m, of the bit
    stands: tuple[Stand, ...]  # the oldest first
    epoch: int = EPOCH_UNKNOWN  # a source that does not know it is taken to mean the present one


class SessionOffer(Frozen):
    """The base offers a session to a tube whose seals it does not know; the numbers are in its own seal."""

    tube: int  # addressee


Message: TypeAlias = (
    Aiding
    | Hello
    | TimeRequest
    | TimeReply
    | NodeState
    | SurveyMeasurement
    | Receipt
    | Command
    | Reply
    | Event
    | BlockSegment
    | BlockStatus
    | StaticRecord
    | DepthReading
    | SessionOffer
)
Kept: TypeAlias = SurveyMeasurement | Event | StaticRecord  # by a tube until its receipt came
