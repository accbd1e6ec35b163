"""Alarms of a column: raised at a level, cleared clearly below it, kept on record.

Those of the projection are raised by what is expected of the end and cleared by the chance that it ends within.
"""

import numpy as np
import pytest

from groundstation.service.hole.deviation_alarms import AlarmList, DeviationAlarm
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd


def at(used: float, md: float = 10.0) -> Deviation:
    """A deviation that uses a share of a tolerance of 10 cm."""
    return Deviation(md, md, np.array([0.0, 0.1 * used]), np.diag([1e-4, 4e-6]), 0.1)


def ending(used: float, std: float = 0.002) -> ProjectedEnd:
    """An end of a tolerance of 10 cm that is foreseen as a round normal."""
    ends = Deviation(12.0, 12.0, np.array([0.0, 0.1 * used]), std**2 * np.eye(2), 0.1)
    return ProjectedEnd(ends, NormalMixture(np.ones(1), ends.offset[None], ends.cov[None]), ends.cov)


def levels(alarms: list[DeviationAlarm], kind: str = "deviation") -> list[float]:
    return sorted(alarm.level for alarm in alarms if alarm.kind == kind)


@pytest.mark.parametrize(
    ("used", "expected"),
    [(0.49, []), (0.51, [0.5]), (0.79, [0.5]), (0.81, [0.5, 0.8]), (0.99, [0.5, 0.8]), (1.01, [0.5, 0.8, 1.0])],
)
def test_every_level_that_is_reached_is_raised_at_once(used: float, expected: list[float]) -> None:
    alarms = AlarmList()
    assert alarms.judge_deviation(at(used), 5.0) is bool(expected)
    assert levels(alarms.active) == expected


def test_a_level_is_reached_where_it_is_met() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(Deviation(2.0, 2.0, np.array([0.5, 0.0]), np.eye(2), 1.0), 1.0)
    assert levels(alarms.active) == [0.5]


def test_an_alarm_says_what_when_and_where() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(at(0.6, md=12.0), 77.0)
    (alarm,) = alarms.active
    assert (alarm.kind, alarm.level, alarm.raised_at, alarm.md) == ("deviation", 0.5, 77.0, 12.0)
    assert alarm.size == pytest.approx(0.06)
    assert alarm.std == pytest.approx(0.002)
    assert alarm.half_width == pytest.approx(0.00392, abs=1e-5)
    assert alarm.limit == pytest.approx(0.1)
    assert alarm.cleared_at is None


def test_an_alarm_of_the_projection_says_what_is_expected_and_how_surely() -> None:
    alarms = AlarmList()
    alarms.judge_projection(ending(0.6, std=0.01), 77.0)
    (alarm,) = alarms.active
    assert (alarm.kind, alarm.level, alarm.raised_at, alarm.md) == ("projection", 0.5, 77.0, 12.0)
    assert alarm.size == pytest.approx(0.06)
    assert alarm.half_width == pytest.approx(0.0196, abs=1e-4)


def test_a_spread_alone_raises_nothing() -> None:
    """At the first survey the end is open, and there is nothing to steer against."""
    alarms = AlarmList()
    assert not alarms.judge_projection(ending(0.1, std=0.2), 1.0)
    assert alarms.active == []


@pytest.mark.parametrize(
    ("used", "std", "stands"),
    [
        (0.49, 0.002, True),  # 65 % within half of the tolerance
        (0.47, 0.002, False),  # 93 %
        (0.45, 0.006, True),  # 79 %
        (0.43, 0.006, False),  # 88 %
        (0.2, 0.05, True),  # expected far below the level, and by no means sure of it
    ],
)
def test_a_projection_is_cleared_when_it_ends_within_the_level_with_80_percent(
    used: float, std: float, stands: bool
) -> None:
    alarms = AlarmList()
    alarms.judge_projection(ending(0.6, std=std), 1.0)
    alarms.judge_projection(ending(used, std=std), 2.0)
    assert (0.5 in levels(alarms.active, "projection")) == stands


def test_what_is_expected_from_stop_to_stop_does_not_make_it_flicker() -> None:
    """The end of a hole on its way to 55 % as its stops of 2 m see it: off by less and less, by its own spread."""
    alarms, random = AlarmList(), np.random.default_rng(4)
    stds = np.geomspace(0.03, 0.001, 14)
    for stop, std in enumerate(stds):
        alarms.judge_projection(ending(0.55 + 10.0 * std * random.normal(), std=std), float(stop))
    assert levels(alarms.alarms, "projection").count(0.5) <= 2
    assert levels(alarms.active, "projection") == [0.5]


def test_a_standing_alarm_is_not_raised_again() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(at(0.6), 1.0)
    assert not alarms.judge_deviation(at(0.7), 2.0)
    assert [alarm.raised_at for alarm in alarms.alarms] == [1.0]


def test_noise_about_a_level_does_not_make_it_flicker() -> None:
    alarms = AlarmList()
    changes = [alarms.judge_deviation(at(used), float(k)) for k, used in enumerate([0.505, 0.495, 0.485, 0.505])]
    assert changes == [True, False, False, False]
    assert levels(alarms.active) == [0.5]


def test_an_alarm_is_cleared_when_the_ratio_is_clearly_below_and_stays_on_record() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(at(0.6), 1.0)
    assert alarms.judge_deviation(at(0.475), 2.0)
    assert alarms.active == []
    (alarm,) = alarms.alarms
    assert (alarm.raised_at, alarm.cleared_at) == (1.0, 2.0)
    assert not alarms.judge_deviation(at(0.475), 3.0)
    assert alarms.alarms[0].cleared_at == 2.0


def test_falling_from_the_limit_clears_from_the_top_down() -> None:
    alarms = AlarmList()
    seen = []
    for k, used in enumerate([1.1, 0.985, 0.97, 0.79, 0.77, 0.49, 0.47]):
        alarms.judge_deviation(at(used), float(k))
        seen.append(levels(alarms.active))
    assert seen == [[0.5, 0.8, 1.0], [0.5, 0.8, 1.0], [0.5, 0.8], [0.5, 0.8], [0.5], [0.5], []]
    assert {alarm.level: alarm.cleared_at for alarm in alarms.alarms} == {1.0: 2.0, 0.8: 4.0, 0.5: 6.0}


def test_a_level_passed_twice_is_two_alarms() -> None:
    alarms = AlarmList()
    for k, used in enumerate([0.6, 0.1, 0.7]):
        alarms.judge_deviation(at(used), float(k))
    assert [(alarm.raised_at, alarm.cleared_at) for alarm in alarms.alarms] == [(0.0, 1.0), (2.0, None)]


def test_kinds_are_raised_and_cleared_apart() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(at(0.6), 1.0)
    alarms.judge_projection(ending(0.9), 1.0)
    assert levels(alarms.active) == [0.5]
    assert levels(alarms.active, "projection") == [0.5, 0.8]
    alarms.judge_deviation(at(0.1), 2.0)
    assert levels(alarms.active) == []
    assert levels(alarms.active, "projection") == [0.5, 0.8]


def test_a_deviation_where_none_is_allowed_raises_every_level() -> None:
    alarms = AlarmList()
    alarms.judge_deviation(Deviation(0.0, 0.0, np.array([0.01, 0.0]), np.eye(2), 0.0), 1.0)
    assert levels(alarms.active) == [0.5, 0.8, 1.0]
