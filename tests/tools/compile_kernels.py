"""Compile what most tests would compile, each worker for itself: ``strings``, ``integers`` or ``others``.

They share nothing, and together they would keep one core busy for minutes while the other waits.
"""

import importlib
import sys


def strings() -> None:
    """The usual kernel of a node, and the string of the studies around it."""
    importlib.import_module("borechain.warm")
    from sim.studies.lab import LAB, run_seed

    run_seed((LAB, 1))


def integers() -> None:
    """A node in integers."""
    warm_kernel("fixed")


def others() -> None:
    """The other kernels of a node, and surveys."""
    from groundstation.survey.compiled_model import warm
    from node.firmware.settings import KERNELS

    for kernel in KERNELS:
        if kernel not in {"float64", "fixed"}:
            warm_kernel(kernel)
    warm()


def warm_kernel(name: str) -> None:
    """Compile a kernel of a node."""
    from node.firmware.kernel_choice import kernel_of
    from node.kernels.warm import warm_step

    loop = kernel_of(name)
    warm_step(loop.step, loop.aiding)


if __name__ == "__main__":
    {"strings": strings, "integers": integers, "others": others}[sys.argv[1]]()
