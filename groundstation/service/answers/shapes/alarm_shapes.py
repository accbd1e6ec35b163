"""Answers about alarms: those that the crew works with, of the tolerance, of the rig itself, where the hole moved."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.alarms.crew_alarms import AlarmState
from groundstation.service.alarms.rig_alarms import KINDS, Level
from groundstation.service.alarms.verdict_words import WINDS
from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.answers.shapes.hole_shapes import MeasuredDepth

CODES = tuple(kind.code for kind in KINDS)
LevelName = Annotated[str, "how much it matters", OneOf(*(level.name.lower() for level in Level))]
Subject = Annotated[str, "what it is about"]
Detail = Annotated[str, "what is known of it"]


@answer_class
class Alarm:
    """One alarm as the crew works with it."""

    number: Annotated[int, "of the alarm, never used twice"]
    state: Annotated[str, "how far it is", OneOf(*AlarmState)]
    code: Annotated[str, "kind: of the rig's, or deviation, projection", OneOf(*CODES, "deviation", "projection")]
    level: LevelName
    subject: Subject
    detail: Detail
    threshold: Annotated[str, "that was passed"]
    md_m: Annotated[float | None, "measured depth, where it is at one"]
    azimuth_deg: Annotated[float | None, "towards which the hole is off"]
    wind: Annotated[str | None, "the same as a word", OneOf(*WINDS)]
    since_s: Annotated[float | None, "rig time at which it was raised"]
    since_utc: Annotated[str | None, "the same in UTC"]
    times: Annotated[int, "that it was raised"]
    count: Annotated[int, "times that its cause was noticed"]
    acknowledged_by: Annotated[str | None, "who"]
    acknowledged_utc: Annotated[str | None, "when"]
    shelved_by: Annotated[str | None, "who"]
    shelved_until_utc: Annotated[str | None, "when it is back"]
    cleared_at_s: Annotated[float | None, "rig time at which its cause was gone"]


@answer_class
class ToleranceAlarmRow:
    """One alarm of the deviation or of the projection, with the threshold that it passed."""

    kind: Annotated[str, "of what", OneOf("deviation", "projection")]
    level_percent: Annotated[float, "of the tolerance"]
    raised_at_s: Annotated[float, "rig time of the survey that raised it"]
    md_m: MeasuredDepth
    deviation_cm: Annotated[float, "then"]
    sigma_cm: Annotated[float, "standard deviation of the deviation"]
    half_width_cm: Annotated[float, "it was within this of the deviation with 95 %"]
    threshold_cm: Annotated[float, "passed"]
    cleared_at_s: Annotated[float | None, "rig time"]


@answer_class
class MovedStation:
    """A station where a survey contradicted those before it: the hole moved."""

    md_m: MeasuredDepth
    at_s: Annotated[float, "rig time"]
    dropped_measurements: Annotated[int, "that no longer count"]
    departure_sigma: Annotated[float, "of the new survey from those before"]
    neighbours_sigma: Annotated[list[float], "of the stations beside it"]


@answer_class
class RigAlarmRow:
    """One alarm of the rig itself."""

    code: Annotated[str, "kind of alarm, see [operating](operate.md#what-the-crew-is-told)", OneOf(*CODES)]
    level: LevelName
    subject: Subject
    detail: Detail
    raised_at_s: Annotated[float | None, "rig time"]
    cleared_at_s: Annotated[float | None, "rig time; null while it stands"]
    count: Annotated[int, "times it was raised"]


@answer_class
class AlarmsAnswer:
    """What the crew works with, and what it is made of."""

    open: list[Alarm]
    closed: list[Alarm]
    raised_last_hour: Annotated[int, "alarms, ten at most in a good run"]
    flood: Annotated[bool, "more than ten were raised within ten minutes, and not yet fewer than five"]
    left_out: Annotated[int, "conditions for which there was no room among the open ones, milder than those"]
    levels_percent: Annotated[list[float], "of the tolerance"]
    active: list[ToleranceAlarmRow]
    cleared: list[ToleranceAlarmRow]
    moved: list[MovedStation]
    rig: list[RigAlarmRow]
    rig_cleared: list[RigAlarmRow]
