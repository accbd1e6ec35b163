"""Compile what most tests would compile, each worker for itself: ``strings`` or ``others``, which share nothing.

Together they would keep one core busy for a minute while the other waits.
"""

import importlib
import sys


def strings() -> None:
    """The usual kernel of a node, and the string of the studies around it."""
    importlib.import_module("borechain.warm")
    from sim.studies.lab import LAB, run_seed

    run_seed((LAB, 1))


def others() -> None:
    """The other kernels of a node, and surveys."""
    from groundstation.survey.compiled_model import warm
    from node.firmware.kernel_choice import kernel_of
    from node.firmware.settings import KERNELS
    from node.kernels.warm import warm_step

    for kernel in KERNELS:
        if kernel != "float64":
            loop = kernel_of(kernel)
            warm_step(loop.step, loop.aiding)
    warm()


if __name__ == "__main__":
    {"strings": strings, "others": others}[sys.argv[1]]()
