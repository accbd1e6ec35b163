"""The paths below ``ground/`` that have an answer now: each with its line of the table and with what makes it."""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass
from types import ModuleType
from typing import Any, Final

from groundstation.errors import SelectorError
from groundstation.service.answers import (
    adjustment_views,
    alarm_views,
    column_views,
    hole_views,
    measurement_views,
    order_views,
    recalibration_views,
    setup_views,
    string_views,
    verdict_views,
    wall_views,
)
from groundstation.service.answers.answer_table import (
    ANSWERS,
    NUMBER,
    AnswerKey,
    find_answer,
    schemas_by_path,
    split_number,
)
from groundstation.service.answers.answer_texts import finite_or_none, json_of, plain_answer, utc_text
from groundstation.service.answers.answer_views import MAKERS, view_of
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.shapes.answer_fields import Fields
from groundstation.service.answers.shapes.string_shapes import AnswerHeader, SchemaAnswer
from groundstation.service.answers.streamed_rows import Parameters

# each tells ``MAKERS`` of its views when it is imported
VIEWS: Final[tuple[ModuleType, ...]] = (
    adjustment_views,
    alarm_views,
    column_views,
    hole_views,
    measurement_views,
    order_views,
    recalibration_views,
    setup_views,
    string_views,
    verdict_views,
    wall_views,
)
SHOWN = 30  # numbers that a refusal names


@dataclass(frozen=True, slots=True)
class AnsweredPath:
    """One path that has an answer now; ``number`` is its member's."""

    answer: AnswerKey
    number: int | None = None

    def show(self, k: RigModel, p: Parameters) -> dict[str, Any]:
        """The whole answer as plain objects: what every answer has, and what its view makes."""
        return dict(plain_answer(answer_header(k)) | plain_answer(self.view(k, p)))

    def json(self, k: RigModel, p: Parameters) -> bytes:
        """The whole answer as JSON; of the hole the text of the last time, behind a header of now."""
        if (text_of := MAKERS[self.answer.shape].text) is not None:
            text = text_of(k, p)
        elif self.answer.of_the_hole and not p:
            text = k.texts.text_of(self.answer.path, lambda: json_of(self.view(k, p)))
        else:
            text = json_of(self.view(k, p))
        return b"".join((json_of(answer_header(k))[:-1], b",", memoryview(text)[1:]))

    def view(self, k: RigModel, p: Parameters) -> Any:
        """What stands behind the header."""
        return MAKERS[self.answer.shape].view(k, p if self.number is None else self.number)

    @property
    def fields(self) -> Fields:
        """Fields of the whole answer."""
        return self.answer.fields

    @property
    def parameters(self) -> tuple[str, ...]:
        """Parameters that it takes."""
        return self.answer.parameters

    @property
    def is_stream(self) -> bool:
        """Whether its rows are numbered in the order of their coming; only new ones are published."""
        return self.answer.is_stream


def answer_header(k: RigModel) -> AnswerHeader:
    """What every answer begins with."""
    return AnswerHeader(k.revisions.newest, utc_text(time.time()), finite_or_none(k.string.time.rig_now))


@view_of(SchemaAnswer)
def answer_schemas(_k: RigModel, _p: Parameters) -> SchemaAnswer:
    """JSON schema of every answer."""
    return SchemaAnswer(schemas_by_path())


def find_path(k: RigModel, path: str) -> AnsweredPath:
    """The path, if it has an answer now.

    Raises
    ------
    SelectorError
        When it has none; it lists those that can have one.
    """
    answer = find_answer(path)
    if not answer.numbers:
        return AnsweredPath(answer)
    number, numbers = split_number(path)[1], list(numbers_of(k, answer))
    if number not in numbers:
        there_are = ", ".join(map(str, numbers[-SHOWN:])) or "none yet"
        raise SelectorError(f"{path}: no such number; of {answer.path} there are {there_are}")
    return AnsweredPath(answer, number)


def numbers_of(k: RigModel, answer: AnswerKey) -> Iterable[int]:
    """Numbers of the members that there are of a path with a number."""
    numbers = MAKERS[answer.shape].numbers
    return () if numbers is None else numbers(k)


def check_parameters(found: Iterable[AnsweredPath], parameters: Parameters, common: tuple[str, ...] = ()) -> None:
    """Refuse a parameter that none of the paths asked for takes; ``common`` are those of every path.

    Raises
    ------
    SelectorError
        Naming those that are taken.
    """
    known = sorted({name for path in found for name in path.parameters} | set(common))
    for name in parameters:
        if name not in known:
            raise SelectorError(f"parameter {name}: expected {'one of ' + ', '.join(known) if known else 'none'}")


def answered_paths(k: RigModel) -> dict[str, AnsweredPath]:
    """Every path that has an answer now."""
    found: dict[str, AnsweredPath] = {}
    for path, answer in ANSWERS.items():
        if not answer.numbers:
            found[path] = AnsweredPath(answer)
        for number in numbers_of(k, answer) if answer.numbers else ():
            found[NUMBER.sub(str(number), path)] = AnsweredPath(answer, number)
    return found


def check_views() -> None:
    """Refuse a table with an answer that nothing makes.

    Raises
    ------
    TypeError
        Naming path and class.
    """
    for path, answer in ANSWERS.items():
        maker = MAKERS.get(answer.shape)
        if maker is None or (maker.numbers is None) != (not answer.numbers):
            raise TypeError(f"{path}: expected a view of {answer.shape.__name__} among {', '.join(map(str, VIEWS))}")


check_views()
