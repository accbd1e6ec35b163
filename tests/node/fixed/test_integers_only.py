"""No float in the integer step: the types and the compiled code of every function of it are read.

The step is all of ``integer_step`` and ``integer_aiding``: also an alignment with the fit at its end, and a static
record. Outside stands what reads the float64 record and shows it (``fixed_step``), and what Python orders on that
record.
"""

import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numba
import pytest

from node.kernels.step.fixed_node import warm_up
from node.kernels.step.fixed_step import integer_aiding, integer_step

INSPECTOR = """
import re, sys
import numba
from numba import types
from numba.core.dispatcher import Dispatcher
from node.kernels.arithmetic.integers import multiply_q31

FLOAT = re.compile(r"\\b(double|float|half|bfloat|x86_fp80|fp128)\\b")

def is_float(kind):
    if isinstance(kind, (types.Float, types.Complex)):
        return True
    if isinstance(kind, types.Literal):
        return isinstance(kind.literal_value, float)
    if isinstance(kind, types.Array):
        return is_float(kind.dtype)
    if isinstance(kind, types.BaseTuple):
        return any(is_float(part) for part in kind)
    if isinstance(kind, types.Record):
        return any(is_float(field.type) for field in kind.fields.values())
    return False

def floats_of(function):
    found = []
    for signature, compiled in function.overloads.items():
        typed = compiled.type_annotation
        found += [f"{name}: {kind}" for name, kind in typed.typemap.items() if is_float(kind)]
        for call in typed.calltypes.values():
            if call is not None and any(is_float(kind) for kind in (call.return_type, *call.args)):
                found.append(str(call))
        for line in function.inspect_llvm(signature).splitlines():
            if FLOAT.search(line) and not line.startswith(("declare", ";")):
                found.append(line.strip())
    return found

def functions():
    modules = [module for name, module in sorted(sys.modules.items()) if name.startswith("node.kernels")]
    found = [function for module in modules for function in vars(module).values() if isinstance(function, Dispatcher)]
    return [function for function in dict.fromkeys(found) if function.overloads]
"""
STEP = """
from node.kernels.record.integer_node import new_integers
from node.kernels.step.fixed_step import integer_aiding, integer_step

integers = new_integers()
nodes, settings, own = integers["node"], integers["settings"], integers[0]
integer_step(nodes, settings, own["parameters"], own["readings"], own["moment"])
integer_aiding(nodes, settings, own["aiding"])
names = set()
for function in functions():
    where = f"{function.__module__}.{function.__name__}"
    names.add(where)
    for found in floats_of(function):
        print(where, found)
parts = "turns.guard.judge_cycle sensors.cluster.fuse_imus sensors.correction.correct_sensor string.make_up.make_up "
parts += "filter.fixed.cycle.run_cycle sensors.aligner.follow_turn sensors.realign.realign_filter "
parts += "sensors.integer_circle.write_circle_offset "
parts += "sensors.integer_extremes.nonexceedance_probability sensors.static_average.add_static"
for part in parts.split():
    assert "node.kernels." + part in names, part
"""
ONE_HALF = """
kernel = numba.njit(error_model="numpy")
@kernel
def clean(x):
    return multiply_q31(x, 1 << 30) + (x >> 1) // 3
@kernel
def leaky(x):
    return multiply_q31(x, 1 << 30) + int((x >> 1) * 0.5)
@kernel
def divided(x):
    return int(x / 2)
for function in (clean, leaky, divided):
    function(12345)
    print(function.__name__, len(floats_of(function)) > 0)
"""


FLOATS_ONLY = """
import numba
from node.kernels.arithmetic.angles import HALF_TURN, wrap_angle
from node.kernels.arithmetic.compiler import ConstantType

def refuse(_):
    raise TypeError("an integer")

ConstantType.fixed = property(refuse, lambda *_: None)
"""
FLOAT_STEP = """
from node.kernels.step.precompile import warm_up
warm_up()
print("all floats")
"""
ALONE = """
alone = numba.njit(lambda x: x if x > 0.0 else -HALF_TURN)
try:
    alone(1.0)
except Exception as error:
    print("an integer" in str(error))
"""


def inspect(program: str, cache: Path) -> str:
    """What ``program`` prints after the inspector, on functions compiled anew: those of a cache tell no types."""
    return subprocess.run(
        [sys.executable, "-c", INSPECTOR + program],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache), "NUMBA_OPT": "0"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


FLOAT = re.compile(r"\b(double|float|half|bfloat|x86_fp80|fp128)\b")


def float_lines(function: Any, signature: Any) -> list[str]:
    """Lines with a float in what was compiled and is run: the function and all it calls, without Python's wrapper."""
    compiled = function.overloads[signature].library._get_module_for_linking()
    bodies = [part for part in compiled.functions if not part.is_declaration and "cpython" not in part.name]
    assert bodies
    return [line.strip() for body in bodies for line in str(body).splitlines() if FLOAT.search(line)]


@pytest.mark.slow
@pytest.mark.parametrize("function", [integer_step, integer_aiding], ids=["step", "aiding"])
def test_the_step_that_is_kept_holds_no_float(function: Any) -> None:
    """The code every node runs, from the cache; the types of its variables are read in `make study`."""
    warm_up()
    kept = [signature for signature, *_ in function._cache._cache_file._load_index()]
    assert kept
    for signature in kept:
        function.compile(signature)
        assert float_lines(function, signature) == []


@pytest.mark.parametrize(
    ("leaky", "leaks"),
    [(lambda x: (x >> 1) // 3, False), (lambda x: int((x >> 1) * 0.5), True), (lambda x: int(x / 2), True)],
    ids=["clean", "a half", "a quotient"],
)
def test_a_float_would_be_found_in_what_is_kept(leaky: Any, leaks: bool) -> None:
    function = numba.njit(error_model="numpy")(leaky)
    function(12345)
    (signature,) = function.overloads
    assert bool(float_lines(function, signature)) is leaks


@pytest.mark.statistical
def test_the_step_holds_no_float(tmp_path: Path) -> None:
    assert inspect(STEP, tmp_path) == ""


@pytest.mark.statistical
def test_no_constant_is_an_integer_in_the_float64_step(tmp_path: Path) -> None:
    """A constant that meets nothing, as under a minus, numba would take for its integer."""
    assert inspect(FLOATS_ONLY + FLOAT_STEP, tmp_path) == "all floats\n"
    assert inspect(FLOATS_ONLY + ALONE, tmp_path) == "True\n"


@pytest.mark.statistical
def test_one_half_would_be_found(tmp_path: Path) -> None:
    assert inspect(ONE_HALF, tmp_path).split("\n")[:3] == ["clean False", "leaky True", "divided True"]
