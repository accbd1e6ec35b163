"""An alarm as the database keeps it: a line of JSON, checked when it is read."""

from __future__ import annotations

import json
from dataclasses import fields
from typing import Any

from groundstation.errors import GroundError
from groundstation.service.alarms.crew_alarms import Condition, CrewAlarm
from groundstation.service.alarms.rig_alarms import Level


class DamagedAlarmError(GroundError, ValueError):
    """The line is no alarm."""


def alarm_to_text(alarm: CrewAlarm) -> str:
    """One line; NaN and infinity are written as Python's JSON does."""
    row = {name: getattr(alarm, name) for name in CrewAlarm.__slots__}
    row["condition"] = {name: getattr(alarm.condition, name) for name in Condition.__slots__}
    return json.dumps(row, sort_keys=True)


def alarm_of_text(text: str) -> CrewAlarm:
    """The alarm of a line.

    Raises
    ------
    DamagedAlarmError
        When it is none.
    """
    try:
        data = json.loads(text)
        condition = _checked_fields(Condition, data.pop("condition") | {})
        alarm: CrewAlarm = _checked_fields(CrewAlarm, data | {"condition": condition})
    except (ValueError, TypeError, AttributeError, KeyError) as error:
        raise DamagedAlarmError(f"expected an alarm, got {text!r:.40}") from error
    return alarm


def _checked_fields(kind: type[Any], data: dict[str, Any]) -> Any:
    """A dataclass whose values have the types of its fields."""
    known = {field.name: str(field.type) for field in fields(kind)}
    values = {}
    for name, value in data.items():
        wanted = TYPES[known[name]]
        if isinstance(value, bool) is not (wanted is bool) or not isinstance(value, wanted):
            raise TypeError(name)
        values[name] = Level(value) if known[name] == "Level" else value
    return kind(**values)


NUMBER, NOTHING = (int, float), type(None)
TYPES: dict[str, Any] = {
    "int": int,
    "float": NUMBER,
    "str": str,
    "bool": bool,
    "Level": int,
    "float | None": (*NUMBER, NOTHING),
    "Condition": Condition,
}
