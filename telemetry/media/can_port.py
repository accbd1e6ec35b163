"""A port on a CAN joint: a controller and a thread that listens to it, around ``can_exchange``.

python-can raises errors of its own that are no ``OSError``; a bus that fails, or that the controller has left, is
opened again with a growing pause, for ever: a joint that opens is an ordinary event of drilling.
"""

from __future__ import annotations

import contextlib
import math
import random
import threading
import time
from collections import deque
from collections.abc import Callable
from functools import partial

import can

from telemetry.errors import MediumError
from telemetry.media.can_controller import TICK, CanController, controller_of
from telemetry.media.can_exchange import CanExchange
from telemetry.media.can_frame import (
    ERROR,
    ERROR_BUS_OFF,
    ERROR_CONTROLLER,
    EXTENDED,
    IDENTIFIER,
    OWN_FRAME,
    RX_OVERFLOW,
)
from telemetry.media.can_log import CanLog
from telemetry.media.can_profile import Profile
from telemetry.media.can_timing import CLASSIC_LARGEST, BitRates
from telemetry.media.port import PortFrame
from telemetry.media.queued_port import QueuedPort
from telemetry.unwritten import Content

BUSY_LIMIT = 512  # frames that may wait while the other end takes them; fewer wait for one that is absent
FIRST_PAUSE, LAST_PAUSE = 0.1, 5.0  # s, before a bus is opened again
UNHEARD_LIMIT = 64  # payloads kept until ``listen``
LOOK_LIMIT = 0.5  # s, after which an arrival is taken to have been read where others never cease
OpenBus = Callable[[], can.BusABC]


