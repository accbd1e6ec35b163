"""How an answer is described: by one class, whose fields say what they hold.

    @answer_class
    class Off:
        \"\"\"How far off the hole is.\"\"\"

        md_m: Annotated[float, "measured depth"]
        wind: Annotated[str, "the same as a word", OneOf("N", "E", "S", "W")]
        limits: list[Limit]  # answers within an answer: their class says what they hold

JSON, its schema, the tables of docs/keys.md, the types of the page and the client's classes are made from it. The unit
of a number ends its name.
"""

from __future__ import annotations

import types
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, Any, TypeVar, Union, dataclass_transform, get_args, get_origin, get_type_hints

Shape = TypeVar("Shape")
JSON_KINDS: dict[Any, str] = {float: "number", int: "integer", str: "string", bool: "boolean"}


class OneOf:
    """Texts of which a field holds one."""

    def __init__(self, *choices: str) -> None:
        self.choices = choices


@dataclass(frozen=True, slots=True)
class AnswerField:
    """One field of an answer: its JSON type, whether it may be null, and what it holds."""

    name: str
    kind: str  # number, integer, string, boolean, object, map
    meaning: str = ""
    null: bool = False
    rank: int = 0  # 1 for a list of them, 2 for a list of lists
    shape: type[Any] | None = None  # class of an object, or of the values of a map
    choices: tuple[str, ...] = ()

    @property
    def fields(self) -> Fields:
        """Fields of an object, or of the values of a map."""
        return () if self.shape is None else fields_of_answer(self.shape)

    def schema(self) -> dict[str, Any]:
        """JSON schema of the value."""
        schema = self._bare_schema()
        for _ in range(self.rank):
            schema = {"type": "array", "items": schema}
        if self.null:
            schema = {"anyOf": [schema, {"type": "null"}]}
        return schema | ({"description": self.meaning} if self.meaning else {})

    def rows(self, before: str = "") -> Iterator[tuple[str, str, str]]:
        """Lines of a table: dotted name, type, meaning."""
        name = f"{before}{self.name}" + "[]" * self.rank + (".{name}" if self.kind == "map" else "")
        if not self.fields:
            shown = {"map": "any"}.get(self.kind, self.kind)
            meaning = self.meaning + (f": {', '.join(self.choices)}" if self.choices else "")
            yield name, shown + (" or null" if self.null else ""), meaning
        for field in self.fields:
            yield from field.rows(f"{name}.")

    def _bare_schema(self) -> dict[str, Any]:
        if self.kind == "object":
            return object_schema(self.fields)
        if self.kind == "map":
            return {"type": "object"} | ({"additionalProperties": object_schema(self.fields)} if self.fields else {})
        return {"type": self.kind} | ({"enum": list(self.choices)} if self.choices else {})


Fields = tuple[AnswerField, ...]
_FIELDS: dict[type[Any], Fields] = {}
_NAMES: dict[type[Any], list[str]] = {}


@dataclass_transform()
def answer_class(shape: type[Shape]) -> type[Shape]:
    """Make a dataclass of an answer, or of a part of one.

    Raises
    ------
    TypeError
        When a field has no meaning, or a type that JSON has not; it names class and field.
    """
    hints = get_type_hints(shape, include_extras=True)
    _FIELDS[shape] = tuple(read_field(shape, name, hint) for name, hint in hints.items())
    _NAMES[shape] = [*hints]
    return dataclass(shape)


def fields_of_answer(shape: type[Any]) -> Fields:
    """Fields of the class of an answer, in the order in which JSON has them."""
    return _FIELDS[shape]


def read_field(shape: type[Any], name: str, hint: Any) -> AnswerField:
    """Field of a class by its annotation; errors as ``answer_class``."""
    bare, *notes = get_args(hint) if get_origin(hint) is Annotated else (hint,)
    meaning = next((note for note in notes if isinstance(note, str)), "")
    choices = next((note.choices for note in notes if isinstance(note, OneOf)), ())
    bare, null = without_none(bare)
    bare, rank = without_lists(bare)
    kind, inside = kind_of(bare)
    if not kind:
        raise TypeError(f"{shape.__name__}.{name}: expected a type of JSON or the class of an answer, got {bare}")
    if not meaning and inside is None:
        raise TypeError(f'{shape.__name__}.{name}: expected what it holds, as Annotated[{bare.__name__}, "meaning"]')
    return AnswerField(name, kind, meaning, null, rank, inside, choices)


def without_none(hint: Any) -> tuple[Any, bool]:
    """A type without None, and whether it had it."""
    if get_origin(hint) not in (Union, types.UnionType):
        return hint, False
    left = [one for one in get_args(hint) if one is not types.NoneType]
    return (left[0], True) if len(left) == 1 else (hint, False)


def without_lists(hint: Any) -> tuple[Any, int]:
    """Type of the members of lists of lists, and how deep those are."""
    rank = 0
    while get_origin(hint) is list:
        hint, rank = get_args(hint)[0], rank + 1
    return hint, rank


def kind_of(hint: Any) -> tuple[str, type[Any] | None]:
    """JSON type of a type, and the class of the answer in it; an empty text where JSON has none."""
    if get_origin(hint) is dict:
        values = get_args(hint)[1]
        return "map", values if values in _FIELDS else None
    if hint in _FIELDS:
        return "object", hint
    return JSON_KINDS.get(hint, ""), None


def filled_answers(shape: type[Shape], rows: Iterable[dict[str, Any]]) -> list[Shape]:
    """Answers of these values, all made alike; quicker than from arguments.

    Raises
    ------
    TypeError
        When the first row's are not the fields of the class in their order.
    """
    found: list[Shape] = []
    for values in rows:
        if not found:
            check_names(shape, [*values])
        made = object.__new__(shape)
        made.__dict__ = values
        found.append(made)
    return found


def filled_columns(shape: type[Shape], columns: Mapping[str, Iterable[Any]]) -> list[Shape]:
    """The same of columns, one a field."""
    return filled_answers(shape, (dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)))


def check_names(shape: type[Any], names: list[str]) -> None:
    """Refuse names that are not those of the fields, in their order; errors as ``filled_answers``."""
    expected = _NAMES[shape]
    if names != expected:
        raise TypeError(f"{shape.__name__}: expected {', '.join(expected)}, got {', '.join(names)}")


def object_schema(fields: Fields) -> dict[str, Any]:
    """JSON schema of an object that has these fields and no others."""
    return {
        "type": "object",
        "properties": {field.name: field.schema() for field in fields},
        "required": [field.name for field in fields],
        "additionalProperties": False,
    }
