"""Alarms of a column that leaves its tolerance, while it can still be corrected.

Each kind (the deviation as drilled, the deviation projected to the target) has one alarm a level. One of the deviation
is raised when the level is reached and cleared when the ratio has fallen clearly below; one of the projection is raised
when the end is expected beyond the level and cleared when it is within with 80 %: so noise, and what the next survey
adds to what is expected, do not make them flicker.
What was raised stays on record with the time and depth of the survey that raised it. No I/O.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from groundstation.survey.wall.column_deviation import LEVELS, Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd

CLEARED_BELOW = 0.02  # of the tolerance, under a level
CLEARED_FROM = 0.8  # chance of ending within a level
DEVIATION, PROJECTION = "deviation", "projection"


@dataclass(frozen=True, slots=True)
class DeviationAlarm:
    """One level of one kind."""

    kind: str  # deviation or projection
    level: float  # of the tolerance
    raised_at: float  # s, of the survey
    md: float  # m
    size: float  # m
    std: float  # m
    half_width: float  # m, of 95 %
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

    def judge_deviation(self, deviation: Deviation, at: float) -> bool:
        """Raise and clear by a new deviation as drilled at rig time ``at`` (s); whether anything changed."""
        ratio = deviation.ratio
        cleared = [level for level in LEVELS if ratio < level - CLEARED_BELOW]
        return self._judge(DEVIATION, deviation, deviation, cleared, at)

    def judge_projection(self, end: ProjectedEnd, at: float) -> bool:
        """Raise and clear by a new projection at rig time ``at`` (s); whether anything changed."""
        standing = [alarm.level for alarm in self.active if alarm.kind == PROJECTION]
        cleared = [
            level
            for level in standing
            if end.ends.ratio < level and end.chance_within(level * end.limit) >= CLEARED_FROM
        ]
        return self._judge(PROJECTION, end.ends, end, cleared, at)

    def _judge(
        self, kind: str, deviation: Deviation, spread: Deviation | ProjectedEnd, cleared: Sequence[float], at: float
    ) -> bool:
        """Raise the levels that are reached and do not stand, and clear some of those that do.

        The half width of ``spread`` is worked out where one is raised.
        """
        changed, standing, ratio = False, dict[float, int](), deviation.ratio
        for place, alarm in enumerate(self.alarms):
            if alarm.kind == kind and alarm.cleared_at is None:
                standing[alarm.level] = place
        for level in LEVELS:
            known = standing.get(level)
            if known is None and ratio >= level:
                self.alarms.append(_alarm_of(kind, level, deviation, spread.half_width, at))
                changed = True
            elif known is not None and level in cleared:
                self.alarms[known] = replace(self.alarms[known], cleared_at=at)
                changed = True
        return changed


def _alarm_of(kind: str, level: float, deviation: Deviation, half_width: float, at: float) -> DeviationAlarm:
    direction = math.atan2(deviation.offset[1], deviation.offset[0]) % math.tau
    size, std, limit = deviation.size, deviation.std, deviation.limit
    return DeviationAlarm(kind, level, at, deviation.md, size, std, half_width, limit, direction)
