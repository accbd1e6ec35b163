"""Where the source of a kernel stands: its tree, its names, and what is taken in its place for integers.

The tree is read of the file that Python imported, so nothing of the kernels is written twice. A function that numba
takes by type (``by_type``, ``by_record``, ``taken_where``) is what its decorator names for integers.
"""

from __future__ import annotations

import ast
import functools
import inspect
import textwrap
from collections.abc import Callable
from pathlib import Path
from typing import Any, Final, NamedTuple

from node.errors import NodeConfigurationError

INTEGERS_AT: Final = {"by_type": 0, "by_record": 0, "taken_where": 1}  # argument of a decorator that serves integers


class UntranslatableKernelError(NodeConfigurationError):
    """A kernel says what C is not made of here; the message names file and line."""


class KernelSource(NamedTuple):
    """One function of a kernel, as it is to be translated.

    Attributes
    ----------
    name : of the function that callers name
    names : what its module knows
    arguments : names of its arguments
    body : its statements, without the docstring
    summary : first line of its docstring
    place : file, below the package's folder, and line
    """

    name: str
    names: dict[str, Any]
    arguments: tuple[str, ...]
    body: list[ast.stmt]
    summary: str
    place: str


def python_function(function: Any) -> Callable[..., Any]:
    """Python's function inside what numba made of it."""
    return getattr(function, "py_func", function)  # type: ignore[no-any-return]


@functools.cache
def integer_source(function: Callable[..., Any]) -> KernelSource:
    """Source of what a kernel of integers runs where it names ``function``.

    Raises
    ------
    UntranslatableKernelError
        When there is no source of it.
    """
    plain = python_function(function)
    tree, place = _tree_of(plain)
    taken = _taken_for_integers(tree)
    if taken is None:
        return _of_function(tree, plain, place)
    if isinstance(taken, ast.Lambda):
        returned = ast.copy_location(ast.Return(taken.body), taken)
        names = tuple(argument.arg for argument in taken.args.args)
        return KernelSource(tree.name, plain.__globals__, names, [returned], _summary(tree), place)
    found = eval(compile(ast.Expression(taken), place, "eval"), plain.__globals__)
    return integer_source(python_function(found))._replace(name=tree.name)


def _tree_of(plain: Callable[..., Any]) -> tuple[ast.FunctionDef, str]:
    try:
        lines, first = inspect.getsourcelines(plain)
    except (OSError, TypeError) as error:
        raise UntranslatableKernelError(
            f"{plain!r}: expected a function with a source, got one without ({error})"
        ) from None
    tree = ast.parse(textwrap.dedent("".join(lines))).body[0]
    if not isinstance(tree, ast.FunctionDef):
        raise UntranslatableKernelError(f"{plain!r}: expected a function, got {type(tree).__name__}")
    ast.increment_lineno(tree, first - 1)
    parts = Path(inspect.getfile(plain)).parts[-4:]
    inside = parts[parts.index("node") :] if "node" in parts else parts  # whatever folder holds the package
    return tree, f"{'/'.join(inside)}:{tree.lineno}"


def _taken_for_integers(tree: ast.FunctionDef) -> ast.expr | None:
    for decorator in tree.decorator_list:
        if isinstance(decorator, ast.Call) and isinstance(decorator.func, ast.Name):
            at = INTEGERS_AT.get(decorator.func.id)
            if at is not None:
                return decorator.args[at]
    return None


def _of_function(tree: ast.FunctionDef, plain: Callable[..., Any], place: str) -> KernelSource:
    body = tree.body[1:] if ast.get_docstring(tree) is not None else tree.body
    names = tuple(argument.arg for argument in tree.args.args)
    return KernelSource(tree.name.lstrip("_"), plain.__globals__, names, body, _summary(tree), place)


def _summary(tree: ast.FunctionDef) -> str:
    return (ast.get_docstring(tree) or "").partition("\n")[0]
