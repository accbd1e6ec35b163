"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

One table names every field, its short key and its range; encoding and decoding both check it. A relay reads the
envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import msgpack

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import (
    BASE,
    MAX_SEGMENTS,
    SCHEMA_VERSION,
    SEGMENT_SIZE,
    Aiding,
    BlockSegment,
    BlockStatus,
    Command,
    Event,
    Hello,
    Message,
    Mode,
    NodeFlag,
    NodeState,
    Receipt,
    Reply,
    Severity,
    StaticRecord,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
    UploadPhase,
)
from telemetry.presentation.fields import (
    MAX_BINARY,
    Field,
    arguments,
    binary,
    covariance,
    imus,
    number,
    pack_imu,
    same,
    text,
    truth,
    vector,
    whole,
)

MAX_PAYLOAD = 4096
TURN = 2.0 * math.pi
NO_TARGET = 255


class Kind(IntEnum):
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


@dataclass(frozen=True, slots=True)
class Envelope:
    """What a relay needs to know of a payload."""

    kind: Kind
    origin: int
    target: int
    sequence: int


VARIANCE, TIME, U32, U53 = 100.0, 1e12, 2**32 - 1, 2**53
TORQUE = 1e6  # N m
ARGUMENTS = Field("arguments", "a", arguments, same)
TUBE = whole("tube", "t", 0, BASE)
SEQUENCE = whole("sequence", "s", 0, U53)
HOPS = whole("hops", "h", -1, BASE)
YAW = number("yaw", "y", 0.0, TURN)
YAW_VAR = number("yaw_var", "yv", 0.0, VARIANCE)
SYSTEMATIC = number("systematic_var", "sv", 0.0, VARIANCE)
FLAGS = whole("flags", "f", 0, 0xFFFF, NodeFlag)
MODE = whole("mode", "m", 0, 7, Mode)
DIGEST = binary("digest", "d", 32, 32)

FIELDS: dict[type[Any], tuple[Kind, tuple[Field, ...]]] = {
    Aiding: (
        Kind.AIDING,
        (
            YAW,
            YAW_VAR,
            SYSTEMATIC,
            number("offset", "o", -TURN, TURN),
            number("rate", "r", -100.0, 100.0),
            number("valid_at", "at", -TIME, TIME),
            SEQUENCE,
            HOPS,
            number("torque", "q", 0.0, TORQUE).later(2, 0.0),
            number("torsion_var", "tv", 0.0, VARIANCE).later(2, 0.0),
            truth("under_torque", "u").later(2, False),
        ),
    ),
    Hello: (
        Kind.HELLO,
        (TUBE, whole("boot_count", "b", 0, U32), HOPS, MODE, number("link_quality", "q", 0.0, 1.0)),
    ),
    TimeRequest: (Kind.TIME_REQUEST, (number("asked_at", "a", -TIME, TIME),)),
    TimeReply: (
        Kind.TIME_REPLY,
        (
            number("asked_at", "a", -TIME, TIME),
            number("received_at", "r", -TIME, TIME),
            number("replied_at", "p", -TIME, TIME),
            number("rig_at", "g", -TIME, TIME),
            number("rig_rate", "k", 0.5, 2.0),
            number("clock_var", "v", 0.0, 1e9),
        ),
    ),
    NodeState: (
        Kind.NODE_STATE,
        (
            TUBE,
            number("at", "at", -TIME, TIME),
            HOPS,
            MODE,
            YAW,
            YAW_VAR,
            SYSTEMATIC,
            vector("gyro_bias", "g", 10.0),
            number("scale_factor", "k", -1.0, 1.0),
            number("innovation", "i", -TURN, TURN),
            number("innovation_var", "iv", 0.0, VARIANCE),
            number("aiding_age", "aa", -10.0, math.inf),
            number("clock_var", "cv", 0.0, 1e9),
            FLAGS,
            whole("cycles", "c", 0, U53),
            whole("overruns", "ov", 0, U53),
            whole("parameters_version", "pv", 0, U32),
            binary("parameters_hash", "ph", 8, 8),
            vector("alignment", "al", TURN).later(2, (0.0, 0.0, 0.0)),
        ),
    ),
    SurveyMeasurement: (
        Kind.SURVEY_MEASUREMENT,
        (
            TUBE,
            SEQUENCE,
            number("station_at", "at", -TIME, TIME),
            HOPS,
            Field("imus", "i", imus, lambda rows: [pack_imu(imu) for imu in rows]),
            YAW,
            YAW_VAR,
            SYSTEMATIC,
            whole("samples", "n", 1, U32),
            number("settle_time", "st", 0.0, TIME),
            FLAGS,
        ),
    ),
    Receipt: (Kind.RECEIPT, (TUBE, SEQUENCE)),
    Command: (Kind.COMMAND, (TUBE, SEQUENCE, text("name", "n"), ARGUMENTS)),
    Reply: (Kind.REPLY, (TUBE, SEQUENCE, truth("done", "d"), text("detail", "x"))),
    Event: (
        Kind.EVENT,
        (
            TUBE,
            SEQUENCE,
            number("at", "at", -TIME, TIME),
            whole("severity", "v", 0, 2, Severity),
            text("code", "c"),
            ARGUMENTS,
        ),
    ),
    BlockSegment: (
        Kind.BLOCK_SEGMENT,
        (
            TUBE,
            SEQUENCE,
            whole("version", "v", 1, U32),
            DIGEST,
            whole("count", "n", 1, MAX_SEGMENTS),
            whole("index", "i", 0, MAX_SEGMENTS - 1),
            binary("data", "b", 1, SEGMENT_SIZE),
            binary("tag", "g", 32, 32),
        ),
    ),
    BlockStatus: (
        Kind.BLOCK_STATUS,
        (
            TUBE,
            SEQUENCE,
            DIGEST,
            whole("phase", "p", 0, 4, UploadPhase),
            whole("received", "r", 0, 2**MAX_SEGMENTS - 1),
            whole("version", "v", 0, U32),
            binary("in_use", "u", 32, 32),
            text("detail", "x"),
        ),
    ),
    StaticRecord: (
        Kind.STATIC_RECORD,
        (
            TUBE,
            SEQUENCE,
            whole("command", "c", 0, U53),
            number("begun_at", "ba", -TIME, TIME),
            number("ended_at", "ea", -TIME, TIME),
            whole("samples", "n", 2, U32),
            vector("rate", "w", 100.0),
            covariance("rate_cov", "wc"),
            vector("force", "f", 1e3),
            covariance("force_cov", "fc"),
            number("temperature", "tc", -273.15, 1000.0),
            truth("moved", "m"),
        ),
    ),
}
TYPE_OF: dict[Kind, tuple[type[Any], tuple[Field, ...]]] = {
    kind: (message, fields) for message, (kind, fields) in FIELDS.items()
}
NEWEST: dict[Kind, int] = {kind: max(field.since for field in fields) for kind, fields in FIELDS.values()}
DOWNWARD = (Kind.RECEIPT, Kind.COMMAND, Kind.BLOCK_SEGMENT)


