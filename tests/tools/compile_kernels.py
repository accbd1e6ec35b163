"""Compile what most tests would compile, each worker for itself: ``floats`` or ``integers``.

The two share next to nothing, and one after the other would keep one core busy for minutes while the other waits. The
kernels in floats share three functions of four, so those come one after the other.
"""

import importlib
import sys


def floats() -> None:
    """The usual kernel of a node and the string of the studies around it, the other kernels in floats, and surveys."""
    from groundstation.survey.well.compiled_model import preload_models
    from node.firmware.settings import KERNELS

    importlib.import_module("borechain.drilling.preload")
    from sim.studies.lab import LAB, run_seed

    run_seed((LAB, 1))
    for kernel in KERNELS:
        if kernel not in {"float64", "fixed"}:
            warm_kernel(kernel)
    preload_models()


def integers() -> None:
    """A node in integers."""
    warm_kernel("fixed")


def warm_kernel(name: str) -> None:
    """Compile a kernel of a node."""
    from node.firmware.kernel_choice import kernel_of
    from node.kernels.step.warm import warm_step

    loop = kernel_of(name)
    warm_step(loop.step, loop.aiding)


if __name__ == "__main__":
    {"floats": floats, "integers": integers}[sys.argv[1]]()