class CanPort(QueuedPort):
    """One end of a CAN joint, see ``port.Port``; it is up while its frames are acknowledged.

    Parameters
    ----------
    name : of the port, for errors
    open_bus : opens the controller, which must report own frames once they are acknowledged
    address : of the process
    largest : bytes of data in a frame, 8 or 64
    limit : frames that may wait
    profile, rates, is_stepped : see ``can_exchange.CanExchange``
    log : takes every frame that crosses the joint

    Raises
    ------
    MediumError
        When the bus cannot be opened.
    """

    def __init__(
        self,
        name: str,
        open_bus: OpenBus,
        address: int,
        largest: int,
        limit: int,
        profile: Profile | None = None,
        rates: BitRates | None = None,
        log: CanLog | None = None,
        *,
        is_stepped: bool = False,
    ) -> None:
        super().__init__(name, limit=limit)
        self._open = partial(open_controller, open_bus, name, largest > CLASSIC_LARGEST, log)
        self._controller: CanController | None = self._open()
        nonce = random.getrandbits(32)
        begun = time.monotonic()
        self._exchange = CanExchange(address, largest, self._queue, nonce, begun, profile, rates, is_stepped=is_stepped)
        self._log, self._limit, self._busy_limit = log, limit, max(BUSY_LIMIT, limit)
        self._lock = threading.RLock()
        self._deliver: Callable[[Content], object] | None = None
        self._unheard: deque[Content] = deque(maxlen=UNHEARD_LIMIT)
        self._looked_at = -math.inf
        self._pause, self._reopen_at = FIRST_PAUSE, math.inf
        self._thread = threading.Thread(target=self._run, name=f"can {name}", daemon=True)
        self._thread.start()

    @property
    def bundle_limit(self) -> int:
        """One payload a frame: eight parts of a block in one would hold an aiding up for 0.5 s at 125 kbit/s."""
        return 0

    def send(self, frame: PortFrame) -> bool:
        """Send a frame now, or as soon as the other end is there."""
        with self._lock:
            self._queue.limit = self._limit if self._exchange.is_alone(time.monotonic()) else self._busy_limit
            return super().send(frame)

    def listen(self, deliver: Callable[[Content], object]) -> None:
        """Call ``deliver``, which never waits, on the port's thread for every frame that arrives."""
        with self._lock:
            while self._unheard:
                deliver(self._unheard.popleft())
            self._deliver = deliver

    def close(self) -> None:
        """Close this end."""
        with self._lock:
            if self._closed:
                return
            self._closed = True
        self._thread.join()
        if self._controller is not None:
            self._controller.shutdown()
        if self._log is not None:
            self._log.close()

    def _is_heard(self) -> bool:
        with self._lock:
            return self._exchange.is_up

    def _drain(self) -> None:
        with self._lock:
            self._pump(time.monotonic())

    def _run(self) -> None:
        asked = time.monotonic()
        while not self._closed:
            if self._controller is None:
                time.sleep(TICK)
                self._reopen()
                continue
            try:
                arrival = self._controller.receive()
            except (can.CanError, OSError, ValueError):
                self._lose_bus("bus_lost")
                continue
            with self._lock:
                now = time.monotonic()
                if arrival is not None:
                    self._on_arrival(*arrival, now)
                self._look(asked if arrival is None else now - LOOK_LIMIT)
                self._pump(now)
            asked = now

    def _on_arrival(self, identifier: int, data: bytes, now: float) -> None:
        kind = identifier & ~IDENTIFIER  # what the flags say that it is
        if kind == EXTENDED:
            payload = self._exchange.on_frame(identifier & IDENTIFIER, data, now)
            if payload is not None:
                (self._deliver or self._unheard.append)(payload)
        elif kind & ERROR:
            self._on_error(identifier & IDENTIFIER, data)
        elif kind & OWN_FRAME:
            self._exchange.on_acknowledged(now)
            self._pause = FIRST_PAUSE
        else:
            self.counters["unknown_identifier"] += 1

    def _on_error(self, error_class: int, data: bytes) -> None:
        if error_class & ERROR_BUS_OFF:
            self._lose_bus("bus_off")
        elif error_class & ERROR_CONTROLLER and data[1:2] and data[1] & RX_OVERFLOW:
            self.counters["receive_overruns"] += 1

    def _look(self, read_until: float) -> None:
        """Advance the exchange to ``read_until`` (s), up to which the controller's frames are known to be read.

        What is missing may lie there unread, where this thread had no time to read it.
        """
        if read_until >= self._looked_at:
            self._looked_at = read_until + TICK
            self._exchange.advance(read_until)

    def _pump(self, now: float) -> None:
        """Hand the controller its next frame."""
        if self._controller is None or self._closed:
            return
        frame = self._exchange.next_frame(now)
        if frame is None:
            if not self._exchange.is_up:
                self._queue.forget_outdated()
            return
        try:
            self._controller.send(frame.identifier, frame.data)
        except (can.CanError, OSError):
            self.counters["refused_by_controller"] += 1
            self._exchange.on_refused()

    def _lose_bus(self, reason: str) -> None:
        with self._lock:  # who sends meanwhile must not hand a frame to a bus that will never acknowledge it
            lost, self._controller = self._controller, None
            self.counters[reason] += 1
            self._exchange.on_refused()
            self._reopen_at = time.monotonic() + self._pause
            self._pause = min(2.0 * self._pause, LAST_PAUSE)
        if lost is not None:
            with contextlib.suppress(can.CanError, OSError):
                lost.shutdown()

    def _reopen(self) -> None:
        if time.monotonic() < self._reopen_at:
            return
        try:
            controller = self._open()
        except MediumError:
            self._reopen_at = time.monotonic() + self._pause
            self._pause = min(2.0 * self._pause, LAST_PAUSE)
            return
        with self._lock:
            self._controller = controller
            self._pump(time.monotonic())


def open_controller(open_bus: OpenBus, name: str, is_fd: bool, log: CanLog | None) -> CanController:
    """Open a controller; its errors are raised as errors of ours.

    Raises
    ------
    MediumError
        When it cannot be opened.
    """
    try:
        return controller_of(open_bus(), is_fd=is_fd, log=log)
    except (can.CanError, OSError, ValueError) as error:
        raise MediumError(f"CAN port {name}: {error}") from error
