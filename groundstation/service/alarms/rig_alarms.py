"""What the crew must know of the rig itself: one table of kinds, and what stands now. No I/O.

An alarm has a kind and a subject; raised again it counts up. It is cleared when its cause is gone, and what happened
once and has no end (a restart) leaves by itself. The health of the rig is the worst of all that stand.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import IntEnum

CLEARED_SHOWN = 200
STANDING = 1000  # alarms at a time; of more the oldest of the mildest goes and is counted
NOTICE_S = 600.0  # s of the own clock for which a notice is shown


class Health(IntEnum):
    """State of the rig as far as it can be told; the larger is the worse."""

    GOOD = 0
    DEGRADED = 1  # less than planned, nothing wrong
    UNKNOWN = 2  # cannot be told: no rig time, no depth, or no tube heard
    BAD = 3  # something is wrong, or was lost


class Level(IntEnum):
    """How much a kind of alarm matters."""

    NOTICE = 0
    DEGRADED = 1
    BAD = 3


@dataclass(frozen=True, slots=True)
class AlarmKind:
    """One line of the table."""

    code: str
    level: Level
    meaning: str


NOTICE, DEGRADED, BAD = Level.NOTICE, Level.DEGRADED, Level.BAD
KINDS: tuple[AlarmKind, ...] = (
    AlarmKind("survey_untrusted", DEGRADED, "a survey's yaw is taken for unknown because of its flags"),
    AlarmKind("survey_set_aside", DEGRADED, "a survey of a faulty sensor is kept and not fused"),
    AlarmKind("survey_unplaced", DEGRADED, "no depth brackets the time of a survey; it is kept and not fused"),
    AlarmKind("survey_refused", DEGRADED, "the numbers of a survey are no survey"),
    AlarmKind("survey_missing", BAD, "a tube made no survey at a stop"),
    AlarmKind("numbers_missing", BAD, "messages of a tube have not come; they are asked for again"),
    AlarmKind("numbers_lost", DEGRADED, "messages of a tube will not come: the tube no longer has them"),
    AlarmKind("tube_counts_anew", NOTICE, "a tube has lost its memory and numbers its messages from the beginning"),
    AlarmKind("tube_restarted", NOTICE, "a tube has started again"),
    AlarmKind(
        "same_number",
        BAD,
        "two tubes give themselves one number: nothing of either is fused until it is told which of them it is",
    ),
    AlarmKind("tube_silent", DEGRADED, "a tube of the string has not been heard for too long"),
    AlarmKind("tube_sensor", DEGRADED, "a tube flags a sensor or its yaw"),
    AlarmKind("tube_disk", DEGRADED, "a tube cannot save its state; a cut now loses what came since"),
    AlarmKind("tube_queue", NOTICE, "a queue of a tube was full and dropped something"),
    AlarmKind("clock", BAD, "a tube's rig time is ahead of the ground station's, or of another epoch"),
    AlarmKind("clock_back", NOTICE, "clock or date of the ground station's machine stepped back, as of a restored one"),
    AlarmKind("epoch", NOTICE, "the encoder has started again: rig time counts anew"),
    AlarmKind(
        "reference",
        BAD,
        "the encoder may have slipped: gyroscopes contradict it at once, or none has watched it; check the azimuths, "
        "and tell north by a new bearing, which ends it",
    ),
    AlarmKind(
        "joint",
        BAD,
        "the yaws of two neighbours have parted: the joint between them turned, or one was told a wrong yaw; "
        "check the azimuths below and above",
    ),
    AlarmKind(
        "belt",
        BAD,
        "all gyroscopes show the encoder to turn less, or more, by the same part: its belt slips, or it has "
        "other counts than its settings say; check the azimuths",
    ),
    AlarmKind(
        "blunder",
        BAD,
        "the surveys of the tubes contradict each other; the detail says what explains it best, and that is taken out",
    ),
    AlarmKind("depth_refused", BAD, "readings of the depth are refused"),
    AlarmKind("depth_silent", BAD, "no depth comes any more"),
    AlarmKind(
        "depth_stands", DEGRADED, "the string has turned for a minute and the depth has not moved: does it stick?"
    ),
    AlarmKind("depth_contradicts", BAD, "the depth does not fit the tubes in the hole"),
    AlarmKind("disk", BAD, "the ground station's database refuses; nothing is acknowledged until it takes"),
    AlarmKind("lease", BAD, "it is not sure that this is still the ground station of the rig: it takes in nothing"),
    AlarmKind("database", BAD, "the database is damaged: messages are asked for again, tell again what was told"),
    AlarmKind("queue", DEGRADED, "a queue of the ground station was full and dropped something"),
    AlarmKind("bad_input", NOTICE, "bytes came that are no message of ours; they were dropped"),
    AlarmKind("wrong_password", NOTICE, "a wrong password was tried on the page; the detail says how often"),
    AlarmKind("page_restarted", NOTICE, "the page's web server has failed and was started again"),
    AlarmKind("seal_refused", NOTICE, "frames or messages were forged or repeated; they had no effect"),
    AlarmKind("key_file", DEGRADED, "the key file was changed and cannot be used, or holds keys that should be ended"),
    AlarmKind("certificate", DEGRADED, "a certificate ends within a month, or its dates are not those of this machine"),
)
KIND_OF = {kind.code: kind for kind in KINDS}


@dataclass(slots=True)
class RigAlarm:
    """One alarm; times are rig time (s), NaN where it was not known."""

    kind: AlarmKind
    subject: str
    detail: str
    raised_at: float
    count: int = 1
    shown_until: float = math.inf  # s, own clock
    cleared_at: float | None = None


class RigAlarms:
    """Alarms that stand, and the newest that were cleared."""

    def __init__(self) -> None:
        self.cleared: deque[RigAlarm] = deque(maxlen=CLEARED_SHOWN)
        self.dropped = 0
        self._standing: dict[tuple[str, str], RigAlarm] = {}
        self._changed = False
        self._now = self._rig_now = math.nan

    def __iter__(self) -> Iterator[RigAlarm]:
        return iter(self._standing.values())

    def advance(self, now: float, rig_now: float) -> None:
        """Let time pass to ``now`` (s, own clock) and ``rig_now`` (s): notices leave."""
        self._now, self._rig_now = now, rig_now
        for alarm in [alarm for alarm in self if alarm.shown_until <= now]:
            self.clear(alarm.kind.code, alarm.subject)

    def alert(self, code: str, subject: str, detail: str = "", *, again: bool = True) -> None:
        """Raise an alarm, or count it up; ``again`` is false for a state that is only looked at again."""
        kind, key = KIND_OF[code], (code, subject)
        shown_until = self._now + NOTICE_S if kind.level is NOTICE and math.isfinite(self._now) else math.inf
        standing = self._standing.get(key)
        if standing is None:
            self._make_room()
            self._standing[key] = RigAlarm(kind, subject, detail, self._rig_now, shown_until=shown_until)
        elif again or standing.detail != detail:
            standing.count += int(again)
            standing.detail, standing.shown_until = detail, shown_until
        else:
            return
        self._changed = True

    def clear(self, code: str, subject: str) -> None:
        """The cause of an alarm is gone; nothing where it does not stand."""
        alarm = self._standing.pop((code, subject), None)
        if alarm is not None:
            alarm.cleared_at = self._rig_now
            self.cleared.append(alarm)
            self._changed = True

    def hold(self, code: str, subject: str, detail: str) -> None:
        """Have an alarm stand while there is a ``detail``, and be cleared when there is none."""
        if detail:
            self.alert(code, subject, detail, again=False)
        elif (code, subject) in self._standing:
            self.clear(code, subject)

    def stands(self, code: str, subject: str) -> bool:
        """Whether an alarm stands."""
        return (code, subject) in self._standing

    def health_of(self, *, is_known: bool) -> Health:
        """The worst of what stands, or that nothing is known of the rig."""
        worst = max((Health(int(alarm.kind.level)) for alarm in self), default=Health.GOOD)
        return max(worst, Health.GOOD if is_known else Health.UNKNOWN)

    def drain_changed(self) -> bool:
        """Whether anything changed since the last call."""
        changed, self._changed = self._changed, False
        return changed

    def _make_room(self) -> None:
        if len(self._standing) >= STANDING:
            mildest = min(self._standing.values(), key=lambda alarm: alarm.kind.level)
            del self._standing[mildest.kind.code, mildest.subject]
            self.dropped += 1
