"""A page whose door is beset by half-open connections, unread streams, wrong passwords; who is signed in asks on."""

from __future__ import annotations

import contextlib
import http.client
import json
import socket
import time
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from borechain.load.page import latency_quantiles
from borechain.load.patience import wait_for
from groundstation.gateway.page.page_settings import PageSettings
from groundstation.gateway.page.passwords import drawn_password, hash_of
from groundstation.ground_host import run_ground
from sim.rig.processes import ProcessTable, Spec
from telemetry.media.zenoh_bus import open_router
from telemetry.runtime.hosting import Place

RIG, GROUND = "doors", "base"
ROLE, NAME = "driller", "anna"
START_S, ANSWER_S = 60.0, 60.0  # that a ground station and an answer are waited for
ASKED = ("session", "status")
ASK_EVERY_S = 0.05


@dataclass(frozen=True, slots=True)
class Siege:
    """Who stands in the door, and how often who is signed in asks meanwhile."""

    half_open: int = 400
    streams: int = 64
    wrong: int = 150
    asks: int = 100


def measure_doors(siege: Siege, endpoint: str, page: PageSettings, folder: Path) -> dict[str, Any]:
    """Beset a page, and say how long who is signed in waited for each answer.

    Raises
    ------
    RigError
        When the page is not served within a minute.
    """
    password = drawn_password()
    served = replace(page, passwords={ROLE: hash_of(password)})
    serve = partial(run_ground, own_clock=True, page=served)
    table = ProcessTable(
        {GROUND: Spec(serve, (Place(RIG, endpoint, folder / "ground"), {}))}, ["borechain.drilling.preload"]
    )
    try:
        table.warm()
        with open_router(endpoint):
            table.start(GROUND)
            cookie = wait_for(lambda: sign_in(page, password), "the page is not served", START_S, ASK_EVERY_S)
            free = answer_times(page, cookie, siege.asks)
            with standing_in_the_door(siege, page):
                beset = answer_times(page, cookie, siege.asks)
    finally:
        table.stop()
    return {
        "half_open": siege.half_open,
        "streams": siege.streams,
        "wrong": siege.wrong,
        "free_ms": latency_quantiles(free),
        "answer_ms": latency_quantiles(beset),
    }


def sign_in(page: PageSettings, password: str) -> str | None:
    """Cookie of a session; None while the page is not served."""
    with contextlib.suppress(OSError), contextlib.closing(connection_to(page)) as connection:
        connection.request("POST", "/api/session", sign_in_body(password), {"content-type": "application/json"})
        answer = connection.getresponse()
        if answer.status == http.client.OK:
            return str(answer.getheader("set-cookie")).partition(";")[0]
    return None


def sign_in_body(password: str) -> bytes:
    """What a page sends to sign in."""
    return json.dumps({"role": ROLE, "name": NAME, "password": password}).encode()


def connection_to(page: PageSettings) -> http.client.HTTPConnection:
    """A new connection, as a browser opens one."""
    return http.client.HTTPConnection(page.host, page.port, timeout=ANSWER_S)


def answer_times(page: PageSettings, cookie: str, asks: int) -> list[float]:
    """Times (s) of answers to who is signed in, each on a connection of its own; of a refusal the longest wait."""
    taken = []
    for number in range(asks):
        asked = time.monotonic()
        with contextlib.closing(connection_to(page)) as connection:
            connection.request("GET", f"/api/{ASKED[number % len(ASKED)]}", headers={"cookie": cookie})
            answer = connection.getresponse()
            answer.read()
        taken.append(time.monotonic() - asked if answer.status == http.client.OK else ANSWER_S)
        time.sleep(ASK_EVERY_S)
    return taken


@contextlib.contextmanager
def standing_in_the_door(siege: Siege, page: PageSettings) -> Iterator[None]:
    """Everything that stands in the door, sent and not read any further, for as long as the context lasts."""
    body = sign_in_body("not the password")
    head = f"Host: {page.host}\r\nContent-Type: application/json\r\nContent-Length: {len(body)}\r\n\r\n"
    requests = [
        *(b"GET /api/status HTTP/1.1\r\nHost: " for _ in range(siege.half_open)),
        *(f"GET /api/stream HTTP/1.1\r\nHost: {page.host}\r\n\r\n".encode() for _ in range(siege.streams)),
        *(f"POST /api/session HTTP/1.1\r\n{head}".encode() + body for _ in range(siege.wrong)),
    ]
    with contextlib.ExitStack() as stack:
        for request in requests:
            one = stack.enter_context(socket.create_connection((page.host, page.port), ANSWER_S))
            with contextlib.suppress(OSError):  # one that has had to make room
                one.sendall(request)
        yield
