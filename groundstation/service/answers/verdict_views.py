"""View of the verdict: every number with as many digits as its uncertainty is worth."""

from __future__ import annotations

import math

import numpy as np

from groundstation.service.alarms.spread_text import spread_text
from groundstation.service.alarms.verdict import (
    SURE,
    Deadline,
    HoleVerdict,
    Known,
    chance_text,
    compass_point,
    deviation_azimuth,
    judge_hole,
    missed_text,
)
from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.alarms.verdict_words import Word
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import round_to_std, rounded_std
from groundstation.service.answers.shapes.column_shapes import Off, Steer, Verdict
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.survey.path.normal_mixture import NormalMixture
from groundstation.survey.wall.column_deviation import Deviation
from groundstation.survey.wall.projected_end import ProjectedEnd

CM = 100.0
PHRASES = {
    Word.ON_TARGET: "ON TARGET",
    Word.WATCH: "WATCH",
    Word.STEER: "STEER",
    Word.OUT: "OUT",
    Word.DONT_KNOW: "DON'T KNOW",
}


@view_of(Verdict)
def answer_verdict(k: RigModel, _p: Parameters) -> Verdict:
    """The verdict of this moment."""
    rig, good_for = k.config.rig, k.config.stale_after
    known = known_of(k.config, k.string, k.setup, k.hole, k.rig_alarms)
    found = judge_hole(known)
    way = None if found.about is None or found.deadline is None else steering_view(found.about, found.deadline, known)
    return Verdict(
        rig=rig,
        good_for_s=good_for,
        verdict=found.word.value,
        by_surveys=found.by_surveys.value,
        line=verdict_line(found),
        todo=todo_line(found, way),
        why=list(found.why),
        doubts=[doubt.value for doubt in found.doubts],
        bit_md_m=known.bit,
        target_m=known.target,
        what=found.what or None,
        unfound_cm=round(CM * known.unfound, 2),
        unfound_drift_cm=round(CM * known.drift, 2),
        off=None if found.about is None else off_target_view(found.about, found.end),
        steer=way,
    )


def off_target_view(d: Deviation, end: ProjectedEnd | None) -> Off:
    """How far off, where, and in which direction; ``end`` is given where it is about that."""
    half_width = d.half_width if end is None else end.half_width
    return Off(
        md_m=round(d.md, 2),
        deviation_cm=round_to_std(CM * d.size, CM * d.std),
        sigma_cm=rounded_std(CM * d.std),
        half_width_cm=rounded_std(CM * half_width),
        within_percent=round(100.0 * (chance_within(d) if end is None else end.within), 1),
        limit_cm=round(CM * d.limit, 1),
        used_percent=round(100.0 * d.ratio) if math.isfinite(d.ratio) else None,
        azimuth_deg=round(math.degrees(deviation_azimuth(d))) % 360,
        wind=compass_point(deviation_azimuth(d)),
    )


def chance_within(d: Deviation) -> float:
    """Chance that what was surveyed is within its limit."""
    return NormalMixture(np.ones(1), d.offset[None], d.cov[None]).chance_within(d.limit)


def steering_view(d: Deviation, deadline: Deadline, known: Known) -> Steer:
    """Where to, and until when."""
    back = deviation_azimuth(d) + math.pi
    return Steer(
        azimuth_deg=round(math.degrees(back)) % 360,
        wind=compass_point(back),
        before_md_m=round(deadline.before, 1),
        left_m=None if deadline.left is None else round(deadline.left, 1),
        missed=deadline.is_missed,
        sure_percent=100.0 * SURE,
        best_percent=round(100.0 * deadline.best, 1),
        bend_deg_per_m=round(math.degrees(known.curvature), 4),
    )


def verdict_line(found: HoleVerdict) -> str:
    """The verdict as one line for a screen."""
    phrase, d, end = PHRASES[found.word], found.about, found.end
    if found.word is Word.DONT_KNOW:
        return f"{phrase}: {found.why[0]}"
    if d is None:
        return phrase
    towards = f"at {round(math.degrees(deviation_azimuth(d))) % 360} deg {compass_point(deviation_azimuth(d))}"
    if end is None:
        size = spread_text(d.size, d.half_width)
        return f"{phrase}: at {d.md:.1f} m {size} (95 %) {towards}; limit {CM * d.limit:.0f} ({100.0 * d.ratio:.0f} %)"
    said = f"{phrase}: {'ended' if end.is_reached else 'ends'} {spread_text(d.size, end.half_width)} (95 %) {towards}"
    said += f"; within {CM * d.limit:.0f} cm: {chance_text(end.within)}"
    deadline = found.deadline
    if deadline is None or deadline.left is None or found.word is Word.OUT:
        return said
    return f"{said}; act " + ("at once" if deadline.is_missed else f"before {deadline.before:.1f} m")


def todo_line(found: HoleVerdict, way: Steer | None) -> str:
    """What to do, in a line for a screen."""
    match found.word:
        case Word.ON_TARGET | Word.WATCH | Word.OUT if found.is_at_end:
            return "the hole is at its depth: nothing is left to steer"
        case Word.ON_TARGET:
            return "go on"
        case Word.WATCH | Word.STEER if way is not None:
            return correction_line(found.word, way)
        case Word.WATCH | Word.STEER:
            return "go on, and look at the next survey"
        case Word.OUT:
            return "stop; the column is out of its tolerance, or will be whatever is done: ask the engineer"
        case Word.DONT_KNOW:
            return "do not drill on by this screen until the cause is mended"


def correction_line(word: Word, way: Steer) -> str:
    """Where to steer to, until when, and what it is worth once that has been missed."""
    verb = "steer" if word is Word.STEER else "go on; if it stays so, steer"
    where = f"{verb} to {way.azimuth_deg:g} deg {way.wind}"
    if way.missed:
        missed = missed_text(0.01 * way.sure_percent, way.before_md_m)
        return f"{where} at once: {missed}, now {chance_text(0.01 * way.best_percent)} at best"
    left = "" if way.left_m is None else f", {way.left_m:.1f} m are left"
    return f"{where} before {way.before_md_m:.1f} m{left}"
