"""Stubs that note what they are given, in the place of what computes."""

from __future__ import annotations

import contextlib
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


def noted(told: Given, *words: Any) -> Any:
    """Return a context that says when it begins and when it ends."""

    @contextlib.contextmanager
    def one(*given: Any, **named: Any) -> Any:
        told.append((*words, "begins", *given, *((named,) if named else ())))
        yield words[0]
        told.append((*words, "ends"))

    return one
