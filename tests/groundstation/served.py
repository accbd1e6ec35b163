"""A ground station that is fed by hand, answering on a real router from a thread of its own."""

from __future__ import annotations

import asyncio
import contextlib
import socket
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass

from hand_fed import Rig

from groundstation.gateway.lease import RigLease
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.ground_host import answering_operators, page_of
from telemetry.media.zenoh_bus import open_client, open_router
from telemetry.messages import Event, Severity


@dataclass(frozen=True)
class Served:
    """What is served and where."""

    rig: Rig
    endpoint: str
    loop: asyncio.AbstractEventLoop
    page: PageSettings | None = None

    def do(self, act: Callable[[Rig], None]) -> None:
        """Have something done to the rig on the thread of its ground station."""

        async def acting() -> None:
            act(self.rig)

        asyncio.run_coroutine_threadsafe(acting(), self.loop).result(60.0)

    def happen(self) -> None:
        """One event more."""

        def submit(rig: Rig) -> None:
            number = 500 + rig.ground.model.newest_row("events")
            rig.tube.mail.submit(Event(1, number, rig.now, Severity.INFO, "stopped"), rig.now)
            rig.run(2.0)

        self.do(submit)


@contextlib.contextmanager
def serving(rig: Rig, page: PageSettings | None = None) -> Iterator[Served]:
    """Serve a rig until the context ends, with a page where one is given."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    loop, ready, end = asyncio.new_event_loop(), threading.Event(), asyncio.Event()

    async def serve() -> None:
        with open_router(endpoint) as bus, page_of(page) as serve_page:
            RigLease(bus, "rig-1", lambda: open_client(endpoint, 2.0))
            async with answering_operators(rig.ground, bus, serve_page):
                ready.set()
                await end.wait()

    thread = threading.Thread(target=loop.run_until_complete, args=(serve(),))
    thread.start()
    try:
        assert ready.wait(30.0)
        yield Served(rig, endpoint, loop, page)
    finally:
        loop.call_soon_threadsafe(end.set)
        thread.join(30.0)
        loop.close()
        rig.ground.close()
