"""Serves the page on the loop of the ground station, again after a failure; ends connections that only hold a place."""

from __future__ import annotations

import asyncio
import contextlib
import logging
import socket
from collections.abc import AsyncIterator, Iterator

import uvicorn

from groundstation.gateway.page.answer_hub import Hub
from groundstation.gateway.page.application import page_application
from groundstation.gateway.page.connections import SignedPeers, protocol_with
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.service.process.ground_process import GroundProcess

IDLE_S = 10.0  # for which a connection may have no request, or be closing
SWEEP_S = 1.0
LARGEST_HEAD = 16_384  # bytes of a request before its body
LAST_WORDS_S = 1  # for answers under way when the ground station ends
AGAIN_S = 0.5  # between the failure of a server and the next one
SERVER_TASK = "page server"


class Server(uvicorn.Server):
    """uvicorn without signals of its own: the ground station's end ends it."""

    @contextlib.contextmanager
    def capture_signals(self) -> Iterator[None]:
        """Leave the signals to the ground station."""
        yield


class Sweeper:
    """Ends connections that have no request under way for some time, and those that close without end.

    A client that holds every place would otherwise keep the crew out: by connections that never ask, ask a letter a
    minute, or take no answer.
    """

    def __init__(self, server: uvicorn.Server) -> None:
        self._server = server
        self._found: dict[object, tuple[object, float]] = {}

    async def run(self) -> None:
        """Sweep until cancelled."""
        while True:
            await asyncio.sleep(SWEEP_S)
            self.sweep(asyncio.get_running_loop().time())

    def sweep(self, now: float) -> None:
        """Look at every connection at ``now`` (s)."""
        found: dict[object, tuple[object, float]] = {}
        for connection in list(self._server.server_state.connections):
            transport, cycle = connection.transport, getattr(connection, "cycle", None)
            if cycle is not None and not cycle.response_complete and not transport.is_closing():
                continue
            before, since = self._found.get(connection, (cycle, now))
            found[connection] = (cycle, since if before is cycle else now)
            if now - found[connection][1] >= IDLE_S:
                transport.abort()
        self._found = found


class ServerSupervisor:
    """Keeps a web server on a listening socket: one that fails is told to the crew, and another one follows.

    Parameters
    ----------
    process : whose page
    config : of each server
    listening : socket of all of them
    """

    def __init__(self, process: GroundProcess, config: uvicorn.Config, listening: socket.socket) -> None:
        self._process, self._config, self._listening = process, config, listening
        self._server = Server(config)
        self._ending = False

    async def run(self) -> None:
        """Serve until ``end``."""
        while not self._ending:
            self._server = Server(self._config)
            serving = asyncio.create_task(self._server.serve([self._listening.dup()]), name=SERVER_TASK)
            sweeping = asyncio.create_task(Sweeper(self._server).run())
            await asyncio.wait([serving])
            sweeping.cancel()
            if not self._ending:
                self._tell(serving)
                close_all(self._server)
                await asyncio.sleep(AGAIN_S)

    def end(self) -> None:
        """Serve nothing more."""
        self._ending = self._server.should_exit = True

    def _tell(self, serving: asyncio.Task[None]) -> None:
        error = None if serving.cancelled() else serving.exception()
        why = "it was ended" if error is None else f"{type(error).__name__}: {error}"
        self._process.model.rig_alarms.alert("page_restarted", "page", why[:200])


def close_all(server: uvicorn.Server) -> None:
    """Free the place of a server that has failed: browsers come again by themselves."""
    for listener in server.servers if hasattr(server, "servers") else ():
        listener.close()
    for connection in list(server.server_state.connections):
        connection.transport.abort()


@contextlib.asynccontextmanager
async def serving_page(process: GroundProcess, page: PageSettings, listening: socket.socket) -> AsyncIterator[None]:
    """Have the page served on a listening socket while the context lasts."""
    hub = Hub(process, is_replay=bool(page.replay))
    signed = SignedPeers()
    config = uvicorn.Config(
        page_application(process, page, hub, signed),
        http=protocol_with(signed),
        ws="none",
        lifespan="off",
        log_config=None,
        access_log=False,
        server_header=False,
        proxy_headers=False,
        h11_max_incomplete_event_size=LARGEST_HEAD,
        timeout_graceful_shutdown=LAST_WORDS_S,
        ssl_certfile=page.certificate,
        ssl_keyfile=page.key,
    )
    quiet = logging.getLogger("uvicorn.error")  # what it would write is in the answer already, or concerns no user
    quiet.addHandler(logging.NullHandler())
    quiet.propagate = False
    supervisor = ServerSupervisor(process, config, listening)
    keeping = asyncio.create_task(supervisor.run())
    try:
        yield
    finally:
        hub.close()
        supervisor.end()
        await asyncio.gather(keeping, return_exceptions=True)
