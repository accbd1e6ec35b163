"""The one pool of processes: seeds over all cores, in their order, with progress."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from functools import partial
from typing import Protocol, TypeVar

from sim.errors import RigError
from sim.one_thread import one_thread_each

Job = TypeVar("Job")
Found = TypeVar("Found")
Step = Callable[[], None]
CORES = "BORECHAIN_CORES"
FEW = 2  # jobs at a time, that this process does itself


class RunAll(Protocol):
    """Runs jobs over the cores of a pool."""

    def __call__(self, work: Callable[[Job], Found], jobs: Iterable[Job]) -> list[Found]:
        """Results of ``work`` in the order of ``jobs``; both must be picklable."""


@contextmanager
def over_cores(most: int, step: Step) -> Iterator[RunAll]:
    """Yield the function that runs jobs on all cores, ``most`` at a time; ``step`` is called after each job.

    A process takes seconds to start, so a study keeps one pool for all its batches, and `FEW` need none.
    """
    processes = min(cores(), most)
    if most <= FEW or processes == 1:
        yield partial(_here, step)
        return
    one_thread_each()
    with multiprocessing.get_context("spawn").Pool(processes) as pool:

        def run_all(work: Callable[[Job], Found], jobs: Iterable[Job]) -> list[Found]:
            results = []
            for found in pool.imap(work, jobs):
                results.append(found)
                step()
            return results

        yield run_all


def cores() -> int:
    """Processes that a study may use: all cores, or as many as ``$BORECHAIN_CORES`` says.

    Raises
    ------
    RigError
        When that is no number of processes.
    """
    given = os.environ.get(CORES, "")
    if not given:
        return os.cpu_count() or 1
    if not given.isdecimal() or int(given) < 1:
        raise RigError(f"{CORES}: expected a number of processes from 1 on, got {given!r:.40}")
    return int(given)


def _here(step: Step, work: Callable[[Job], Found], jobs: Iterable[Job]) -> list[Found]:
    results = []
    for job in jobs:
        results.append(work(job))
        step()
    return results


def seeded(setup: Job, count: int) -> list[tuple[Job, int]]:
    """Jobs of one setup with the seeds 1..``count``."""
    return [(setup, seed) for seed in range(1, count + 1)]
