"""Parts of what a rig compiles, beside each other: ``python -m borechain.drilling.kernel_parts PART...``.

A line goes to its output for every function that was compiled. What is there already is loaded, so that a part takes a
second where nothing is lacking. Only what a rig calls is kept: a kernel inside another one is compiled anew by who
calls it alone.

Numba, and what it loads with its first function, is loaded once; each part is then compiled by a process forked off,
and in a new environment the bytecode of all that is written once, and not by every one of them.
"""

from __future__ import annotations

import gc
import multiprocessing
import signal
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any, Final

import numpy as np
from llvmlite import binding
from numba import njit

from borechain.drilling.compile_ahead import mark_of
from borechain.drilling.whole_compilation import compiled_whole
from node.kernels.arithmetic.compiler import leave_blas_out, telling_compiled


def compile_step() -> None:
    """The step of a node in floats."""
    from node.kernels.step.precompile import warm_up

    warm_up()


def compile_surveys() -> None:
    """The end of a step, which the part ``step`` then finds; the encoder; the ground station's surveys."""
    from node.kernels.step.precompile import warm_encoder, warm_end

    warm_end()
    warm_encoder()
    warm_surveys()
    from node.kernels.arithmetic.angles import from_binary

    word: Any = np.uint32(0)  # of a report
    from_binary(word)


def warm_surveys() -> None:
    """What the ground station makes of surveys before it adjusts the hole."""
    from groundstation.survey.path.kernels import curvature_filter, frame_along, mixture_chances
    from groundstation.survey.well.kernels import position_errors

    for kernels in (position_errors, frame_along, curvature_filter, mixture_chances):
        kernels.warm_up()
    from groundstation.survey.path.developed_directions import develop_directions

    part = np.tile([0.0, 0.0, 1.0, 0.0], (2, 1))[:, :3]  # of a wider table, as those of stations are
    develop_directions(part, np.zeros((2, 4, 4))[:, :3, :3])


def compile_adjustment() -> None:
    """The adjustment of the hole."""
    from groundstation.survey.adjustment.warm_adjustment import warm_adjustment

    keep_loops()
    warm_adjustment()


def keep_loops() -> None:
    """Have LLVM write out no loop from now on, in all of this process.

    An adjustment multiplies blocks (4, 4) at some thirty places, and each was written out: a third of its compilation,
    for code that was no faster. The order of the sums is the same, and so is every bit.
    """
    binding.set_option("borechain", "-unroll-threshold=0")


def compile_integers() -> None:
    """The step of a node in integers."""
    from node.firmware.kernel_choice import kernel_of
    from node.kernels.step.precompile import warm_step

    loop = kernel_of("fixed")
    warm_step(loop.step, loop.aiding)


PARTS: Final[Mapping[str, Callable[[], None]]] = {
    "step": compile_step,
    "surveys": compile_surveys,
    "adjustment": compile_adjustment,
    "integers": compile_integers,
}


def compile_beside(parts: Sequence[str]) -> None:
    """Compile parts beside each other, and mark those that succeeded; none outlives this call."""
    load_compiler()
    fork = multiprocessing.get_context("fork")
    running = [fork.Process(target=compile_part, args=(part,)) for part in parts]
    for process in running:
        process.start()
    try:
        for part, process in zip(parts, running, strict=True):
            process.join()
            if process.exitcode == 0:
                mark_of(part).touch()
    finally:
        for process in running:
            process.kill()


def load_compiler() -> None:
    """Have numba load what it needs for any function, by compiling one."""
    leave_blas_out()
    njit()(_get_same)(0.0)
    gc.freeze()  # no process writes into the pages that they share, only to look for garbage


def _get_same(number: float) -> float:
    return number


def compile_part(part: str) -> None:
    """Compile one part, with a line for each function."""
    with compiled_whole(), telling_compiled(began=lambda: None, ended=say_one):
        PARTS[part]()


def say_one() -> None:
    """Write the line of a function that was compiled."""
    sys.stdout.write(".\n")
    sys.stdout.flush()


def end_when_told() -> None:
    """Have SIGTERM end this process as any exit does, and not at once: what it has forked ends with it."""
    signal.signal(signal.SIGTERM, lambda number, _frame: sys.exit(128 + number))


if __name__ == "__main__":
    end_when_told()
    compile_beside(sys.argv[1:])
