"""Warnings of what was read: values that are missing or hardly can be. They stand in every answer."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class EntryWarning:
    """One warning: of which hole or column, from which measured depth to which (m; None where it is all of it)."""

    kind: str  # missing, dogleg, spike, lean, depth, radius, unread
    what: str
    text: str
    top: float | None = None
    bottom: float | None = None


def warning_rows(warnings: tuple[EntryWarning, ...]) -> list[dict[str, Any]]:
    """Objects for JSON."""
    names = {"top": "from_m", "bottom": "to_m"}
    return [{names.get(key, key): value for key, value in asdict(warning).items()} for warning in warnings]
