"""Formulas of instrument models: what they mean, that numbers and wells agree, and what is no formula."""

import ast
import math
import operator
from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from groundstation.errors import ToolError
from groundstation.survey.tools.formulas import ARRAY, FUNCTIONS, VARIABLES, compile_formulas, is_zero, parse_formula

SCALAR = SimpleNamespace(  # the same functions of plain numbers
    sin=math.sin, cos=math.cos, tan=math.tan, sqrt=math.sqrt, abs=abs, max=max, min=min,
    step=lambda x: 1.0 if x > 0.0 else 0.0,
)  # fmt: skip
VALUES = {name: 0.1 + 0.37 * k for k, name in enumerate(VARIABLES)}


def evaluated(text: str, parameters: dict[str, float] | None = None, **changed: float) -> float:
    parameters = parameters or {}
    inputs = [{**VALUES, **changed}[name] for name in VARIABLES] + list(parameters.values())
    (value,) = compile_formulas([text], tuple(parameters))(SCALAR, inputs)
    return float(value)


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("1", 1.0),
        ("1.5e-3", 1.5e-3),
        (".5", 0.5),
        (" 2 ", 2.0),
        ("1+2*3", 7.0),
        ("(1+2)*3", 9.0),
        ("8-3-2", 3.0),
        ("16/4/2", 2.0),
        ("2*3^2", 18.0),
        ("2**3", 8.0),
        ("2^-1", 0.5),
        ("-2^2", -4.0),
        ("(-2)^2", 4.0),
        ("0-2^2", -4.0),
        ("--3", 3.0),
        ("+3", 3.0),
        ("-(2+3)", -5.0),
        ("3--2", 5.0),
        ("2*-3", -6.0),
        ("(-8)^3", -512.0),
        ("pi", math.pi),
        ("180 * rad", math.pi),
        ("Sqrt(2)", math.sqrt(2.0)),
        ("Sqr(9)", 3.0),
        ("Abs(-2)", 2.0),
        ("Max(1, 2)", 2.0),
        ("Min(1, 2)", 1.0),
        ("Max(1, -Min(3, 4))", 1.0),
        ("Step(0)", 0.0),
        ("Step(1e-9)", 1.0),
        ("Step(-1)", 0.0),
        ("Tan(pi/4)", 1.0),
        ("Sin(pi/6) + Cos(pi/3)", 1.0),
    ],
)
def test_a_formula_of_numbers_has_its_value(text: str, expected: float) -> None:
    assert evaluated(text) == pytest.approx(expected, rel=1e-15)


@pytest.mark.parametrize(
    ("text", "value", "expected"),
    [
        ("Inc^2", -3.0, 9.0),
        ("-Inc^2", 3.0, -9.0),
        ("-Inc^2", -3.0, -9.0),
        ("(-Inc)^2", 3.0, 9.0),
        ("(-1)^Inc", 2.0, 1.0),
        ("-1^Inc", 2.0, -1.0),
        ("(-2)*Inc", 3.0, -6.0),
        ("1 - -Inc", 3.0, 4.0),
        ("Inc - -2", 3.0, 5.0),
        ("Inc^-1", 4.0, 0.25),
        ("Inc^0.25", 16.0, 2.0),
        ("2^Inc^2", 3.0, 512.0),
        ("Abs(Inc)", -3.0, 3.0),
        ("Step(Inc - 2)", 3.0, 1.0),
        ("Step(Inc - 4)", 3.0, 0.0),
    ],
)
def test_signs_and_powers_bind_as_on_paper(text: str, value: float, expected: float) -> None:
    assert evaluated(text, Inc=value) == pytest.approx(expected)


@pytest.mark.parametrize("name", VARIABLES)
def test_every_variable_has_its_own_value_in_any_case(name: str) -> None:
    for spelled in (name, name.lower(), name.upper()):
        assert evaluated(spelled) == VALUES[name]


