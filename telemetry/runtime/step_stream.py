"""Steps and answers on a local stream, for the processes that one launcher starts on one machine.

The string's frames stay on their media. A step or an answer by zenoh passes a router and three foreign threads; here it
is one write and one read.
"""

from __future__ import annotations

import contextlib
import selectors
import socket
import struct
from collections import deque
from collections.abc import Callable
from pathlib import Path

from telemetry.errors import MediumError

LENGTH = struct.Struct(">I")
CHUNK = 1 << 16
LARGEST = 1 << 26  # bytes; a peer that announces more is not a process of ours
NAME_LIMIT = 10.0  # wall s within which a connecting process must say which it is


class StepStream:
    """One end of a connection: payloads in order, each with its length before it."""

    def __init__(self, connected: socket.socket) -> None:
        self._socket = connected
        self._buffer = bytearray()
        self._complete: deque[bytes] = deque()

    def fileno(self) -> int:
        """File descriptor, to wait for several at once."""
        return self._socket.fileno()

    def send(self, payload: bytes) -> None:
        """Send one payload; an end that is gone is noticed when it is read from."""
        with contextlib.suppress(OSError):
            self._socket.sendall(LENGTH.pack(len(payload)) + payload)

    def receive(self, timeout: float | None = None) -> bytes | None:
        """Next payload, or None when the other end is gone or this one was shut.

        Raises
        ------
        TimeoutError
            When none came within ``timeout`` wall seconds.
        """
        self._socket.settimeout(timeout)
        while not self._complete:
            if not self._read():
                return None
        return self._complete.popleft()

    def arrived(self) -> list[bytes] | None:
        """Payloads that have come, for a caller that knows there is something to read; None when the end is gone."""
        alive = self._read()
        found = list(self._complete)
        self._complete.clear()
        return found if found or alive else None

    def shut(self) -> None:
        """End it: a thread that waits in ``receive`` gets None; may be called from a signal handler."""
        with contextlib.suppress(OSError):
            self._socket.shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        """Close the connection."""
        self._socket.close()

    def _read(self) -> bool:
        try:
            chunk = self._socket.recv(CHUNK)
        except TimeoutError:
            raise
        except OSError:
            chunk = b""
        self._buffer += chunk
        while len(self._buffer) >= LENGTH.size:
            end = LENGTH.size + LENGTH.unpack_from(self._buffer)[0]
            if end > LARGEST:
                return False
            if len(self._buffer) < end:
                break
            self._complete.append(bytes(self._buffer[LENGTH.size : end]))
            del self._buffer[:end]
        return bool(chunk)


def join_steps(place: Path, name: str) -> StepStream:
    """Connect the process ``name`` with the stepper that listens at ``place``.

    Raises
    ------
    MediumError
        When there is no listener.
    """
    connected = socket.socket(socket.AF_UNIX)
    try:
        connected.connect(str(place))
    except OSError as error:
        connected.close()
        raise MediumError(f"{name}: no stepper at {place} ({error.strerror}); is the medium running?") from error
    stream = StepStream(connected)
    stream.send(name.encode())
    return stream


class StepListener:
    """The stepper's end: takes connections, and waits for all of them and for ``wake`` at once.

    Parameters
    ----------
    place : file of the socket, in a folder that is its user's alone
    joined : called with a name and its stream when a process has connected
    came : called with a name and a payload; None when its stream has ended
    """

    def __init__(
        self, place: Path, joined: Callable[[str, StepStream], object], came: Callable[[str, bytes | None], object]
    ) -> None:
        self._joined, self._came = joined, came
        self._listening = socket.socket(socket.AF_UNIX)
        self._listening.bind(str(place))
        self._listening.listen()
        self._woken, self._waker = socket.socketpair()
        self._woken.setblocking(False)
        self._waker.setblocking(False)
        self._streams: dict[str, StepStream] = {}
        self._selector = selectors.DefaultSelector()
        self._selector.register(self._listening, selectors.EVENT_READ, self._accept)
        self._selector.register(self._woken, selectors.EVENT_READ, self._drain)

    def wake(self) -> None:
        """End a ``wait``, from any thread."""
        with contextlib.suppress(OSError):  # so many wake-ups wait already that one more tells nothing
            self._waker.send(b"\0")

    def wait(self, timeout: float) -> bool:
        """Handle what comes within ``timeout`` wall seconds; False if nothing did."""
        ready = self._selector.select(max(timeout, 0.0))
        for key, _ in ready:
            key.data()
        return bool(ready)

    def close(self) -> None:
        """Close every connection."""
        self._selector.close()
        for stream in self._streams.values():
            stream.close()
        for end in (self._listening, self._woken, self._waker):
            end.close()

    def _drain(self) -> None:
        with contextlib.suppress(BlockingIOError):
            self._woken.recv(CHUNK)

    def _accept(self) -> None:
        connected, _ = self._listening.accept()
        stream = StepStream(connected)
        try:
            name = (stream.receive(NAME_LIMIT) or b"").decode()
        except (TimeoutError, UnicodeDecodeError):
            name = ""
        if not name:
            stream.close()
            return
        self._leave(name)
        connected.settimeout(None)
        self._streams[name] = stream
        self._selector.register(stream, selectors.EVENT_READ, lambda: self._read(name, stream))
        self._joined(name, stream)

    def _read(self, name: str, stream: StepStream) -> None:
        payloads = stream.arrived()
        for payload in payloads or ():
            self._came(name, payload)
        if payloads is None and self._streams.get(name) is stream:
            self._leave(name)

    def _leave(self, name: str) -> None:
        stream = self._streams.pop(name, None)
        if stream is not None:
            self._selector.unregister(stream)
            stream.close()
            self._came(name, None)
