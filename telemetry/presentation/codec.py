"""Messages as bytes: a msgpack map with short keys, its schema version and route in the envelope, its fields in ``b``.

One table names every field, its short key and its range; encoding and decoding both check it. A relay reads the
envelope alone and hands the very same bytes on.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import msgpack

from telemetry.errors import DecodeError, EncodeError
from telemetry.messages import (
    BASE,
    SCHEMA_VERSION,
    Aiding,
    Command,
    Event,
    Hello,
    ImuMean,
    Message,
    Mode,
    NodeFlag,
    NodeState,
    Receipt,
    Reply,
    Severity,
    SurveyMeasurement,
    TimeReply,
    TimeRequest,
)

MAX_PAYLOAD = 4096
MAX_TEXT = 256
MAX_ARGUMENTS = 32
MAX_IMUS = 16
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


@dataclass(frozen=True, slots=True)
class Envelope:
    """What a relay needs to know of a payload."""

    kind: Kind
    origin: int
    target: int
    sequence: int


@dataclass(frozen=True, slots=True)
class Field:
    """One field: attribute, short key, check (raises ValueError) and what is put on the wire."""

    name: str
    key: str
    check: Callable[[Any], Any]
    pack: Callable[[Any], Any]


def _same(value: Any) -> Any:
    return value


def number(name: str, key: str, low: float, high: float) -> Field:
    """Finite float in [low, high]."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"{name}: expected a number in [{low:g}, {high:g}], got {value!r:.40}")
        return float(value)

    return Field(name, key, check, _same)


def whole(name: str, key: str, low: int, high: int, wrap: Callable[[int], Any] = int) -> Field:
    """Integer in [low, high]; ``wrap`` makes it an enumeration."""

    def check(value: Any) -> Any:
        if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
            raise ValueError(f"{name}: expected an integer in [{low}, {high}], got {value!r:.40}")
        return wrap(value)

    return Field(name, key, check, int)


def truth(name: str, key: str) -> Field:
    """Boolean."""

    def check(value: Any) -> bool:
        if not isinstance(value, bool):
            raise ValueError(f"{name}: expected true or false, got {value!r:.40}")
        return value

    return Field(name, key, check, _same)