def test_functions_and_constants_and_parameters_are_read_in_any_case() -> None:
    assert evaluated("SIN(inc) + sin(INC) + Sin(Inc)") == pytest.approx(3.0 * math.sin(VALUES["Inc"]))
    assert evaluated("PI + Pi") == pytest.approx(math.tau)
    assert evaluated("SPEED * speed", {"Speed": 3.0}) == 9.0


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Foo", "unknown name Foo; expected one of MD, MDPrev, .* or a parameter of the tool"),
        ("Sin(Foo)", "unknown name Foo"),
        ("Sin", "unknown name Sin"),
        ("Foo(Inc)", "unknown function foo; expected one of sin, cos"),
        ("asin(Inc)", "unknown function asin"),
        ("Sin()", "sin: expected 1 values, got 0"),
        ("Sin(Inc, MD)", "sin: expected 1 values, got 2"),
        ("Max(Inc)", "max: expected 2 values, got 1"),
        ("Min(Inc, MD, TVD)", "min: expected 2 values, got 3"),
        ("Sin(x=1)", "expected numbers, names"),
        ("Max(*Inc)", "expected numbers, names"),
        ("", "expected a formula, got ''"),
        ("  ", "expected a formula, got"),
        ("Inc +", "expected a formula, got"),
        ("(Inc", "expected a formula, got"),
        ("2 Inc", "expected a formula, got"),
        ("Inc = 2", "expected a formula, got"),
        ("Inc; MD", "expected a formula, got"),
        ("import os", "expected a formula, got"),
        ("Inc\x00", "expected a formula, got"),
        ("1 / 0", "division by zero"),
        ("(-8) ^ 0.5", "complex"),
        ("10 ^ 400", r"\(10\.0\) \*\* \(400\.0\)"),
        ("1" * 3000, "at most 2000 characters, got 3000"),
        ("1, 2", "expected numbers, names"),
        ("[1]", "expected numbers, names"),
        ("{}", "expected numbers, names"),
        ("'Inc'", "expected numbers, names"),
        ("b'x'", "expected numbers, names"),
        ("f'{Inc}'", "expected numbers, names"),
        ("1j", "expected numbers, names"),
        ("True", "expected numbers, names"),
        ("None", "expected numbers, names"),
        ("...", "expected numbers, names"),
        ("Inc.real", "expected numbers, names"),
        ("().__class__", "expected numbers, names"),
        ("Inc[0]", "expected numbers, names"),
        ("lambda: 1", "expected numbers, names"),
        ("(lambda x: x)(1)", "expected numbers, names"),
        ("[x for x in (1,)]", "expected numbers, names"),
        ("1 if Inc else 2", "expected numbers, names"),
        ("Inc and MD", "expected numbers, names"),
        ("Inc < MD", "expected numbers, names"),
        ("not Inc", "expected numbers, names"),
        ("~Inc", "expected numbers, names"),
        ("(Inc := 2)", "expected numbers, names"),
        ("Inc // MD", "expected numbers, names"),
        ("Inc % MD", "expected numbers, names"),
        ("Inc @ MD", "expected numbers, names"),
        ("1 << 2", "expected numbers, names"),
        ("__import__('os')", "expected numbers, names|unknown function"),
        ("open(1)", "unknown function open"),
        ("eval(1)", "unknown function eval"),
        ("print(Inc)", "unknown function print"),
        ("_sin(Inc)", "unknown function _sin"),
        ("m.sin(Inc)", "expected numbers, names"),
        ("inputs", "unknown name inputs"),
        ("m", "unknown name m"),
        ("v0", "unknown name v0"),
        ("t0", "unknown name t0"),
        ("Sin(Inc) + t0", "unknown name t0"),
        ("inf", "unknown name inf"),
        ("nan", "unknown name nan"),
    ],
)
def test_what_is_no_formula_is_refused_and_named(text: str, message: str) -> None:
    with pytest.raises(ToolError, match=message) as caught:
        compile_formulas([text])
    assert "formula" in str(caught.value)


@pytest.mark.parametrize(
    "text",
    [
        "1e999",
        "1e999 * Inc",
        "Inc + 1e308 * 10",
        "Inc * (1e308 + 1e308)",
        "0 * 1e999",
        "-1e999",
        "1e999 - 1e999",
        "9" * 400,
        "9" * 400 + " * Inc",
        "-" * 1900 + "1",
        "-" * 1900 + "Inc",
        "1" + "+1" * 990,
        "Inc" + "+Inc" * 490,
        "(" * 900 + "1" + ")" * 900,
        "Sin(" * 300 + "Inc" + ")" * 300,
    ],
    ids=lambda text: f"{text[:12]}...{len(text)}",
)
def test_a_formula_that_is_too_large_or_too_deep_has_a_value_or_is_refused(text: str) -> None:
    try:
        value = evaluated(text)
    except ToolError:
        return
    assert math.isfinite(value)


