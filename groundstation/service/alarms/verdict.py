"""Is the hole on its way, and if not: how far off, in which direction, and until where can it be corrected? No I/O.

One of five words, a function of what is known and of nothing else. The four that are about the hole are chances:

ON TARGET   it ends within its limit with 95 % or more
WATCH       with less, but the depth by which a correction must begin lies behind the next survey; or at its depth
            it ends within, unless the one look at its last station is wrong
STEER       with less than 50 % and steering helps, or that depth comes before the next survey, or has been passed
OUT         a station is beyond its limit, or even with a correction from now on it ends within with less than 50 %

``DON'T KNOW`` comes before all others wherever one of the things that the answer counts on is missing, so that old data
never look good; what the surveys alone would say is told beside it.

A correction is taken to bend the hole towards its axis by the rig's stated curvature k, beside what the hole does by
itself, from a length z on: so it moves the end by up to k (L - z)^2 / 2 at the target L, and holds what it has reached.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from groundstation.service.alarms.spread_text import spread_text
from groundstation.service.alarms.verdict_words import WINDS, VerdictDoubt, Word
from groundstation.survey.wall.column_deviation import LEVELS, Deviation
from groundstation.survey.wall.projected_end import REACHED, ProjectedEnd

LOWEST, _, LIMIT = LEVELS  # of the tolerance, of what was drilled
SURE = 0.95  # chance of ending within, from which on it is on target; a correction is to bring it there
EVEN = 0.5  # chance below which it is more likely out than in
SURELY = 2.0  # standard deviations
WORTH_TELLING = 0.1  # of the limit
LOOK_ALONE = (  # cm
    "one tube alone has read the last station: were it wrong there, the toe would be up to {:.1f} cm off; "
    "the next survey shows it, or one with the string lifted by a tube"
)
BELT_SLIPS = (  # cm
    "a belt of the encoder that slips a little at every stop, too little to be found, would have the toe up to "
    "{:.1f} cm off: hold the encoder against the mark on the drive head"
)


@dataclass(frozen=True, slots=True)
class Known:
    """What a verdict is made of; m and rad.

    ``curvature`` (rad/m) is the most by which the rig can bend the hole back, ``stop`` the way to the next survey.
    """

    target: float  # length of the design axis
    curvature: float
    stop: float
    bit: float | None = None
    worst: Deviation | None = None  # of the stations surveyed, the one that uses most of its tolerance
    projection: ProjectedEnd | None = None  # at the target, if the hole goes on as it tends to
    doubts: tuple[tuple[VerdictDoubt, str], ...] = ()
    unfound: float = 0.0  # m by which the toe may be off if the tube errs that read the last station alone
    drift: float = 0.0  # likewise if the encoder slips a little at every stop, too little to be found

    @property
    def is_at_end(self) -> bool:
        """Whether nothing is left to drill: by the bit, or by the deepest survey."""
        by_bit = self.bit is not None and self.bit >= self.target - REACHED
        return by_bit or (self.projection is not None and self.projection.is_reached)


@dataclass(frozen=True, slots=True)
class Deadline:
    """The last depth from which a correction still makes it `SURE` that the hole ends within, and what if it is late.

    It stays what it is when it has been passed: ``left`` is negative then, and ``best`` the chance that a correction
    from now on still gives.
    """

    before: float  # m along the axis
    left: float | None  # m of drilling until then; None where the depth of the bit is not known
    best: float

    @property
    def is_missed(self) -> bool:
        """Whether the bit is beyond it."""
        return self.left is not None and self.left < 0.0


@dataclass(frozen=True, slots=True)
class HoleVerdict:
    """The answer, and what it rests on.

    ``by_surveys`` is what the surveys say, whatever is doubtful now. ``about`` is the deviation that decided and
    ``end`` the projection, where it is about that; ``deadline`` is absent where nothing is to be steered, and
    ``is_at_end`` is whether nothing can be.
    """

    word: Word
    by_surveys: Word
    why: tuple[str, ...]
    doubts: tuple[VerdictDoubt, ...] = ()
    what: str = ""  # deviation or projection
    about: Deviation | None = None
    end: ProjectedEnd | None = None
    deadline: Deadline | None = None
    is_at_end: bool = False


def judge_hole(known: Known) -> HoleVerdict:
    """Verdict on what is known."""
    verdict = judge_surveys(known)
    doubts = list(known.doubts)
    if known.projection is None:
        doubts.insert(0, (VerdictDoubt.NO_SURVEY, "no station has been surveyed yet"))
    elif not _is_out_surely(verdict) and (spread := SURELY * known.projection.surveyed_std) >= known.projection.limit:
        limit = f"{100.0 * known.projection.limit:.0f} cm"
        why = f"the surveys leave the end open by ±{100.0 * spread:.0f} cm, the limit is {limit}"
        doubts.append((VerdictDoubt.UNCERTAIN, why))
    if not doubts:
        return verdict
    return replace(
        verdict, word=Word.DONT_KNOW, why=tuple(text for _, text in doubts), doubts=tuple(doubt for doubt, _ in doubts)
    )


def _is_out_surely(verdict: HoleVerdict) -> bool:
    """Whether the hole has left its tolerance, or ends outside however far its end is open by the surveys."""
    if verdict.word is not Word.OUT or verdict.end is None:
        return verdict.word is Word.OUT
    end = verdict.end
    return math.hypot(*end.ends.offset) - SURELY * end.surveyed_std > end.limit


def judge_surveys(known: Known) -> HoleVerdict:
    """What the surveys say, taken for good and for fresh."""
    worst, end = known.worst, known.projection
    if worst is None or end is None:
        return HoleVerdict(Word.DONT_KNOW, Word.DONT_KNOW, ())
    if worst.ratio >= LIMIT:
        why = (
            f"the hole is {_size_text(worst)} off at {worst.md:.1f} m, the limit there is {100.0 * worst.limit:.0f} cm"
        )
        return HoleVerdict(Word.OUT, Word.OUT, (why,), (), "deviation", worst)
    if end.within >= SURE and worst.ratio >= LOWEST:
        used = f"{100.0 * worst.ratio:.0f} % of the tolerance"
        why = f"{_size_text(worst)} off at {worst.md:.1f} m, {used}; {_within_text(end)}"
        return HoleVerdict(Word.WATCH, Word.WATCH, (why,), (), "deviation", worst, is_at_end=known.is_at_end)
    deadline = None if known.is_at_end or end.within >= SURE else correction_deadline(end, known)
    word, why = _word_of(end, deadline, known.stop)
    reasons = (why, *_say_unfound(end, known))
    beside = max(known.unfound, known.drift)  # two mistakes at once that nothing shows are not reckoned with
    if word is Word.ON_TARGET and known.is_at_end and math.hypot(*end.ends.offset) + beside > end.limit:
        word = Word.WATCH
    return HoleVerdict(word, word, reasons, (), "projection", end.ends, end, deadline, known.is_at_end)


def _say_unfound(end: ProjectedEnd, known: Known) -> tuple[str, ...]:
    """What mistakes that no reading shows may do at the toe, each where that is a good part of the limit."""
    told = ((known.unfound, LOOK_ALONE), (known.drift, BELT_SLIPS))
    return tuple(words.format(100.0 * size) for size, words in told if size >= WORTH_TELLING * end.limit)


def _word_of(end: ProjectedEnd, deadline: Deadline | None, stop: float) -> tuple[Word, str]:
    """Word about the end, and why."""
    within = _within_text(end)
    if end.within >= SURE:
        return Word.ON_TARGET, within
    if deadline is None:
        return Word.WATCH if end.within >= EVEN else Word.OUT, f"it is at its depth; {within}"
    if deadline.is_missed:
        missed = missed_text(SURE, deadline.before)
        word = Word.STEER if deadline.best >= EVEN else Word.OUT
        return word, f"{within}; {missed}, now {chance_text(deadline.best)} at best"
    if end.within < EVEN <= end.centred:
        return Word.STEER, f"{within}, more likely out than in"
    if deadline.left is not None and deadline.left < stop:
        return Word.STEER, f"{within}, and the next survey comes too late for a correction"
    return Word.WATCH, within if end.centred >= EVEN else f"{within}, too early to say where it ends"


def correction_deadline(end: ProjectedEnd, known: Known) -> Deadline:
    """Where a correction must begin, that the hole ends within its limit by the chance `SURE`.

    Bent by ``k`` rad/m from a length z on, its end moves by k (L - z)^2 / 2 at the target L. So it is in time where
    that and the limit together hold the end that is foreseen without it.
    """
    excess = max(end.distance_of(SURE) - end.limit, 0.0)
    before = known.target - math.sqrt(2.0 * excess / known.curvature)
    if known.bit is None:
        return Deadline(before, None, end.chance_within(end.limit))
    moved = 0.5 * known.curvature * max(known.target - known.bit, 0.0) ** 2
    return Deadline(before, before - known.bit, end.chance_within(end.limit + moved))


def missed_text(sure: float, before: float) -> str:
    """That a depth (m) for a chance has been passed; or that none was deep enough to begin at."""
    return f"{100.0 * sure:.0f} % " + (f"was to be had until {before:.1f} m" if before > 0.0 else "was never to be had")


def chance_text(chance: float) -> str:
    """A chance in per cent, for people: never 0 or 100 where it is neither."""
    if 0.0 < chance < 0.01:
        return "< 1 %"
    return "> 99 %" if 0.99 < chance < 1.0 else f"{100.0 * chance:.0f} %"


def compass_point(azimuth: float) -> str:
    """Compass word of an azimuth (rad), one of sixteen."""
    return WINDS[round(azimuth / math.tau * len(WINDS)) % len(WINDS)]


def deviation_azimuth(deviation: Deviation) -> float:
    """Azimuth (rad, in [0, 2 pi)) towards which the hole is off."""
    return math.atan2(deviation.offset[1], deviation.offset[0]) % math.tau


def _within_text(end: ProjectedEnd) -> str:
    return f"within {100.0 * end.limit:.0f} cm: {chance_text(end.within)}"


def _size_text(deviation: Deviation) -> str:
    return spread_text(deviation.size, deviation.half_width)
