"""What makes each answer: a view of the model, or one that shows a member by its number. No I/O."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar

from groundstation.service.answers.model import RigModel
from groundstation.service.answers.streamed_rows import Parameters

Shape = TypeVar("Shape")
View = Callable[[RigModel, Parameters], Shape]
MemberView = Callable[[RigModel, int], Shape]


@dataclass(frozen=True, slots=True)
class AnswerMaker:
    """What makes the answers of one class.

    Parameters
    ----------
    view : makes the answer; of a member it is called with the member's number
    text : JSON of the same, where rows of it are kept as such
    numbers : of the members that there are; None for an answer without a number
    """

    view: Callable[[RigModel, Any], Any]
    text: Callable[[RigModel, Parameters], bytes] | None = None
    numbers: Callable[[RigModel], Iterable[int]] | None = None


MAKERS: dict[type[Any], AnswerMaker] = {}


def view_of(
    shape: type[Shape], text: Callable[[RigModel, Parameters], bytes] | None = None
) -> Callable[[View[Shape]], View[Shape]]:
    """Have a view make the answers of a class; ``text`` is their JSON, where rows of it are kept as such."""

    def register_view(view: View[Shape]) -> View[Shape]:
        MAKERS[shape] = AnswerMaker(view, text)
        return view

    return register_view


def member_view_of(
    shape: type[Shape], numbers: Callable[[RigModel], Iterable[int]]
) -> Callable[[MemberView[Shape]], MemberView[Shape]]:
    """Have a view make the answers of a class, one a number; ``numbers`` are those that there are."""

    def register_view(view: MemberView[Shape]) -> MemberView[Shape]:
        MAKERS[shape] = AnswerMaker(view, numbers=numbers)
        return view

    return register_view
