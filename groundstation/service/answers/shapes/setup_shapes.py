"""The answer about the setup: what is known of the rig, how well, from where, and what it costs at the toe."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.service.setup.told_value import SetupKind, SetupSource


@answer_class
class SetupRow:
    """One item of the setup."""

    item: Annotated[str, "name, such as north, joint.4-3 and mount.3"]
    kind: Annotated[str, "what it is", OneOf(*SetupKind)]
    subject: Annotated[str, "tube, or joint as upper and lower tube; empty of what the rig has once"]
    words: Annotated[str, "name for people, such as accelerometer of tube 3"]
    value: Annotated[list[float], "one, of the collar inclination and azimuth; empty where it may be any"]
    sigma: Annotated[float, "standard deviation of each"]
    unit: Annotated[str, "of both: deg, m, m/s^2, deg/s, deg/m or 1"]
    source: Annotated[str, "where it is from", OneOf(*SetupSource)]
    detail: Annotated[str, "the same in words"]
    told: Annotated[bool, "it was told or measured"]
    missing: Annotated[bool, "without it the hole is not known, and it was not told"]
    by: Annotated[str, "who told it; empty where no order did"]
    utc: Annotated[str, "when that was"]
    age_s: Annotated[float | None, "since then; null where no order told it"]
    times_told: Annotated[int, "by orders, also what does not stand any more"]
    check: Annotated[str, "what checks it, in words; empty where readings show a slip, or it was not told"]
    least_slip: Annotated[float | None, "smallest slip that its check shows; null where it has none"]
    toe_cm: Annotated[float, "standard deviation that it makes at the toe"]
    way: Annotated[str, "across the hole, or along it where it is one of the depth", OneOf("across", "along")]


@answer_class
class SetupAnswer:
    """What is known of the rig: what is missing first, then what costs most at the toe, across the hole, then along."""

    ready: Annotated[bool, "nothing is missing, unchecked or contradicted"]
    missing: Annotated[list[str], "items without which the hole is not known"]
    unchecked: Annotated[list[str], "items that were told once, of which no reading shows a slip, and nothing checks"]
    hold: Annotated[str, "why it is not ready, in words; empty where it is"]
    contradicted: Annotated[list[str], "what is told one way and checked another, in words"]
    todo: Annotated[str, "the next thing to do"]
    worst: Annotated[str, "item that costs most at the toe, across the hole"]
    costs_most: Annotated[str, "the same for people, with what it costs"]
    at_m: Annotated[float, "measured depth of the toe"]
    surveyed: Annotated[bool, "the costs are of the hole as surveyed; before the first station of its design"]
    left_out: Annotated[str, "what the costs do not hold"]
    items: list[SetupRow]
