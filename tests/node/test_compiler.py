"""What is used of numba beyond its documented interface does what we take it to do, in the numba that is installed.

tests/test_installation.py runs this file with the lowest that pyproject.toml allows as well.
"""

from __future__ import annotations

import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numba.core.errors import NumbaError

from node.kernels.arithmetic.compiler import COUNTED, ByAddress
from node.kernels.arithmetic.formats import RATE_Q
from node.kernels.arithmetic.jit import compile_function
from node.kernels.arithmetic.operations import by_type
from node.kernels.arithmetic.quantity import NONE, rate_quantity

ROOT = Path(__file__).parents[2]
PRIVATE = re.compile(r"^\s*(?:from|import)\s+numba\.(?!extending)", re.MULTILINE)
LIMIT = rate_quantity(0.5)
WHOLE = 1 << RATE_Q
KEPT = """
from node.kernels.arithmetic.compiler import leave_blas_out
leave_blas_out()
import sys
from node.kernels.arithmetic.integers import rounded_shift
rounded_shift(8, 1)
stats = rounded_shift.stats
print(sum(stats.cache_misses.values()), sum(stats.cache_hits.values()), "scipy.linalg" in sys.modules)
"""


def unkept(function: Any, **options: Any) -> Any:
    """Compile a function of a test, which is not kept."""
    return compile_function(function, cache=False, **options)


@unkept
def held_at(a: float) -> float:
    """A rate, held at a constant."""
    return min(max(a, -1 * LIMIT), LIMIT)


@unkept
def or_none(a: float) -> float:
    """A rate, or no number beyond a constant."""
    return a if a < LIMIT else NONE


def test_a_constant_takes_the_form_of_what_it_meets() -> None:
    assert [or_none(0.25), or_none(WHOLE // 4)] == [0.25, WHOLE // 4]
    assert math.isnan(or_none(2.0))
    assert or_none(2 * WHOLE) == NONE.fixed


def test_the_least_and_the_largest_take_constants() -> None:
    assert unkept(lambda a: min(a, LIMIT))(2.0) == 0.5
    assert unkept(lambda a: max(LIMIT, a))(WHOLE) == WHOLE
    assert unkept(lambda a: min(a, LIMIT))(WHOLE) == WHOLE // 2


def test_python_hands_a_constant_over_as_the_float_that_it_is() -> None:
    assert unkept(lambda a: a * 2.0)(LIMIT) == 1.0


@by_type(lambda a: a >> 1)
def halved(a: float) -> float:
    """Half of it."""
    return 0.5 * a


def test_a_function_is_taken_by_the_types_of_its_arguments() -> None:
    found = unkept(lambda a: halved(a))  # noqa: PLW0108  numba takes what is called, not what is compiled
    assert [found(3.0), found(3)] == [1.5, 1]
    assert isinstance(found(3), int)


def test_a_function_is_called_by_its_address() -> None:
    counts = np.zeros(1)
    called = ByAddress(unkept(count_up, no_cfunc_wrapper=False), counts, 1.0)

    def twice(function: Any, counts: Any) -> float:
        return float(function(counts, 1.0) + function(counts, 2.0))

    assert unkept(twice)(called, counts) == 1.0 + 3.0
    assert counts[0] == 3.0


def count_up(counts: Any, by: float) -> float:
    """Count up, in place."""
    counts[0] += by
    return float(counts[0])


def test_a_shared_body_is_given_kernels() -> None:
    double = unkept(lambda a: 2.0 * a)
    body = unkept(apply_twice, inline="always")
    assert unkept(lambda a: body(double, a))(3.0) == 12.0


def apply_twice(function: Any, a: float) -> float:
    """Apply it to what it gives."""
    return float(function(function(a)))


@pytest.mark.slow
def test_a_kernel_is_kept_by_its_sources_and_loaded_without_linear_algebra(tmp_path: Path) -> None:
    surroundings = {name: value for name, value in os.environ.items() if not name.startswith("NUMBA")}
    surroundings |= {"XDG_CACHE_HOME": str(tmp_path)}
    command = [sys.executable, "-c", KEPT]
    said = [
        subprocess.run(command, env=surroundings, cwd=ROOT, capture_output=True, text=True, check=True).stdout
        for _ in range(2)
    ]
    assert said == ["1 0 False\n", "0 1 False\n"]
    assert {path.name for path in tmp_path.glob("borechain/kernels-*/*")} == {"node.kernels.arithmetic.integers"}


def test_a_kernel_holds_no_code_for_callers_in_c_unless_it_is_an_entry() -> None:
    def plain(a: float) -> float:
        return 2.0 * a

    for made, holds in ((unkept(plain), False), (unkept(plain, no_cfunc_wrapper=False), True)):
        made(1.0)
        (code,) = made.inspect_llvm().values()
        assert ("cfunc." in code) is holds


def test_a_kernel_counts_no_references_and_makes_no_array() -> None:
    def make_sum(numbers: Any) -> float:
        made = np.zeros(3)
        made[:] = numbers
        return float(made[0] + made[1] + made[2])

    def move_down(numbers: Any) -> None:
        numbers[:2] = numbers[1:]

    def first_of(numbers: Any) -> float:
        rest = numbers[1:]
        return float(rest[0] if numbers[0] < 0.0 else numbers[0])

    numbers = np.arange(1.0, 4.0)
    for options, counts in (({}, False), (COUNTED, True)):
        made = unkept(first_of, **options)
        assert made(numbers) == 1.0
        (code,) = made.inspect_llvm().values()
        assert ("@NRT_" in code) is counts
    assert unkept(make_sum, **COUNTED)(numbers) == 6.0
    for refused in (make_sum, move_down):
        with pytest.raises(NumbaError, match=r"array passed into the function|NRT required"):
            unkept(refused)(numbers)


def test_no_other_file_of_ours_leans_on_private_modules() -> None:
    folders = ("benchmarks", "borechain", "groundstation", "node", "sim", "telemetry")
    files = [path for folder in folders for path in (ROOT / folder).rglob("*.py")]
    found = {str(path.relative_to(ROOT)) for path in files if PRIVATE.search(path.read_text())}
    only_ahead = "borechain/drilling/whole_compilation.py"  # in processes that compile and end
    assert found == {"node/kernels/arithmetic/compiler.py", only_ahead}
