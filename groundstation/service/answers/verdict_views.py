"""View of the verdict: every number with as many digits as its uncertainty is worth."""

from __future__ import annotations

import math

from groundstation.service.alarms.verdict import (
    FINEST_CM,
    HoleVerdict,
    Word,
    compass_point,
    deviation_azimuth,
    judge_hole,
)
from groundstation.service.alarms.verdict_doubts import known_of
from groundstation.service.answers.answer_views import view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.rounding import round_to_std, rounded_std
from groundstation.service.answers.shapes.column_shapes import Off, Steer, Verdict
from groundstation.service.answers.streamed_rows import Parameters
from groundstation.survey.wall.column_deviation import Deviation

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
    way = None if found.about is None or found.act_before is None else steering_view(found.about, found)
    return Verdict(
        rig=rig,
        good_for_s=good_for,
        verdict=found.word.value,
        by_surveys=found.by_surveys.value,
        line=verdict_line(found),
        todo=todo_line(found.word, way),
        why=list(found.why),
        doubts=[doubt.value for doubt in found.doubts],
        bit_md_m=known.bit,
        target_m=known.target,
        what=found.what or None,
        off=None if found.about is None else off_target_view(found.about),
        steer=way,
    )


def off_target_view(d: Deviation) -> Off:
    """How far off, where, and in which direction."""
    return Off(
        md_m=round(d.md, 2),
        deviation_cm=round_to_std(CM * d.size, CM * d.std),
        sigma_cm=rounded_std(CM * d.std),
        limit_cm=round(CM * d.limit, 1),
        used_percent=round(100.0 * d.ratio) if math.isfinite(d.ratio) else None,
        azimuth_deg=round(math.degrees(deviation_azimuth(d))) % 360,
        wind=compass_point(deviation_azimuth(d)),
    )


def steering_view(d: Deviation, found: HoleVerdict) -> Steer:
    """Where to, and until when."""
    back = deviation_azimuth(d) + math.pi
    return Steer(
        azimuth_deg=round(math.degrees(back)) % 360,
        wind=compass_point(back),
        before_md_m=None if found.act_before is None else round(found.act_before, 1),
        left_m=None if found.left is None else round(found.left, 1),
    )


def verdict_line(found: HoleVerdict) -> str:
    """The verdict as one line for a screen."""
    phrase, d = PHRASES[found.word], found.about
    if found.word is Word.DONT_KNOW:
        return f"{phrase}: {found.why[0]}"
    if d is None:
        return phrase
    spread = max(rounded_std(CM * d.std), FINEST_CM)
    size = round_to_std(CM * d.size, spread) if spread >= 1.0 else CM * d.size  # rounded once, as it is written
    is_end = found.what == "projection"
    where = "ends" if is_end else f"at {d.md:.1f} m"
    said = f"{phrase}: {where} {size:.1f} ± {spread:.1f} cm at {round(math.degrees(deviation_azimuth(d))) % 360} deg"
    said += f" {compass_point(deviation_azimuth(d))}; limit {CM * d.limit:.0f} ({100.0 * d.ratio:.0f} %)"
    if found.act_before is None or found.left is None or found.word is Word.OUT:
        return said
    return f"{said}; act " + (f"before {found.act_before:.1f} m" if found.left > 0.0 else "at once")


def todo_line(word: Word, way: Steer | None) -> str:
    """What to do, in a line for a screen."""
    match word:
        case Word.ON_TARGET:
            return "go on"
        case Word.WATCH | Word.STEER if way is not None:
            verb = "steer" if word is Word.STEER else "if it grows, steer"
            where = f"{verb} to {way.azimuth_deg:g} deg {way.wind}"
            if way.left_m is not None and way.left_m <= 0.0:
                return f"{where} at once"
            left = "" if way.left_m is None else f", {way.left_m:.1f} m are left"
            return f"{where} before {way.before_md_m:.1f} m{left}"
        case Word.WATCH | Word.STEER:
            return "go on, and look at the next survey"
        case Word.OUT:
            return "stop; the column is out of its tolerance, or will be whatever is done: ask the engineer"
        case Word.DONT_KNOW:
            return "do not drill on by this screen until the cause is mended"
