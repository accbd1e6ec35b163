"""What hosts the ground station: its link, its gateways and its answers on one asyncio loop."""

from __future__ import annotations

import asyncio
import contextlib
import gc
import threading
from collections.abc import AsyncIterator, Callable, Iterator
from functools import partial
from typing import Any

from groundstation.config import GroundConfig, checked_config
from groundstation.gateway.lease import RigLease
from groundstation.gateway.leased_process import LeasedProcess
from groundstation.gateway.page.page_settings import PageSettings, open_page_socket
from groundstation.gateway.zenoh import ZenohGateway
from groundstation.service.hole.blunder_search import RunApart
from groundstation.service.process.ground_process import GroundProcess
from node.kernels.arithmetic.formats import PERIOD
from telemetry import keys
from telemetry.media.credentials import credentials_for, file_name
from telemetry.media.neighbours import neighbour_ports, stepped_ports
from telemetry.media.zenoh_bus import ZenohBus, open_client
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import BASE, ENCODER, Side, address_name
from telemetry.runtime.event_loop import run_event_loop, stop_on_signals
from telemetry.runtime.hosting import Place, begin_process, reporting_errors, rig_session, warn_of_keys, write_warning
from telemetry.runtime.kept_memory import keep_freed_memory
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.step_client import AsyncStepClient, serve_stepped
from telemetry.runtime.timing import CycleTiming

NAME = "ground"
ONE_TRY = 2.0  # wall s, to join a router for a question
ServePage = Callable[[GroundProcess], contextlib.AbstractAsyncContextManager[None]]
OpenGateways = Callable[[], contextlib.AbstractAsyncContextManager["asyncio.Task[None]"]]


def run_ground(
    place: Place, settings: dict[str, Any], *, own_clock: bool = False, page: PageSettings | None = None
) -> None:
    """Ground station: a stepper or its own clock drives its link, operators come in at any time.

    ``settings`` are those of ``GroundConfig``; ``page`` says where a page is served, if one is.

    Raises
    ------
    ConfigurationError
        When a setting is outside its range; nothing was opened.
    PageError
        When the page's port is taken.
    """
    begin_process(NAME)
    with reporting_errors(NAME):
        # settings, key and database are looked at before half a minute is spent on a router that may be absent
        given = {"rig": place.rig, "folder": place.folder, "key_file": place.key_file, "keys": place.keys}
        config = checked_config(**given, **settings)
        load_kernels()
        with (
            contextlib.closing(start_ground_process(config, run_on_thread if own_clock else None)) as process,
            page_of(page) as serve_page,
            rig_session(place, file_name(BASE)) as bus,
            contextlib.closing(RigLease(bus, place.rig, partial(fresh_session, place))) as lease,
        ):
            warn_of_keys(NAME, process.endpoint.seals)
            open_gateways = partial(answering_operators, process, bus, serve_page)
            run_event_loop(
                serve_by_own_clock(process, bus, open_gateways, lease)
                if own_clock
                else serve_on_stepper(process, bus, place, open_gateways)
            )


def fresh_session(place: Place) -> contextlib.AbstractContextManager[ZenohBus]:
    """One more session with the router, for a question."""
    return open_client(place.endpoint, ONE_TRY, credentials_for(place.endpoint, place.keys, file_name(BASE)))


def load_kernels() -> None:
    """Compile what surveys are computed with, or load it, before it says that it lives: no question waits for that."""
    from groundstation.survey.adjustment.warm_adjustment import warm_adjustment
    from groundstation.survey.path.kernels import curvature_filter, frame_along, mixture_chances
    from groundstation.survey.well.kernels import position_errors
    from node.kernels.arithmetic.compiler import leave_blas_out

    leave_blas_out()
    for kernels in (position_errors, frame_along, curvature_filter, mixture_chances):
        kernels.warm_up()
    warm_adjustment()


def run_on_thread(act: Callable[[], None]) -> threading.Thread:
    """Do something on a thread of its own."""
    thread = threading.Thread(target=act, daemon=True)
    thread.start()
    return thread


def start_ground_process(config: GroundConfig, run_apart: RunApart | None = None) -> GroundProcess:
    """Return a ground station with everything computed and the longest answer made once, so that no first query waits.

    Nor does one wait for a garbage collection over what was imported and restored (0.1 s of ten thousand surveys), or
    for memory that an answer before it had, see ``kept_memory``.
    """
    keep_freed_memory()
    process = GroundProcess(config, run_apart=run_apart)
    process.operator.ask_json("measurements")
    gc.freeze()
    return process


def no_page(_process: GroundProcess) -> contextlib.AbstractAsyncContextManager[None]:
    """Serve no page."""
    return contextlib.nullcontext()


async def serve_by_own_clock(
    process: GroundProcess, bus: ZenohBus, open_gateways: OpenGateways, lease: RigLease
) -> None:
    """Run the ground station by its own clock, below it the encoder, until a signal ends it."""
    rig = process.config.rig
    async with open_gateways() as answers:
        ports = neighbour_ports(ZenohMedium(bus), rig, BASE, {Side.LOWER: ENCODER})
        lease.watch()
        leased = LeasedProcess(process, lease)
        loop = OwnClockLoop(leased, ports, OwnClock(), CycleTiming(), PERIOD, partial(write_warning, NAME))
        process.operator.wake = lambda: loop.call(lambda woken, now: woken.on_timer(now))
        bus.subscribe(keys.DEPTH.format(rig=rig), partial(hear_depth, loop))
        end_with(answers, loop.stop)
        await loop.run()


async def serve_on_stepper(process: GroundProcess, bus: ZenohBus, place: Place, open_gateways: OpenGateways) -> None:
    """Run the ground station step by step until a signal ends it; between two steps operators are answered."""
    rig = process.config.rig
    async with open_gateways() as answers:
        ports = stepped_ports(ZenohMedium(bus), rig, BASE, [Side.LOWER])
        with place.step_stream(address_name(BASE)) as stream:
            client = AsyncStepClient(bus, rig, BASE, ports, stream)  # its token of life is last
            end_with(answers, client.stop)
            await serve_stepped(process, client, partial(write_warning, NAME))


@contextlib.asynccontextmanager
async def answering_operators(
    process: GroundProcess, bus: ZenohBus, serve_page: ServePage = no_page
) -> AsyncIterator[asyncio.Task[None]]:
    """Have operators on ``bus`` and on the page answered while the context lasts; yields the task of the bus."""
    gateway = ZenohGateway(bus, process)
    task = asyncio.create_task(gateway.serve())
    try:
        async with serve_page(process):
            yield task
    finally:
        gateway.close()
        await task


@contextlib.contextmanager
def page_of(page: PageSettings | None) -> Iterator[ServePage]:
    """What serves a page: it listens at once, so that a port that is taken is told before anything is waited for."""
    if page is None:
        yield no_page
        return
    from groundstation.gateway.page.server import serving_page  # without a page no web server is loaded

    with open_page_socket(page) as listening:
        write_warning(NAME, f"page {page.url}")
        yield lambda process: serving_page(process, page, listening)


def end_with(answers: asyncio.Task[None], stop: Callable[[], None]) -> None:
    """Have ``stop`` called by signals, and when the task that answers ends: a launcher then starts the process anew."""
    stop_on_signals(stop)
    answers.add_done_callback(lambda _task: stop())


def hear_depth(loop: OwnClockLoop, _key: str, payload: bytes) -> None:
    """Hand what came on the key of the depth to the process, whatever it is."""
    loop.call(lambda process, now: process.on_depth(payload, now))
