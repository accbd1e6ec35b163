"""Alarms of a column: raised at a level, cleared clearly below it, kept on record."""

import numpy as np
import pytest

from groundstation.service.hole.deviation_alarms import AlarmList, DeviationAlarm
from groundstation.survey.wall.column_deviation import Deviation


def at(used: float, md: float = 10.0) -> Deviation:
    """A deviation that uses a share of a tolerance of 10 cm."""
    return Deviation(md, md, np.array([0.0, 0.1 * used]), np.diag([1e-4, 4e-6]), 0.1)


def levels(alarms: list[DeviationAlarm], kind: str = "deviation") -> list[float]:
    return sorted(alarm.level for alarm in alarms if alarm.kind == kind)


@pytest.mark.parametrize(
    ("used", "expected"),
    [(0.49, []), (0.51, [0.5]), (0.79, [0.5]), (0.81, [0.5, 0.8]), (0.99, [0.5, 0.8]), (1.01, [0.5, 0.8, 1.0])],
)
def test_every_level_that_is_reached_is_raised_at_once(used: float, expected: list[float]) -> None:
    alarms = AlarmList()
    assert alarms.judge_deviation("deviation", at(used), 5.0) is bool(expected)
    assert levels(alarms.active) == expected


def test_a_level_is_reached_where_it_is_met() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("deviation", Deviation(2.0, 2.0, np.array([0.5, 0.0]), np.eye(2), 1.0), 1.0)
    assert levels(alarms.active) == [0.5]


def test_an_alarm_says_what_when_and_where() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("projection", at(0.6, md=12.0), 77.0)
    (alarm,) = alarms.active
    assert (alarm.kind, alarm.level, alarm.raised_at, alarm.md) == ("projection", 0.5, 77.0, 12.0)
    assert alarm.size == pytest.approx(0.06)
    assert alarm.std == pytest.approx(0.002)
    assert alarm.limit == pytest.approx(0.1)
    assert alarm.cleared_at is None


def test_a_standing_alarm_is_not_raised_again() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("deviation", at(0.6), 1.0)
    assert not alarms.judge_deviation("deviation", at(0.7), 2.0)
    assert [alarm.raised_at for alarm in alarms.alarms] == [1.0]


def test_noise_about_a_level_does_not_make_it_flicker() -> None:
    alarms = AlarmList()
    changes = [
        alarms.judge_deviation("deviation", at(used), float(k)) for k, used in enumerate([0.505, 0.495, 0.485, 0.505])
    ]
    assert changes == [True, False, False, False]
    assert levels(alarms.active) == [0.5]


def test_an_alarm_is_cleared_when_the_ratio_is_clearly_below_and_stays_on_record() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("deviation", at(0.6), 1.0)
    assert alarms.judge_deviation("deviation", at(0.475), 2.0)
    assert alarms.active == []
    (alarm,) = alarms.alarms
    assert (alarm.raised_at, alarm.cleared_at) == (1.0, 2.0)
    assert not alarms.judge_deviation("deviation", at(0.475), 3.0)
    assert alarms.alarms[0].cleared_at == 2.0


def test_falling_from_the_limit_clears_from_the_top_down() -> None:
    alarms = AlarmList()
    seen = []
    for k, used in enumerate([1.1, 0.985, 0.97, 0.79, 0.77, 0.49, 0.47]):
        alarms.judge_deviation("deviation", at(used), float(k))
        seen.append(levels(alarms.active))
    assert seen == [[0.5, 0.8, 1.0], [0.5, 0.8, 1.0], [0.5, 0.8], [0.5, 0.8], [0.5], [0.5], []]
    assert {alarm.level: alarm.cleared_at for alarm in alarms.alarms} == {1.0: 2.0, 0.8: 4.0, 0.5: 6.0}


def test_a_level_passed_twice_is_two_alarms() -> None:
    alarms = AlarmList()
    for k, used in enumerate([0.6, 0.1, 0.7]):
        alarms.judge_deviation("deviation", at(used), float(k))
    assert [(alarm.raised_at, alarm.cleared_at) for alarm in alarms.alarms] == [(0.0, 1.0), (2.0, None)]


def test_kinds_are_raised_and_cleared_apart() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("deviation", at(0.6), 1.0)
    alarms.judge_deviation("projection", at(0.9), 1.0)
    assert levels(alarms.active) == [0.5]
    assert levels(alarms.active, "projection") == [0.5, 0.8]
    alarms.judge_deviation("deviation", at(0.1), 2.0)
    assert levels(alarms.active) == []
    assert levels(alarms.active, "projection") == [0.5, 0.8]


def test_a_deviation_where_none_is_allowed_raises_every_level() -> None:
    alarms = AlarmList()
    alarms.judge_deviation("deviation", Deviation(0.0, 0.0, np.array([0.01, 0.0]), np.eye(2), 0.0), 1.0)
    assert levels(alarms.active) == [0.5, 0.8, 1.0]
