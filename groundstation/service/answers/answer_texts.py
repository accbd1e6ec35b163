"""Answers as they are sent: JSON, and the plain objects of JSON. One function for every class of an answer."""

from __future__ import annotations

import datetime
import math
from collections.abc import Iterable
from dataclasses import is_dataclass
from typing import Any, Final

import orjson

json_of: Final = orjson.dumps  # JSON of an answer or of a part of one


def text_with_rows(answer: Any, texts: Iterable[bytes]) -> bytes:
    """JSON of an answer whose last field is an empty list, with rows in it whose JSON is known.

    The rows may be megabytes, which are copied once.
    """
    before, bracket, end = json_of(answer).rpartition(b"]")
    listed = list(texts) or [b""]
    listed[0] = before + listed[0]
    listed[-1] += bracket + end
    return b",".join(listed)


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
