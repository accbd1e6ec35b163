"""The fields of messages: what each may hold and how it is put on the wire."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

from telemetry.messages import ImuMean

MAX_TEXT = 256
MAX_ARGUMENTS = 32
MAX_IMUS = 16
MAX_BINARY = 256


@dataclass(frozen=True, slots=True)
class Field:
    """One field: attribute, short key, check (raises ValueError) and what is put on the wire.

    A field of a later schema version has the value that stands for it in payloads of earlier ones.
    """

    name: str
    key: str
    check: Callable[[Any], Any]
    pack: Callable[[Any], Any]
    since: int = 1
    before: Any = None

    def later(self, since: int, before: Any) -> Field:
        """The same field, first said in schema version ``since``; payloads without it mean ``before``."""
        return replace(self, since=since, before=before)


def same(value: Any) -> Any:
    """The value as it is."""
    return value


def number(name: str, key: str, low: float, high: float) -> Field:
    """Finite float in [low, high]."""

    def check(value: Any) -> float:
        if isinstance(value, bool) or not isinstance(value, int | float) or not low <= value <= high:
            raise ValueError(f"{name}: expected a number in [{low:g}, {high:g}], got {value!r:.40}")
        return float(value)

    return Field(name, key, check, same)


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

    return Field(name, key, check, same)


def text(name: str, key: str) -> Field:
    """Short string."""

    def check(value: Any) -> str:
        if not isinstance(value, str) or len(value) > MAX_TEXT:
            raise ValueError(f"{name}: expected at most {MAX_TEXT} characters, got {value!r:.40}")
        return value

    return Field(name, key, check, same)


def binary(name: str, key: str, low: int, high: int) -> Field:
    """Bytes, ``low`` to ``high`` of them."""

    def check(value: Any) -> bytes:
        if not isinstance(value, bytes) or not low <= len(value) <= high:
            raise ValueError(f"{name}: expected {low}..{high} bytes, got {value!r:.40}")
        return value

    return Field(name, key, check, same)


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


def covariance(name: str, key: str) -> Field:
    """Three rows of three finite numbers, variances of zero or more on the diagonal."""
    return Field(name, key, lambda value: _covariance(name, value), lambda rows: [list(row) for row in rows])


def _covariance(name: str, value: Any) -> tuple[tuple[float, float, float], ...]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"{name}: expected a 3x3 covariance, got {value!r:.40}")
    rows = [_vector(name, row, 1e6) for row in value]
    if min(rows[0][0], rows[1][1], rows[2][2]) < 0.0:
        raise ValueError(f"{name}: expected variances of zero or more")
    return rows[0], rows[1], rows[2]


def imus(value: Any) -> tuple[ImuMean, ...]:
    """Check of a cluster's means."""
    if not isinstance(value, list | tuple) or not 1 <= len(value) <= MAX_IMUS:
        raise ValueError(f"imus: expected 1..{MAX_IMUS} IMUs, got {value!r:.40}")
    return tuple(_imu(item) for item in value)


def _imu(item: Any) -> ImuMean:
    if isinstance(item, ImuMean):
        item = pack_imu(item)
    if not isinstance(item, list) or len(item) != 2 or not isinstance(item[1], list | tuple) or len(item[1]) != 3:
        raise ValueError(f"imus: expected a mean and a 3x3 covariance, got {item!r:.40}")
    rows = [_vector("force_cov", row, 1e6) for row in item[1]]
    if min(rows[0][0], rows[1][1], rows[2][2]) < 0.0:
        raise ValueError("force_cov: expected variances of zero or more")
    return ImuMean(_vector("force", item[0], 1e3), (rows[0], rows[1], rows[2]))


def pack_imu(imu: ImuMean) -> list[Any]:
    """One IMU on the wire: mean, then the rows of its covariance."""
    return [list(imu.force), [list(row) for row in imu.force_cov]]


def arguments(value: Any) -> dict[str, Any]:
    """Check of named scalars."""
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
