"""Classes of answers: what they refuse, and that whatever draws an answer draws fields that it has."""

import json
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Annotated, Any

import pytest

from groundstation.service.answers import paths
from groundstation.service.answers.answer_table import ANSWERS, AnswerKey
from groundstation.service.answers.answer_texts import json_of, plain_answer
from groundstation.service.answers.shapes.answer_fields import (
    AnswerField,
    OneOf,
    answer_class,
    fields_of_answer,
    filled_answers,
    filled_columns,
    object_schema,
)
from telemetry.application.arguments import shown_name
from telemetry.application.commands import COMMANDS

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "groundstation" / "gateway" / "page" / "static" / "js"
UNITS = "deg|dps|m|cm|s|utc|db|percent|mps2"  # that end the name of a field


@answer_class
class Layer:
    """A layer of the ground."""

    name: Annotated[str, "of what", OneOf("clay", "sand")]
    to_m: Annotated[float | None, "its end"]


@answer_class
class Ground:
    """Layers of the ground."""

    layers: list[Layer]
    by_name: dict[str, Layer]
    top: Layer | None
    grid: Annotated[list[list[float]], "of anything"]


def test_a_class_is_read_as_its_fields() -> None:
    layer = fields_of_answer(Layer)
    assert layer == (
        AnswerField("name", "string", "of what", choices=("clay", "sand")),
        AnswerField("to_m", "number", "its end", null=True),
    )
    assert [(field.kind, field.rank, field.null, field.fields) for field in fields_of_answer(Ground)] == [
        ("object", 1, False, layer),
        ("map", 0, False, layer),
        ("object", 0, True, layer),
        ("number", 2, False, ()),
    ]
    assert object_schema(layer)["required"] == ["name", "to_m"]
    clay = Layer("clay", None)
    made = Ground([clay], {"clay": clay}, clay, [[1.0]])
    row = {"name": "clay", "to_m": None}
    assert plain_answer(made) == {"layers": [row], "by_name": {"clay": row}, "top": row, "grid": [[1.0]]}
    assert json.loads(json_of(made)) == plain_answer(made)


@pytest.mark.parametrize(
    ("hint", "line"),
    [
        (float, r'Mud\.mud_c: expected what it holds, as Annotated\[float, "meaning"\]'),
        (Annotated[float | None, OneOf("a")], r'Mud\.mud_c: expected what it holds, as Annotated\[float, "meaning"\]'),
        (list[list[str]], r'Mud\.mud_c: expected what it holds, as Annotated\[str, "meaning"\]'),
        (dict[str, Any], r'Mud\.mud_c: expected what it holds, as Annotated\[dict, "meaning"\]'),
        (Annotated[bytes, "meaning"], r"Mud\.mud_c: expected a type of JSON or the class of an answer, got .*bytes"),
        (Annotated[int | str, "meaning"], r"Mud\.mud_c: expected a type of JSON or the class of an answer, got int"),
    ],
)
def test_a_field_without_a_meaning_or_a_type_of_json_is_refused_by_class_and_name(hint: Any, line: str) -> None:
    with pytest.raises(TypeError, match=line):
        answer_class(type("Mud", (), {"__annotations__": {"depth_m": Annotated[float, "where"], "mud_c": hint}}))


def test_values_that_are_not_the_fields_of_a_class_are_refused() -> None:
    assert filled_columns(Layer, {"name": ["clay", "sand"], "to_m": [2.0, None]}) == [
        Layer("clay", 2.0),
        Layer("sand", None),
    ]
    for names in (("name",), ("to_m", "name"), ("name", "to_m", "from_m")):
        with pytest.raises(TypeError, match="Layer: expected name, to_m, got " + ", ".join(names)):
            filled_answers(Layer, [dict.fromkeys(names)])


def test_an_answer_that_nothing_makes_is_named_at_the_start(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(ANSWERS, "ground", AnswerKey("ground", Ground, "what is drilled"))
    with pytest.raises(TypeError, match="ground: expected a view of Ground among"):
        paths.check_views()


def field_names(shape: type[Any]) -> Iterator[str]:
    """Names of all fields of a class and of those within it."""
    for field in fields_of_answer(shape):
        yield field.name
        if field.shape is not None:
            yield from field_names(field.shape)


@pytest.mark.parametrize("file", [*sorted(PAGE.glob("*.js")), *sorted((ROOT / "borechain" / "crew").glob("*.py"))])
def test_what_draws_answers_draws_fields_that_they_have(file: Path) -> None:
    told = {shown_name(one.quantity) for spec in COMMANDS for one in spec.arguments}  # by a form
    known = {"rig_time_s", *told, *(name for one in ANSWERS.values() for name in field_names(one.shape))}
    drawn = set(re.findall(rf"""(?:\.|\["|get\(")([a-z][a-z_]*_(?:{UNITS}))\b""", file.read_text()))
    assert drawn - known == set()
