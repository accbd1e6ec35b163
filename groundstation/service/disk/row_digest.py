"""The hash by which a changed bit of a row is found: of its other columns, in their order."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from telemetry.presentation.content import content_of

DIGEST = "digest"


def add_digest(row: Mapping[str, Any]) -> dict[str, Any]:
    """A row with its hash."""
    return {**row, DIGEST: digest_of(row)}


def is_sound(row: Mapping[str, Any]) -> bool:
    """Whether a row is what was written; one without a hash is of a version that wrote none."""
    return row.get(DIGEST) in (None, digest_of(row))


def digest_of(row: Mapping[str, Any]) -> str:
    """Hash of all columns but itself; a number that came back as another type is another number."""
    values = [value for name, value in sorted(row.items()) if name != DIGEST]
    return content_of(repr(values).encode()).hex()


def as_read(value: float) -> float:
    """A number as a database gives it back: without a type of its own, and zero without a sign."""
    return float(value) + 0.0
