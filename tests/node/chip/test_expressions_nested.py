"""Expressions of each operator inside each other, in C beside Python: what binds tighter, and how wide a number is."""

import ctypes
import importlib.util
import random
from pathlib import Path
from typing import Any

import pytest
from chip_tools import needs_gcc, run_program

from node.translation.c_helpers import helpers_text
from node.translation.c_program import CProgram
from node.translation.c_structs import CStructs
from node.translation.kernel_source import integer_source
from node.translation.kinds_of_values import INTEGER, Plain

LEAVES = ("a", "b", "c", "3", "-7", "SIZE", "~5", "-SIZE", "(~2)")
ORDERS = ("<", "<=", ">", ">=", "==", "!=")
WHOLE, TRUE = 90, 50  # functions that give an integer, and a truth
NARROW = Plain("int32_t")


def integer(dice: random.Random, depth: int) -> str:
    if depth == 0:
        return dice.choice(LEAVES)
    kind = dice.randrange(13)
    one, other = integer(dice, depth - 1), integer(dice, depth - 1)
    if kind < 4:
        return f"({one}) {dice.choice('+-')} ({other})" if dice.random() < 0.4 else f"{one} {dice.choice('+-')} {other}"
    if kind < 6:
        return f"({one}) {dice.choice('&|^')} ({other})"
    if kind == 6:
        return f"{dice.choice('abc')} * {dice.choice(LEAVES)}"
    if kind == 7:
        return f"({one}) {dice.choice(('//', '%'))} {dice.choice(('8', '5', '-3', 'SIZE', '1'))}"
    if kind == 8:
        return f"{dice.choice('-~')}({one})"
    if kind == 9:
        return f"({one} if {truth(dice, depth - 1)} else {other})"
    if kind == 10:
        return f"{dice.choice(('min', 'max'))}({one}, {other}, abs({dice.choice(LEAVES)}))"
    if kind == 11:
        return f"(({one}) >> {dice.choice('0123')}) + ({dice.choice(LEAVES)} << {dice.choice('0123')})"
    return f"int({truth(dice, depth - 1)}) + int({truth(dice, depth - 1)})"


def truth(dice: random.Random, depth: int) -> str:
    kind = dice.randrange(8)
    if depth == 0 or kind < 2:
        return f"({integer(dice, depth)} {dice.choice(ORDERS)} {integer(dice, depth)})"
    one, other = truth(dice, depth - 1), truth(dice, depth - 1)
    if kind < 5:
        return f"({one} {dice.choice(('and', 'or'))} {other} {dice.choice(('and', 'or'))} {truth(dice, 0)})"
    if kind == 5:
        return f"(not {one})"
    if kind == 6:
        signs = dice.choice(("<", "<=")), dice.choice(("<", "<="))
        return f"({dice.choice(LEAVES)} {signs[0]} max(a, b) {signs[1]} {dice.choice(LEAVES)})"
    return f"({integer(dice, depth - 1)} in (1, a, {dice.choice(LEAVES)}))"


@pytest.fixture(scope="module")
def pairs(tmp_path_factory: pytest.TempPathFactory) -> list[tuple[str, Any, Any]]:
    """Text of each expression, its function in Python and that in C."""
    folder, dice = tmp_path_factory.mktemp("nested"), random.Random(109)
    texts = [integer(dice, 3) for _ in range(WHOLE)] + [f"int({truth(dice, 3)})" for _ in range(TRUE)]
    texts += ["c * c", "c * 100003", "-c * c", "c - (b - a)", "c - (b + a)", "a - (b - c) * 2", "(c & 255) * c"]
    bodies = [f"def found_{k}(a, b, c):\n    return {text}\n" for k, text in enumerate(texts)]
    module = load(folder / "nested_kernels.py", "SIZE = 16\n\n" + "\n".join(bodies))
    program = CProgram(CStructs())
    for k in range(len(texts)):
        source = integer_source(getattr(module, f"found_{k}"))
        program.write(source, (INTEGER, INTEGER, NARROW), f"c_{k}", static="")
    functions = "\n".join(program.texts)
    head = "#include <stdbool.h>\n#include <stdint.h>\n"
    (folder / "t.c").write_text("\n".join([head, helpers_text(functions), program.constants_text(), functions]))
    options = ("-std=c99", "-O1", "-Wparentheses", "-Wshift-overflow", "-Werror", "-shared", "-fPIC")
    done = run_program("gcc", *options, "t.c", "-o", "t.so", folder=folder)
    assert done.returncode == 0, done.stderr
    library = ctypes.CDLL(str(folder / "t.so"))
    found = []
    for k, text in enumerate(texts):
        in_c = getattr(library, f"c_{k}")
        in_c.restype, in_c.argtypes = ctypes.c_int64, (ctypes.c_int64, ctypes.c_int64, ctypes.c_int32)
        found.append((text, getattr(module, f"found_{k}"), in_c))
    return found


def load(path: Path, text: str) -> Any:
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@needs_gcc
def test_expressions_inside_each_other_give_in_c_what_they_give_in_python(pairs: list[tuple[str, Any, Any]]) -> None:
    dice = random.Random(5)
    edges = [(a, b, c) for a in (-16, -1, 0, 3) for b in (-7, 0, 1, 16) for c in (-100_000, -3, 0, 7, 100_000)]
    drawn = [(dice.randint(-40, 40), dice.randint(-40, 40), dice.randint(-100_000, 100_000)) for _ in range(60)]
    for text, in_python, in_c in pairs:
        for given in (*edges, *drawn):
            assert in_c(*given) == in_python(*given), (text, given)
