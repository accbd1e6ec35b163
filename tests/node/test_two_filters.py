"""The table of the two forms of the filter is what stands in their modules: every function and every argument."""

from __future__ import annotations

import ast
from itertools import chain
from pathlib import Path

import pytest

from node.kernels.filter.contract import ALONE, FORMATS, PAIRS, TwoForms

FILTER = Path(__file__).parents[2] / "node" / "kernels" / "filter"
MODULES = [*sorted(FILTER.glob("float64/*.py")), *sorted(FILTER.glob("fixed/*.py")), FILTER / "smoothing.py"]
ARRAYS = {"rate", "force", "down", "covariance", "row", "gain", "decay"}  # formats that may be of an array


def functions() -> dict[str, ast.FunctionDef]:
    """Every function of the two forms, by module and name."""
    return {
        f"{'.'.join(module.relative_to(FILTER).with_suffix('').parts)}.{node.name}": node
        for module in MODULES
        for node in ast.parse(module.read_text()).body
        if isinstance(node, ast.FunctionDef)
    }


FOUND = functions()


def arguments(takes: str) -> list[tuple[str, str]]:
    """Name and format of every argument of a line of the table."""
    parts = [argument.partition(":") for argument in takes.split()]
    return [(name, kind or name) for name, _, kind in parts]


def forms(pair: TwoForms) -> list[tuple[str, str, bool]]:
    """Place, arguments and whether it is in integers, of both forms."""
    return [
        (f"{pair.floats_in}.{pair.name}", pair.takes, False),
        (f"{pair.integers_in}.{pair.name}", pair.integers_take or pair.takes, True),
    ]


def types_of(kind: str, integers: bool) -> set[str]:
    """How an argument of a format may be annotated."""
    if kind in {"state", "config"}:
        return {"Any"}
    scalar = "int" if integers or FORMATS[kind].q is None else "float"
    return {scalar, "Array"} if kind in ARRAYS else {scalar}


def test_every_function_of_either_form_stands_in_the_table() -> None:
    named = [place for place, _, _ in chain.from_iterable(map(forms, PAIRS))]
    assert sorted([*named, *ALONE]) == sorted(FOUND)


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.name)
def test_both_forms_take_what_the_table_says(pair: TwoForms) -> None:
    for place, takes, integers in forms(pair):
        found, told = FOUND[place].args.args, arguments(takes)
        assert [argument.arg for argument in found] == [name for name, _ in told], place
        for argument, (name, kind) in zip(found, told, strict=True):
            assert argument.annotation is not None
            assert ast.unparse(argument.annotation) in types_of(kind, integers), f"{place} {name}"


@pytest.mark.parametrize("pair", PAIRS, ids=lambda pair: pair.name)
def test_both_forms_give_what_the_table_says(pair: TwoForms) -> None:
    for place, _, integers in forms(pair):
        returns = FOUND[place].returns
        assert returns is not None
        given = ast.unparse(returns)
        if pair.gives:
            assert given in types_of(pair.gives, integers) - {"Array"}, place
        else:
            assert given == "None" or place == "fixed.update.joseph_update", place  # which gives 1 / S to ``look_back``


def test_an_argument_that_is_told_alike_is_of_one_form_of_numbers() -> None:
    used = {kind for pair in PAIRS for _, takes, _ in forms(pair) for _, kind in arguments(takes)}
    assert used | {pair.gives for pair in PAIRS} - {""} == set(FORMATS)
