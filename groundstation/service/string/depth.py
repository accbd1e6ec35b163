"""Where the bit was: a numbered stream of readings, bounded by rig time, by the string and by how fast a bit moves.

A depth is known where readings bracket its time within ``gap``, or where the bit is known to have stood. What the
stream may not say is refused, with the reason. The readings after a jump stay refused until they agree again with those
before it, or until the crew has looked; so do the stands that the stream repeats of that time. Of two stands that
contradict each other neither is believed.
"""

from __future__ import annotations

import math
from array import array
from bisect import bisect_left, bisect_right, insort
from collections import Counter, deque
from dataclasses import dataclass, field

from telemetry.frozen import replace
from telemetry.messages import EPOCH_UNKNOWN, DepthReading, Stand

LIMIT = 100_000  # readings kept of an epoch, those at rest in a stand count as two
STANDS_KEPT = 10_000
EPOCHS_KEPT = 8
DOUBTS_KEPT = 100
CONTRADICTION, DOUBTFUL = "a stand contradicts another", "a stand of a doubtful time"
AHEAD, LATE = 2.0, 30.0  # s against rig time
SLACK = 0.02  # m, of two readings
RETURNED = 0.1  # m from the last reading before a jump, within which the depth is believed again


@dataclass(slots=True)
class Track:
    """Readings of one epoch in the order of time; ``run[k]`` says that all between k - 1 and k were equal and close.

    They are numbers side by side: as objects each would take four times the room, and two come in a second of drilling.
    """

    gap: float
    at: array[float] = field(default_factory=lambda: array("d"))
    md: array[float] = field(default_factory=lambda: array("d"))
    run: array[int] = field(default_factory=lambda: array("b"))

    def append_reading(self, at: float, md: float) -> bool:
        """Add a reading, later than all; True when the bit has come to rest at a new depth."""
        rested = len(self.md) >= 2 and md == self.md[-1] == self.md[-2]
        if rested and at - self.at[-1] <= self.gap and (self.run[-1] or self.at[-1] - self.at[-2] <= self.gap):
            self.at[-1], self.run[-1] = at, True
            return False
        came_to_stand = len(self.md) >= 2 and md == self.md[-1] != self.md[-2]
        self.at.append(at)
        self.md.append(md)
        self.run.append(False)
        if len(self.at) > LIMIT:
            del self.at[: LIMIT // 2], self.md[: LIMIT // 2], self.run[: LIMIT // 2]
        return came_to_stand

    def depth_at(self, time: float) -> float | None:
        """Depth (m) between two readings that bracket ``time`` (s); None where none do."""
        k = bisect_right(self.at, time)
        if k == len(self.at):
            return self.md[-1] if k and self.at[-1] == time else None
        if k == 0 or not (self.run[k] or self.at[k] - self.at[k - 1] <= self.gap):
            return None
        if self.md[k] == self.md[k - 1]:
            return self.md[k]
        share = (time - self.at[k - 1]) / (self.at[k] - self.at[k - 1])
        return self.md[k - 1] + share * (self.md[k] - self.md[k - 1])


Instant = tuple[int, float]  # epoch, and s of rig time in it
NEVER: Instant = (-1, 0.0)


@dataclass(frozen=True, slots=True)
class DepthDoubt:
    """What a later start has to know: what it may not believe, and what the crew has looked at."""

    trusted: tuple[int, float, float] | None = None  # epoch, time and depth (m) of the last reading before a jump
    accepted: Instant = NEVER  # at which the crew accepted the depth
    times: tuple[Stand, ...] = ()  # of which no stand is believed; the last has no end while a jump lasts


class DepthLog:
    """Depth of the bit over rig time.

    Parameters
    ----------
    rate : m/s, the fastest that a bit is moved
    gap : s, between two readings that bracket a time

    Attributes
    ----------
    refusals : readings refused, by reason
    lost : numbers of the stream that never came
    jumped : why readings are refused since a jump, or empty
    """

    def __init__(self, rate: float, gap: float) -> None:
        self.refusals: Counter[str] = Counter()
        self.lost = 0
        self.jumped = ""
        self.stands: list[Stand] = []  # in the order of epoch and begin
        self._rate, self._gap = rate, gap
        self._tracks: dict[int, Track] = {}
        self._sequence: int | None = None
        self._raw: tuple[int, float, float] | None = None  # epoch, time and depth of the last reading that came
        self._raw_made_at = math.nan  # s, own clock; NaN where it came before the ground station's start
        self._trusted: tuple[int, float, float] | None = None  # of the last one that was taken
        self._accepted = NEVER  # when the crew accepted the depth
        self._doubtful: deque[Stand] = deque(maxlen=DOUBTS_KEPT)  # times of which no stand is believed

    @property
    def latest(self) -> float | None:
        """Newest depth, m."""
        return None if self._trusted is None else self._trusted[2]

    def on_reading(self, reading: DepthReading, epoch: int, rig_now: float, now: float, deepest: float) -> str:
        """Take a reading at ``rig_now`` (s) of ``epoch`` and ``now`` (s, own clock); returns why not, or nothing.

        ``deepest`` (m) is what the string reaches.
        """
        reason = self._refusal(reading, epoch, rig_now, now, deepest)
        if reason:
            self.refusals[reason] += 1
            return reason
        if self._doubtful and self._doubtful[-1].ended_at == math.inf:  # it had no end at the last start
            self._doubtful[-1] = replace(self._doubtful[-1], ended_at=reading.at)
        self._trusted = (epoch, reading.at, reading.md)
        self._track(epoch).append_reading(reading.at, reading.md)
        return ""

    def add_stand(self, told: Stand) -> Stand | None:
        """Remember that the bit stood, or that it still does; the stand as it is known now, None where not believed.

        One that began in a doubtful time and lasts until the newest reading is believed from the end of that time on.
        """
        stand = self._after_doubtful_times(told)
        if stand is None:
            self.refusals[DOUBTFUL] += 1
            return None
        for place in range(len(self.stands) - 1, -1, -1):
            known = self.stands[place]
            if known.md == stand.md and _is_same_stand(known, stand):
                begun_at, ended_at = min(known.begun_at, stand.begun_at), max(known.ended_at, stand.ended_at)
                self.stands[place] = Stand(stand.epoch, begun_at, ended_at, stand.md)
                return self.stands[place]
        since = self._trusted[:2] if self.jumped and self._trusted is not None else (math.inf, 0.0)
        if (stand.epoch, stand.ended_at) > since:
            self.refusals[DOUBTFUL] += 1
            return None
        against = [known for known in self.stands if known.epoch == stand.epoch and not self._agree(known, stand)]
        if against:
            self.refusals[CONTRADICTION] += 1
            for doubtful in (*against, stand):
                self._doubt(doubtful)
            self._suspect(max(against, key=lambda known: known.begun_at), stand)
            return None
        insort(self.stands, stand, key=_stand_begin)
        del self.stands[:-STANDS_KEPT]
        return stand

    def stand_before(self, stand: Stand) -> Stand | None:
        """The last known stand that began before another."""
        place = bisect_left(self.stands, (stand.epoch, stand.begun_at), key=_stand_begin)
        return self.stands[place - 1] if place else None

    def is_of_before(self, stand: Stand, epoch: int) -> bool:
        """Whether a stand without an epoch is known from one before ``epoch``: the encoder's clock may run on."""
        if stand.epoch != EPOCH_UNKNOWN:
            return False
        before = (known for known in self.stands if known.epoch != epoch and stand.ended_at <= known.ended_at)
        return any(_is_same_stand(replace(stand, epoch=known.epoch), known) for known in before)

    @property
    def doubt(self) -> DepthDoubt:
        """What is to be kept beside the stands."""
        times = tuple(self._doubtful)
        if self.jumped and times:
            times = (*times[:-1], replace(times[-1], ended_at=math.inf))
        return DepthDoubt(self._trusted if self.jumped else None, self._accepted, times)

    def recall(self, doubt: DepthDoubt) -> None:
        """Go on with what was kept, before any stand is believed."""
        self._accepted = doubt.accepted
        self._doubtful.extend(doubt.times)
        if doubt.trusted is not None:
            self.jumped = f"from {doubt.trusted[2]:.2f} m, before the ground station's start"
            self._raw = self._trusted = doubt.trusted

    def restore(self, stands: list[Stand]) -> None:
        """Go on with the stands that were kept."""
        for stand in stands:
            self.add_stand(stand)
        if stands and not self.jumped:
            newest = stands[-1]
            self._raw = self._trusted = (newest.epoch, newest.ended_at, newest.md)

    def at(self, epoch: int, time: float) -> float | None:
        """Depth (m) at rig time ``time`` (s); None where nothing brackets it."""
        track = self._tracks.get(epoch)
        found = None if track is None else track.depth_at(time)
        if found is not None:
            return found
        k = bisect_right(self.stands, (epoch, time), key=_stand_begin) - 1
        stand = self.stands[k] if k >= 0 else None
        return stand.md if stand is not None and stand.epoch == epoch and time <= stand.ended_at else None

    def accepted_at(self, epoch: int) -> float:
        """Rig time (s) of an epoch up to which the crew has looked at the depth; minus infinity where it has not."""
        own, time = self._accepted
        return time if own == epoch else -math.inf

    def accept(self) -> None:
        """Believe the next reading, whatever came before."""
        if self._raw is not None:
            self._accepted = self._raw[:2]
        self.jumped, self._raw = "", None

    def _after_doubtful_times(self, stand: Stand) -> Stand | None:
        """What of a stand is not of a doubtful time; one in which the crew has looked is not, whatever came before."""
        looked = (stand.epoch, stand.begun_at) <= self._accepted < (stand.epoch, stand.ended_at)
        doubtful = (d for d in self._doubtful if not (looked and (d.epoch, d.ended_at) <= self._accepted))
        begun_at = max((time.ended_at for time in doubtful if _stands_overlap(time, stand)), default=stand.begun_at)
        if begun_at == stand.begun_at:
            return stand
        goes_on = self._trusted == (stand.epoch, stand.ended_at, stand.md)
        return replace(stand, begun_at=begun_at) if goes_on and begun_at < stand.ended_at else None

    def _suspect(self, one: Stand, other: Stand) -> None:
        """Take a contradiction for an unheard jump: what came since may be as wrong as the later stand."""
        first, second = sorted((one, other), key=lambda stand: stand.begun_at)
        if not self.jumped:
            self.jumped = f"from {first.md:.2f} m to {second.md:.2f} m between two stands"
            self._trusted = (first.epoch, first.ended_at, first.md)

    def _doubt(self, time: Stand) -> None:
        """Believe no stand of a time, also where one was believed before."""
        self._doubtful.append(time)
        self.stands = [known for known in self.stands if not _stands_overlap(time, known)]

    def _agree(self, one: Stand, other: Stand) -> bool:
        """Whether the bit can have moved from one stand to the other in the time between them."""
        first, second = sorted((one, other), key=lambda stand: stand.begun_at)
        if second.begun_at < first.ended_at:
            return False
        if (first.epoch, first.ended_at) <= self._accepted <= (second.epoch, second.ended_at):
            return True  # the crew has looked since the first ended
        return abs(second.md - first.md) <= self._rate * (second.begun_at - first.ended_at) + SLACK

    def _refusal(self, reading: DepthReading, epoch: int, rig_now: float, now: float, deepest: float) -> str:
        if reading.epoch not in (EPOCH_UNKNOWN, epoch):
            return "of another epoch of rig time"
        if reading.at > rig_now + AHEAD:
            return "ahead of rig time"
        if reading.at < rig_now - LATE:
            return "behind rig time"
        raw = self._raw
        same_epoch = raw is not None and raw[0] == epoch
        if raw is not None and same_epoch and reading.at <= raw[1]:
            return "repeated"
        self._count(reading.sequence)
        if reading.md > deepest:
            return "deeper than the string reaches"
        made_at, before = now - (rig_now - reading.at), self._raw_made_at
        self._raw, self._raw_made_at = (epoch, reading.at, reading.md), made_at
        if raw is not None and same_epoch:
            self._judge_jump(reading, raw)
        elif raw is not None and not self.jumped:
            self._judge_jump_between_epochs(reading, epoch, raw, made_at - before)
        return "after a jump" if self.jumped else ""

    def _is_too_fast(self, reading: DepthReading, md: float, seconds: float) -> bool:
        """Whether no bit moves so far in the ``seconds`` since it was at ``md`` (m); NaN seconds say nothing."""
        if not abs(reading.md - md) > self._rate * seconds + SLACK:
            return False
        self.jumped = f"from {md:.2f} m to {reading.md:.2f} m in {seconds:.1f} s"
        return True

    def _judge_jump_between_epochs(
        self, reading: DepthReading, epoch: int, raw: tuple[int, float, float], seconds: float
    ) -> None:
        """Rig time began anew between two readings: the own clock says how many ``seconds`` lie between them."""
        if self._is_too_fast(reading, raw[2], max(seconds, 0.0)):
            self._doubt(Stand(raw[0], raw[1], math.inf, raw[2]))
            self._doubt(Stand(epoch, -math.inf, reading.at, raw[2]))

    def _judge_jump(self, reading: DepthReading, raw: tuple[int, float, float]) -> None:
        if not self.jumped:
            if self._is_too_fast(reading, raw[2], reading.at - raw[1]):
                self._doubt(Stand(raw[0], raw[1], reading.at, raw[2]))
        elif self._trusted is not None and abs(reading.md - self._trusted[2]) <= RETURNED:
            self.jumped = ""
            self._trust_stand(self._trusted)
        elif self._doubtful and self._doubtful[-1].epoch == raw[0]:
            self._doubtful[-1] = replace(self._doubtful[-1], ended_at=reading.at)
        else:
            self._doubt(Stand(raw[0], raw[1], reading.at, raw[2]))

    def _trust_stand(self, end: tuple[int, float, float]) -> None:
        """Doubt no more a stand that ended at the trusted reading: the one that contradicts it was the jump."""
        believed = (time for time in self._doubtful if (time.epoch, time.ended_at, time.md) != end)
        self._doubtful = deque(believed, maxlen=DOUBTS_KEPT)

    def _count(self, sequence: int) -> None:
        if self._sequence is not None and sequence > self._sequence + 1:
            self.lost += sequence - self._sequence - 1
        self._sequence = sequence

    def _track(self, epoch: int) -> Track:
        if epoch not in self._tracks:
            self._tracks[epoch] = Track(self._gap)
            while len(self._tracks) > EPOCHS_KEPT:
                del self._tracks[next(iter(self._tracks))]
        return self._tracks[epoch]


def _stand_begin(stand: Stand) -> Instant:
    return stand.epoch, stand.begun_at


def _is_same_stand(one: Stand, other: Stand) -> bool:
    return (one.epoch, one.md) == (other.epoch, other.md) and _stands_touch(one, other)


def _stands_overlap(one: Stand, other: Stand) -> bool:
    """Whether two times have more than an instant in common."""
    return one.epoch == other.epoch and one.begun_at < other.ended_at and other.begun_at < one.ended_at


def _stands_touch(one: Stand, other: Stand) -> bool:
    return one.begun_at <= other.ended_at and other.begun_at <= one.ended_at
