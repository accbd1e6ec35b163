"""How a ring closes in the order in which its columns were drilled."""

import math
from dataclasses import replace
from datetime import date
from pathlib import Path

import numpy as np
import pytest

from groundstation.errors import SurveyError
from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.closing import ClosingDay, closing_by_day
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.wall_file import read_wall
from groundstation.survey.wall.wall_joints import Detour

PIPES, ACROSS = 12, 2.4  # of a ring of freeze pipes; m, its diameter
DAYS = [f"2026-11-{10 + k // 4}" for k in range(PIPES)]


def ring(folder: Path, days: list[str], *, outward_deg: float = 0.0, more: str = "") -> list[ClosingDay]:
    """Stages of a ring whose pipes lean outward, frozen to 0.4 m around each; 12 m long."""
    heads, rows = "column,north_m,east_m,drilled_on,between,replaces\n", "column,md_m,inclination_deg,azimuth_deg\n"
    for k in range(PIPES):
        turn = math.tau * k / PIPES
        heads += f"P{k + 1},{ACROSS / 2 * math.cos(turn):.6f},{ACROSS / 2 * math.sin(turn):.6f},{days[k]},,\n"
        rows += "".join(f"P{k + 1},{md},{outward_deg},{math.degrees(turn):.6f}\n" for md in (0, 6, 12))
    (folder / "heads.csv").write_text(heads + more)
    (folder / "stations.csv").write_text(rows + ("X,0,0,0\nX,12,0,0\n" if more else ""))
    (folder / "ring.toml").write_text(
        'radius_m = 0.4\nthickness_m = 0.1\nlayout = "shaft"\nlength_m = 12\nheads = "heads.csv"\n'
        'stations = "stations.csv"\ninstrument = "gyro-continuous"\n'
    )
    wall = read_wall(folder / "ring.toml")
    return wall.stages


def test_a_ring_closes_with_its_last_pipe(tmp_path: Path) -> None:
    found = ring(tmp_path, DAYS)
    assert [stage.day for stage in found] == [date(2026, 11, day) for day in (10, 11, 12)]
    assert [stage.open_joints for stage in found] == [9, 5, 0]  # four pipes in a row make three joints
    assert [stage.closed for stage in found] == pytest.approx([3 / 12, 7 / 12, 1.0])
    assert found[0].drilled == ["P1", "P2", "P3", "P4"]
    assert found[-1].widest is not None
    assert found[-1].widest[2] == pytest.approx(ACROSS * math.sin(math.pi / PIPES), abs=1e-4)


def test_a_ring_that_opens_downwards_never_closes_below_and_names_its_widest_spacing(tmp_path: Path) -> None:
    lean = 5.0
    last = ring(tmp_path, DAYS, outward_deg=lean)[-1]
    toe = 2.0 * (ACROSS / 2 + 12.0 * math.sin(math.radians(lean))) * math.sin(math.pi / PIPES)
    assert last.open_joints == 12
    assert 0.0 < last.closed < 1.0
    assert last.widest is not None
    assert last.widest[2] == pytest.approx(toe, rel=0.01)


def test_a_pipe_that_is_not_drilled_leaves_its_joints_open_until_another_stands_in(tmp_path: Path) -> None:
    assert ring(tmp_path, [*DAYS[:-1], ""])[-1].open_joints == 2
    turn = math.tau * (PIPES - 1) / PIPES
    stand_in = f"X,{ACROSS / 2 * math.cos(turn):.6f},{ACROSS / 2 * math.sin(turn):.6f},2026-11-20,,P12\n"
    found = ring(tmp_path, [*DAYS[:-1], ""], more=stand_in)
    assert (found[-1].day, found[-1].drilled, found[-1].closed) == (date(2026, 11, 20), ["X"], 1.0)
    assert found[-2].open_joints == 2


def test_a_column_between_two_closes_their_joint_with_the_later_of_its_own_two() -> None:
    heads, depths = np.array([[0.0, 0.0], [0.0, 1.3], [0.0, 0.65]]), np.array([0.0, 1.0])
    centres = np.repeat(heads[:, None], 2, axis=1)
    columns = Columns.surveyed(["A", "B", "X"], depths, centres, np.zeros((3, 2, 2, 2)), heads, 0.4)
    days = [date(2026, 11, 10), date(2026, 11, 12), date(2026, 11, 11)]
    joint, detour = np.array([[0, 1]]), Detour(0, np.array([[0, 2], [2, 1]]))
    found = closing_by_day(columns, joint, 0.1, days, [detour])
    assert [(stage.day.day, stage.closed) for stage in found] == [(10, 0.0), (11, 0.0), (12, 1.0)]


def test_without_a_day_nothing_is_said_of_time(tmp_path: Path) -> None:
    assert ring(tmp_path, [""] * PIPES) == []


def test_a_day_that_cannot_be_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(SurveyError, match=r"line 3: column P2: drilled_on: expected a day as 2026-11-20, got 'May'"):
        ring(tmp_path, [DAYS[0], "May", *DAYS[2:]])


def row_of_three(days: list[date]) -> tuple[Columns, list[ClosingDay]]:
    """Three columns 0.7 and 1.2 m apart, and how they close to joints of 0.1 m."""
    heads, depths = np.array([[0.0, 0.0], [0.0, 0.7], [0.0, 1.9]]), np.array([0.0, 1.0])
    columns = Columns.surveyed(
        ["A", "B", "C"], depths, np.repeat(heads[:, None], 2, axis=1), np.zeros((3, 2, 2, 2)), heads, 0.7
    )
    return columns, closing_by_day(columns, np.array([[0, 1], [1, 2]]), 0.1, days)


def test_the_widest_spacing_of_a_day_is_of_columns_that_were_drilled_then() -> None:
    _, found = row_of_three([date(2026, 11, 10), date(2026, 11, 10), date(2026, 11, 12)])
    assert [stage.widest for stage in found] == [(0, 0, pytest.approx(0.7)), (1, 0, pytest.approx(1.2))]


def test_what_is_drilled_and_not_surveyed_closes_its_joints_too() -> None:
    days = [date(2026, 11, 10)] * 3
    columns, surveyed = row_of_three(days)
    states = columns.states.copy()
    states[1, 1] = ColumnState.UNSURVEYED
    drilled = closing_by_day(replace(columns, states=states), np.array([[0, 1], [1, 2]]), 0.1, days)
    assert drilled == surveyed
    assert surveyed[-1].closed == 1.0
    states[1, 1] = ColumnState.MISSING
    assert closing_by_day(replace(columns, states=states), np.array([[0, 1], [1, 2]]), 0.1, days)[-1].closed == 0.5
