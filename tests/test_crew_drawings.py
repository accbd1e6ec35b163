"""What the crew's terminal draws: in which cell, how far, which way; read from the characters."""

from __future__ import annotations

import math
from types import SimpleNamespace
from typing import Any

import pytest

from borechain.crew.screen_panels import (
    PLAN_HEIGHT,
    PLAN_WIDTH,
    actions_panel,
    ending_row,
    plan_panel,
    strip_panel,
    strip_row,
    wall_lines,
)

MIDDLE = PLAN_WIDTH // 2, PLAN_HEIGHT // 2


def row(north: float, east: float, md: float = 1.0, limit: float = 45.0, **more: Any) -> dict[str, Any]:
    return {"north_cm": north, "east_cm": east, "md_m": md, "limit_cm": limit, "used_percent": 1.0} | more


def picture(**answers: Any) -> Any:
    return SimpleNamespace(answers=answers, done=[], orders=[])


def plan(stations: list[dict[str, Any]], end: dict[str, Any] | None = None) -> dict[str, list[tuple[int, int]]]:
    """Cells of each mark, as (cells to the right, cells up) from the middle."""
    column = {"stations": stations, "projection": end, "worst": stations[0]}
    lines = plan_panel(picture(column=column)).plain.split("\n")
    assert len(lines) == PLAN_HEIGHT
    found: dict[str, list[tuple[int, int]]] = {}
    for y, line in enumerate(lines):
        for x, mark in enumerate(line):
            if mark != " ":
                found.setdefault(mark, []).append((x - MIDDLE[0], MIDDLE[1] - y))
    return found


@pytest.mark.parametrize(
    ("north", "east", "cell"),
    [(20.0, 0.0, (0, 2)), (-30.0, 0.0, (0, -3)), (0.0, 30.0, (6, 0)), (0.0, -20.0, (-4, 0)), (20.0, -30.0, (-6, 2))],
)
def test_the_plan_has_north_up_east_to_the_right_and_cells_twice_as_high_as_wide(
    north: float, east: float, cell: tuple[int, int]
) -> None:
    """The limit of 45 cm is four and a half cells from the middle: ten centimetres a cell up, two cells across."""
    found = plan([row(3.0, 0.0), row(north, east)], row(0.0, 0.0))
    assert found["@"] == [cell]
    assert found["N"] == [(0, MIDDLE[1])]


def test_the_ring_is_at_the_limit_and_the_end_where_it_is_foreseen() -> None:
    found = plan([row(1.0, 0.0), row(2.0, 0.0)], row(-20.0, 30.0, limit=45.0))
    assert found["x"] == [(6, -2)]
    for right, up in found["."]:
        assert math.hypot(right / 2.0, up) == pytest.approx(4.5, abs=0.8)
    assert {(9, 0), (-9, 0)} <= set(found["."])
    wide = plan([row(1.0, 0.0), row(2.0, 0.0)], row(0.0, 90.0, limit=45.0))  # beyond the limit: all is drawn smaller
    assert wide["x"] == [(9, 0)]
    assert max(right for right, _ in wide["."]) == 4


@pytest.mark.parametrize(("used", "filled"), [(0.0, 0), (8.0, 1), (50.0, 6), (51.0, 7), (100.0, 12), (130.0, 12)])
def test_a_row_of_the_strip_is_as_long_as_what_is_used(used: float, filled: int) -> None:
    text = strip_row(row(0.0, 0.0, md=7.5, used_percent=used)).plain
    assert text.startswith("   7.5 |")
    bar = text.partition("|")[2][:12]
    assert bar.count("=") == filled
    assert bar[:filled] == "=" * filled
    assert [bar[6], bar[9]] == ["=" if filled > 6 else ":", "=" if filled > 9 else ":"]


def test_the_strip_shows_the_newest_depths_downwards() -> None:
    stations = [row(0.0, 0.0, md=float(k)) for k in range(15)]
    lines = strip_panel(picture(column={"stations": stations, "projection": None})).plain.split("\n")[1:]
    assert [float(line.partition("|")[0]) for line in lines] == [float(k) for k in range(6, 15)]


@pytest.mark.parametrize(
    ("at", "half", "bar"),
    [
        (22.5, 7.5, "    --x-    |"),  # of 45 cm in twelve cells: from 4 to 8, in the middle 6
        (7.5, 3.75, " -x         |"),
        (41.25, 7.5, "         --x>"),
        (60.0, 3.75, "            >"),
        (60.0, 30.0, "        ---->"),
    ],
)
def test_the_end_is_an_interval_with_the_place_expected_in_it(at: float, half: float, bar: str) -> None:
    end = row(0.0, at, deviation_cm=at)
    assert ending_row(end, {"half_width_cm": half, "within_percent": 60.0}).plain[7:20] == bar


def test_the_joints_that_most_likely_leak_are_shown_the_worst_first() -> None:
    joints = [
        {"joint": f"J{k}", "thickness_m": 1.0, "probability_where_surveyed": chance}
        for k, chance in enumerate((0.01, 0.3, None, 0.2))
    ]
    wall = {"problem": None, "joints": joints, "required_thickness_m": 0.8, "allowed_probability": 0.05}
    assert [line.plain.split()[0] for line in wall_lines(picture(wall={"wall": wall}))] == ["J1", "J3"]


def test_the_newest_actions_are_shown() -> None:
    seen = picture()
    seen.done = [f"order {k}" for k in range(9)]
    lines = [line.strip() for line in actions_panel(seen, 4).plain.split("\n")]
    assert lines == ["ACTIONS", "order 6", "order 7", "order 8"]
