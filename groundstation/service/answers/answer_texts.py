"""Answers as they are sent: JSON, and the plain objects of JSON. One function for every class of an answer."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable
from dataclasses import is_dataclass
from typing import Any, Final

import orjson

json_of: Final = orjson.dumps  # JSON of an answer or of a part of one


def listed_texts(texts: Iterable[bytes]) -> Any:
    """JSON of the rows of a list, to stand in an answer in their place."""
    return orjson.Fragment(b"[%b]" % b",".join(texts))


def plain_answer(value: Any) -> Any:
    """The same as objects, lists and scalars."""
    if isinstance(value, list):
        return [plain_answer(one) for one in value]
    if isinstance(value, dict):
        return {name: plain_answer(one) for name, one in value.items()}
    return plain_answer(vars(value)) if is_dataclass(value) else value


def utc_text(utc: float) -> str:
    """A time of people (s since 1970) as ISO 8601."""
    return datetime.datetime.fromtimestamp(utc, datetime.UTC).isoformat(timespec="milliseconds")


def utc_or_none(utc: float) -> str | None:
    """The same; None where the time is not finite."""
    return utc_text(utc) if math.isfinite(utc) else None


def finite_or_none(value: float) -> float | None:
    """JSON has no infinity and no nan."""
    return value if math.isfinite(value) else None