def text(name: str, key: str) -> Field:
    """Short string."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or len(value) > MAX_TEXT:
            raise ValueError(f"{name}: expected at most {MAX_TEXT} characters, got {value!r:.40}")
        return value

    return Field(name, key, check, _same)


def vector(name: str, key: str, limit: float) -> Field:
    """Three finite numbers of magnitude up to ``limit``."""
    return Field(name, key, lambda value: _vector(name, value, limit), list)


def _vector(name: str, value: Any, limit: float) -> tuple[float, float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"{name}: expected three numbers, got {value!r:.40}")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not -limit <= item <= limit:
            raise ValueError(f"{name}: expected numbers within +-{limit:g}, got {item!r:.40}")
    return float(value[0]), float(value[1]), float(value[2])


def _imus(value: Any) -> tuple[ImuMean, ...]:
    if not isinstance(value, list | tuple) or not 1 <= len(value) <= MAX_IMUS:
        raise ValueError(f"imus: expected 1..{MAX_IMUS} IMUs, got {value!r:.40}")
    return tuple(_imu(item) for item in value)


def _imu(item: Any) -> ImuMean:
    if isinstance(item, ImuMean):
        item = _pack_imu(item)
    if not isinstance(item, list) or len(item) != 2 or not isinstance(item[1], list | tuple) or len(item[1]) != 3:
        raise ValueError(f"imus: expected a mean and a 3x3 covariance, got {item!r:.40}")
    rows = [_vector("force_cov", row, 1e6) for row in item[1]]
    if min(rows[0][0], rows[1][1], rows[2][2]) < 0.0:
        raise ValueError("force_cov: expected variances of zero or more")
    return ImuMean(_vector("force", item[0], 1e3), (rows[0], rows[1], rows[2]))


def _pack_imu(imu: ImuMean) -> list[Any]:
    return [list(imu.force), [list(row) for row in imu.force_cov]]


def _arguments(value: Any) -> dict[str, Any]:
    if not isinstance(value, dict) or len(value) > MAX_ARGUMENTS:
        raise ValueError(f"arguments: expected at most {MAX_ARGUMENTS} names, got {value!r:.40}")
    for name, item in value.items():
        if not isinstance(name, str) or len(name) > MAX_TEXT:
            raise ValueError(f"arguments: expected a short name, got {name!r:.40}")
        if not (item is None or isinstance(item, bool | int | float | str)):
            raise ValueError(f"arguments: {name}: expected a scalar, got {item!r:.40}")
        if isinstance(item, float) and not math.isfinite(item):
            raise ValueError(f"arguments: {name}: expected a finite number, got {item}")
        if isinstance(item, int) and not -(2**63) <= item < 2**63:
            raise ValueError(f"arguments: {name}: expected a 64-bit integer")
        if isinstance(item, str) and len(item) > MAX_TEXT:
            raise ValueError(f"arguments: {name}: expected at most {MAX_TEXT} characters")
    return value


VARIANCE, TIME, U32, U53 = 100.0, 1e12, 2**32 - 1, 2**53
ARGUMENTS = Field("arguments", "a", _arguments, _same)
TUBE = whole("tube", "t", 0, BASE)
SEQUENCE = whole("sequence", "s", 0, U53)
HOPS = whole("hops", "h", -1, BASE)
YAW = number("yaw", "y", 0.0, TURN)
YAW_VAR = number("yaw_var", "yv", 0.0, VARIANCE)
SYSTEMATIC = number("systematic_var", "sv", 0.0, VARIANCE)
FLAGS = whole("flags", "f", 0, 0xFFFF, NodeFlag)
MODE = whole("mode", "m", 0, 7, Mode)

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
        ),
    ),
    SurveyMeasurement: (
        Kind.SURVEY_MEASUREMENT,
        (
            TUBE,
            SEQUENCE,
            number("station_at", "at", -TIME, TIME),
            HOPS,
            Field("imus", "i", _imus, lambda imus: [_pack_imu(imu) for imu in imus]),
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
}
TYPE_OF: dict[Kind, tuple[type[Any], tuple[Field, ...]]] = {
    kind: (message, fields) for message, (kind, fields) in FIELDS.items()
}
DOWNWARD = (Kind.RECEIPT, Kind.COMMAND)


def encode(message: Message) -> bytes:
    """Payload of a message.

    Raises
    ------
    EncodeError
        When a field is outside its range.
    """
    kind, fields = FIELDS[type(message)]
    body: dict[str, Any] = {}
    try:
        for field in fields:
            body[field.key] = field.pack(field.check(getattr(message, field.name)))
    except ValueError as error:
        raise EncodeError(f"{type(message).__name__}: {error}") from error
    origin = getattr(message, "tube", NO_TARGET)
    target = origin if kind in DOWNWARD else BASE
    envelope = {"v": SCHEMA_VERSION, "k": int(kind), "o": origin, "t": target, "s": getattr(message, "sequence", 0)}
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
        values = {field.name: field.check(body.get(field.key)) for field in fields}
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
        rows = msgpack.unpackb(payload, max_str_len=MAX_PAYLOAD, max_bin_len=0, max_ext_len=0)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException) as error:
        raise DecodeError(f"payload: not msgpack: {error}") from error
    if not isinstance(rows, dict):
        raise DecodeError(f"payload: expected a map, got {type(rows).__name__}")
    return rows


def _envelope(rows: dict[str, Any]) -> Envelope:
    version, kind = rows.get("v"), rows.get("k")
    if version != SCHEMA_VERSION:
        raise DecodeError(f"payload: expected schema version {SCHEMA_VERSION}, got {version!r:.40}")
    if type(kind) is not int or kind not in TYPE_OF:
        raise DecodeError(f"payload: unknown kind {kind!r:.40}")
    route = []
    for key, high in (("o", 255), ("t", 255), ("s", U53)):
        value = rows.get(key)
        if type(value) is not int or not 0 <= value <= high:
            raise DecodeError(f"payload: envelope field {key}: expected 0..{high}, got {value!r:.40}")
        route.append(value)
    return Envelope(Kind(kind), route[0], route[1], route[2])
