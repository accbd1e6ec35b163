"""Alarms as a crew works with them: raised, acknowledged, shelved, latched, cleared; after ISA-18.2. No I/O.

What is wrong now comes as a list of conditions, again and again; an alarm is raised when its condition has stood for
the delay of its level, and is one alarm however often the condition comes and goes meanwhile. Where more is wrong than
a crew can read, the worst is kept and the rest is counted.
Source: ANSI/ISA-18.2-2016, states of an alarm (5.3), delays, flood (more than ten in ten minutes, until below five).
"""

from __future__ import annotations

import enum
import math
from collections import deque
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace

from groundstation.errors import SelectorError
from groundstation.service.alarms.rig_alarms import Level

OPEN_AT_MOST = 40  # alarms that are not cleared
CLEARED_KEPT = 200
DELAYS = {Level.NOTICE: 0.0, Level.DEGRADED: 10.0, Level.BAD: 0.0}  # s, own clock, that a condition stands before
AGAIN_WITHIN = 60.0  # s, own clock, within which a condition that returns is the same alarm
SETTLED_AFTER = 30.0  # s, own clock, after a start before what was known is taken for gone
STEPS_BACK = 60.0  # s by which a date may be put right without a word
HOUR, TEN_MINUTES = 3600.0, 600.0
FLOOD_FROM, FLOOD_UNTIL = 10, 5  # alarms raised within ten minutes

Key = tuple[str, str]  # code and subject


class AlarmState(enum.StrEnum):
    """How far an alarm is."""

    RAISED = "raised"  # its condition stands, not acknowledged
    ACKNOWLEDGED = "acknowledged"  # its condition stands
    SHELVED = "shelved"  # put away for a time
    LATCHED = "latched"  # its condition is gone, not acknowledged
    CLEARED = "cleared"


@dataclass(frozen=True, slots=True)
class Times:
    """One moment: s of the own clock, of rig time (NaN where it is not known), and UTC since 1970."""

    now: float
    rig_now: float
    utc: float


@dataclass(frozen=True, slots=True)
class Condition:
    """Something that is wrong now: what, where (m along the hole), towards which azimuth (rad), beyond what."""

    code: str
    subject: str
    level: Level
    detail: str = ""
    md: float | None = None
    direction: float | None = None
    threshold: str = ""
    count: int = 1  # times that it was noticed

    @property
    def key(self) -> Key:
        """Identity: one alarm a key."""
        return self.code, self.subject


@dataclass(frozen=True, slots=True)
class CrewAlarm:
    """One alarm; rig times are NaN where they are not known, times of people are in UTC (s since 1970)."""

    number: int  # never used twice
    condition: Condition  # as it was when it stood last
    since: float  # s, rig time
    since_utc: float
    stands: bool = True
    times: int = 1  # that it was raised
    acknowledged_by: str = ""
    acknowledged_utc: float = math.nan
    shelved_by: str = ""
    shelved_until: float = -math.inf  # UTC
    cleared_at: float | None = None  # s, rig time, of the condition
    dropped: bool = False  # for want of room

    def state(self, utc: float) -> AlarmState:
        """State at a time (UTC, s)."""
        if self.dropped:
            return AlarmState.CLEARED
        if utc < self.shelved_until:
            return AlarmState.SHELVED
        if self.stands:
            return AlarmState.ACKNOWLEDGED if self.acknowledged_by else AlarmState.RAISED
        latches = self.condition.level is Level.BAD and not self.acknowledged_by
        return AlarmState.LATCHED if latches else AlarmState.CLEARED


