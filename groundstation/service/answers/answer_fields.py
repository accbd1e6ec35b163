"""How the answer of a key is described once: a JSON schema and the table of the documentation are made from it."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class AnswerField:
    """One field of an answer: its JSON type, whether it may be null, and what it holds."""

    name: str
    kind: str  # number, integer, string, boolean, object, map
    meaning: str = ""
    null: bool = False
    rank: int = 0  # 1 for a list of them, 2 for a list of lists
    fields: tuple[AnswerField, ...] = ()  # of an object, or of the values of a map
    choices: tuple[str, ...] = ()

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
            yield name, shown + (" or null" if self.null else ""), meaning.removeprefix(": ")
        for field in self.fields:
            yield from field.rows(f"{name}.")

    def _bare_schema(self) -> dict[str, Any]:
        if self.kind == "object":
            return object_schema(self.fields)
        if self.kind == "map":
            return {"type": "object"} | ({"additionalProperties": object_schema(self.fields)} if self.fields else {})
        return {"type": self.kind} | ({"enum": list(self.choices)} if self.choices else {})


Fields = tuple[AnswerField, ...]


def object_schema(fields: Fields) -> dict[str, Any]:
    """JSON schema of an object that has these fields and no others."""
    return {
        "type": "object",
        "properties": {field.name: field.schema() for field in fields},
        "required": [field.name for field in fields],
        "additionalProperties": False,
    }


def number(name: str, meaning: str = "", *, null: bool = False) -> AnswerField:
    """A finite number; the unit ends its name."""
    return AnswerField(name, "number", meaning, null)


def integer(name: str, meaning: str = "", *, null: bool = False) -> AnswerField:
    """A whole number."""
    return AnswerField(name, "integer", meaning, null)


def text(name: str, meaning: str = "", *choices: str, null: bool = False) -> AnswerField:
    """A text, one of the choices where there are any."""
    return AnswerField(name, "string", meaning, null, choices=choices)


def truth(name: str, meaning: str = "", *, null: bool = False) -> AnswerField:
    """True or false."""
    return AnswerField(name, "boolean", meaning, null)


def numbers(name: str, meaning: str = "", rank: int = 1, *, null: bool = False) -> AnswerField:
    """A list of numbers, or with rank 2 the rows of a matrix."""
    return AnswerField(name, "number", meaning, null, rank)


def texts(name: str, meaning: str = "", *choices: str) -> AnswerField:
    """A list of texts."""
    return AnswerField(name, "string", meaning, rank=1, choices=choices)


def integers(name: str, meaning: str = "") -> AnswerField:
    """A list of whole numbers."""
    return AnswerField(name, "integer", meaning, rank=1)


def group(name: str, fields: Fields, *, null: bool = False) -> AnswerField:
    """An object in the answer."""
    return AnswerField(name, "object", null=null, fields=fields)


def rows(name: str, fields: Fields) -> AnswerField:
    """A list of objects."""
    return AnswerField(name, "object", rank=1, fields=fields)


def mapping(name: str, meaning: str = "", fields: Fields = ()) -> AnswerField:
    """An object whose names are not fixed; ``fields`` are those of each of its values."""
    return AnswerField(name, "map", meaning, fields=fields)
