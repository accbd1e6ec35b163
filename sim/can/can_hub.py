"""Segments on a UDP port of this machine, for controllers of python-can's interface ``borechain_loopback``.

A controller's first datagram is ``ATTACH``, a byte of flags and the name of its segment; a segment exists as long as
it has a controller. The next ones carry frames in the layout of Linux, and a few bytes for the rest
(``telemetry.media.can_loopback``).
"""

from __future__ import annotations

import contextlib
import math
import select
import socket
import threading
import time
from collections.abc import Callable, Iterator

from sim.can.wire import CanWire
from sim.errors import RigError
from telemetry.media.can_frame import unpack_frame
from telemetry.media.can_loopback_protocol import (
    ATTACH,
    ATTACHED,
    DETACH,
    FLAG_FD,
    FLAG_OWN,
    HERE,
    LARGEST_DATAGRAM,
    RECEIVE_BUFFER,
    RESTART,
)
from telemetry.media.can_timing import BitRates

Address = tuple[str, int]
IP_RECVERR = 11
LONGEST_WAIT = 1.0  # s


class CanHub:
    """All segments of one port.

    Parameters
    ----------
    port : of 127.0.0.1, 0 for any that is free
    rates : bit rates of every segment

    Raises
    ------
    RigError
        When the port is taken.
    """

    def __init__(self, port: int = 0, rates: BitRates | None = None) -> None:
        self._rates = rates
        self.wires: dict[str, CanWire] = {}
        self._segment_of: dict[Address, str] = {}
        self._counts: dict[Address, int] = {}
        self._due: dict[str, float] = {}  # s, when each segment has more
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER)
        self._socket.setsockopt(socket.IPPROTO_IP, IP_RECVERR, 1)  # learn that a controller's process is gone
        try:
            self._socket.bind(("127.0.0.1", port))
        except OSError as error:
            self._socket.close()
            raise RigError(f"CAN segments on UDP port {port}: {error.strerror}; choose another port") from error
        self._socket.setblocking(False)
        self.port: int = self._socket.getsockname()[1]
        self._lock = threading.Lock()
        self._wake_out, self._wake_in = socket.socketpair()

    def serve(self) -> None:
        """Serve until ``stop``."""
        while True:
            wait = self._turn()
            readable, _, _ = select.select([self._socket, self._wake_in], [], [], wait)
            if self._wake_in in readable and self._wake_in.recv(64).startswith(b"q"):
                return

    def stop(self) -> None:
        """End ``serve``; from any thread."""
        self._wake_out.send(b"q")

    def act(self, change: Callable[[CanWire], None], segment: str) -> None:
        """Change a segment, such as cut it, from any thread."""
        with self._lock:
            change(self.wires[segment])
            self._due[segment] = -math.inf
        self._wake_out.send(b"w")

    def close(self) -> None:
        """Close the port."""
        for endpoint in (self._socket, self._wake_in, self._wake_out):
            endpoint.close()

    def _turn(self) -> float:
        """Take what has arrived and advance every segment; returns the time (s) until something is due."""
        with self._lock:
            while (arrival := self._receive()) is not None:
                self._on_datagram(*arrival)
            now = time.monotonic()
            for segment in [segment for segment, due in self._due.items() if due <= now]:
                self._advance(segment, now)
            due = min(self._due.values(), default=math.inf)
        return min(max(due - now, 0.0), LONGEST_WAIT)

    def _receive(self) -> tuple[bytes, Address] | None:
        try:
            return self._socket.recvfrom(LARGEST_DATAGRAM)
        except BlockingIOError:
            return None
        except ConnectionRefusedError:
            self._bury()
            return self._receive()

    def _bury(self) -> None:
        """Remove controllers whose processes have ended."""
        with contextlib.suppress(BlockingIOError):
            while True:
                _, _, _, address = self._socket.recvmsg(LARGEST_DATAGRAM, 512, socket.MSG_ERRQUEUE)
                self._detach(address)

    def _on_datagram(self, datagram: bytes, address: Address) -> None:
        if datagram.startswith(ATTACH) and len(datagram) > len(ATTACH) + 1:
            self._detach(address)  # of a process that has ended, and whose port another one has got
            flags, name = datagram[len(ATTACH)], datagram[len(ATTACH) + 1 :]
            self._attach(address, flags, name.decode(errors="replace"))
            return
        segment = self._segment_of.get(address)
        if segment is None:
            self._put(DETACH, address)  # of a hub before this one
        elif datagram == DETACH:
            self._detach(address)
        elif datagram == RESTART:
            self.wires[segment].restart(address)
            self._due[segment] = -math.inf
        elif datagram != HERE:
            with contextlib.suppress(ValueError):
                frame, _ = unpack_frame(datagram)
                now = time.monotonic()
                self.wires[segment].submit(address, frame, now)
                self._advance(segment, now)

    def _attach(self, address: Address, flags: int, segment: str) -> None:
        wire = self.wires.setdefault(segment, CanWire(self._rates))
        wire.attach(address, fd=bool(flags & FLAG_FD), hears_itself=bool(flags & FLAG_OWN))
        self._segment_of[address], self._counts[address] = segment, 0
        self._due[segment] = -math.inf  # a frame may have waited for a listener
        self._put(ATTACHED, address)

    def _detach(self, address: Address) -> None:
        segment = self._segment_of.pop(address, None)
        self._counts.pop(address, None)
        if segment is None:
            return
        self.wires[segment].detach(address)
        self._due[segment] = -math.inf
        if not self.wires[segment].controllers:
            del self.wires[segment], self._due[segment]

    def _advance(self, segment: str, now: float) -> None:
        """Deliver the frames that a segment has for its controllers."""
        wire = self.wires.get(segment)
        if wire is None:
            return  # its last controller went meanwhile
        for address, frame in wire.advance(now):
            if isinstance(address, tuple) and address in self._counts:
                self._counts[address] += 1
                self._put(frame.pack(self._counts[address]), address)
        if segment in self.wires:
            self._due[segment] = wire.due()

    def _put(self, datagram: bytes, address: Address) -> None:
        try:
            self._socket.sendto(datagram, address)
        except ConnectionRefusedError:
            self._bury()
            with contextlib.suppress(OSError):
                self._socket.sendto(datagram, address)
        except BlockingIOError:
            pass  # its receive buffer is full: an overrun, which the receiver sees by the count


@contextlib.contextmanager
def running_hub(rates: BitRates | None = None, port: int = 0) -> Iterator[CanHub]:
    """Hub on a thread of this process."""
    hub = CanHub(port, rates)
    thread = threading.Thread(target=hub.serve, name="can hub", daemon=True)
    thread.start()
    try:
        yield hub
    finally:
        hub.stop()
        thread.join()
        hub.close()