@given(st.one_of(st.text(max_size=40), st.text(alphabet="0123456789.eE+-*/^()SinIncMDx, '\"[]", max_size=40)))
@example("1e999")
@example("\ud800")
@example("0x1for x")
@example("1_0")
def test_random_text_is_a_formula_or_refused(text: str) -> None:
    try:
        compiled = compile_formulas([text])
    except ToolError:
        return
    inputs = [VALUES[name] for name in VARIABLES]
    try:
        (value,) = compiled(SCALAR, inputs)
    except (ArithmeticError, ValueError, TypeError):  # no value here, such as 1 / (Inc - Inc) or Step((-Inc)^0.5)
        return
    assert isinstance(value, float | complex | int)


Direct = Callable[[dict[str, float]], float]
OPERATORS: dict[str, Callable[[float, float], float]] = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
}
ONE: dict[str, Callable[[float], float]] = {
    "Sin": math.sin,
    "cos": math.cos,
    "ABS": abs,
    "Step": lambda x: 1.0 if x > 0.0 else 0.0,
}
TWO: dict[str, Callable[[float, float], float]] = {"Max": max, "min": min}


def leaf() -> st.SearchStrategy[tuple[str, Direct]]:
    def name(text: str) -> tuple[str, Direct]:
        return text, lambda values: values[text]

    def number(value: float) -> tuple[str, Direct]:
        return repr(value), lambda _: value

    return st.one_of(
        st.sampled_from(VARIABLES[:8]).map(name), st.floats(0.01, 9.0).map(number), st.just(("0", lambda _: 0.0))
    )


def grown(inner: st.SearchStrategy[tuple[str, Direct]]) -> st.SearchStrategy[tuple[str, Direct]]:
    def binary(sign: str, a: tuple[str, Direct], b: tuple[str, Direct]) -> tuple[str, Direct]:
        return f"({a[0]} {sign} {b[0]})", lambda values: OPERATORS[sign](a[1](values), b[1](values))

    def power(a: tuple[str, Direct], exponent: int) -> tuple[str, Direct]:
        return f"({a[0]})^{exponent}", lambda values: a[1](values) ** float(exponent)

    def minus(a: tuple[str, Direct]) -> tuple[str, Direct]:
        return f"-({a[0]})", lambda values: -a[1](values)

    def one(function: str, a: tuple[str, Direct]) -> tuple[str, Direct]:
        return f"{function}({a[0]})", lambda values: ONE[function](a[1](values))

    def two(function: str, a: tuple[str, Direct], b: tuple[str, Direct]) -> tuple[str, Direct]:
        return f"{function}({a[0]}, {b[0]})", lambda values: TWO[function](a[1](values), b[1](values))

    def root(a: tuple[str, Direct]) -> tuple[str, Direct]:
        return f"Sqrt(Abs({a[0]}))", lambda values: math.sqrt(abs(a[1](values)))

    return st.one_of(
        st.builds(binary, st.sampled_from(sorted(OPERATORS)), inner, inner),
        st.builds(power, inner, st.integers(0, 3)),
        st.builds(minus, inner),
        st.builds(one, st.sampled_from(sorted(ONE)), inner),
        st.builds(two, st.sampled_from(sorted(TWO)), inner, inner),
        st.builds(root, inner),
    )


TREES = st.recursive(leaf(), grown, max_leaves=15)


@pytest.mark.slow
@given(st.lists(TREES, min_size=1, max_size=4), st.lists(st.floats(-3.0, 3.0), min_size=24, max_size=24))
def test_numbers_and_wells_give_what_the_tree_gives(trees: list[tuple[str, Direct]], numbers: list[float]) -> None:
    rows = [dict(zip(VARIABLES, numbers[k:] + numbers[:k] + [0.5], strict=False)) for k in range(3)]
    try:
        expected = [[tree(row) for row in rows] for _, tree in trees]
        compiled = compile_formulas([text for text, _ in trees])
        scalar = [compiled(SCALAR, [row.get(name, 0.0) for name in VARIABLES]) for row in rows]
    except (ZeroDivisionError, OverflowError, ToolError):
        return  # both refuse to divide by zero: the next test
    inputs = [np.array([row.get(name, 0.0) for row in rows]) for name in VARIABLES]
    with np.errstate(all="ignore"):
        array = compiled(ARRAY, inputs)
    for k, row in enumerate(expected):
        np.testing.assert_allclose([values[k] for values in scalar], row, rtol=1e-12, atol=1e-300)
        np.testing.assert_allclose(np.broadcast_to(array[k], 3), row, rtol=1e-9, atol=1e-9)


