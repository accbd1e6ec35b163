"""No float in the integer loop: the types and the compiled code of every function of it are read."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import node.kernels.fixed

OUTSIDE = {"__init__", "beside", "border", "node", "step"}  # the border, where floats become integers, and beyond
INSPECTOR = """
import importlib, re, sys
from pathlib import Path
import numba
from numba.core import types
from numba.core.dispatcher import Dispatcher
from node.kernels.jit import kernel

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

def functions(names):
    for name in names:
        module = importlib.import_module(f"node.kernels.fixed.{name}")
        for function in vars(module).values():
            if isinstance(function, Dispatcher):
                yield function
"""
LOOP = """
from node.kernels.fixed.node import warm_up
from node.kernels.fixed.cycle import run_cycle
warm_up()
for function in dict.fromkeys(functions(sys.argv[1:])):
    where = f"{function.__module__}.{function.__name__}"
    shared = function.__module__ == "node.kernels.ring" or where == "node.kernels.modes.step_modes"
    assert shared or function.__module__.startswith("node.kernels.fixed."), where + " is no integer function"
    assert function.overloads, where + " was not compiled"
    for found in floats_of(function):
        print(where, found)
"""
ONE_HALF = """
from node.kernels.fixed.arithmetic import mul
kernel = numba.njit(error_model="numpy")
@kernel
def clean(x):
    return mul(x, 1 << 30) + (x >> 1) // 3
@kernel
def leaky(x):
    return mul(x, 1 << 30) + int((x >> 1) * 0.5)
@kernel
def divided(x):
    return int(x / 2)
for function in (clean, leaky, divided):
    function(12345)
    print(function.__name__, len(floats_of(function)) > 0)
"""


def loop_modules() -> list[str]:
    return sorted({path.stem for path in Path(node.kernels.fixed.__file__).parent.glob("*.py")} - OUTSIDE)


def inspect(program: str, cache: Path) -> str:
    """What ``program`` prints after the inspector, on functions compiled anew: those of a cache tell no types."""
    return subprocess.run(
        [sys.executable, "-c", INSPECTOR + program, *loop_modules()],
        env=os.environ | {"NUMBA_CACHE_DIR": str(cache), "NUMBA_OPT": "0"},
        capture_output=True,
        text=True,
        check=True,
    ).stdout


@pytest.mark.slow
def test_the_loop_holds_no_float(tmp_path: Path) -> None:
    assert inspect(LOOP, tmp_path) == ""


@pytest.mark.slow
def test_one_half_would_be_found(tmp_path: Path) -> None:
    assert inspect(ONE_HALF, tmp_path).split("\n")[:3] == ["clean False", "leaky True", "divided True"]
