"""A stub that notes what it is given, in the place of what computes."""

from __future__ import annotations

from typing import Any

import pytest

Given = list[Any]


def instead(monkeypatch: pytest.MonkeyPatch, place: str, found: Any) -> Given:
    """Have a function answer at once; returns what it is given."""
    given: Given = []

    def answer(*words: Any, **named: Any) -> Any:
        given.append((*words, *((named,) if named else ())))
        return found

    monkeypatch.setattr(place, answer)
    return given