@given(TREES)
def test_a_formula_refuses_only_when_its_tree_has_no_value(tree: tuple[str, Direct]) -> None:
    text, direct = tree
    values = {name: VALUES[name] for name in VARIABLES}
    try:
        expected = direct(values)
    except ArithmeticError:
        with pytest.raises((ArithmeticError, ToolError)):
            evaluated(text)
        return
    assert evaluated(text) == pytest.approx(expected, rel=1e-12, abs=1e-300)


class Counted:
    """Functions that count how often they are called."""

    def __init__(self) -> None:
        self.calls: list[str] = []

    def __getattr__(self, name: str) -> Callable[..., Any]:
        def call(*values: float) -> float:
            self.calls.append(name)
            return float(getattr(SCALAR, name)(*values))

        return call


def test_a_common_part_is_computed_once() -> None:
    formulas = ["Sin(Inc) * Cos(Az)", "Sin(Inc) * Sin(Az)", "cos(inc)", "-SIN(Inc) + Sin( Inc )", "Sin(Inc) * Cos(Az)"]
    counted = Counted()
    inputs = [VALUES[name] for name in VARIABLES]
    got = compile_formulas(formulas)(counted, inputs)
    assert sorted(counted.calls) == ["cos", "cos", "sin", "sin"]
    i, a = VALUES["Inc"], VALUES["Az"]
    expected = [math.sin(i) * math.cos(a), math.sin(i) * math.sin(a), math.cos(i), 0.0, math.sin(i) * math.cos(a)]
    np.testing.assert_allclose(got, expected, rtol=1e-15)


def test_parts_that_only_look_alike_are_not_shared() -> None:
    texts = ["Inc - MD", "MD - Inc", "Inc / MD", "MD / Inc", "Max(Inc, MD)", "Min(Inc, MD)", "Inc^2", "2^Inc"]
    i, md = 0.7, 2.0
    expected = [i - md, md - i, i / md, md / i, md, i, i**2, 2.0**i]
    inputs = [{**VALUES, "Inc": i, "MD": md}[name] for name in VARIABLES]
    np.testing.assert_allclose(compile_formulas(texts)(SCALAR, inputs), expected)


def test_a_constant_formula_is_a_number_for_wells_too() -> None:
    inputs = [np.full(5, VALUES[name]) for name in VARIABLES]
    assert compile_formulas(["2 * 3", "-1", "0"])(ARRAY, inputs) == [6.0, -1.0, 0.0]


def test_the_formula_that_is_wrong_is_named() -> None:
    with pytest.raises(ToolError, match=r"formula 'Inc \+ Wrong': unknown name Wrong"):
        compile_formulas(["Inc", "Inc + Wrong", "MD"])


@pytest.mark.parametrize(("text", "zero"), [("0", True), ("0.0", True), ("-0", True), ("1", False), ("Inc", False)])
def test_zero_is_told_from_anything_else(text: str, zero: bool) -> None:
    assert is_zero(text) is zero


def test_every_function_is_that_of_plain_numbers() -> None:
    for name in set(FUNCTIONS) - {"sqr"}:
        arguments = [0.3, 0.7][: FUNCTIONS[name]]
        one = getattr(SCALAR, name)(*arguments)
        many = getattr(ARRAY, name)(*(np.array([value]) for value in arguments))
        assert many[0] == pytest.approx(one, rel=1e-15)


def test_parsing_takes_the_longest_formula_that_is_allowed() -> None:
    assert isinstance(parse_formula("Inc" + " " * 1997), ast.Name)
    with pytest.raises(ToolError, match="at most 2000 characters, got 2001"):
        parse_formula("Inc" + " " * 1998)
