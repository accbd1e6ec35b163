"""Answer about the wall: the hole that is drilled, its neighbours, and the joints between them."""

from __future__ import annotations

from typing import Annotated

from groundstation.service.answers.shapes.answer_fields import OneOf, answer_class
from groundstation.survey.wall.column_state import ColumnState

OfHead = Annotated[float, "of its head"]
JointState = Annotated[str, "the worst along it", OneOf(*(state.name.lower() for state in ColumnState))]


@answer_class
class WallHole:
    """One hole of the neighbourhood."""

    hole: Annotated[str, "name; the first is the one that is drilled, the others are its neighbours"]
    north_m: OfHead
    east_m: OfHead
    length_m: Annotated[float, "of its design"]
    drilled_to_m: Annotated[float | None, "depth of its end"]
    surveyed_to_m: Annotated[float | None, "depth of its last survey"]


@answer_class
class WallJoint:
    """One joint between two columns."""

    joint: Annotated[str, "names of the two"]
    state: JointState
    surveyed_percent: Annotated[float, "of its depths, those at which both are surveyed"]
    probability: Annotated[float, "of being too thin, the largest; 1 where a hole is missing"]
    depth_m: Annotated[float, "where that is"]
    probability_where_surveyed: Annotated[float | None, "the largest where both are surveyed"]
    thickness_m: Annotated[float | None, "the least, as surveyed"]
    thinnest_at_m: Annotated[float, "where that is"]


@answer_class
class ClosingColumn:
    """One more column, which would close what is open."""

    joint: Annotated[str, "that would be closed"]
    north_m: OfHead
    east_m: OfHead
    from_m: Annotated[float, "where the joint is open"]
    to_m: Annotated[float, "where the joint is open"]
    closes: Annotated[bool, "whether one column is enough"]


@answer_class
class WallNeighbourhood:
    """The hole that is drilled and those beside it."""

    name: Annotated[str, "of the wall"]
    hole: Annotated[str, "that is drilled here"]
    required_thickness_m: Annotated[float, "of a joint"]
    allowed_probability: Annotated[float, "of anything too thin"]
    verdict: Annotated[str | None, "on these joints", OneOf("tight", "not_proven", "not_tight")]
    problem: Annotated[str | None, "why they cannot be judged"]
    findings: Annotated[list[str], "what is open or doubtful"]
    holes: list[WallHole]
    joints: list[WallJoint]
    extra_columns: list[ClosingColumn]


@answer_class
class WallAnswer:
    """The joints of now; null where no wall was named."""

    wall: WallNeighbourhood | None
