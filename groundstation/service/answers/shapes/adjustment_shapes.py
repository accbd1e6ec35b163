"""The answer about the adjustment of the hole: what its tubes say about each other."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.string_shapes import Tube
from groundstation.survey.adjustment.blunder_kind import BlunderKind

Name = Annotated[str, "what it is of, such as a tube; empty of all"]


@answer_class
class BlunderRow:
    """Something that is wrong with the hole or its string."""

    kind: Annotated[str, "what explains the contradiction best", OneOf(*(kind.value for kind in BlunderKind))]
    subject: Name
    from_md_m: Annotated[float, "depth of the bit at the stop from which on, or at which, it is wrong"]
    is_doubt: Annotated[bool, "whether the second best explains nearly as much; then both are left open"]
    text: Annotated[str, "in words, of a doubt both explanations"]
    evidence: Annotated[float, "decimal places of the chance that an honest hole shows as much: 3 is one in a thousand"]
    second_kind: Annotated[str | None, "second best explanation"]
    second_evidence: Annotated[float | None, "of the second best"]
    misfit_before: Annotated[float, "of all surveys without it, 1 is as it should be"]
    misfit_after: Annotated[float, "of all surveys with it"]
    best: Annotated[str, "best explanation in words"]
    second: Annotated[str | None, "second best in words, and how likely it is beside the best"]
    moved_cm: Annotated[float | None, "by which the toe would be elsewhere without it put right; null if not known"]
    sigma_cm: Annotated[float | None, "standard deviation that it adds at the toe, since its size is not known exactly"]
    todo: Annotated[str, "what to do about it"]


@answer_class
class AdjustedTube:
    """A tube as all surveys of the hole show it."""

    tube: Tube
    bias_mg: Annotated[list[float], "of its accelerometer, the tilt of its mount in it: x, y, z"]
    sigma_bias_mg: Annotated[list[float], "standard deviations of it"]
    looks: Annotated[int, "surveys of the tube that count"]
    smallest_step_mg: Annotated[float | None, "step at its newest stop that would be found; null if nothing can tell"]
    unfound_step_cm: Annotated[float | None, "what a step that is not found does at the toe at most"]


@answer_class
class ToeShare:
    """What one source gives to the sigma at the toe."""

    source: Annotated[str, "kind of error"]
    subject: Name
    sigma_cm: Annotated[float, "standard deviation at the toe that it makes, the larger of north and east"]


@answer_class
class ToePart:
    """What all errors of one source give to the sigma at the toe together."""

    source: Annotated[str, "kind of error, as of `toe`"]
    words: Annotated[str, "the same for people, with the tube that gives most"]
    sigma_cm: Annotated[float, "standard deviation that it makes of `sigma_toe_cm`, whose square theirs add up to"]
    percent: Annotated[float, "of the variance at the toe to north and east"]


@answer_class
class LeastFound:
    """A mistake that may be made at the last stop, of its kind the one that does most at the toe when not found."""

    kind: Annotated[str, "what would be wrong", OneOf(*(kind.value for kind in BlunderKind))]
    subject: Name
    smallest: Annotated[float | None, "size from which on it would be found; null if nothing can tell"]
    unit: Annotated[str, "of it: mg, deg or m"]
    unfound_cm: Annotated[float | None, "what one that is not found does at the toe at most"]
    words: Annotated[str, "all of it for people"]


@answer_class
class NextStopAdvice:
    """Where to stop next: the turn of the string against this stop after which the toe is known best."""

    turn_deg: Annotated[float, "by which to turn the string on, against where it stands at the last stop"]
    sigma_cm: Annotated[float, "standard deviation of the new toe after it, to north or east in the mean"]
    same_face_cm: Annotated[float, "the same without a turn"]
    words: Annotated[str, "the same for people"]


@answer_class
class AdjustmentAnswer:
    """One adjustment of the whole hole: how well all surveys fit, what is wrong, and what each thing costs."""

    surveys: Annotated[int, "looks of tubes at stations that are in it"]
    redundancy: Annotated[float, "numbers beyond those that the hole and its tubes need"]
    misfit: Annotated[float | None, "weighted squares of what is left over what they are to be: 1 is as it should be"]
    play_deg: Annotated[float | None, "by which tubes lie askew in the hole from stop to stop, as the surveys show it"]
    counts: Annotated[bool, "directions and sigmas that are shown elsewhere are those of this adjustment"]
    said: Annotated[str, "how well all surveys fit, in words"]
    toe_md_m: Annotated[float | None, "depth of the last station, the toe"]
    sigma_toe_cm: Annotated[float | None, "standard deviation at the toe, the larger of north and east"]
    searched: Annotated[int, "surveys by which it was looked for what is wrong; of the newest that may still go on"]
    blunders: list[BlunderRow]
    toe: list[ToeShare]
    parts: list[ToePart]
    left_out: Annotated[str, "what is in no sigma, in words"]
    unfound: list[LeastFound]
    tubes: list[AdjustedTube]
    next_stop: NextStopAdvice | None
