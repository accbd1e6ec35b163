"""Checks of real answers against the fields that their keys promise."""

import functools
from typing import Any

import jsonschema

from groundstation.service.answers.answer_texts import plain_answer
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import answered_paths, find_path
from groundstation.service.answers.shapes.answer_fields import Fields, object_schema


@functools.cache
def validator(fields: Fields) -> jsonschema.Draft202012Validator:
    """Validator of the answers that have these fields."""
    schema = object_schema(fields)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def check_answer(view: dict[str, Any], fields: Fields) -> None:
    """An answer has the fields of its key, all of them and no others."""
    validator(fields).validate(view)


def shown_on(model: RigModel, path: str, **parameters: str) -> dict[str, Any]:
    """What a model shows on a path, behind the header."""
    return plain_answer(find_path(model, path).view(model, parameters))


def check_answers(model: RigModel) -> set[str]:
    """Every answer that a model has; returns their paths."""
    found = answered_paths(model)
    for path in found.values():
        check_answer(path.show(model, {}), path.fields)
    return set(found)
