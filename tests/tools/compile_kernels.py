"""Compile what most tests would compile, each worker for itself: ``floats`` or ``integers``.

The two share next to nothing, and one after the other would keep one core busy for minutes while the other waits. The
kernels in floats share three functions of four, so those come one after the other.
"""

import importlib
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from node.firmware.kernel_choice import Loop


def floats() -> None:
    """The usual kernel of a node and the string of the studies around it, the published form of it, and surveys."""
    from groundstation.survey.well.compiled_model import preload_models

    importlib.import_module("borechain.drilling.preload")
    from sim.studies.lab import LAB, run_seed
    from sim.studies.published_form.published_step import published_loop

    run_seed((LAB, 1))
    warm_loop(published_loop())
    preload_models()


def integers() -> None:
    """A node in integers."""
    from node.firmware.kernel_choice import kernel_of

    warm_loop(kernel_of("fixed"))


def warm_loop(loop: "Loop") -> None:
    """Compile a kernel of a node."""
    from node.kernels.step.precompile import warm_step

    warm_step(loop.step, loop.aiding)


if __name__ == "__main__":
    {"floats": floats, "integers": integers}[sys.argv[1]]()
