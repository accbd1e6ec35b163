"""Every message field by field: short key on the wire, unit, range, resolution, schema version, meaning.

The one description of the wire: the msgpack codec and the tables of ``docs/wire.md`` are made from it, and signals of
a bus with few bits can be. ``telemetry.messages`` holds the same fields as Python types; a test holds both together.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

from telemetry.messages import (
    BASE,
    CONTENT_SIZE,
    MAX_SEGMENTS,
    SEGMENT_SIZE,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    DepthReading,
    Event,
    Hello,
    NodeFlag,
    NodeMode,
    NodeState,
    Receipt,
    Reply,
    SessionOffer,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
    UploadPhase,
)
from telemetry.quantities import Quantity, ValueKind


class MessageKind(IntEnum):
    """Type of a message on the wire."""

    AIDING = 1
    HELLO = 2
    TIME_REQUEST = 3
    TIME_REPLY = 4
    NODE_STATE = 5
    SURVEY_MEASUREMENT = 6
    RECEIPT = 7
    COMMAND = 8
    REPLY = 9
    EVENT = 10
    BLOCK_SEGMENT = 11
    BLOCK_STATUS = 12
    STATIC_RECORD = 13
    DEPTH_READING = 14
    SESSION_OFFER = 15


@dataclass(frozen=True, slots=True)
class MessageField(Quantity):
    """One field of a message.

    A field of a later schema version (``since``) has the value that stands for it in payloads of earlier ones
    (``before``). ``enumeration`` is the type of an integer that counts or flags something.
    """

    key: str = ""
    since: int = 1
    before: Any = None
    enumeration: type[IntEnum] | type[NodeFlag] | None = None


@dataclass(frozen=True, slots=True)
class MessageSpec:
    """One message: its type, number, how it travels, how long its sender keeps it, and its fields in order."""

    message: type[Any]
    kind: MessageKind
    travels: str
    kept: str
    fields: tuple[MessageField, ...]

    @property
    def newest(self) -> int:
        """Schema version of its newest field."""
        return max(field.since for field in self.fields)


def _number(name: str, key: str, unit: str, low: float, high: float, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.NUMBER, meaning, unit, low, high, key=key, **more)


def _integer(name: str, key: str, low: int, high: int, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.INTEGER, meaning, "1", low, high, key=key, **more)


def _variance(name: str, key: str, unit: str, high: float, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.NUMBER, meaning, unit, 0.0, high, key=key, step_db=VARIANCE_STEP, **more)


def _vector(name: str, key: str, unit: str, limit: float, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.VECTOR, meaning, unit, -limit, limit, key=key, **more)


def _covariance(name: str, key: str, unit: str, meaning: str) -> MessageField:
    return MessageField(name, ValueKind.COVARIANCE, meaning, unit, -1e6, 1e6, key=key)


def _boolean(name: str, key: str, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.BOOLEAN, meaning, key=key, **more)


def _text(name: str, key: str, meaning: str) -> MessageField:
    return MessageField(name, ValueKind.TEXT, meaning, key=key)


def _binary(name: str, key: str, low: int, high: int, meaning: str, **more: Any) -> MessageField:
    return MessageField(name, ValueKind.BINARY, meaning, "bytes", low, high, key=key, **more)


def _time(name: str, key: str, meaning: str) -> MessageField:
    return MessageField(name, ValueKind.NUMBER, meaning, "s", -LARGEST_TIME, LARGEST_TIME, key=key, step=TIME_STEP)


def _margin(name: str, key: str, where: str) -> MessageField:
    meaning = f"of the frames from {where} over the radio's threshold; inf without a radio, or with none heard"
    return MessageField(
        name, ValueKind.NUMBER, meaning, "dB", -200.0, math.inf, key=key, since=4, before=math.inf, step=0.5
    )


TURN, VARIANCE, TORQUE, U32, U53 = math.tau, 100.0, 1e6, 2**32 - 1, 2**53
ANGLE_STEP = TURN / 2**24  # rad
TIME_STEP = 1e-5  # s
LARGEST_TIME = 1e12  # s
MAX_EPOCH = U32
DEEPEST = 1e5  # m
VARIANCE_STEP = 0.5  # dB
ADDRESS = _integer("tube", "t", 0, BASE, "whose it is: 0 encoder, 1..250 tube, 251 base station")
ADDRESSEE = _integer("tube", "t", 0, BASE, "whom it is for")
SEQUENCE = _integer("sequence", "s", 0, U53, "number, with the tube its identity")
ORDER_NUMBER = _integer("sequence", "s", 0, U53, "number of the order, unique per ground station")
UPLOAD_NUMBER = _integer("sequence", "s", 0, U53, "number of the upload, unique per ground station")
HOPS = _integer("hops", "h", -1, BASE, "distance from the encoder in tubes, -1 unknown")
YAW = _number("yaw", "y", "rad", 0.0, TURN, "yaw", step=ANGLE_STEP)
YAW_VAR = _variance("yaw_var", "yv", "rad^2", VARIANCE, "random variance of the yaw")
SYSTEMATIC = _variance("systematic_var", "sv", "rad^2", VARIANCE, "constant errors of joints; never averages away")
FLAGS = _integer("flags", "f", 0, 0xFFFF, "trust in the own yaw, bits of the table below", enumeration=NodeFlag)
EPOCH = _integer("epoch", "ep", 0, MAX_EPOCH, "of rig time: starts of the encoder so far, 0 unknown", since=4, before=0)
MODE = _integer("mode", "m", 0, 7, "execution state", enumeration=NodeMode)
DIGEST = _binary("digest", "d", 32, 32, "SHA-256 of the whole block")
ARGUMENTS = MessageField("arguments", ValueKind.SCALARS, "by name", key="a")
ONE_HOP, UP, DOWN, ONCE = "one hop", "up", "down", "sent once"
EACH_HOP = "acknowledged on each hop"
RECEIPTED = "the ground station's receipt"

SCHEMA: tuple[MessageSpec, ...] = (
    MessageSpec(
        Aiding,
        MessageKind.AIDING,
        ONE_HOP,
        ONCE,
        (
            _number("yaw", "y", "rad", 0.0, TURN, "the encoder's measurement, passed on unchanged", step=ANGLE_STEP),
            YAW_VAR,
            SYSTEMATIC,
            _number("offset", "o", "rad", -TURN, TURN, "make-up angles of the joints passed so far", step=ANGLE_STEP),
            _number("rate", "r", "rad/s", -100.0, 100.0, "rate about the tube axis", step=1e-5),
            _time("valid_at", "at", "rig time at which the yaw was valid"),
            _integer("sequence", "s", 0, U53, "number of the measurement; the same number is the same one, repeated"),
            _integer("hops", "h", -1, BASE, "of the sender; 0 is the encoder"),
            _number(
                "torque",
                "q",
                "N m",
                0.0,
                TORQUE,
                "in the string: the drive's; once released what may be trapped, 1 sigma",
                since=2,
                before=0.0,
                step=1.0,
            ),
            _variance("torsion_var", "tv", "rad^2", VARIANCE, "of the twist in the tubes passed", since=2, before=0.0),
            _boolean("under_torque", "u", "the drive holds the string twisted", since=2, before=False),
            EPOCH,
            _binary(
                "seal", "m", 0, 9, "of the measurement: generation of the key, tag; empty: none", since=5, before=b""
            ),
        ),
    ),
    MessageSpec(
        Hello,
        MessageKind.HELLO,
        ONE_HOP,
        ONCE,
        (
            ADDRESS,
            _integer("boot_count", "b", 0, U32, "starts so far"),
            HOPS,
            MODE,
            _number("link_quality", "q", "1", 0.0, 1.0, "share of this side's frames received lately", step=0.01),
        ),
    ),
    MessageSpec(TimeRequest, MessageKind.TIME_REQUEST, ONE_HOP, ONCE, (_time("asked_at", "a", "clock of the asker"),)),
    MessageSpec(
        TimeReply,
        MessageKind.TIME_REPLY,
        ONE_HOP,
        ONCE,
        (
            _time("asked_at", "a", "clock of the asker, echoed"),
            _time("received_at", "r", "clock of the replier when it received the request"),
            _time("replied_at", "p", "clock of the replier when it replied"),
            _time("rig_at", "g", "rig time at replied_at"),
            _number("rig_rate", "k", "1", 0.5, 2.0, "rig seconds per second of the replier's clock", step=1e-9),
            _variance("clock_var", "v", "s^2", 1e9, "of rig_at"),
            EPOCH,
        ),
    ),
    MessageSpec(
        NodeState,
        MessageKind.NODE_STATE,
        UP,
        "sent once, the newest wins",
        (
            ADDRESS,
            _time("at", "at", "rig time"),
            HOPS,
            MODE,
            YAW,
            YAW_VAR,
            SYSTEMATIC,
            _vector("gyro_bias", "g", "rad/s", 10.0, "estimated bias of the gyroscope", step=1e-7),
            _number("scale_factor", "k", "1", -1.0, 1.0, "estimated error of the gyroscope's z scale", step=1e-6),
            _number("innovation", "i", "rad", -TURN, TURN, "of the last aiding", step=ANGLE_STEP),
            _variance("innovation_var", "iv", "rad^2", VARIANCE, "of the innovation"),
            _number(
                "aiding_age", "aa", "s", -10.0, math.inf, "since the last aiding used, inf before the first", step=0.01
            ),
            _variance("clock_var", "cv", "s^2", 1e9, "variance of the node's rig time"),
            FLAGS,
            _integer("cycles", "c", 0, U53, "since the start"),
            _integer("overruns", "ov", 0, U53, "cycles that ended too late"),
            _integer("parameters_version", "pv", 0, U32, "of the parameter block in use, 0 is the identity"),
            _binary("parameters_hash", "ph", 8, 8, "first bytes of the block's SHA-256"),
            _vector(
                "alignment",
                "al",
                "rad",
                TURN,
                "pitch, roll and standard error of the first IMU, 0 if never aligned",
                since=2,
                before=(0.0, 0.0, 0.0),
                step=1e-6,
            ),
            EPOCH,
            _integer("numbered", "nn", 0, U53, "newest number given to what is kept, 0 if none", since=4, before=0),
            _margin("upper_margin", "um", "above"),
            _margin("lower_margin", "lm", "below"),
        ),
    ),
    MessageSpec(
        SurveyMeasurement,
        MessageKind.SURVEY_MEASUREMENT,
        UP,
        RECEIPTED,
        (
            ADDRESS,
            SEQUENCE,
            _time("station_at", "at", "rig time, end of the moving average"),
            HOPS,
            MessageField(
                "imus", ValueKind.IMUS, "mean specific force of each IMU and its covariance", "m/s^2", key="i"
            ),
            YAW,
            YAW_VAR,
            SYSTEMATIC,
            _integer("samples", "n", 1, U32, "in the mean"),
            _number("settle_time", "st", "s", 0.0, 1e12, "between the stop and the end of the average", step=0.01),
            FLAGS,
            EPOCH,
        ),
    ),
    MessageSpec(
        Receipt,
        MessageKind.RECEIPT,
        DOWN,
        EACH_HOP,
        (
            ADDRESSEE,
            _integer("sequence", "s", 0, U53, "what is stored now"),
            _binary(
                "content", "c", 0, CONTENT_SIZE, "BLAKE2b of its payload; a tube forgets no other", since=4, before=b""
            ),
        ),
    ),
    MessageSpec(
        Command,
        MessageKind.COMMAND,
        DOWN,
        "its reply",
        (ADDRESSEE, ORDER_NUMBER, _text("name", "n", "of the command, see the key `cmd`"), ARGUMENTS),
    ),
    MessageSpec(
        Reply,
        MessageKind.REPLY,
        UP,
        f"{EACH_HOP}, kept for repeated commands",
        (
            ADDRESS,
            ORDER_NUMBER,
            _boolean("done", "d", "the order was obeyed"),
            _text("detail", "x", "why it was refused, or what happens now"),
            MessageField("values", ValueKind.VALUES, "what the command's table promises", key="w", since=3, before={}),
        ),
    ),
    MessageSpec(
        Event,
        MessageKind.EVENT,
        UP,
        RECEIPTED,
        (
            ADDRESS,
            SEQUENCE,
            _time("at", "at", "rig time"),
            _integer("severity", "v", 0, 2, "0 information, 1 warning, 2 error", enumeration=Severity),
            _text("code", "c", "what happened"),
            ARGUMENTS,
            EPOCH,
        ),
    ),
    MessageSpec(
        BlockSegment,
        MessageKind.BLOCK_SEGMENT,
        DOWN,
        f"{EACH_HOP}; the upload repeats it until the node has it",
        (
            ADDRESSEE,
            UPLOAD_NUMBER,
            _integer("version", "v", 1, U32, "of the block"),
            DIGEST,
            _integer("count", "n", 1, MAX_SEGMENTS, "segments of the block"),
            _integer("index", "i", 0, MAX_SEGMENTS - 1, "of this one, from 0"),
            _binary("data", "b", 1, SEGMENT_SIZE, "part of the canonical bytes"),
            _binary("tag", "g", 32, 32, "HMAC-SHA256 under the rig's key"),
        ),
    ),
    MessageSpec(
        BlockStatus,
        MessageKind.BLOCK_STATUS,
        UP,
        f"{EACH_HOP}; the next segment asks for it again",
        (
            ADDRESS,
            UPLOAD_NUMBER,
            DIGEST,
            _integer("phase", "p", 0, 4, "how far the upload has come, table below", enumeration=UploadPhase),
            _integer("received", "r", 0, 2**MAX_SEGMENTS - 1, "bit k: segment k is on the node's disk"),
            _integer("version", "v", 0, U32, "of the block in use"),
            _binary("in_use", "u", 32, 32, "SHA-256 of the block in use"),
            _text("detail", "x", "why it was refused"),
        ),
    ),
    MessageSpec(
        StaticRecord,
        MessageKind.STATIC_RECORD,
        UP,
        RECEIPTED,
        (
            ADDRESS,
            SEQUENCE,
            _integer("command", "c", 0, U53, "number of the order that asked for it"),
            _time("begun_at", "ba", "rig time"),
            _time("ended_at", "ea", "rig time"),
            _integer("samples", "n", 2, U32, "in the means"),
            _vector("rate", "w", "rad/s", 100.0, "mean, raw", step=1e-8),
            _covariance("rate_cov", "wc", "(rad/s)^2", "of one sample"),
            _vector("force", "f", "m/s^2", 1e3, "mean, raw", step=1e-6),
            _covariance("force_cov", "fc", "(m/s^2)^2", "of one sample"),
            _number("temperature", "tc", "C", -273.15, 1000.0, "mean", step=0.01),
            _boolean("moved", "m", "it was not at rest all the time"),
            EPOCH,
        ),
    ),
    MessageSpec(
        DepthReading,
        MessageKind.DEPTH_READING,
        "on its own key",
        "overwritten: every reading repeats the last stands",
        (
            _integer("sequence", "s", 0, U53, "counted up by the source"),
            _time("at", "at", "rig time"),
            _number("md", "md", "m", 0.0, DEEPEST, "of the bit", step=1e-3),
            MessageField(
                "stands", ValueKind.STANDS, "last stands of the bit, oldest first", "m", 0.0, DEEPEST, key="st"
            ),
            EPOCH,
        ),
    ),
    MessageSpec(SessionOffer, MessageKind.SESSION_OFFER, DOWN, "offered again until it is taken", (ADDRESSEE,)),
)
SPEC_OF: dict[type[Any], MessageSpec] = {spec.message: spec for spec in SCHEMA}
