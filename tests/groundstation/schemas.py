"""Checks of real answers against the fields that their keys promise."""

import functools
from typing import Any

import jsonschema

from groundstation.service.answers.answer_fields import Fields, object_schema
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.paths import paths


@functools.cache
def validator(fields: Fields) -> jsonschema.Draft202012Validator:
    """Validator of the answers that have these fields."""
    schema = object_schema(fields)
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def check_answer(view: dict[str, Any], fields: Fields) -> None:
    """An answer has the fields of its key, all of them and no others."""
    validator(fields).validate(view)


def check_answers(model: RigModel) -> set[str]:
    """Every answer that a model has; returns their paths."""
    found = paths(model)
    for path in found.values():
        check_answer(path.show(model, {}), path.fields)
    return set(found)