def encode(message: Message) -> bytes:
    """Payload of a message, in the earliest schema version that can say it.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    kind, fields = FIELDS[type(message)]
    body: dict[str, Any] = {}
    said = (field.since for field in fields if field.since > 1 and getattr(message, field.name) != field.before)
    version = max(said, default=1)
    try:
        for field in fields:
            if field.since <= version:
                body[field.key] = field.pack(field.check(getattr(message, field.name)))
    except ValueError as error:
        raise EncodeError(f"{type(message).__name__}: {error}") from error
    origin = getattr(message, "tube", NO_TARGET)
    target = origin if kind in DOWNWARD else BASE
    envelope = {"v": version, "k": int(kind), "o": origin, "t": target, "s": getattr(message, "sequence", 0)}
    return bytes(msgpack.packb(envelope | {"b": body}))


def decode(payload: bytes) -> Message:
    """Message of a payload.

    Raises
    ------
    DecodeError
        Whatever else the bytes are.
    """
    rows = _unpack(payload)
    kind = _envelope(rows).kind
    message, fields = TYPE_OF[kind]
    body = rows.get("b")
    if not isinstance(body, dict):
        raise DecodeError(f"{message.__name__}: expected a map of fields, got {body!r:.40}")
    try:
        values = {
            field.name: field.check(body.get(field.key)) if field.since <= rows["v"] else field.before
            for field in fields
        }
    except ValueError as error:
        raise DecodeError(f"{message.__name__}: {error}") from error
    decoded: Message = message(**values)
    return decoded


def peek(payload: bytes) -> Envelope:
    """Envelope of a payload, its body unread.

    Raises
    ------
    DecodeError
        When the bytes have no envelope of this version.
    """
    return _envelope(_unpack(payload))


def _unpack(payload: bytes) -> dict[str, Any]:
    if len(payload) > MAX_PAYLOAD:
        raise DecodeError(f"payload: expected at most {MAX_PAYLOAD} bytes, got {len(payload)}")
    try:
        rows = msgpack.unpackb(payload, max_str_len=MAX_PAYLOAD, max_bin_len=MAX_BINARY, max_ext_len=0)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise DecodeError(f"payload: not msgpack: {error}") from error
    if not isinstance(rows, dict):
        raise DecodeError(f"payload: expected a map, got {type(rows).__name__}")
    return rows


def _envelope(rows: dict[str, Any]) -> Envelope:
    version, kind = rows.get("v"), rows.get("k")
    if type(version) is not int or not 1 <= version <= SCHEMA_VERSION:
        raise DecodeError(f"payload: expected schema version 1 to {SCHEMA_VERSION}, got {version!r:.40}")
    if type(kind) is not int or kind not in TYPE_OF:
        raise DecodeError(f"payload: unknown kind {kind!r:.40}")
    if version > NEWEST[Kind(kind)]:
        raise DecodeError(f"payload: {Kind(kind).name.lower()}: expected version {NEWEST[Kind(kind)]}, got {version}")
    route = []
    for key, high in (("o", 255), ("t", 255), ("s", U53)):
        value = rows.get(key)
        if type(value) is not int or not 0 <= value <= high:
            raise DecodeError(f"payload: envelope field {key}: expected 0..{high}, got {value!r:.40}")
        route.append(value)
    return Envelope(Kind(kind), route[0], route[1], route[2])
