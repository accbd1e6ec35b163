"""python-can's interface ``borechain_loopback``: a controller on a CAN segment that a hub on this machine simulates.

For machines without CAN hardware. The channel is ``PORT/SEGMENT``: the hub's UDP port on 127.0.0.1 and any name.
python-can finds the class by its entry point, or where the package is not installed after ``register_loopback``.
"""

from __future__ import annotations

import contextlib
import select
import socket
import time
from typing import Any

import can
from can.interfaces import BACKENDS

from telemetry.media.can_frame import (
    COUNT_AT,
    ERROR,
    ERROR_CONTROLLER,
    EXTENDED,
    IDENTIFIER,
    REMOTE,
    RX_OVERFLOW,
    Arrival,
    CanFrame,
    arrival_of,
    error_frame,
    is_frame,
    unpack_frame,
)
from telemetry.media.can_loopback_protocol import (
    ATTACH,
    ATTACHED,
    DETACH,
    FLAG_FD,
    FLAG_OWN,
    HERE,
    INTERFACE,
    LARGEST_DATAGRAM,
    RECEIVE_BUFFER,
    RESTART,
)

ATTACH_LIMIT = 2.0  # s
OVERRUN = error_frame(ERROR_CONTROLLER, RX_OVERFLOW)
ASK_EVERY = 0.5  # s of silence, after which a controller makes sure that its hub is still there


def register_loopback() -> None:
    """Make the interface known to python-can by its name, installed or not."""
    BACKENDS.setdefault(INTERFACE, (__name__, LoopbackBus.__name__))


class LoopbackBus(can.BusABC):
    """A controller; see ``can.BusABC``.

    Parameters
    ----------
    channel : ``PORT/SEGMENT``; ``socket`` holds its frames, see ``can_frame``
    fd : whether it speaks CAN FD; one that does not destroys every FD frame on its segment
    receive_own_messages : whether it hears its own frames once they are acknowledged
    receive_buffer : bytes, asked of the system; a frame takes some 800

    Raises
    ------
    can.CanInitializationError
        When no hub answers, or the channel is none.
    """

    def __init__(
        self,
        channel: str,
        *,
        fd: bool = True,
        receive_own_messages: bool = False,
        receive_buffer: int = RECEIVE_BUFFER,
        **kwargs: Any,
    ) -> None:
        port, _, segment = str(channel).partition("/")
        if not port.isdecimal() or not segment:
            raise can.CanInitializationError(f"{INTERFACE}: expected the channel PORT/SEGMENT, got {channel}")
        self.channel_info = f"{INTERFACE} {channel}"
        self.overruns = 0
        self._count = 0
        self._overrun_pending = False
        self._ask_at = 0.0
        self.socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.socket.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, receive_buffer)
        self.socket.connect(("127.0.0.1", int(port)))
        self._attach(segment, (FLAG_FD if fd else 0) | (FLAG_OWN if receive_own_messages else 0))
        super().__init__(channel=channel, **kwargs)
        self._can_protocol = can.CanProtocol.CAN_FD if fd else can.CanProtocol.CAN_20

    def send(self, msg: can.Message, timeout: float | None = None) -> None:
        """Hand a frame to the controller, which repeats it until it is acknowledged."""
        del timeout
        if msg.is_fd and self._can_protocol is not can.CanProtocol.CAN_FD:
            raise can.CanOperationError(f"{self.channel_info}: an FD frame on a controller without FD")
        frame = CanFrame(identifier_of(msg), bytes(msg.data), msg.is_fd)
        try:
            self.socket.send(frame.pack())
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}", error.errno) from error

    def restart(self) -> None:
        """Rejoin the bus after bus-off."""
        self.socket.send(RESTART)

    def fileno(self) -> int:
        """Descriptor that is readable when a frame waits."""
        return self.socket.fileno()

    def shutdown(self) -> None:
        """Leave the segment."""
        super().shutdown()
        if self.socket.fileno() >= 0:
            with contextlib.suppress(OSError):  # the hub left first
                self.socket.send(DETACH)
            self.socket.close()

    def _attach(self, segment: str, flags: int) -> None:
        try:
            self.socket.settimeout(ATTACH_LIMIT)
            self.socket.send(ATTACH + bytes([flags]) + segment.encode())
            answered = self.socket.recv(LARGEST_DATAGRAM) == ATTACHED
        except OSError:
            answered = False
        self.socket.settimeout(None)
        if not answered:
            self.socket.close()
            raise can.CanInitializationError(
                f"{self.channel_info}: no hub answers on that UDP port: is the simulated bus running?"
            )

    def take(self) -> Arrival | None:
        """Return the waiting frame, without python-can's message of it; None if none comes while the socket waits.

        Raises
        ------
        can.CanOperationError
            When the hub is not there, or another one.
        """
        if self._overrun_pending:
            self._overrun_pending = False
            return OVERRUN.can_id, OVERRUN.data
        datagram = self._next_datagram()
        return None if datagram is None else arrival_of(datagram)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        if self._overrun_pending:
            self._overrun_pending = False
            return message_of(OVERRUN, self.channel_info), True
        readable, _, _ = select.select([self.socket], [], [], timeout)
        if not readable:
            self._make_sure_of_hub()
            return None, False
        datagram = self._next_datagram()
        return None if datagram is None else message_of(unpack_frame(datagram)[0], self.channel_info), False

    def _next_datagram(self) -> bytes | None:
        """Return the waiting frame, counted; None if there is none, or other bytes."""
        try:
            datagram = self.socket.recv(LARGEST_DATAGRAM)
        except (BlockingIOError, TimeoutError):
            self._make_sure_of_hub()
            return None
        except OSError as error:
            raise can.CanOperationError(f"{self.channel_info}: {error.strerror}", error.errno) from error
        if datagram == DETACH:
            raise can.CanOperationError(f"{self.channel_info}: the hub was started anew")
        self._ask_at = time.monotonic() + ASK_EVERY
        if not is_frame(datagram):
            return None
        self._watch_count(datagram[COUNT_AT])
        return datagram

    def _make_sure_of_hub(self) -> None:
        """Report this controller to the hub: one that has gone, maybe with a frame of ours, shows by an error."""
        now = time.monotonic()
        if now >= self._ask_at:
            self._ask_at = now + ASK_EVERY
            try:
                self.socket.send(HERE)
            except OSError as error:
                raise can.CanOperationError(f"{self.channel_info}: {error.strerror}", error.errno) from error

    def _watch_count(self, count: int) -> None:
        """Count frames lost for want of room in the receive buffer."""
        missed = (count - self._count - 1) & 0xFF
        self._count = count
        if missed:
            self.overruns += missed
            self._overrun_pending = True


def identifier_of(msg: can.Message) -> int:
    """Identifier of a message with the flags of Linux."""
    flags = (EXTENDED if msg.is_extended_id else 0) | (REMOTE if msg.is_remote_frame else 0)
    return msg.arbitration_id | flags | (ERROR if msg.is_error_frame else 0)


def message_of(frame: CanFrame, channel: str) -> can.Message:
    """Return a frame as a message of python-can."""
    return can.Message(
        timestamp=time.time(),
        arbitration_id=frame.can_id & IDENTIFIER,
        is_extended_id=bool(frame.can_id & EXTENDED),
        is_remote_frame=bool(frame.can_id & REMOTE),
        is_error_frame=frame.is_error,
        is_fd=frame.fd,
        bitrate_switch=frame.fd,
        is_rx=not frame.own,
        channel=channel,
        data=frame.data,
    )
