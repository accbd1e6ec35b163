"""zenoh as a medium: a joint is two keys, and each end hears what the other puts on its own."""

from __future__ import annotations

import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from telemetry import keys
from telemetry.media.credentials import credentials_for
from telemetry.media.port import PortFrame, TubeEnd
from telemetry.media.queued_port import QueuedPort
from telemetry.media.zenoh_bus import Subscription, ZenohBus, open_client

CONNECT_TIMEOUT = 30.0  # s
WITH_KEYS = ",keys="
FRAMES = "application/octet-stream"


class DeliveryThread(threading.local):
    """Whether this thread is one of zenoh's, about to hand a frame out."""

    now = False


hearing = DeliveryThread()


class ZenohPort(QueuedPort):
    """One end of a joint on two keys, see ``port.Port``; it is up while anybody subscribes to ``send_key``.

    A frame that is sent in answer, on the thread of zenoh's that heard the other one, never waits for room in the line:
    that thread makes the room.
    """

    def __init__(self, bus: ZenohBus, send_key: str, receive_key: str) -> None:
        super().__init__(send_key)
        self._bus = bus
        self._receive_key = receive_key
        self._publisher = bus.publisher(send_key, encoding=FRAMES)
        self._answering = bus.publisher(send_key, encoding=FRAMES, droppable=True)
        self._publisher.watch()
        self._subscription: Subscription | None = None

    def send(self, frame: PortFrame) -> bool:
        """Send a frame now, or as soon as the other end is there."""
        if len(self._queue) or self._closed or not self._publisher.is_heard:
            return super().send(frame)
        payload = frame.payload  # the usual case: nothing waits, and nothing has to
        if len(payload) > self._queue.largest:
            return super().send(frame)
        (self._answering if hearing.now else self._publisher).put(payload)
        return True

    def listen(self, deliver: Callable[[bytes], object]) -> None:
        """Call ``deliver``, which never waits, on a foreign thread for every frame that arrives."""

        def hear(frame: bytes) -> None:
            hearing.now = True
            try:
                deliver(frame)
            finally:
                hearing.now = False

        self._subscription = self._bus.hear(self._receive_key, hear)

    def close(self) -> None:
        """Close this end."""
        if self._closed:
            return
        self._closed = True
        self._publisher.close()
        self._answering.close()
        if self._subscription is not None:
            self._subscription.close()

    def _is_heard(self) -> bool:
        return self._publisher.is_heard

    def _drain(self) -> None:
        self._queue.drain(self._is_heard, (self._answering if hearing.now else self._publisher).put)


class ZenohMedium:
    """Ends of a tube on one session."""

    def __init__(self, bus: ZenohBus) -> None:
        self._bus = bus

    def open_port(self, end: TubeEnd) -> ZenohPort:
        """Port of one end: it hears the neighbour's, or the stepper that joins ends as the schedule wants."""
        heard = keys.port_key(end.rig, end.address, end.side, "rx")
        if end.neighbour is not None:
            facing = end.facing
            heard = keys.port_key(facing.rig, facing.address, facing.side, "tx")
        return ZenohPort(self._bus, keys.port_key(end.rig, end.address, end.side, "tx"), heard)


@contextmanager
def open_medium(where: str) -> Iterator[ZenohMedium]:
    """Session with the router at the endpoint ``where``; over TLS ``,keys=FOLDER/NAME`` says who this is.

    Raises
    ------
    MediumError
        When no router answers there.
    """
    endpoint, _, stem = where.partition(WITH_KEYS)
    credentials = credentials_for(endpoint, Path(stem).parent if stem else None, Path(stem).name)
    with open_client(endpoint or keys.DEFAULT_ENDPOINT, CONNECT_TIMEOUT, credentials) as bus:
        yield ZenohMedium(bus)
