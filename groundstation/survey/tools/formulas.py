"""Weighting functions as text, compiled: the formulas of an instrument model become one function without repeats.

The text is that of the ISCWSA tool files: numbers, names, + - * / ^, parentheses and the functions below, in any case.
Every formula of a tool is parsed, checked against these lists and written into one straight-line function in which a
common part is computed once; it runs on whole wells (``numpy``) or, written into a loop, compiled.
"""

from __future__ import annotations

import ast
import math
import sys
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from types import SimpleNamespace
from typing import Any

import numpy as np

from groundstation.errors import ToolError

VARIABLES = (
    "MD", "MDPrev", "TVD", "Inc", "IncPrev", "Az", "AzPrev", "AzT", "AzTPrev", "AzM", "AzMPrev",
    "GField", "BField", "Dip", "Latitude", "EarthRate", "Time", "TimePrev",
    "SigmaYaw", "SigmaSystematic", "SigmaForce", "Readings", "Previous",
)  # fmt: skip
CONSTANTS = {"pi": math.pi, "rad": math.pi / 180.0}
FUNCTIONS = {"sin": 1, "cos": 1, "tan": 1, "sqrt": 1, "sqr": 1, "abs": 1, "max": 2, "min": 2, "step": 1}
OPERATORS: dict[type[ast.operator], str] = {ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Pow: "**"}
ROOTS = {0.5: 1, 0.25: 2}  # exponents that are roots of roots
LONGEST = 2000  # characters; an instrument's formula has a line

ARRAY = SimpleNamespace(
    sin=np.sin, cos=np.cos, tan=np.tan, sqrt=np.sqrt, abs=np.abs, max=np.maximum, min=np.minimum,
    step=lambda x: np.where(x > 0.0, 1.0, 0.0),
)  # fmt: skip

Compiled = Callable[[Any, Sequence[Any]], list[Any]]


class _Writer:
    """Collects assignments; equal parts share one."""

    def __init__(self, names: dict[str, str], parameters: Sequence[str]) -> None:
        self._parameters = parameters
        self.lines: list[str] = []
        self.used: set[str] = set()
        self._names = names
        self._known: dict[str, str] = {}

    def value(self, node: ast.expr) -> str:
        """Token that holds the value of a node: a number, an input or a local."""
        match node:
            case ast.Constant(value=(int() | float()) as number) if not isinstance(number, bool):
                return _finite(number)
            case ast.Name():
                return self._name(node.id)
            case ast.UnaryOp(op=ast.USub()):
                return self._operation("-", self.value(node.operand))
            case ast.UnaryOp(op=ast.UAdd()):
                return self.value(node.operand)
            case ast.BinOp() if type(node.op) in OPERATORS:
                return self._operation(OPERATORS[type(node.op)], self.value(node.left), self.value(node.right))
            case ast.Call(func=ast.Name(id=function), keywords=[]):
                return self._call(function.lower(), [self.value(argument) for argument in node.args])
        raise ToolError(f"expected numbers, names, + - * / ^ and functions, got {ast.unparse(node)!r}")

    def _name(self, name: str) -> str:
        if name.lower() in CONSTANTS:
            return _token(CONSTANTS[name.lower()])
        known = self._names.get(normalise_name(name))
        if known is None:
            own = ", ".join(self._parameters) or "it has none"
            raise ToolError(
                f"unknown name {name}; expected one of {', '.join(VARIABLES)} or a parameter of the tool ({own})"
            )
        self.used.add(known)
        return known

    def _operation(self, operator: str, *parts: str) -> str:
        numbers = [_number(part) for part in parts]
        if all(number is not None for number in numbers):
            return self._folded(operator, [number for number in numbers if number is not None])
        if operator == "**" and numbers[1] in ROOTS:
            return self._power(parts[0], ROOTS[numbers[1]])
        return self._local(f"-{parts[0]}" if len(parts) == 1 else f"{parts[0]} {operator} {parts[1]}")

    def _power(self, base: str, roots: int) -> str:
        """A power that roots give faster."""
        for _ in range(roots):
            base = self._call("sqrt", [base])
        return base

    @staticmethod
    def _folded(operator: str, numbers: list[float]) -> str:
        text = f"{operator}({numbers[0]!r})" if len(numbers) == 1 else f"({numbers[0]!r}) {operator} ({numbers[1]!r})"
        try:
            result = eval(text, {"__builtins__": {}})
            return _finite(result)
        except (ArithmeticError, TypeError) as error:
            raise ToolError(f"{text}: {error}") from None

    def _call(self, function: str, arguments: list[str]) -> str:
        if function not in FUNCTIONS:
            raise ToolError(f"unknown function {function}; expected one of {', '.join(FUNCTIONS)}")
        if len(arguments) != FUNCTIONS[function]:
            raise ToolError(f"{function}: expected {FUNCTIONS[function]} values, got {len(arguments)}")
        function = "sqrt" if function == "sqr" else function
        self.used.add(f"_{function}")
        return self._local(f"_{function}({', '.join(arguments)})")

    def _local(self, text: str) -> str:
        if text not in self._known:
            self._known[text] = f"t{len(self._known)}"
            self.lines.append(f"{self._known[text]} = {text}")
        return self._known[text]


