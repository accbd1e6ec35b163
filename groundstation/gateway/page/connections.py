"""Connections of the page: each that comes finds a place, for which another one gives way that has done less.

A connection gives way before others when it has no request under way, then the older before the newer. Those of who is
signed in stay. So a stranger who opens many connections ends his own, and a browser whose first request is a
moment away is there longer than that.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from itertools import count

from starlette.datastructures import Address
from uvicorn.protocols.http.h11_impl import H11Protocol, RequestResponseCycle

CONNECTIONS = 200  # at a time
OF_ONE_ADDRESS = 64  # of these, without a session
ORDER = count()


class SignedPeers:
    """Other ends of the connections on which a session was shown."""

    def __init__(self) -> None:
        self._peers: set[tuple[str, int]] = set()

    def add(self, peer: Address) -> None:
        """A session was shown on this connection."""
        self._peers.add((peer.host, peer.port))

    def discard(self, peer: tuple[str, int] | None) -> None:
        """A connection has ended."""
        if peer is not None:
            self._peers.discard(peer)

    def __contains__(self, peer: object) -> bool:
        """Whether a session was shown on a connection."""
        return peer in self._peers

    def __len__(self) -> int:
        """How many there are."""
        return len(self._peers)


class BoundedProtocol(H11Protocol):
    """One connection, which makes room for itself when it comes."""

    signed: SignedPeers
    opened: int

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin a connection."""
        super().connection_made(transport)
        self.opened = next(ORDER)
        others = [one for one in self.connections if isinstance(one, BoundedProtocol)]
        for one in those_to_end(others, self, self.signed):
            one.transport.abort()
            one.connections.discard(one)

    def connection_lost(self, exc: Exception | None) -> None:
        """End it."""
        self.signed.discard(self.client)
        super().connection_lost(exc)

    @property
    def is_busy(self) -> bool:
        """Whether a request is under way."""
        cycle: RequestResponseCycle | None = self.cycle  # none before the first request
        return cycle is not None and not cycle.response_complete


def those_to_end(
    connections: Iterable[BoundedProtocol], fresh: BoundedProtocol, signed: SignedPeers
) -> list[BoundedProtocol]:
    """Connections that give way to ``fresh``, which is one of them."""
    others = [one for one in connections if one is not fresh]
    strangers = sorted((one for one in others if one.client not in signed), key=lambda one: (one.is_busy, one.opened))
    neighbours = [one for one in strangers if host_of(one) == host_of(fresh)]
    ended = neighbours[: max(len(neighbours) + 1 - OF_ONE_ADDRESS, 0)]
    rest = [one for one in strangers if one not in ended]
    return ended + rest[: max(len(others) + 1 - len(ended) - CONNECTIONS, 0)]


def host_of(connection: BoundedProtocol) -> str:
    """Address of the other end."""
    return "" if connection.client is None else connection.client[0]


def protocol_with(signed: SignedPeers) -> type[BoundedProtocol]:
    """The protocol of a server whose sessions are noted in ``signed``."""
    return type("PageProtocol", (BoundedProtocol,), {"signed": signed})
