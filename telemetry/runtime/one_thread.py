"""One thread for the matrices of each process.

They are small, and their library keeps a thread a core busy, waiting for the next product: two processes on two cores
would spend as much on waiting as on work, and one alone a sixth more than it needs. One thread sums in the same order
on a machine of any number of cores.
"""

from __future__ import annotations

import os

ONE_THREAD = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def one_thread_each() -> None:
    """Have every process that is started from now on multiply in one thread, unless its environment says how many."""
    for name in ONE_THREAD:
        os.environ.setdefault(name, "1")
