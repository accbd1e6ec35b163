"""The one pool of processes: seeds over all cores, in their order, with progress."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import partial
from multiprocessing.pool import Pool
from typing import Protocol, TypeVar

from sim.errors import RigError
from telemetry.runtime.one_thread import one_thread_each

Job = TypeVar("Job")
Found = TypeVar("Found")
Step = Callable[[], None]
CORES = "BORECHAIN_CORES"
FEW = 2  # jobs at a time, that this process does itself
KEPT: ContextVar[list[Pool] | None] = ContextVar("pool", default=None)  # where one is kept: it, once it is started


class RunAll(Protocol):
    """Runs jobs over the cores of a pool."""

    def __call__(self, work: Callable[[Job], Found], jobs: Iterable[Job]) -> list[Found]:
        """Results of ``work`` in the order of ``jobs``; both must be picklable."""


@contextmanager
def over_cores(most: int, step: Step) -> Iterator[RunAll]:
    """Yield the function that runs jobs on all cores, ``most`` at a time; ``step`` is called after each job.

    A process takes seconds to start, so a study keeps one pool for all its batches, many studies keep theirs in
    ``one_pool``, and `FEW` jobs need none.
    """
    processes = min(usable_cores(), most)
    if most <= FEW or processes == 1:
        yield partial(_here, step)
        return
    with _pool_of(processes) as pool:

        def run_all(work: Callable[[Job], Found], jobs: Iterable[Job]) -> list[Found]:
            results = []
            for found in pool.imap(work, jobs):
                results.append(found)
                step()
            return results

        yield run_all


@contextmanager
def one_pool() -> Iterator[None]:
    """Run all ``over_cores`` inside on the same processes, which are started on first use."""
    token = KEPT.set([])
    try:
        yield
    finally:
        for pool in KEPT.get() or ():
            pool.terminate()
            pool.join()
        KEPT.reset(token)


@contextmanager
def _pool_of(processes: int) -> Iterator[Pool]:
    """Yield a pool of its own, or the shared one, which has a process a core."""
    kept = KEPT.get()
    if kept is None:
        with _started(processes) as pool:
            yield pool
        return
    if not kept:
        kept.append(_started(usable_cores()))
    yield kept[0]


def _started(processes: int) -> Pool:
    one_thread_each()
    return multiprocessing.get_context("spawn").Pool(processes)


def usable_cores() -> int:
    """Processes that a study may use: all cores, or as many as ``$BORECHAIN_CORES`` says.

    Raises
    ------
    RigError
        When the variable is not a positive integer.
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


def seed_jobs(setup: Job, count: int) -> list[tuple[Job, int]]:
    """Jobs of one setup with the seeds 1..``count``."""
    return [(setup, seed) for seed in range(1, count + 1)]
