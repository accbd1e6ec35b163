"""A CAN controller as a port needs it: identifiers with their data in and out.

python-can opens every interface. Where its frames lie on a socket as Linux lays them out, the kernel's and those of the
loopback bus, they are read and written here by one system call each and without an object of python-can's. Any other
interface, and a port that keeps a log, goes by python-can's messages.
"""

from __future__ import annotations

import socket
import struct
from typing import Protocol

import can
from can.interfaces.socketcan import SocketcanBus

from telemetry.media.can_frame import (
    CLASSIC,
    EXTENDED,
    FD,
    FD_FLAGS,
    HEAD,
    HEADER,
    OWN_FRAME,
    Arrival,
)
from telemetry.media.can_log import CanLog
from telemetry.media.can_loopback import LoopbackBus, identifier_of

TICK = 0.05  # s, that a controller is waited for


class CanController(Protocol):
    """One controller; failures raise ``can.CanError``, ``OSError`` or ``ValueError``."""

    def send(self, identifier: int, data: bytes) -> None:
        """Hand over a frame of 29 bits, which the controller repeats until it is acknowledged."""

    def receive(self) -> Arrival | None:
        """Return the next frame (``OWN_FRAME`` is set on an own one); None if none comes within ``TICK`` s."""

    def shutdown(self) -> None:
        """Close the bus."""


def controller_of(bus: can.BusABC, *, is_fd: bool, log: CanLog | None) -> CanController:
    """Return the fastest controller for ``bus``."""
    if log is None and isinstance(bus, LoopbackBus):
        return LoopbackController(bus, is_fd=is_fd)
    if log is None and isinstance(bus, SocketcanBus):
        return KernelController(bus, is_fd=is_fd)
    return LibraryController(bus, is_fd=is_fd, log=log)


class LibraryController:
    """Any interface of python-can; ``log`` takes every frame that crosses the joint."""

    def __init__(self, bus: can.BusABC, *, is_fd: bool, log: CanLog | None) -> None:
        self._bus, self._is_fd, self._log = bus, is_fd, log

    def send(self, identifier: int, data: bytes) -> None:
        """Hand over a frame."""
        self._bus.send(
            can.Message(
                arbitration_id=identifier,
                data=data,
                is_extended_id=True,
                is_fd=self._is_fd,
                bitrate_switch=self._is_fd,
            )
        )

    def receive(self) -> Arrival | None:
        """The next frame."""
        message = self._bus.recv(TICK)
        if message is None:
            return None
        if self._log is not None:
            self._log.write(message)
        return identifier_of(message) | (0 if message.is_rx else OWN_FRAME), bytes(message.data)

    def shutdown(self) -> None:
        """Close the bus."""
        self._bus.shutdown()


class LoopbackController:
    """A controller of the loopback bus."""

    def __init__(self, bus: LoopbackBus, *, is_fd: bool) -> None:
        self._bus = bus
        self._socket = bus.socket
        self._layout, self._flags = (FD, FD_FLAGS) if is_fd else (CLASSIC, 0)
        wait_at_most(self._socket, TICK)

    def send(self, identifier: int, data: bytes) -> None:
        """Hand over a frame."""
        self._socket.send(self._layout.pack(identifier | EXTENDED, len(data), self._flags, 0, 0, data))

    def receive(self) -> Arrival | None:
        """The next frame."""
        return self._bus.take()

    def shutdown(self) -> None:
        """Close the bus."""
        self._bus.shutdown()


class KernelController:
    """A controller that Linux drives (SocketCAN)."""

    def __init__(self, bus: SocketcanBus, *, is_fd: bool) -> None:
        self._bus = bus
        self._socket: socket.socket = bus.socket
        self._layout, self._flags = (FD, FD_FLAGS) if is_fd else (CLASSIC, 0)
        wait_at_most(self._socket, TICK)

    def send(self, identifier: int, data: bytes) -> None:
        """Hand over a frame; a full transmit queue is an error."""
        frame = self._layout.pack(identifier | EXTENDED, len(data), self._flags, 0, 0, data)
        self._socket.send(frame, socket.MSG_DONTWAIT)

    def receive(self) -> Arrival | None:
        """The next frame; what this machine sent comes back as a frame that is not routed."""
        try:
            frame, _, flags, _ = self._socket.recvmsg(FD.size)
        except (BlockingIOError, TimeoutError):
            return None
        identifier, length = HEAD.unpack_from(frame)
        return identifier | (OWN_FRAME if flags & socket.MSG_DONTROUTE else 0), frame[HEADER : HEADER + length]

    def shutdown(self) -> None:
        """Close the bus."""
        self._bus.shutdown()


def wait_at_most(endpoint: socket.socket, seconds: float) -> None:
    """Let the system end a wait for a datagram: one call a frame, where Python would first ask whether one is there.

    A system of 32 bits may want another layout of a time; there Python asks.
    """
    endpoint.settimeout(None)
    try:
        endpoint.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("@ll", 0, round(1e6 * seconds)))
    except OSError:
        endpoint.settimeout(seconds)
