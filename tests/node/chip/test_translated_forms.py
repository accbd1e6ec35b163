"""Each form in C as it was read and approved, character by character; and each that is refused with its line.

What the C does is compared with Python where it runs, here for loops and in ``test_translation.py`` for the rest. After
a change that is meant, run this file with ``.venv/bin/python`` and ``PYTHONPATH=tests/node:tests/tools:.``; the
difference is read like code.
"""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
import translated_forms
from chip_tools import needs_gcc, run_program

from node.kernels.record.integer_filter import FIXED_STATE
from node.translation.c_helpers import helpers_text
from node.translation.c_program import CProgram
from node.translation.c_structs import CStructs
from node.translation.kernel_source import UntranslatableKernelError, integer_source, python_function
from node.translation.kinds_of_values import INTEGER, ArrayOf, RecordOf

APPROVED = Path(__file__).parents[2] / "data" / "translated_forms.c"
VALUES = ArrayOf(INTEGER, (5,))
REFUSALS = """\
loops_pairs: expected a loop over one name: for j, k in ((0, 1), (2, 0)):
says_float: expected a whole number, for chips count in integers: 0.5
says_word: expected a whole number, for chips count in integers: 'word'
names_float: expected integers, a table of them or a kernel, got float: HALF
names_nothing: expected a name that is known: missing
names_dict: expected integers, a table of them or a kernel, got dict: NAMES
divides: expected integers and an operator of theirs: a / 2
raises_unknown: expected a power that is known: 2 ** a
orders_down: expected a number between two: 5 > scaled_by(a, 1) > 1
looks_among: expected a number among several that stand in the source: a in a
names_argument: expected arguments by their place: scaled_by(a, places=1)
calls_number: expected a kernel to call: a(1)
calls_builtin: expected int, bool, abs, min or max: sum(a, a)
calls_short: expected 2 arguments of scaled_by, got 1
calls_itself: expected no function that calls itself: calls_itself
reads_field: expected a field of a record: a.field
reads_element: expected an element of an array: a[0]
reads_length: expected the length of an array: a.shape[0]
loops_else: expected a loop without else: while a > 0:
loops_wide: expected a step of 1 or -1: for k in range(0, a, 2):
loops_array: expected a loop over a range: for k in a:
parts_three: expected 3 values, got 2: b, c, d = two_of(a, a)
keeps_function: expected a value: other = scaled_by
asserts: expected what C has too, got Assert: assert a
lists: expected what C has too, got ListComp: [b + a for b in (1, 2)]
negates_several: expected an integer: -two_of(a, a)
compares_several: expected numbers to compare: two_of(a, a) < a
chooses_two_kinds: expected two of one kind: a if a > 0 else two_of(a, a)
asks_several: expected a number or a truth: two_of(a, a)
""".splitlines()


def program_of_forms() -> CProgram:
    """Every form, with what each calls."""
    program = CProgram(CStructs())
    for function in translated_forms.PLAIN:
        program.write(integer_source(function), (INTEGER, INTEGER), f"c_{function.__name__}", static="")
    program.write(integer_source(translated_forms.walked_over), (VALUES, INTEGER), "c_walked_over", static="")
    program.write(integer_source(translated_forms.stored_in), (RecordOf(FIXED_STATE), INTEGER), "c_stored_in")
    return program


def text_of(program: CProgram) -> str:
    """Constants and functions."""
    return "\n".join([program.constants_text(), *program.texts])


def test_each_form_is_the_c_that_was_approved() -> None:
    assert text_of(program_of_forms()) == APPROVED.read_text(encoding="utf-8")


def test_each_form_that_c_has_not_is_refused_with_its_line() -> None:
    said = []
    for function in translated_forms.REFUSED:
        plain = python_function(function)
        with pytest.raises(UntranslatableKernelError) as refused:
            CProgram(CStructs()).write(integer_source(function), (INTEGER,), "c_refused")
        place, _, why = str(refused.value).partition(": ")
        path, _, line = place.rpartition(":")
        assert path.endswith("translated_forms.py")
        assert plain.__code__.co_firstlineno <= int(line) <= plain.__code__.co_firstlineno + 3, plain.__name__
        said.append(f"{plain.__name__}: {why.splitlines()[0]}")
    assert said == REFUSALS


@needs_gcc
@pytest.mark.parametrize("first", [0, 3, 1 << 39])
def test_loops_do_in_c_what_they_do_in_python(tmp_path: Path, first: int) -> None:
    program = CProgram(CStructs())
    program.write(integer_source(translated_forms.walked_over), (VALUES, INTEGER), "c_walked_over", static="")
    text = text_of(program)
    head = "#include <stdbool.h>\n#include <stdint.h>\n"
    (tmp_path / "t.c").write_text(head + helpers_text(text) + text)
    options = ("-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC")
    done = run_program("gcc", *options, "t.c", "-o", "t.so", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    walked = ctypes.CDLL(str(tmp_path / "t.so")).c_walked_over
    walked.restype = ctypes.c_int64
    numbers = (2, -7, 11, 1 << 33, -13)
    found = walked((ctypes.c_int64 * 5)(*numbers), ctypes.c_int64(first))

    class Numbers(tuple):
        shape = (5,)

    assert found == python_function(translated_forms.walked_over)(Numbers(numbers), first)


if __name__ == "__main__":
    APPROVED.write_text(text_of(program_of_forms()), encoding="utf-8")
