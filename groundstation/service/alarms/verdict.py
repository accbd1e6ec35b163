"""Is the hole on its way, and if not: how far off, in which direction, and until where can it be corrected? No I/O.

One of five words, a function of what is known and of nothing else. ``DON'T KNOW`` comes before all others wherever one
of the things that the answer counts on is missing, so that old data never look good; what the surveys alone would
say is told beside it.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, replace

from groundstation.survey.wall.column_deviation import LEVELS, Deviation

LOWEST, STEER_AT, LIMIT = LEVELS  # of the tolerance
WINDS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")
SURELY = 2.0  # standard deviations
FINEST_CM = 0.1  # cm, of a line for a screen


class Word(enum.StrEnum):
    """What a crew needs to know first; the later the worse."""

    ON_TARGET = "on_target"
    WATCH = "watch"
    STEER = "steer"
    OUT = "out"
    DONT_KNOW = "dont_know"


class VerdictDoubt(enum.StrEnum):
    """Reason of the verdict "don't know"."""

    NO_SURVEY = "no_survey"
    STALE = "stale"
    DEPTH = "depth"
    CLOCK = "clock"
    YAW = "yaw"
    UNCERTAIN = "uncertain"
    SETUP = "setup"
    CONTRADICTION = "contradiction"


@dataclass(frozen=True, slots=True)
class Known:
    """What a verdict is made of; m and rad.

    ``curvature`` (rad/m) is the most by which the rig can bend the hole back.
    """

    target: float  # length of the design axis
    curvature: float
    bit: float | None = None
    worst: Deviation | None = None  # of the stations surveyed, the one that uses most of its tolerance
    projection: Deviation | None = None  # at the target, if the hole goes on straight
    doubts: tuple[tuple[VerdictDoubt, str], ...] = ()


@dataclass(frozen=True, slots=True)
class HoleVerdict:
    """The answer, and what it rests on.

    ``by_surveys`` is what the surveys say, whatever is doubtful now. ``about`` is the deviation that decided, and
    ``act_before`` (m along the axis) the last depth from which a correction still helps; both may be absent.
    """

    word: Word
    by_surveys: Word
    why: tuple[str, ...]
    doubts: tuple[VerdictDoubt, ...] = ()
    what: str = ""  # deviation or projection
    about: Deviation | None = None
    act_before: float | None = None
    left: float | None = None  # m of drilling until then


def judge_hole(known: Known) -> HoleVerdict:
    """Verdict on what is known."""
    verdict = judge_surveys(known)
    doubts = list(known.doubts)
    if known.projection is None:
        doubts.insert(0, (VerdictDoubt.NO_SURVEY, "no station has been surveyed yet"))
    elif verdict.word is not Word.OUT and (spread := SURELY * known.projection.std) >= known.projection.limit:
        limit = f"{100.0 * known.projection.limit:.0f} cm"
        doubts.append((VerdictDoubt.UNCERTAIN, f"the end is known to ±{100.0 * spread:.0f} cm, the limit is {limit}"))
    if not doubts:
        return verdict
    return replace(
        verdict, word=Word.DONT_KNOW, why=tuple(text for _, text in doubts), doubts=tuple(doubt for doubt, _ in doubts)
    )


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
    before = act_before(end, known)
    left = None if known.bit is None else before - known.bit
    word, why = _word_of(worst, end, left)
    if word is Word.ON_TARGET or (word is Word.WATCH and end.ratio < LOWEST and worst.ratio >= LOWEST):
        what, about = ("deviation", worst) if word is Word.WATCH else ("projection", end)
        return HoleVerdict(word, word, (why,), (), what, about)
    return HoleVerdict(word, word, (why,), (), "projection", end, before, left)


def _word_of(worst: Deviation, end: Deviation, left: float | None) -> tuple[Word, str]:
    ends = f"ends {_size_text(end)} off, the limit is {100.0 * end.limit:.0f} cm ({100.0 * end.ratio:.0f} %)"
    if end.ratio >= LIMIT and left is not None and left <= 0.0:
        return Word.OUT, f"{ends}, and no correction can bring it back any more"
    if end.ratio >= STEER_AT:
        return Word.STEER, ends
    if end.ratio >= LOWEST:
        return Word.WATCH, ends
    if worst.ratio >= LOWEST:
        used = f"{100.0 * worst.ratio:.0f} % of the tolerance"
        return Word.WATCH, f"{_size_text(worst)} off at {worst.md:.1f} m, {used}; it ends within"
    if end.size + SURELY * end.std >= end.limit:
        return Word.WATCH, f"{ends}, and may be beyond it"
    return Word.ON_TARGET, ends


def act_before(end: Deviation, known: Known) -> float:
    """Length along the axis (m) at which a correction must have begun.

    A hole that is bent by ``k`` rad/m from a length z on is moved by k (L - z)^2 / 2 at the target L. The correction is
    to bring the end below the lowest level; where it is too late for that, at least within the limit.
    """
    wanted = [end.size - level * end.limit for level in (LOWEST, LIMIT)]
    lengths = [known.target - math.sqrt(2.0 * max(excess, 0.0) / known.curvature) for excess in wanted]
    return lengths[0] if known.bit is None or lengths[0] > known.bit else lengths[1]


def compass_point(azimuth: float) -> str:
    """Compass word of an azimuth (rad), one of sixteen."""
    return WINDS[round(azimuth / math.tau * len(WINDS)) % len(WINDS)]


def deviation_azimuth(deviation: Deviation) -> float:
    """Azimuth (rad, in [0, 2 pi)) towards which the hole is off."""
    return math.atan2(deviation.offset[1], deviation.offset[0]) % math.tau


def _size_text(deviation: Deviation) -> str:
    return f"{100.0 * deviation.size:.1f} ± {100.0 * deviation.std:.1f} cm"