class CrewAlarms:
    """Every alarm that is open, and the newest that were cleared."""

    def __init__(self) -> None:
        self.cleared: deque[CrewAlarm] = deque(maxlen=CLEARED_KEPT)
        self.in_flood = False
        self._open: dict[Key, CrewAlarm] = {}
        self._newest = 0  # number
        self._first_seen: dict[Key, float] = {}  # s, own clock, of conditions that stand
        self._gone_at: dict[Key, float] = {}  # s, own clock, of alarms that were cleared a moment ago
        self._left_out: set[Key] = set()  # conditions that stand and had no room
        self._left_out_before = 0
        self._quiet: dict[Key, Level] = {}  # conditions of stored data, with their level
        self._raised_at: deque[float] = deque()  # s, own clock, within an hour
        self._changed: dict[int, CrewAlarm] = {}
        self._settled_at = -math.inf  # s, own clock
        self._is_restored = False
        self._now = math.nan
        self.utc = -math.inf  # s since 1970, of the last update

    def __iter__(self) -> Iterator[CrewAlarm]:
        """Open alarms, the worst first, of equals the newest."""
        return iter(sorted(self._open.values(), key=lambda a: (-a.condition.level, -a.number)))

    @property
    def left_out(self) -> int:
        """Conditions that found no room so far."""
        return self._left_out_before + len(self._left_out)

    def raised_within(self, duration: float) -> int:
        """Alarms raised in the last seconds of the own clock, an hour at most."""
        return sum(at > self._now - duration for at in self._raised_at)

    def restore(self, stored: Iterable[CrewAlarm], conditions: Iterable[Condition]) -> None:
        """Go on with stored alarms; the conditions that stored data show raise none."""
        for alarm in sorted(stored, key=lambda one: one.number):
            self._newest = max(self._newest, alarm.number)
            if alarm.state(-math.inf) is AlarmState.CLEARED:
                self.cleared.append(alarm)
            else:
                self._open[alarm.condition.key] = alarm
        self._quiet = {one.key: one.level for one in conditions if one.key not in self._open}
        dates = [
            date for one in (*self._open.values(), *self.cleared) for date in (one.since_utc, one.acknowledged_utc)
        ]
        self.utc = max((date for date in dates if math.isfinite(date)), default=-math.inf)
        self._is_restored = True

    def follow_date(self, utc: float) -> float:
        """Seconds by which the date is before one that was; what is shelved comes back as much earlier. Else 0."""
        back = self.utc - utc
        if not STEPS_BACK < back < math.inf:
            return 0.0
        for alarm in list(self._open.values()):
            if alarm.shelved_by:
                self._change(replace(alarm, shelved_until=alarm.shelved_until - back))
        self.utc = utc
        return back

    def update(self, conditions: Iterable[Condition], times: Times) -> None:
        """Take what is wrong now."""
        self._now, self.utc = times.now, times.utc
        if self._is_restored:
            self._settled_at, self._is_restored = times.now + SETTLED_AFTER, False
        standing = {one.key: one for one in conditions}
        self._forget(standing, times.now)
        self._take_from_shelf(times.utc)
        for key, alarm in list(self._open.items()):
            if key in standing:
                self._stay(alarm, standing[key], times)
            else:
                self._go(alarm, times)
        due = [one for key, one in standing.items() if key not in self._open and self._is_due(one, times.now)]
        for condition in sorted(due, key=lambda one: -one.level):
            self._raise(condition, times)
        within = self.raised_within(TEN_MINUTES)
        self.in_flood = within > FLOOD_FROM or (self.in_flood and within >= FLOOD_UNTIL)

    def acknowledged(self, number: int, by: str, utc: float) -> CrewAlarm:
        """The alarm as it is once ``by`` has acknowledged it; ``put`` makes it so.

        Raises
        ------
        SelectorError
            When there is none of that number, or it was acknowledged before; the message says by whom.
        """
        alarm = self._get(number)
        if alarm.acknowledged_by:
            raise SelectorError(
                f"alarm {number}: {alarm.acknowledged_by} has acknowledged it, {utc - alarm.acknowledged_utc:.0f} s ago"
            )
        return replace(alarm, acknowledged_by=by, acknowledged_utc=utc)

    def shelved(self, number: int, by: str, until: float) -> CrewAlarm:
        """The alarm as it is once ``by`` has put it away until a time (UTC, s); errors as ``acknowledged``."""
        return replace(self._get(number), shelved_by=by, shelved_until=until)

    def unshelved(self, number: int) -> CrewAlarm:
        """The alarm as it is once it is taken back; errors as ``acknowledged``."""
        alarm = self._get(number)
        if not alarm.shelved_by:
            raise SelectorError(f"alarm {number}: expected one that is shelved")
        return replace(alarm, shelved_by="", shelved_until=-math.inf)

    def put(self, alarm: CrewAlarm) -> None:
        """Take an alarm in the place of the one of its number; one that has cleared by it is closed."""
        self._change(alarm)
        if alarm.state(self.utc) is AlarmState.CLEARED:
            self._close(alarm)

    def drain_changed(self) -> list[CrewAlarm]:
        """Alarms that changed since the last call."""
        changed, self._changed = list(self._changed.values()), {}
        return changed

    def _get(self, number: int) -> CrewAlarm:
        for alarm in self._open.values():
            if alarm.number == number:
                return alarm
        known = ", ".join(str(alarm.number) for alarm in self) or "none is open"
        raise SelectorError(f"alarm {number}: no such open alarm; expected one of {known}")

    def _take_from_shelf(self, utc: float) -> None:
        """Have those back whose time on the shelf has passed."""
        for alarm in list(self._open.values()):
            if alarm.shelved_by and utc >= alarm.shelved_until:
                self._change(replace(alarm, shelved_by="", shelved_until=-math.inf))

    def _forget(self, standing: dict[Key, Condition], now: float) -> None:
        """Drop what is only remembered while a condition stands, or for a time."""
        self._first_seen = {key: self._first_seen.get(key, now) for key in standing}
        self._quiet = {key: level for key, level in self._quiet.items() if key in standing}
        ended = self._left_out - standing.keys()
        self._left_out_before += len(ended)
        self._left_out -= ended
        self._gone_at = {key: at for key, at in self._gone_at.items() if now <= at + AGAIN_WITHIN}
        while self._raised_at and self._raised_at[0] <= now - HOUR:
            self._raised_at.popleft()

    def _is_due(self, condition: Condition, now: float) -> bool:
        quiet = self._quiet.get(condition.key)
        if quiet is not None and condition.level <= quiet:
            return False
        return now >= self._first_seen[condition.key] + DELAYS[condition.level]

    def _stay(self, alarm: CrewAlarm, condition: Condition, times: Times) -> None:
        """The condition of a known alarm stands: again, or worse than before, it wants to be acknowledged anew."""
        if alarm.stands and condition.level <= alarm.condition.level:
            if condition != alarm.condition:
                self._change(replace(alarm, condition=condition))
            return
        self._raised_at.append(times.now)
        self._change(
            replace(
                alarm, condition=condition, stands=True, since=times.rig_now, since_utc=times.utc, cleared_at=None,
                times=alarm.times + 1, acknowledged_by="", acknowledged_utc=math.nan,
            )
        )  # fmt: skip

    def _go(self, alarm: CrewAlarm, times: Times) -> None:
        """The condition of an open alarm does not stand; what was known before a start has time to show itself."""
        if alarm.stands and times.now < self._settled_at:
            return
        if alarm.stands:
            alarm = replace(alarm, stands=False, cleared_at=times.rig_now)
            self._change(alarm)
        if alarm.state(times.utc) is AlarmState.CLEARED:
            self._close(alarm)
            self._gone_at[alarm.condition.key] = times.now

    def _raise(self, condition: Condition, times: Times) -> None:
        key = condition.key
        if not self._make_room(condition):
            self._left_out.add(key)
            return
        self._left_out.discard(key)
        before = next((a for a in reversed(self.cleared) if a.condition.key == key), None)
        if key in self._gone_at and before is not None:
            self.cleared.remove(before)
            self._stay(replace(before, stands=False, dropped=False), condition, times)
            return
        self._newest += 1
        self._raised_at.append(times.now)
        self._change(CrewAlarm(self._newest, condition, times.rig_now, times.utc))

    def _make_room(self, condition: Condition) -> bool:
        """Have room, if need be in the place of the oldest of the mildest; False where all others matter as much."""
        if len(self._open) < OPEN_AT_MOST:
            return True
        mildest = min(self._open.values(), key=lambda a: (a.condition.level, a.stands, a.number))
        if (mildest.condition.level, mildest.stands) >= (condition.level, True):
            return False
        self._left_out.add(mildest.condition.key)
        self._close(replace(mildest, dropped=True))
        return True

    def _change(self, alarm: CrewAlarm) -> None:
        self._open[alarm.condition.key] = alarm
        self._changed[alarm.number] = alarm

    def _close(self, alarm: CrewAlarm) -> None:
        self._open.pop(alarm.condition.key, None)
        self._changed[alarm.number] = alarm
        self.cleared.append(alarm)
