"""The answer about the adjustment of the hole: what its tubes say about each other."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.string_shapes import Tube
from groundstation.survey.adjustment.hypotheses import BlunderKind

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
class NextStopAdvice:
    """Where to stop next: the turn of the string against this stop after which the toe is known best."""

    turn_deg: Annotated[float, "by which to turn the string on, against where it stands at the last stop"]
    sigma_cm: Annotated[float, "standard deviation of the new toe after it"]
    same_face_cm: Annotated[float, "the same without a turn"]


@answer_class
class AdjustmentAnswer:
    """One adjustment of the whole hole: how well all surveys fit, what is wrong, and what each thing costs."""

    surveys: Annotated[int, "looks of tubes at stations that are in it"]
    redundancy: Annotated[float, "numbers beyond those that the hole and its tubes need"]
    misfit: Annotated[float | None, "weighted squares of what is left over what they are to be: 1 is as it should be"]
    play_deg: Annotated[float | None, "by which tubes lie askew in the hole from stop to stop, as the surveys show it"]
    sigma_toe_cm: Annotated[float | None, "standard deviation at the toe, the larger of north and east"]
    searched: Annotated[int, "surveys by which it was looked for what is wrong; of the newest that may still go on"]
    blunders: list[BlunderRow]
    toe: list[ToeShare]
    tubes: list[AdjustedTube]
    next_stop: NextStopAdvice | None
