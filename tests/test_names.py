"""Names: a class and a module mean one thing in all packages, and a module's function says more than one word.

Each exception stands here with its reason, and goes from here as soon as it is one no longer.
"""

from __future__ import annotations

import ast
import itertools
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGES = ("borechain", "groundstation", "node", "sim", "telemetry")
MOST_WORDS = 60  # one-word names of functions that may stay

CLASSES: dict[str, str] = {}
MODULES = {
    "cycle": "the two forms of the filter, alike by contract",
    "errors": "one tree of errors a package",
    "figure": "one a study, by the contract of a study",
    "fixed_lag": "the two forms of the filter, alike by contract",
    "propagation": "the two forms of the filter, alike by contract",
    "run": "one a study, by the contract of a study",
    "strapdown": "the two forms of the filter, alike by contract",
    "update": "the two forms of the filter, alike by contract",
}
FUNCTIONS = {
    "arcsine": "the name of the function in mathematics",
    "arctangent": "the name of the function in mathematics",
    "calibrate": "a verb of the public API of notebooks",
    "dogleg": "the field's term for the angle between two directions",
    "drill": "a verb of the public API of notebooks",
    "kernel": "the decorator that makes one, read as a word at each",
    "load": "a verb of the public API of notebooks",
    "main": "entry point of a program, the name that tools look for",
    "quantile": "the name of the function in statistics",
    "query": "a verb of the public API of notebooks",
    "replay": "a verb of the public API of notebooks",
    "scenarios": "a verb of the public API of notebooks",
    "sinc": "the name of the function in mathematics",
    "survey": "a verb of the public API of notebooks",
    "wall": "a verb of the public API of notebooks",
}


@dataclass(frozen=True, slots=True)
class Named:
    """What a module declares at its top: a class, or a function that is no command."""

    name: str
    place: str  # module and line
    is_class: bool


@cache
def modules() -> dict[Path, list[Named]]:
    """What every module of product code declares; their trees would be a million objects of every worker."""
    paths = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
    return {path.relative_to(ROOT): list(declared(path)) for path in paths}


def declared(path: Path) -> Iterator[Named]:
    """Classes and functions of a module."""
    for node in ast.parse(path.read_text()).body:
        place = f"{path.relative_to(ROOT)}:{node.lineno}"
        if isinstance(node, ast.ClassDef):
            yield Named(node.name, place, is_class=True)
        elif isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and not is_command(node):
            yield Named(node.name, place, is_class=False)


def places_of(*, classes: bool) -> dict[str, list[str]]:
    """Where each class, or each function, of a name stands."""
    places = defaultdict(list)
    for one in itertools.chain.from_iterable(modules().values()):
        if one.is_class == classes:
            places[one.name].append(one.place)
    return places


def is_command(function: ast.FunctionDef | ast.AsyncFunctionDef) -> bool:
    """Whether click names a command after it."""
    called = (d.func if isinstance(d, ast.Call) else d for d in function.decorator_list)
    return any(isinstance(d, ast.Attribute) and d.attr in ("command", "group") for d in called)


def one_word_functions() -> dict[str, list[str]]:
    """Public functions of modules whose name is one word, with where they stand."""
    return {name: places for name, places in places_of(classes=False).items() if "_" not in name}


def repeated(places: dict[str, list[str]]) -> dict[str, list[str]]:
    return {name: found for name, found in places.items() if len(found) > 1}


def test_a_class_name_means_one_thing() -> None:
    taken = repeated(places_of(classes=True))
    assert {name: found for name, found in taken.items() if name not in CLASSES} == {}
    assert CLASSES.keys() <= taken.keys(), "a reason whose name is unique by now"


def test_a_module_name_means_one_thing() -> None:
    places = defaultdict(list)
    for path in modules():
        if path.stem not in ("__init__", "__main__"):
            places[path.stem].append(str(path))
    taken = repeated(places)
    assert {name: found for name, found in taken.items() if name not in MODULES} == {}
    assert MODULES.keys() <= taken.keys(), "a reason whose name is unique by now"


def test_a_function_says_more_than_one_word() -> None:
    found = one_word_functions()
    assert {name: places for name, places in found.items() if name not in FUNCTIONS} == {}
    assert FUNCTIONS.keys() <= found.keys(), "a reason whose function is gone"
    assert sum(map(len, found.values())) <= MOST_WORDS


def test_every_exception_has_its_reason() -> None:
    reasons = [*CLASSES.values(), *MODULES.values(), *FUNCTIONS.values()]
    assert all(len(reason.split()) >= 3 for reason in reasons)
