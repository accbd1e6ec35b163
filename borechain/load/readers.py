"""Readers of a ground station under load: browsers that follow its page, terminals that follow its keys."""

from __future__ import annotations

import contextlib
import json
import queue
import socket
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from borechain.client import Ground
from telemetry.media.zenoh_bus import Query, open_client
from telemetry.runtime.hosting import begin_process

NODES = "nodes/"
BARE = "bench/bare"
CONNECT_S = 30.0
PART = 65_536  # bytes


def follow_page(host: str, port: int, until: float, out: Path) -> None:
    """Read the stream of a page until a time (s, monotonic) and write how late each state of a tube was (s).

    ``out`` is there, and empty, as soon as the first news has come.
    """
    begin_process("browser")
    late: list[float] = []
    with contextlib.closing(socket.create_connection((host, port), CONNECT_S)) as connection:
        connection.sendall(f"GET /api/stream HTTP/1.1\r\nHost: {host}\r\n\r\n".encode())
        for line in read_lines(connection, until):
            if not late:
                out.touch()
            if line.startswith(b"data: ") and b'"path"' in line:
                told = json.loads(line[6:])
                late += state_lateness(told["path"], told["answer"])
    out.write_text(json.dumps(late))


def follow_keys(endpoint: str, rig: str, until: float, out: Path) -> None:
    """Follow the keys over the bus as the crew's screen does, and write how late each state of a tube was (s)."""
    begin_process("terminal")
    late: list[float] = []
    arrived: queue.SimpleQueue[tuple[str, dict[str, Any]]] = queue.SimpleQueue()
    with open_client(endpoint, CONNECT_S) as bus:
        Ground(bus, rig).follow("**", lambda path, view: arrived.put((path, view)))
        while (left := until - time.monotonic()) > 0.0:
            with contextlib.suppress(queue.Empty):
                late += state_lateness(*arrived.get(timeout=left))
                if len(late) <= 1:
                    out.touch()
    out.write_text(json.dumps(late))


def answer_nothing(endpoint: str, until: float) -> None:
    """Answer queries of ``BARE`` at once until a time (s, monotonic): the cost of bus and machine without work."""
    begin_process("bare")
    with open_client(endpoint, CONNECT_S) as bus:
        bus.queryable_kept(BARE, answer_empty)
        time.sleep(max(until - time.monotonic(), 0.0))


def answer_empty(query: Query) -> None:
    """End a query with an empty answer."""
    query.reply(BARE, b"{}")
    query.finish()


def state_lateness(path: str, answer: dict[str, Any]) -> list[float]:
    """Seconds since a tube told its state, whose rig time is this machine's clock; empty for other answers."""
    return [time.monotonic() - answer["at_s"]] if path.startswith(NODES) else []


def read_lines(connection: socket.socket, until: float) -> Iterator[bytes]:
    """Lines of a stream until a time (s, monotonic)."""
    rest = b""
    while (left := until - time.monotonic()) > 0.0:
        connection.settimeout(left)
        try:
            part = connection.recv(PART)
        except TimeoutError:
            return
        if not part:
            return
        *whole, rest = (rest + part).split(b"\n")
        yield from whole
