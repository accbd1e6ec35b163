"""How each kind of field is checked by hand, and what of it msgpack packs: what the codec is held to."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from copy import copy
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import Any

from telemetry.messages import ImuMean, Stand
from telemetry.quantities import (
    MAX_ARGUMENTS,
    MAX_IMUS,
    MAX_LIST,
    MAX_STANDS,
    MAX_TEXT,
    Quantity,
    ValueKind,
    check_binary,
    check_boolean,
    check_integer,
    check_number,
    check_text,
)
from telemetry.schema import LARGEST_TIME, MAX_EPOCH, MessageField

LARGEST_COVARIANCE, LARGEST_FORCE = 1e6, 1e3  # (m/s^2)^2 and the like, m/s^2

Check = Callable[[Quantity, Any], Any]


@dataclass(frozen=True, slots=True)
class ByHand:
    """One field on the wire: attribute, short key, check (raises ValueError), and what is packed if not the value."""

    name: str
    key: str
    check: Callable[[Any], Any]
    pack: Callable[[Any], Any] | None
    since: int
    before: Any

    def default(self) -> Any:
        """The value that stands for the field in payloads of earlier schema versions."""
        return copy(self.before)


def by_hand(field: MessageField) -> ByHand:
    """Checks of one line of the schema."""
    check, pack = CHECKS[field.kind]
    checked: Callable[[Any], Any] = partial(check, field)
    if field.enumeration is not None:
        checked = partial(check_member, field)
    return ByHand(field.name, field.key, checked, pack, field.since, field.before)


def check_member(field: MessageField, value: Any) -> enum.IntEnum | enum.IntFlag:
    """A member or flags of their number."""
    assert field.enumeration is not None
    return field.enumeration(check_integer(field, value))


def check_vector(q: Quantity, value: Any) -> tuple[float, float, float]:
    """Three finite numbers of magnitude up to the limit."""
    return _vector(q.name, value, q.high)


def check_covariance(q: Quantity, value: Any) -> tuple[tuple[float, float, float], ...]:
    """Three rows of three finite numbers, variances of zero or more on the diagonal."""
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"{q.name}: expected a 3x3 covariance, got {value!r:.40}")
    return _covariance(q.name, value)


def check_imus(q: Quantity, value: Any) -> tuple[ImuMean, ...]:
    """Means of the IMUs of a cluster."""
    if not isinstance(value, list | tuple) or not 1 <= len(value) <= MAX_IMUS:
        raise ValueError(f"{q.name}: expected 1..{MAX_IMUS} IMUs, got {value!r:.40}")
    return tuple(_imu(item) for item in value)


def check_scalars(q: Quantity, value: Any) -> dict[str, Any]:
    """Named scalars."""
    _check_names(q, value)
    for name, item in value.items():
        _check_scalar(q, name, item)
    return dict(value)


def check_values(q: Quantity, value: Any) -> dict[str, Any]:
    """Named scalars and lists of finite numbers."""
    _check_names(q, value)
    checked = {}
    for name, item in value.items():
        if isinstance(item, list | tuple):
            checked[name] = _numbers(q, name, item)
        else:
            _check_scalar(q, name, item)
            checked[name] = item
    return checked


def pack_rows(rows: Any) -> list[list[float]]:
    """A matrix on the wire."""
    return [list(row) for row in rows]


def pack_imus(imus: Any) -> list[Any]:
    """IMUs on the wire: each its mean, then the rows of its covariance."""
    return [[list(imu.force), pack_rows(imu.force_cov)] for imu in imus]


def check_stands(q: Quantity, value: Any) -> tuple[Stand, ...]:
    """Stands of the bit in the order of time, those of one epoch one after the other."""
    if not isinstance(value, list | tuple) or len(value) > MAX_STANDS:
        raise ValueError(f"{q.name}: expected at most {MAX_STANDS} stands, got {value!r:.40}")
    stands = tuple(_stand(q, item) for item in value)
    for before, after in pairwise(stands):
        if before.epoch == after.epoch and after.begun_at < before.ended_at:
            raise ValueError(f"{q.name}: expected stands one after the other, got {after.begun_at} in another")
    return stands


def pack_stands(stands: Any) -> list[Any]:
    """Stands on the wire: epoch, begin, end and depth of each."""
    return [[stand.epoch, stand.begun_at, stand.ended_at, stand.md] for stand in stands]


CHECKS: dict[ValueKind, tuple[Check, Callable[[Any], Any] | None]] = {
    ValueKind.NUMBER: (check_number, None),
    ValueKind.INTEGER: (check_integer, None),
    ValueKind.BOOLEAN: (check_boolean, None),
    ValueKind.TEXT: (check_text, None),
    ValueKind.BINARY: (check_binary, None),
    ValueKind.VECTOR: (check_vector, list),
    ValueKind.COVARIANCE: (check_covariance, pack_rows),
    ValueKind.IMUS: (check_imus, pack_imus),
    ValueKind.SCALARS: (check_scalars, None),
    ValueKind.VALUES: (check_values, None),
    ValueKind.STANDS: (check_stands, pack_stands),
}


def _vector(name: str, value: Any, limit: float) -> tuple[float, float, float]:
    if not isinstance(value, list | tuple) or len(value) != 3:
        raise ValueError(f"{name}: expected three numbers, got {value!r:.40}")
    for item in value:
        if isinstance(item, bool) or not isinstance(item, int | float) or not -limit <= item <= limit:
            raise ValueError(f"{name}: expected numbers within +-{limit:g}, got {item!r:.40}")
    return float(value[0]), float(value[1]), float(value[2])


def _covariance(name: str, value: Any) -> tuple[tuple[float, float, float], ...]:
    rows = [_vector(name, row, LARGEST_COVARIANCE) for row in value]
    if min(rows[0][0], rows[1][1], rows[2][2]) < 0.0:
        raise ValueError(f"{name}: expected variances of zero or more")
    return rows[0], rows[1], rows[2]


def _imu(item: Any) -> ImuMean:
    if isinstance(item, ImuMean):
        item = pack_imus([item])[0]
    if not isinstance(item, list) or len(item) != 2 or not isinstance(item[1], list | tuple) or len(item[1]) != 3:
        raise ValueError(f"imus: expected a mean and a 3x3 covariance, got {item!r:.40}")
    first, second, third = _covariance("force_cov", item[1])
    return ImuMean(_vector("force", item[0], LARGEST_FORCE), (first, second, third))


def _stand(q: Quantity, item: Any) -> Stand:
    if isinstance(item, Stand):
        item = pack_stands([item])[0]
    if not isinstance(item, list) or len(item) != 4:
        raise ValueError(f"{q.name}: expected epoch, begin, end and depth, got {item!r:.40}")
    epoch, *numbers = item
    if type(epoch) is not int or not 0 <= epoch <= MAX_EPOCH:
        raise ValueError(f"{q.name}: expected an epoch of 0..{MAX_EPOCH}, got {epoch!r:.40}")
    begun_at, ended_at, md = _vector(q.name, numbers, LARGEST_TIME)
    if not (begun_at <= ended_at and q.low <= md <= q.high):
        raise ValueError(f"{q.name}: expected begin, end and a depth of {q.low:g}..{q.high:g} m, got {item!r:.60}")
    return Stand(epoch, begun_at, ended_at, md)


def _check_names(q: Quantity, value: Any) -> None:
    if not isinstance(value, dict) or len(value) > MAX_ARGUMENTS:
        raise ValueError(f"{q.name}: expected at most {MAX_ARGUMENTS} names, got {value!r:.40}")
    for name in value:
        if not isinstance(name, str) or len(name) > MAX_TEXT:
            raise ValueError(f"{q.name}: expected a short name, got {name!r:.40}")


def _check_scalar(q: Quantity, name: str, item: Any) -> None:
    if not (item is None or isinstance(item, bool | int | float | str)):
        raise ValueError(f"{q.name}: {name}: expected a scalar, got {item!r:.40}")
    if isinstance(item, float) and not math.isfinite(item):
        raise ValueError(f"{q.name}: {name}: expected a finite number, got {item}")
    if isinstance(item, int) and not -(2**63) <= item < 2**63:
        raise ValueError(f"{q.name}: {name}: expected a 64-bit integer")
    if isinstance(item, str) and len(item) > MAX_TEXT:
        raise ValueError(f"{q.name}: {name}: expected at most {MAX_TEXT} characters")


def _numbers(q: Quantity, name: str, items: Any) -> tuple[float, ...]:
    for item in items:
        if isinstance(item, bool) or not isinstance(item, int | float) or not math.isfinite(item):
            raise ValueError(f"{q.name}: {name}: expected finite numbers, got {item!r:.40}")
    if len(items) > MAX_LIST:
        raise ValueError(f"{q.name}: {name}: expected at most {MAX_LIST} numbers, got {len(items)}")
    return tuple(float(item) for item in items)
