"""Answers about the column that is drilled: its deviation from the design, its history, the verdict."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.alarms.verdict_words import WINDS, VerdictDoubt, Word
from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.hole_shapes import MeasuredDepth

FromAxis = Annotated[float, "from the design axis"]
Wind = Annotated[str, "the same as a word", OneOf(*WINDS)]
SOME_WORD = OneOf(*(word.value for word in Word))


@answer_class
class DesignAxis:
    """Design of the column."""

    inclination_deg: Annotated[float, "of the axis at its head"]
    azimuth_deg: Annotated[float, "of the axis at its head"]
    target_m: Annotated[float, "length of the axis"]
    radius_m: Annotated[float, "of the finished column"]
    tolerance: Annotated[str, "preset, or the limit as a sum"]
    course_m: Annotated[
        list[list[float]], "points of the axis from its head to its end: length, north, east, down; two where straight"
    ]


@answer_class
class ColumnDeviation:
    """Deviation of the hole from the design axis at one depth."""

    md_m: MeasuredDepth
    along_m: Annotated[float, "along the design axis"]
    north_cm: FromAxis
    east_cm: FromAxis
    deviation_cm: FromAxis
    sigma_cm: Annotated[float, "standard deviation of the deviation"]
    deviation_percent: Annotated[float, "of the length"]
    direction_deg: Annotated[float, "azimuth of the deviation"]
    limit_cm: Annotated[float, "tolerance at this depth"]
    used_percent: Annotated[float, "of the tolerance"]
    level_percent: Annotated[float, "highest alarm level reached"]


@answer_class
class ConeRow:
    """Where the hole will be at one depth, if it goes on as it tends to."""

    md_m: MeasuredDepth
    along_m: Annotated[float, "along the design axis"]
    north_cm: Annotated[float, "expected, from the design axis"]
    east_cm: Annotated[float, "expected, from the design axis"]
    deviation_cm: Annotated[float, "expected, from the design axis"]
    half_width_cm: Annotated[float, "of the deviation: it is within this of what is expected with 95 %"]
    radius_cm: Annotated[float, "of the cone: the hole is within this of the place expected with 95 %"]
    limit_cm: Annotated[float, "tolerance at this depth"]


@answer_class
class ForeseenEnd:
    """What is known of where the hole ends, if nothing is steered and it goes on as its own directions say."""

    within_percent: Annotated[float, "chance that it ends within the limit"]
    half_width_cm: Annotated[float, "of the deviation of the projection: 95 %"]
    surveyed_sigma_cm: Annotated[float, "standard deviation of the end that is of the surveys alone"]
    bend_deg_per_m: Annotated[float | None, "curvature of the hole now, as expected; null at its end"]
    cone: list[ConeRow]


@answer_class
class DominantAngle:
    """Which of two angles makes more of the uncertainty of the toe."""

    angle: Annotated[str, "which matters more for the position of the toe"]
    by_inclination_m: Annotated[float, "part of the uncertainty"]
    by_azimuth_m: Annotated[float, "part of the uncertainty"]


@answer_class
class ColumnAnswer:
    """Deviation from the design axis at every station, and expected at the target; ``ahead`` says how sure that is."""

    design: DesignAxis
    stations: list[ColumnDeviation]
    worst: ColumnDeviation
    projection: ColumnDeviation | None
    ahead: ForeseenEnd | None
    dominant: DominantAngle | None


@answer_class
class HistoryMoment:
    """What was known of the column at the end of one stop."""

    moment: Annotated[int, "number, for `column?moment=`"]
    at_s: Annotated[float, "rig time of its newest survey"]
    md_m: Annotated[float, "measured depth of its newest station"]
    deviation_cm: Annotated[float, "of the end, or before that is known of the worst station"]
    limit_cm: Annotated[float, "tolerance there"]
    used_percent: Annotated[float, "of the tolerance"]


@answer_class
class HistoryAnswer:
    """What was known at the end of every stop, thinned."""

    moments: list[HistoryMoment]


@answer_class
class Off:
    """How far off the hole is, at which measured depth, and towards which azimuth."""

    md_m: MeasuredDepth
    deviation_cm: FromAxis
    sigma_cm: Annotated[float, "standard deviation of it"]
    half_width_cm: Annotated[float, "it is within this of the deviation with 95 %"]
    within_percent: Annotated[float, "chance that it is within the limit"]
    limit_cm: Annotated[float, "tolerance there"]
    used_percent: Annotated[float | None, "of the tolerance; null where none is allowed"]
    azimuth_deg: Annotated[float, "towards which the hole is off"]
    wind: Wind


@answer_class
class Steer:
    """Where to steer to, and the last depth from which that makes it sure that the hole ends within its limit.

    A correction is taken to bend the hole towards its axis by ``bend_deg_per_m``, beside what the hole does by itself,
    from there on and by every survey.
    """

    azimuth_deg: Annotated[float, "towards which to steer"]
    wind: Wind
    before_md_m: Annotated[float, "last depth from which a correction makes the end sure"]
    left_m: Annotated[float | None, "of drilling until there; less than 0 once it has been passed"]
    missed: Annotated[bool, "whether it has been passed"]
    sure_percent: Annotated[float, "chance of ending within that a correction is to bring"]
    best_percent: Annotated[float, "chance that a correction from now on brings"]
    bend_deg_per_m: Annotated[float, "most by which the rig bends the hole back, as it was stated"]


@answer_class
class Verdict:
    """on_target, watch, steer, out or dont_know, with its reasons; good for ``good_for_s`` after its arrival."""

    rig: Annotated[str, "name"]
    good_for_s: Annotated[float, "after its arrival; who has heard no later verdict by then knows nothing"]
    verdict: Annotated[str, "what the crew needs to know first", SOME_WORD]
    by_surveys: Annotated[str, "what the surveys alone say, fresh or not", SOME_WORD]
    line: Annotated[str, "all of it in a line"]
    todo: Annotated[str, "what to do, in a line"]
    why: Annotated[list[str], "what it rests on, or why it is not known"]
    doubts: Annotated[list[str], "why it is not known, as words", OneOf(*(doubt.value for doubt in VerdictDoubt))]
    bit_md_m: Annotated[float | None, "measured depth of the bit"]
    target_m: Annotated[float, "length of the design axis"]
    what: Annotated[str | None, "which deviation decided", OneOf("deviation", "projection")]
    unfound_cm: Annotated[float, "by which the toe may be off if the tube errs that read the last station alone"]
    unfound_drift_cm: Annotated[
        float, "by which the toe may be off if the encoder slips a little at every stop, too little to be found"
    ]
    off: Off | None
    steer: Steer | None
