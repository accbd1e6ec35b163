"""Write the types of the answers for the page's modules: ``python docs/make_page_types.py``.

An editor reads them through the modules' JSDoc; a browser never asks for the file.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

DOCS = Path(__file__).parent
sys.path[:0] = [str(DOCS.parent)]

from groundstation.service.answers.answer_table import ANSWERS, AnswerKey  # noqa: E402
from groundstation.service.answers.shapes.answer_fields import AnswerField, fields_of_answer  # noqa: E402
from groundstation.service.answers.shapes.string_shapes import AnswerHeader  # noqa: E402

TYPES = DOCS.parent / "groundstation" / "gateway" / "page" / "static" / "js" / "answers.d.ts"
SCALARS = {"number": "number", "integer": "number", "string": "string", "boolean": "boolean"}
HEAD = "// Answers of the ground station, made from its classes: python docs/make_page_types.py\n"


def types_text() -> str:
    """The file as it is: one interface a class, and which path holds which."""
    shapes = dict.fromkeys([AnswerHeader, *(inner for one in ANSWERS.values() for inner in shapes_in(one.shape))])
    parts = [HEAD, *map(interface_text, shapes), paths_text()]
    return "\n".join(parts)


def shapes_in(shape: type[Any]) -> Iterator[type[Any]]:
    """Classes within a class, those inside first, and itself."""
    for field in fields_of_answer(shape):
        if field.shape is not None:
            yield from shapes_in(field.shape)
    yield shape


def interface_text(shape: type[Any]) -> str:
    """One class as an interface."""
    lines = [line for field in fields_of_answer(shape) for line in field_lines(field)]
    return f"/** {first_line(shape)} */\nexport interface {shape.__name__} {{\n" + "\n".join(lines) + "\n}\n"


def field_lines(field: AnswerField) -> list[str]:
    """A field with its meaning above it."""
    return ([f"  /** {field.meaning} */"] if field.meaning else []) + [f"  {field.name}: {type_text(field)};"]


def type_text(field: AnswerField) -> str:
    """Type of a field's value."""
    inside = field.shape.__name__ if field.shape is not None else SCALARS.get(field.kind, "unknown")
    if field.choices:
        inside = " | ".join(json.dumps(choice) for choice in field.choices)
    if field.kind == "map":
        inside = f"Record<string, {inside}>"
    if field.rank and " | " in inside:
        inside = f"({inside})"
    return inside + "[]" * field.rank + (" | null" if field.null else "")


def paths_text() -> str:
    """Which path holds which answer, as the page keeps them: by path, as far as they have come."""
    lines = [f"  {path_text(one)}: {AnswerHeader.__name__} & {one.shape.__name__};" for one in ANSWERS.values()]
    return "/** Answer of each path. */\nexport interface Answers {\n" + "\n".join(lines) + "\n}\n"


def path_text(one: AnswerKey) -> str:
    """A path as the name of a property; of those with a number all at once."""
    if not one.numbers:
        return one.path
    pattern = one.path
    for name in one.numbers:
        pattern = pattern.replace(f"{{{name}}}", "${number}")
    return f"[path: `{pattern}`]"


def first_line(shape: type[Any]) -> str:
    """What a class says of itself first."""
    return (shape.__doc__ or "").partition("\n")[0].replace("``", "")


if __name__ == "__main__":
    TYPES.write_text(types_text())
