"""Who computes the chunks of a campaign: the cores of this machine, or the workers of a dask cluster."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Final

from sim.campaign.campaign_folder import code_digest
from sim.campaign.chunk import Chunk, run_chunk
from sim.errors import RigError
from sim.studies.pool import usable_cores
from telemetry.runtime.one_thread import one_thread_each

if TYPE_CHECKING:
    from distributed import Client

Range = tuple[int, int]
Computed = Iterator[tuple[Range, Chunk]]
CONNECT_TIMEOUT: Final = 10.0  # s
RETRIES: Final = 3  # of a chunk whose worker died


def compute_chunks(scenario: bytes, ranges: Sequence[Range], engine: str, scheduler: str | None) -> Computed:
    """Chunks as they are done, in any order.

    Parameters
    ----------
    scenario : pickled
    ranges : first and last run of each chunk
    engine : ``local`` or ``dask``
    scheduler : address of a dask scheduler; with None a cluster of this machine's cores is started

    Raises
    ------
    RigError
        When there is no such cluster, it has other code, or it was lost; chunks that came before are whole.
    """
    return on_dask(scenario, ranges, scheduler) if engine == "dask" else on_this_machine(scenario, ranges)


def on_this_machine(scenario: bytes, ranges: Sequence[Range]) -> Computed:
    """A process a core, each a chunk at a time."""
    processes = min(usable_cores(), len(ranges))
    if processes < 2:
        for first, last in ranges:
            yield (first, last), run_chunk(scenario, first, last)
        return
    one_thread_each()
    run_chunk(scenario, 1, 1)  # compiles, or finds the compiled: the others then only load
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        yield from pool.imap_unordered(work_of, [(scenario, *span) for span in ranges])


def work_of(job: tuple[bytes, int, int]) -> tuple[Range, Chunk]:
    """One chunk, with the runs it is of."""
    scenario, first, last = job
    return (first, last), run_chunk(scenario, first, last)


def on_dask(scenario: bytes, ranges: Sequence[Range], scheduler: str | None) -> Computed:
    """A task a chunk; what a dead worker had begun, another does again."""
    import distributed

    lost = (distributed.KilledWorker, distributed.CancelledError, OSError, TimeoutError)  # a closed line is an OSError
    as_completed: Callable[..., Any] = distributed.as_completed

    with connect_cluster(scheduler, len(ranges)) as client:
        check_code(client)
        futures = [client.submit(work_of, (scenario, *span), retries=RETRIES, pure=False) for span in ranges]
        try:
            for future in as_completed(futures):
                found: tuple[Range, Chunk] = future.result()
                future.release()
                yield found
        except lost as error:
            where = scheduler or "the cluster of this machine"
            raise RigError(
                f"{where}: was lost while it worked ({type(error).__name__}); the chunks before are kept, "
                "the same command goes on with the others"
            ) from error


@contextmanager
def connect_cluster(scheduler: str | None, chunks: int) -> Iterator[Client]:
    """A client of a cluster that listens, or of one on this machine's loopback address."""
    import distributed

    connect: Callable[..., Any] = distributed.Client

    if scheduler is None:
        workers = max(min(usable_cores(), chunks), 1)
        made: Callable[..., Any] = distributed.LocalCluster
        with (
            made(n_workers=workers, threads_per_worker=1, host="127.0.0.1", dashboard_address=None) as local,
            connect(local) as client,
        ):
            yield client
        return
    try:
        client = connect(scheduler, timeout=CONNECT_TIMEOUT)
    except (OSError, TimeoutError, ValueError) as error:
        raise RigError(f"{scheduler}: expected a dask scheduler that answers within {CONNECT_TIMEOUT:g} s") from error
    with client:
        yield client


def check_code(client: Client) -> None:
    """Refuse workers of other code.

    Raises
    ------
    RigError
        When there is no worker, or one would compute something else.
    """
    wanted = code_digest()
    found: dict[str, str] = client.run(code_digest)
    if not found:
        raise RigError("the scheduler has no workers; start some with: dask worker ADDRESS --nthreads 1")
    for worker, digest in found.items():
        if digest != wanted:
            raise RigError(f"{worker}: has code {digest}, not {wanted} as here; install the same version there")
