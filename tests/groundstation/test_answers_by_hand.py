"""Rows that are kept as text, revisions of paths, ranges of a selector: against what would be made anew each time."""

from __future__ import annotations

import json
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.errors import SelectorError
from groundstation.service.answers.answer_texts import (
    finite_or_none,
    plain_answer,
    text_with_rows,
    utc_or_none,
    utc_text,
)
from groundstation.service.answers.revisions import Revisions
from groundstation.service.answers.row_texts import TOGETHER, RowTexts
from groundstation.service.answers.selector_range import EVERYTHING, SelectorRange
from groundstation.survey.well.trajectory_rows import runs_of


@given(
    asked=st.lists(st.lists(st.integers(0, 12), unique=True, max_size=6), max_size=6),
    changes=st.lists(st.integers(0, 12), max_size=6),
)
def test_rows_are_those_of_now_and_made_anew_only_where_their_marks_are_others(
    asked: list[list[int]], changes: list[int]
) -> None:
    texts, versions, made = RowTexts(2), dict.fromkeys(range(13), 0), list[tuple[int, int]]()
    known: dict[int, int] = {}
    for k, rows in enumerate(asked):
        if k < len(changes):
            versions[changes[k]] += 1
        numbers = np.array(rows, np.int64)
        marks = np.array([[versions[row], 7] for row in rows], np.int64).reshape(-1, 2)
        made.clear()

        def render(places: Any, rows: list[int] = rows) -> list[Any]:
            made.extend((rows[place], versions[rows[place]]) for place in places.tolist())
            return [{"row": rows[place], "version": versions[rows[place]]} for place in places.tolist()]

        found = [json.loads(text) for text in texts.texts_of(numbers, marks, render)]
        assert found == [{"row": row, "version": versions[row]} for row in rows]
        assert made == [(row, versions[row]) for row in rows if known.get(row) != versions[row]]
        known |= {row: versions[row] for row in rows}


@pytest.mark.parametrize("count", [0, 1, TOGETHER - 1, TOGETHER, TOGETHER + 1, 3 * TOGETHER])
def test_so_many_rows_are_made_at_a_time(count: int) -> None:
    parts: list[int] = []

    def render(places: Any) -> list[int]:
        parts.append(len(places))
        return [int(place) for place in places]

    found = RowTexts(1).texts_of(np.arange(count), np.zeros((count, 1), np.int64), render)
    assert [int(text) for text in found] == list(range(count))
    assert sum(parts) == count
    assert max(parts, default=0) <= TOGETHER


def test_a_path_changes_at_the_revision_that_tells_of_it() -> None:
    revisions = Revisions()
    revisions.on_event()
    revisions.on_published(["stations", "nodes/1", "verdict", "changes"])
    assert (revisions.newest, revisions.changed_at) == (2, {"stations": 2})
    revisions.on_event()
    revisions.on_published(iter(["alarms"]))
    assert (revisions.newest, revisions.changed_at) == (4, {"stations": 2, "alarms": 4})
    revisions.on_published(["stations"])
    assert revisions.changed_at == {"stations": 5, "alarms": 4}


@pytest.mark.parametrize(
    ("text", "inside", "outside"),
    [
        ("4..12", (3.999, 4.0, 12.0, 12.001), (3.9989, 12.0011)),
        ("4..", (3.999, 1e9), (3.9989,)),
        ("..12", (-1e9, 12.001), (12.0011,)),
        ("7", (6.999, 7.001), (6.9989, 7.0011)),
        ("..", (-1e9, 1e9), ()),
        ("-3..-1", (-3.001, -0.999), (-3.0011, -0.9989)),
        ("5..5", (5.0,), (5.0011,)),
    ],
)
def test_a_range_holds_its_ends_to_the_millimetre(
    text: str, inside: tuple[float, ...], outside: tuple[float, ...]
) -> None:
    found = SelectorRange.parse("md", text)
    assert all(found.holds(value) for value in inside)
    assert not any(found.holds(value) for value in outside)
    assert found.single is (text == "7")
    assert SelectorRange.of_parameter("md", {"md": text}) == found
    assert SelectorRange.of_parameter("md", {}) is EVERYTHING


@pytest.mark.parametrize("text", ["", "x", "5..4", "nan", "nan..", "1..2..3", "4..x"])
def test_another_range_is_refused(text: str) -> None:
    with pytest.raises(SelectorError, match=r"parameter md: expected a number or a range such as md=4\.\.12, got '"):
        SelectorRange.parse("md", text)


@dataclass
class Shown:
    """An answer whose last field is a list."""

    name: str
    rows: list[Any] = field(default_factory=list)


@pytest.mark.parametrize("rows", [[], [1], [1, 2], [{"a": [1]}, {"b": "]"}, None]])
def test_rows_stand_in_the_text_of_their_answer(rows: list[Any]) -> None:
    text = text_with_rows(Shown("a ] b"), (json.dumps(row).encode() for row in rows))
    assert json.loads(text) == {"name": "a ] b", "rows": rows}


def test_an_answer_becomes_plain_in_lists_and_tables_too() -> None:
    inner = Shown("i", [1.5])
    assert plain_answer({"x": [inner, 3], "y": inner, "z": None}) == {
        "x": [{"name": "i", "rows": [1.5]}, 3],
        "y": {"name": "i", "rows": [1.5]},
        "z": None,
    }
    assert plain_answer(Shown("o", [inner])) == {"name": "o", "rows": [{"name": "i", "rows": [1.5]}]}


def test_times_and_numbers_that_are_none() -> None:
    assert utc_text(86400.0 * 365 + 1.25) == "1971-01-01T00:00:01.250+00:00"
    assert (utc_or_none(math.inf), utc_or_none(math.nan), utc_or_none(0.0)) == (
        None,
        None,
        "1970-01-01T00:00:00.000+00:00",
    )
    assert (finite_or_none(math.nan), finite_or_none(-math.inf), finite_or_none(0.0)) == (None, None, 0.0)


@pytest.mark.parametrize("widths", [[3], [2, 2], [2, 3], [1, 1, 3, 3, 4], [0, 4]])
def test_columns_part_where_their_number_changes(widths: list[int]) -> None:
    """Of each station as many columns as were known of it; all of them are there once and in their order."""
    shared = np.arange(len(widths) * 3 * 4, dtype=float).reshape(len(widths), 3, 4)
    parts = runs_of(shared, np.array(widths, np.intp))
    found = [one for part in parts for one in part]
    assert len(found) == len(widths)
    for k, (one, width) in enumerate(zip(found, widths, strict=True)):
        assert one.tolist() == shared[k, :, :width].tolist()