def _finite(number: float) -> str:
    """Token of a number.

    Raises
    ------
    ToolError
        When it is beyond what a float holds.
    """
    if isinstance(number, complex):
        raise ToolError("expected numbers in a formula, got a complex one")
    if not abs(number) <= sys.float_info.max:
        raise ToolError("expected finite numbers in a formula, got a larger one")
    return _token(float(number))


def _token(number: float) -> str:
    """A negative number in parentheses, for ``-1.0 ** x`` is not ``(-1.0) ** x``."""
    return repr(number) if number >= 0.0 else f"({number!r})"


def _number(token: str) -> float | None:
    try:
        return float(token.strip("()"))
    except ValueError:
        return None


def normalise_name(name: str) -> str:
    """A name as formulas compare it: published files write gxy_running_speed and GXYRunningSpeed."""
    return name.lower().replace("_", "")


def parse_formula(text: str) -> ast.expr:
    """Tree of one formula.

    Raises
    ------
    ToolError
        When the text is not a formula.
    """
    if len(text) > LONGEST:
        raise ToolError(f"expected a formula of at most {LONGEST} characters, got {len(text)}")
    try:
        return ast.parse(text.strip().replace("^", "**"), mode="eval").body
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        raise ToolError(f"expected a formula, got {text!r:.80}") from None


@lru_cache(maxsize=4096)
def is_zero(text: str) -> bool:
    """Whether a formula is the number 0."""
    return _number(text) == 0.0


@dataclass(frozen=True, slots=True)
class Program:
    """Formulas as straight-line code: assignments in order, then the token that holds each result.

    ``inputs`` are the places, in ``VARIABLES`` and then the parameters, of the locals ``v0``, ``v1``, ... that the code
    reads, ``functions`` the names it calls, with an underscore before.
    """

    lines: list[str]
    results: list[str]
    inputs: list[int]
    functions: list[str]


def translate_formulas(formulas: Iterable[str], parameters: Sequence[str] = ()) -> Program:
    """Code of many formulas in which a common part is computed once.

    Raises
    ------
    ToolError
        With the formula that cannot be translated.
    """
    names = {normalise_name(name): f"v{k}" for k, name in enumerate([*VARIABLES, *parameters])}
    writer = _Writer(names, parameters)
    results = []
    for text in formulas:
        try:
            results.append(writer.value(parse_formula(text)))
        except (ToolError, RecursionError) as error:
            reason = str(error) if isinstance(error, ToolError) else "expected fewer operations within each other"
            raise ToolError(f"formula {text!r:.80}: {reason}") from None
    inputs = sorted(int(token[1:]) for token in writer.used if token.startswith("v"))
    return Program(writer.lines, results, inputs, sorted(token for token in writer.used if token.startswith("_")))


def compile_formulas(formulas: Iterable[str], parameters: Sequence[str] = ()) -> Compiled:
    """One function ``f(m, inputs)`` for many formulas.

    ``m`` holds the functions, as ``ARRAY`` does; ``inputs`` are the values of ``VARIABLES`` and then of the
    ``parameters``; it returns one value a formula (a plain float where the formula is constant).

    Raises
    ------
    ToolError
        With the formula that cannot be compiled.
    """
    program = translate_formulas(formulas, parameters)
    head = [f"{function} = m.{function[1:]}" for function in program.functions]
    taken = [f"v{k} = inputs[{k}]" for k in program.inputs]
    body = [*head, *taken, *program.lines, f"return [{', '.join(program.results)}]"]
    source = "def f(m, inputs):\n" + "\n".join(f"    {line}" for line in body)
    space: dict[str, Any] = {}
    exec(compile(source, "<formulas>", "exec"), space)
    compiled: Compiled = space["f"]
    return compiled
