"""From the TOML of a scenario to its model: the first thing that is wrong, in one line with the file and the key."""

from __future__ import annotations

import difflib
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from sim.errors import ScenarioError
from telemetry.bounded_bytes import bounded_text
from telemetry.toml_tables import parse_toml_tables

Model = TypeVar("Model", bound=BaseModel)


def read_toml(path: Path) -> dict[str, Any]:
    """Tables of a file.

    Raises
    ------
    ScenarioError
        When the file cannot be read or is not TOML.
    """
    try:
        return parse_toml_tables(bounded_text(path))
    except OSError as error:
        raise ScenarioError(
            f"{path}: {error.strerror}; expected a scenario file, or a name of borechain scenario list"
        ) from error
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise ScenarioError(f"{path}: not TOML: {error}") from error


def validate_tables(where: Path, tables: dict[str, Any], model: type[Model], version: int) -> Model:
    """Model of the tables of ``where``, whose key ``version``, 1 where it is absent, is at most ``version``.

    Raises
    ------
    ScenarioError
        When they are of a newer version, or hold a key or a value that the model does not know.
    """
    given = tables.get("version", 1)
    if isinstance(given, int) and given > version:
        raise ScenarioError(f"{where}: version: expected at most {version}, got {given}; it needs a newer borechain")
    try:
        return model.model_validate(tables)
    except ValidationError as error:
        raise ScenarioError(f"{where}: {_first(error.errors(), model)}") from error


def spelling_hint(word: str, known: list[str]) -> str:
    """What was probably meant by a word, and what there is."""
    near = difflib.get_close_matches(word, known, n=1)
    hint = f"did you mean {near[0]}? " if near else ""
    return f"{hint}expected one of {', '.join(known)}"


def _first(errors: Sequence[ErrorDetails], model: type[BaseModel]) -> str:
    """A misspelt key before the key that is missed because of it, else the first."""
    unknown = next((error for error in errors if error["type"] == "extra_forbidden"), None)
    first = errors[0] if unknown is None else unknown
    *tables, key = [str(part) for part in first["loc"]]
    name = ".".join((*tables, key))
    if unknown is None:
        return f"{name}: {first['msg']}, got {first['input']!r:.60}"
    return f"{name}: unknown key; {spelling_hint(key, _keys(model, tables))}"


def _keys(model: type[BaseModel], tables: Sequence[str]) -> list[str]:
    """Keys of a table inside ``model``."""
    for name in tables:
        if name.isdecimal():
            continue  # of one table among several of that name
        annotation = model.model_fields[name].annotation
        candidates: list[Any] = [annotation, *get_args(annotation)]
        model = next(c for c in candidates if isinstance(c, type) and issubclass(c, BaseModel))
    return list(model.model_fields)
