"""Each form of expression and statement in C beside Python itself; and what is not translated, by file and line."""

import ctypes
from collections.abc import Callable

import chip_kernels
import pytest
from chip_tools import needs_gcc, run_program
from hypothesis import given
from hypothesis import strategies as st

from node.kernels.record.integer_filter import FIXED_STATE
from node.translation.c_helpers import helpers_text
from node.translation.c_program import CProgram
from node.translation.c_structs import CStructs
from node.translation.kernel_source import UntranslatableKernelError, integer_source, python_function
from node.translation.kinds_of_values import INTEGER, RecordOf

PAIRS = ("divide_down", "shift_both", "bounded", "ordered_sum", "counted", "between", "own_truth")
small = st.integers(-(2**40), 2**40)
near = st.one_of(st.integers(-20, 20), small)


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    program, folder = CProgram(CStructs()), tmp_path_factory.mktemp("translated")
    for name in PAIRS:
        program.write(integer_source(getattr(chip_kernels, name)), (INTEGER, INTEGER), f"c_{name}", static="")
    program.write(integer_source(chip_kernels.divide_by_eight), (INTEGER,), "c_divide_by_eight", static="")
    functions = "\n".join(program.texts)
    head = "#include <stdbool.h>\n#include <stdint.h>\n"
    (folder / "t.c").write_text("\n".join([head, helpers_text(functions), program.constants_text(), functions]))
    options = ("-std=c99", "-O2", "-Wall", "-Wextra", "-Wconversion", "-Werror", "-shared", "-fPIC")
    done = run_program("gcc", *options, "t.c", "-o", "t.so", folder=folder)
    assert done.returncode == 0, done.stderr
    return ctypes.CDLL(str(folder / "t.so"))


def in_c(library: ctypes.CDLL, name: str, *numbers: int) -> int:
    function = getattr(library, f"c_{name}")
    function.restype = ctypes.c_bool if name == "own_truth" else ctypes.c_int64
    return int(function(*map(ctypes.c_int64, numbers)))


def in_python(name: str) -> Callable[..., int]:
    return python_function(getattr(chip_kernels, name))


@needs_gcc
@given(a=near, b=near.filter(bool))
def test_quotients_and_remainders_go_down(library: ctypes.CDLL, a: int, b: int) -> None:
    assert in_c(library, "divide_down", a, b) == in_python("divide_down")(a, b)
    assert in_c(library, "divide_by_eight", a) == in_python("divide_by_eight")(a)


@needs_gcc
@given(a=st.integers(-(2**30), 2**30), places=st.integers(0, 31))
def test_shifts_keep_the_sign(library: ctypes.CDLL, a: int, places: int) -> None:
    assert in_c(library, "shift_both", a, places) == in_python("shift_both")(a, places)


@needs_gcc
@pytest.mark.parametrize("name", ["bounded", "ordered_sum", "counted", "between", "own_truth"])
@given(a=near, b=st.one_of(st.integers(-20, 20), st.integers(-(2**30), 2**30)))
def test_statements_do_what_python_does(library: ctypes.CDLL, name: str, a: int, b: int) -> None:
    python = in_python(name)
    inner = {"bounded": python_function(chip_kernels.bounded)}
    python = type(python)(python.__code__, python.__globals__ | inner)  # without numba
    assert in_c(library, name, a, b) == python(a, b)


@pytest.mark.parametrize(
    ("name", "kinds", "said"),
    [
        ("uses_float", (INTEGER,), "chips count in integers: 0.5"),
        ("adds_unsigned", (RecordOf(FIXED_STATE),), "int() around one of two unsigned numbers"),
        ("two_kinds", (RecordOf(FIXED_STATE), INTEGER), "expected one kind for a variable"),
    ],
)
def test_what_c_would_do_otherwise_is_refused(name: str, kinds: tuple, said: str) -> None:
    source = integer_source(getattr(chip_kernels, name))
    with pytest.raises(UntranslatableKernelError) as refused:
        CProgram(CStructs()).write(source, kinds, name)
    assert said in str(refused.value)
    line = python_function(getattr(chip_kernels, name)).__code__.co_firstlineno
    assert f"chip_kernels.py:{line + (4 if name == 'two_kinds' else 2)}: " in str(refused.value)
