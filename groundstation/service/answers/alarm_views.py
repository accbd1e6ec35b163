"""View of the alarms: those that the crew works with, and what they are made of."""

from __future__ import annotations

import math

from groundstation.service.alarms.crew_alarms import HOUR, CrewAlarm, CrewAlarms
from groundstation.service.alarms.rig_alarms import RigAlarm
from groundstation.service.alarms.verdict import compass_point
from groundstation.service.answers.answer_texts import finite_or_none, utc_or_none
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.alarm_shapes import (
    Alarm,
    AlarmsAnswer,
    MovedStation,
    RigAlarmRow,
    ToleranceAlarmRow,
)
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.service.hole.deviation_alarms import DeviationAlarm
from groundstation.service.hole.movement import Moved
from groundstation.survey.wall.column_deviation import LEVELS


@view_of(AlarmsAnswer)
def answer_alarms(k: RigModel, _p: Parameters) -> AlarmsAnswer:
    """What the crew works with; deviations and alarms of the rig, standing or cleared; where the hole moved."""
    crew, deviations, moved, rig = k.crew_alarms, k.hole.alarms, k.hole.moved, k.rig_alarms
    return AlarmsAnswer(
        open=[crew_alarm_row(crew, alarm) for alarm in crew],
        closed=[crew_alarm_row(crew, alarm) for alarm in crew.cleared],
        raised_last_hour=crew.raised_within(HOUR),
        flood=crew.in_flood,
        left_out=crew.left_out,
        levels_percent=[round(100.0 * level) for level in LEVELS],
        active=[tolerance_alarm_row(alarm) for alarm in deviations.active],
        cleared=[tolerance_alarm_row(alarm) for alarm in deviations.alarms if alarm.cleared_at is not None],
        moved=[moved_station(one) for one in moved],
        rig=[rig_alarm_row(alarm) for alarm in rig],
        rig_cleared=[rig_alarm_row(alarm) for alarm in rig.cleared],
    )


def moved_station(m: Moved) -> MovedStation:
    """A station where the hole moved."""
    return MovedStation(
        md_m=round(m.md, 6),
        at_s=m.at,
        dropped_measurements=m.dropped,
        departure_sigma=m.evidence.own,
        neighbours_sigma=list(m.evidence.neighbours),
    )


def rig_alarm_row(a: RigAlarm) -> RigAlarmRow:
    """One alarm of the rig itself."""
    return RigAlarmRow(
        code=a.kind.code,
        level=a.kind.level.name.lower(),
        subject=a.subject,
        detail=a.detail,
        raised_at_s=finite_or_none(a.raised_at),
        cleared_at_s=None if a.cleared_at is None else finite_or_none(a.cleared_at),
        count=a.count,
    )


def tolerance_alarm_row(a: DeviationAlarm) -> ToleranceAlarmRow:
    """One alarm with the threshold it passed."""
    return ToleranceAlarmRow(
        kind=a.kind,
        level_percent=round(100.0 * a.level),
        raised_at_s=a.raised_at,
        md_m=round(a.md, 6),
        deviation_cm=100.0 * a.size,
        sigma_cm=100.0 * a.std,
        threshold_cm=100.0 * a.level * a.limit,
        cleared_at_s=a.cleared_at,
    )


def crew_alarm_row(crew: CrewAlarms, a: CrewAlarm) -> Alarm:
    """One alarm as the crew works with it."""
    what = a.condition
    return Alarm(
        number=a.number,
        state=a.state(crew.utc).value,
        code=what.code,
        level=what.level.name.lower(),
        subject=what.subject,
        detail=what.detail,
        threshold=what.threshold,
        md_m=None if what.md is None else round(what.md, 2),
        azimuth_deg=None if what.direction is None else round(math.degrees(what.direction)) % 360,
        wind=None if what.direction is None else compass_point(what.direction),
        since_s=finite_or_none(a.since),
        since_utc=utc_or_none(a.since_utc),
        times=a.times,
        count=what.count,
        acknowledged_by=a.acknowledged_by or None,
        acknowledged_utc=utc_or_none(a.acknowledged_utc),
        shelved_by=a.shelved_by or None,
        shelved_until_utc=utc_or_none(a.shelved_until),
        cleared_at_s=None if a.cleared_at is None else finite_or_none(a.cleared_at),
    )
