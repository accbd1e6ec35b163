"""What is wrong now, from the tolerance of the column and from the rig itself, as conditions of one kind."""

from __future__ import annotations

from collections.abc import Iterator

from groundstation.service.alarms.crew_alarms import Condition
from groundstation.service.alarms.rig_alarms import Level
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.verdict_views import FINEST_CM
from groundstation.service.hole.deviation_alarms import Alarm
from groundstation.survey.wall.column_deviation import LEVELS

LEVEL_OF = dict(zip(LEVELS, (Level.NOTICE, Level.DEGRADED, Level.BAD), strict=True))


def conditions_of(k: RigModel) -> list[Condition]:
    """Everything that stands: one condition a kind of deviation, at the highest level reached."""
    return [*_of_the_rig(k), *_of_the_column(k)]


def _of_the_rig(k: RigModel) -> Iterator[Condition]:
    for alarm in k.rig_alarms:
        kind = alarm.kind
        yield Condition(
            kind.code, alarm.subject, kind.level, alarm.detail, _depth_of(k, alarm.subject), count=alarm.count
        )


def _of_the_column(k: RigModel) -> Iterator[Condition]:
    highest: dict[str, Alarm] = {}
    for alarm in k.hole.alarms.active:
        if alarm.kind not in highest or alarm.level > highest[alarm.kind].level:
            highest[alarm.kind] = alarm
    for kind, alarm in highest.items():
        detail = f"{100.0 * alarm.size:.1f} ± {max(100.0 * alarm.std, FINEST_CM):.1f} cm"
        threshold = f"{100.0 * alarm.level:.0f} % of {100.0 * alarm.limit:.0f} cm"
        yield Condition(kind, "column", LEVEL_OF[alarm.level], detail, alarm.md, alarm.direction, threshold)


def _depth_of(k: RigModel, subject: str) -> float | None:
    """Measured depth (m) of the node that an alarm is about."""
    name, _, number = subject.partition(" ")
    below = k.tally.length_below(int(number)) if name == "tube" and number.isdecimal() else None
    bit = k.depths.latest
    return None if bit is None or below is None else max(bit - below, 0.0)
