"""What the key of the alarms holds: those that the crew works with, and what they are made of."""

from __future__ import annotations

import math
from typing import Any

from groundstation.service.alarms.crew_alarms import HOUR, CrewAlarm
from groundstation.service.alarms.rig_alarms import RigAlarm
from groundstation.service.alarms.verdict import compass_point
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.views import finite, utc_text
from groundstation.service.hole.deviation_alarms import DeviationAlarm
from groundstation.survey.wall.column_deviation import LEVELS

View = dict[str, Any]


def alarms(k: RigModel, _p: dict[str, str]) -> View:
    """What the crew works with; deviations and alarms of the rig, standing or cleared; where the hole moved."""
    crew = k.crew_alarms
    return {
        "open": [crew_alarm_view(k, alarm) for alarm in crew],
        "closed": [crew_alarm_view(k, alarm) for alarm in crew.cleared],
        "raised_last_hour": crew.raised_within(HOUR),
        "flood": crew.in_flood,
        "left_out": crew.left_out,
        "levels_percent": [round(100.0 * level) for level in LEVELS],
        "active": [alarm_view(alarm) for alarm in k.hole.alarms.active],
        "cleared": [alarm_view(alarm) for alarm in k.hole.alarms.alarms if alarm.cleared_at is not None],
        "moved": [
            {
                "md_m": round(moved.md, 6),
                "at_s": moved.at,
                "dropped_measurements": moved.dropped,
                "departure_sigma": moved.evidence.own,
                "neighbours_sigma": list(moved.evidence.neighbours),
            }
            for moved in k.hole.moved
        ],
        "rig": [rig_alarm_view(alarm) for alarm in k.rig_alarms],
        "rig_cleared": [rig_alarm_view(alarm) for alarm in k.rig_alarms.cleared],
    }


def rig_alarm_view(a: RigAlarm) -> View:
    """One alarm of the rig itself."""
    return {
        "code": a.kind.code,
        "level": a.kind.level.name.lower(),
        "subject": a.subject,
        "detail": a.detail,
        "raised_at_s": finite(a.raised_at),
        "cleared_at_s": None if a.cleared_at is None else finite(a.cleared_at),
        "count": a.count,
    }


def alarm_view(a: DeviationAlarm) -> View:
    """One alarm with the threshold it passed."""
    return {
        "kind": a.kind,
        "level_percent": round(100.0 * a.level),
        "raised_at_s": a.raised_at,
        "md_m": round(a.md, 6),
        "deviation_cm": 100.0 * a.size,
        "sigma_cm": 100.0 * a.std,
        "threshold_cm": 100.0 * a.level * a.limit,
        "cleared_at_s": a.cleared_at,
    }


def crew_alarm_view(k: RigModel, a: CrewAlarm) -> View:
    """One alarm as the crew works with it."""
    what = a.condition
    return {
        "number": a.number,
        "state": a.state(k.crew_alarms.utc).value,
        "code": what.code,
        "level": what.level.name.lower(),
        "subject": what.subject,
        "detail": what.detail,
        "threshold": what.threshold,
        "md_m": None if what.md is None else round(what.md, 2),
        "azimuth_deg": None if what.direction is None else round(math.degrees(what.direction)) % 360,
        "wind": None if what.direction is None else compass_point(what.direction),
        "since_s": finite(a.since),
        "since_utc": utc_text(a.since_utc),
        "times": a.times,
        "count": what.count,
        "acknowledged_by": a.acknowledged_by or None,
        "acknowledged_utc": utc_text(a.acknowledged_utc),
        "shelved_by": a.shelved_by or None,
        "shelved_until_utc": utc_text(a.shelved_until),
        "cleared_at_s": None if a.cleared_at is None else finite(a.cleared_at),
    }
