"""What is wrong now, from the tolerance of the column and from the rig itself, as conditions of one kind."""

from __future__ import annotations

from collections.abc import Iterator

from groundstation.service.alarms.crew_alarms import Condition
from groundstation.service.alarms.rig_alarms import Level, RigAlarms
from groundstation.service.alarms.spread_text import spread_text
from groundstation.service.hole.deviation_alarms import DeviationAlarm
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.string.known_string import KnownString
from groundstation.survey.wall.column_deviation import LEVELS

LEVEL_OF = dict(zip(LEVELS, (Level.NOTICE, Level.DEGRADED, Level.BAD), strict=True))


def conditions_of(alarms: RigAlarms, string: KnownString, hole: SurveyedHole) -> list[Condition]:
    """Everything that stands: one condition a kind of deviation, at the highest level reached."""
    return [*_of_the_rig(alarms, string), *_of_the_column(hole)]


def _of_the_rig(alarms: RigAlarms, string: KnownString) -> Iterator[Condition]:
    for alarm in alarms:
        kind = alarm.kind
        yield Condition(
            kind.code, alarm.subject, kind.level, alarm.detail, _depth_of(string, alarm.subject), count=alarm.count
        )


def _of_the_column(hole: SurveyedHole) -> Iterator[Condition]:
    highest: dict[str, DeviationAlarm] = {}
    for alarm in hole.alarms.active:
        if alarm.kind not in highest or alarm.level > highest[alarm.kind].level:
            highest[alarm.kind] = alarm
    for kind, alarm in highest.items():
        detail = f"{spread_text(alarm.size, alarm.half_width)} (95 %)"
        threshold = f"{100.0 * alarm.level:.0f} % of {100.0 * alarm.limit:.0f} cm"
        yield Condition(kind, "column", LEVEL_OF[alarm.level], detail, alarm.md, alarm.direction, threshold)


def _depth_of(string: KnownString, subject: str) -> float | None:
    """Measured depth (m) of the node that an alarm is about."""
    name, _, number = subject.partition(" ")
    md = string.depth_of_node(int(number)) if name == "tube" and number.isdecimal() else None
    return None if md is None else max(md, 0.0)
