"""Alarms of a column that leaves its tolerance, while it can still be corrected.

Each kind (the deviation as drilled, the deviation projected to the target) has one alarm a level. An alarm is raised
when the level is reached and cleared when the ratio has fallen clearly below, so that noise does not make it flicker.
What was raised stays on record with the time and depth of the survey that raised it. No I/O.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from groundstation.survey.wall.column_deviation import LEVELS, Deviation

CLEARED_BELOW = 0.02  # of the tolerance, under a level


@dataclass(frozen=True, slots=True)
class DeviationAlarm:
    """One level of one kind."""

    kind: str  # deviation or projection
    level: float  # of the tolerance
    raised_at: float  # s, of the survey
    md: float  # m
    size: float  # m
    std: float  # m
    limit: float  # m, the threshold is level times this
    direction: float  # rad, azimuth of the deviation
    cleared_at: float | None = None


class AlarmList:
    """Every alarm raised so far."""

    def __init__(self) -> None:
        self.alarms: list[DeviationAlarm] = []

    @property
    def active(self) -> list[DeviationAlarm]:
        """Alarms not cleared."""
        return [alarm for alarm in self.alarms if alarm.cleared_at is None]

    def judge_deviation(self, kind: str, deviation: Deviation, at: float) -> bool:
        """Raise and clear by a new deviation at rig time ``at`` (s); whether anything changed."""
        ratio, changed, standing = deviation.ratio, False, dict[float, int]()
        for place, alarm in enumerate(self.alarms):
            if alarm.kind == kind and alarm.cleared_at is None:
                standing[alarm.level] = place
        for level in LEVELS:
            known = standing.get(level)
            if known is None and ratio >= level:
                direction = math.atan2(deviation.offset[1], deviation.offset[0]) % math.tau
                new = DeviationAlarm(
                    kind, level, at, deviation.md, deviation.size, deviation.std, deviation.limit, direction
                )
                self.alarms.append(new)
                changed = True
            elif known is not None and ratio < level - CLEARED_BELOW:
                self.alarms[known] = replace(self.alarms[known], cleared_at=at)
                changed = True
        return changed
