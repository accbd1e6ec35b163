"""Who contradicts the encoder: a gyroscope alone may be wrong, several at one time say that the encoder is. No I/O.

A tube is a witness of a time if it ran through it: one that started then, or stood still, took the yaw that it was
given, and one whose gyroscope gave nothing took the rate of the encoder: none of them has anything to say. So a
contradiction counts against the encoder when all who could have seen it agree. Where every tube starts upon a yaw that
was saved over other joints than its own, or without any because the string turned when the power went, no tube has
watched the encoder meanwhile, and that is said too.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection

from telemetry.application.series import SERIES_SHIFT
from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, Event

AGAINST_THE_ENCODER = ("yaw_reset", "gyro_step", "gyro_scale", "encoder_stands")
STARTS = ("booted", "restored")
REJECTED = "aiding_rejected"  # the first of a row of aidings that contradict a yaw, up to its reset
SEEN_LATER = 10.0  # s from there to a gyroscope that is found to give nothing: it gave nothing then
OUTCOME_WITHIN = 4  # numbers after it, of which one says what came of it
CUT_SHORT = 60.0  # s from there to a start, after which it was an outlier
ELSEWHERE = "reference_changed"  # the yaw of a node came over other joints before
BLIND = ("bad_sample", "gyro_saturated", "gyro_stuck")  # the gyroscope gives nothing, until the sensor has recovered
CYCLE = 10.0 / 19.0  # s, of a node
SETTLED_AFTER = 10.0  # s after a start in which a tube may still find its yaw
TOGETHER = 30.0  # s
ENOUGH = 2  # tubes
STARTS_KEPT = 1000  # of all tubes
STARTS_OF_ONE = 100
EPOCHS_KEPT = 100
OFF_BEFORE = 30.0  # s before a start in which a tube may have been without power
SAID_KEPT = 50  # of a tube
TIMES_KEPT = 20  # of a tube and epoch
Times = dict[tuple[int, int], deque[tuple[float, float]]]  # s, rig time, by tube and epoch


class EncoderCrossCheck:
    """What the tubes' events say of the encoder."""

    def __init__(self) -> None:
        # newest contradiction by tube and start: a stranger with the number of a tube speaks for itself alone
        self._contradicted: dict[tuple[int, int], Event] = {}
        self._began: dict[tuple[int, int], Event] = {}  # its first rejected aiding, by tube and number
        self._starts: dict[int, deque[Event]] = {}  # newest of each tube
        self._off: Times = {}
        self._blind: Times = {}  # without a gyroscope
        self._rejected: dict[int, Event] = {}  # newest row of contradictions without an outcome, by tube
        self._elsewhere: dict[int, Event] = {}  # newest start upon a yaw of another place, by tube
        self._said: dict[int, deque[Event]] = {}  # newest events, by tube
        self._told: tuple[Event, ...] = ()
        self._told_blank: deque[Event] = deque(maxlen=STARTS_KEPT)  # starts without a yaw that were told of
        self._spans: dict[int, tuple[float, float]] = {}  # s, first and last event of each epoch

    def on_event(self, event: Event, heard: Collection[int]) -> str:
        """Handle an event while these tubes are heard; says who contradicts the encoder where that is new, or ''."""
        place = event.tube, event.epoch
        self._add_to_span(event)
        self._said.setdefault(event.tube, deque(maxlen=SAID_KEPT)).append(event)
        if event.code in STARTS:
            self._starts.setdefault(event.tube, deque(maxlen=STARTS_OF_ONE)).append(event)
            _add_time(self._off, place, event.at - OFF_BEFORE, event.at)
            self._count_what_was_cut_short(event)
        elif event.code == "overrun":
            _add_time(self._off, place, event.at, event.at + CYCLE * int(str(event.arguments.get("missed", 0))))
        elif event.code in BLIND:
            _add_time(self._blind, place, self._blind_since(event), math.inf)
            return ""  # what it tells next says whether that is over by now
        elif event.code == "sensor_recovered" and event.arguments.get("after") in BLIND:
            self._end_blind(place, event)
        elif event.code == REJECTED:
            self._rejected[event.tube] = event
        elif event.code in AGAINST_THE_ENCODER:
            rejected = self._rejected.pop(event.tube, event)
            self._count(self._dated(event, rejected), rejected)
        elif event.code == ELSEWHERE and self._was_restored(event) and not self._was_settled(event):
            self._elsewhere[event.tube] = event
            if unwatched := self._nobody_has_watched(event, heard):
                return unwatched
        return self._judge(heard)

    def on_lost(self, tube: int, lost: tuple[int, int], heard: Collection[int], *, doubts: bool) -> str:
        """Messages of a tube are lost, the first and last by number; says who contradicts the encoder where it is new.

        That its yaw was reset may be among them, if it had just begun to contradict, or ``doubts`` its yaw by now. What
        is not known is not excused.
        """
        rejected = self._rejected.get(tube)
        if rejected is not None and rejected.sequence < lost[0] <= rejected.sequence + OUTCOME_WITHIN:
            self._count(replace(rejected, code="yaw_reset"), self._rejected.pop(tube))
        elif doubts and (after := next((e for e in self._said.get(tube, ()) if e.sequence > lost[1]), None)):
            self._count(replace(after, code="yaw_reset"), after)
        else:
            return ""
        return self._judge(heard)

    def look(self, epoch: int, rig_now: float, lately: Collection[int]) -> str:
        """Says so where all who were heard lately started at one time without a yaw; at a rig time (s) of an epoch.

        Nothing links what the encoder counts now to what it counted before. A tube that ran all the while below one
        without power is heard again within the time in which that tube settles.
        """
        blank: list[Event] = []
        for tube in lately:
            start = max(self._starts.get(tube, ()), key=_in_time, default=None)
            if start is None or not _is_blank(start):
                return ""  # the usual case, found at the first tube
            blank.append(start)
        if all(start in self._told_blank for start in blank):
            return ""
        newest = max(blank, key=_in_time)
        if newest.epoch == epoch and rig_now < newest.at + SETTLED_AFTER:
            return ""
        if not all(self._is_beside(one, newest) for one in blank):
            return ""
        self._told_blank.extend(blank)
        return f"no tube watched it before {newest.at:.0f} s: none has kept its yaw"

    def _judge(self, heard: Collection[int]) -> str:
        known = self._contradicted.values()
        # one that has just started contradicts what it saved: the string may have turned while it was off
        settled = [one for one in known if self._was_settled(one)]
        restored = [one for one in known if self._was_restored(one)]
        found = next((one for one in known if self._speaks_against_the_encoder(one, settled, restored, heard)), None)
        if found is None or (told := self._together(found)) == self._told:
            return ""
        self._told = told
        return f"tubes {', '.join(str(tube) for tube in sorted({e.tube for e in told}))} at {found.at:.0f} s"

    def _count(self, event: Event, began: Event) -> None:
        """A tube contradicts the encoder, since an aiding that it rejected before; one of long ago was an outlier."""
        self._began[event.tube, event.sequence] = began if self._apart(began, event) <= CUT_SHORT else event
        while len(self._began) > STARTS_KEPT:
            del self._began[next(iter(self._began))]
        start = self._start_before(event)
        self._contradicted[event.tube, 0 if start is None else start.sequence] = event
        while len(self._contradicted) > STARTS_KEPT:
            del self._contradicted[next(iter(self._contradicted))]

    @staticmethod
    def _dated(event: Event, rejected: Event) -> Event:
        """A contradiction of a tube that does not know rig time any more is of when it began."""
        is_undated = event.epoch == EPOCH_UNKNOWN and rejected.sequence < event.sequence
        return replace(event, at=rejected.at, epoch=rejected.epoch) if is_undated else event

    def _count_what_was_cut_short(self, start: Event) -> None:
        """A tube that lost its power as it began to contradict will not go on: it takes the yaw that it is given."""
        rejected = self._rejected.get(start.tube)
        is_before = rejected is not None and _in_time(rejected) <= _in_time(start)
        if rejected is not None and is_before and self._apart(rejected, start) <= CUT_SHORT:
            self._count(rejected, self._rejected.pop(start.tube))

    def _speaks_against_the_encoder(
        self, event: Event, settled: Collection[Event], restored: Collection[Event], heard: Collection[int]
    ) -> bool:
        """Whether all who could have seen what an event says agree.

        Of all contradictions some are of tubes that had found their yaw, ``settled``, or had it saved, ``restored``.
        """
        beside = [e for e in settled if self._is_beside(e, event)]
        if len(beside) >= ENOUGH:
            return True
        may_all_agree = any(self._is_beside(e, event) for e in restored)
        if not beside and not may_all_agree:
            return False
        tubes = {e.tube for e in self._together(event)}
        if may_all_agree and all(tube in tubes or self._was_without_gyroscope(tube, event) for tube in heard):
            return True  # every yaw that was saved or known says another thing
        if not beside or beside[0].code != "yaw_reset":
            return False  # alone, a gyroscope is wrong sooner
        return not any(tube not in tubes and self._has_watched(tube, event) for tube in heard)

    def _nobody_has_watched(self, event: Event, heard: Collection[int]) -> str:
        """Says so where all who are heard have just started upon a yaw of another place."""
        found = [self._elsewhere.get(tube) for tube in heard]
        if not all(one is not None and self._is_beside(one, event) for one in found):
            return ""
        return f"no tube watched it before {event.at:.0f} s: what they had saved is of other places"

    def _together(self, event: Event) -> tuple[Event, ...]:
        return tuple(e for e in self._contradicted.values() if self._is_beside(e, event))

    def _is_beside(self, one: Event, other: Event) -> bool:
        """Whether two events, whichever was earlier, are of one time."""
        if one.epoch == other.epoch:
            return abs(one.at - other.at) <= TOGETHER
        return self._apart(*sorted([one, other], key=_in_time)) <= TOGETHER

    def _apart(self, earlier: Event, later: Event) -> float:
        """Seconds between two events; where rig time began anew in between, those that are known to have gone by.

        An encoder that slipped and then started again is contradicted by some before its start and by others after.
        """
        if earlier.epoch == later.epoch:
            return later.at - earlier.at
        between = any(earlier.epoch < known < later.epoch for known in self._spans)
        if between or EPOCH_UNKNOWN in (earlier.epoch, later.epoch):
            return math.inf
        (_, last), (first, _) = (self._spans.get(one.epoch, (-math.inf, math.inf)) for one in (earlier, later))
        return last - earlier.at + later.at - first

    def _add_to_span(self, event: Event) -> None:
        first, last = self._spans.get(event.epoch, (math.inf, -math.inf))
        self._spans[event.epoch] = min(first, event.at), max(last, event.at)
        while len(self._spans) > EPOCHS_KEPT:
            del self._spans[min(self._spans)]

    def _was_settled(self, event: Event) -> bool:
        """Whether a tube had found its yaw before, since its start."""
        if event.epoch == EPOCH_UNKNOWN:
            return False
        start = self._start_before(event)
        return start is None or self._apart(start, event) >= SETTLED_AFTER

    def _was_restored(self, event: Event) -> bool:
        """Whether a tube had gone on from what it had saved."""
        start = self._start_before(event)
        return start is not None and start.code == "restored"

    def _start_before(self, event: Event) -> Event | None:
        """The start that an event followed, by its number: two tubes may have the same name, and epochs may change."""
        known = (start for start in self._starts.get(event.tube, ()) if start.epoch <= event.epoch)
        before = [start for start in known if start.sequence <= event.sequence]
        return max(before, key=lambda start: (start.sequence, *_in_time(start)), default=None)

    def _blind_since(self, event: Event) -> float:
        """Rig time (s) from which on a tube had no gyroscope: from where it began to contradict, if it just did.

        That one repeats itself is seen after some cycles; whether it or the encoder was wrong in them, is unknown.
        """
        rejected = self._rejected.pop(event.tube, event)
        is_of_this = rejected.epoch == event.epoch and 0.0 <= event.at - rejected.at <= SEEN_LATER
        return rejected.at - CYCLE if is_of_this else event.at

    def _end_blind(self, place: tuple[int, int], event: Event) -> None:
        """The gyroscope gives something again: the newest time without one that had begun has an end.

        Where its begin is not known, with a database that was lost, the event says how long it was.
        """
        times = self._blind.get(place, deque())
        for number in reversed(range(len(times))):
            if times[number][0] <= event.at and times[number][1] == math.inf:
                times[number] = times[number][0], event.at
                return
        cycles = event.arguments.get("cycles", 0)
        if isinstance(cycles, (int, float)) and cycles > 0:
            _add_time(self._blind, place, event.at - CYCLE * cycles, event.at)

    def _has_watched(self, tube: int, event: Event) -> bool:
        """Whether a tube ran, had settled and had a gyroscope all the while that another contradicted.

        It could have seen the same. What contradicts happened before the first aiding that was rejected for it: one
        that began to listen since has nothing to say.
        """
        began = self._began.get((event.tube, event.sequence), event)
        return not any(_is_in(self._off, tube, at) or self._was_without_gyroscope(tube, at) for at in (began, event))

    def _was_without_gyroscope(self, tube: int, event: Event) -> bool:
        return _is_in(self._blind, tube, event)


def _add_time(times: Times, place: tuple[int, int], since: float, until: float) -> None:
    times.setdefault(place, deque(maxlen=TIMES_KEPT)).append((since, until))
    while len(times) > STARTS_KEPT:
        del times[next(iter(times))]


def _is_in(times: Times, tube: int, event: Event) -> bool:
    """Whether an event happened within a time of a tube, or before it had settled after that."""
    own = times.get((tube, event.epoch), ())
    return any(since <= event.at <= until + SETTLED_AFTER for since, until in own)


def _is_blank(start: Event) -> bool:
    """Whether a tube that ran before starts without a yaw: it turned meanwhile, or has lost its memory."""
    if start.code == "restored":
        return start.arguments.get("worth_h") == 0.0
    return start.sequence >> SERIES_SHIFT > 0


def _in_time(event: Event) -> tuple[int, float]:
    """What events are ordered by: rig time of a later epoch is later."""
    return event.epoch, event.at
