"""One CAN segment as a pure state machine: who may send, how long it takes, who hears it, who is thrown off.

Times are seconds of the caller's clock. An unacknowledged frame waits, as a controller would repeat it, until one more
is attached. Error counters follow ISO 11898-1: a transmission that fails costs 8, one that succeeds gives back
1, 128 is error passive, over 255 is bus-off. A missing acknowledgement brings no controller further than error passive.
"""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Hashable
from dataclasses import dataclass, field
from typing import NamedTuple

from telemetry.media.can_frame import ERROR_ACK, ERROR_BUS_OFF, ERROR_PROTOCOL, CanFrame, error_frame
from telemetry.media.can_timing import BitRates

FAILURE, SUCCESS = 8, 1
PASSIVE, BUS_OFF = 128, 256
SEND_BUFFER = 256  # frames


class Delivery(NamedTuple):
    """A frame that a controller gets."""

    to: Hashable
    frame: CanFrame


@dataclass(slots=True)
class WireController:
    """One controller: what it may receive, what waits in it and its error counter."""

    fd: bool
    hears_itself: bool
    waiting: deque[tuple[float, CanFrame]] = field(default_factory=deque)  # since when, what
    errors: int = 0  # transmit error counter
    is_off: bool = False
    unacknowledged: bool = False  # its first frame was sent and not acknowledged

    @property
    def state(self) -> str:
        """``active``, ``passive`` or ``off``, by the error counter."""
        return "off" if self.is_off else "passive" if self.errors >= PASSIVE else "active"


@dataclass(frozen=True, slots=True)
class Transmission:
    """The transmission on the wire."""

    senders: tuple[Hashable, ...]
    frame: CanFrame
    end: float
    fails: bool


class CanWire:
    """A segment and its controllers.

    ``disturbed`` transmissions fail from now on and ``is_cut`` parts all controllers from each other: plain fields, to
    be switched by tests.

    Parameters
    ----------
    rates : bit rates; without pace every frame takes no time
    """

    def __init__(self, rates: BitRates | None = None) -> None:
        self.rates = rates if rates is not None else BitRates()
        self.controllers: dict[Hashable, WireController] = {}
        self.busy = 0.0  # s, that frames and error frames took
        self.frames = 0
        self.overruns = 0  # frames that found a full send buffer
        self.disturbed = 0
        self.is_cut = False
        self._idle_at = -math.inf
        self._current: Transmission | None = None

    def attach(self, name: Hashable, *, fd: bool = True, hears_itself: bool = True) -> None:
        """Attach a controller."""
        self.controllers[name] = WireController(fd, hears_itself)

    def detach(self, name: Hashable) -> None:
        """Detach a controller; its waiting frames are lost."""
        self.controllers.pop(name, None)

    def restart(self, name: Hashable) -> None:
        """Restart a controller that is bus-off."""
        controller = self.controllers[name]
        controller.errors, controller.is_off = 0, False

    def submit(self, name: Hashable, frame: CanFrame, now: float) -> bool:
        """Hand a frame to a controller; returns False where its send buffer is full or it is bus-off."""
        controller = self.controllers[name]
        if controller.is_off or len(controller.waiting) >= SEND_BUFFER:
            self.overruns += 1
            return False
        controller.waiting.append((now, frame))
        return True

    def due(self) -> float:
        """Time (s) at which ``advance`` has something to do next, infinite if never."""
        if self._current is not None:
            return self._current.end
        earliest = math.inf
        for name, one in self.controllers.items():
            if one.waiting and one.waiting[0][0] < earliest and self._is_able(name, one):
                earliest = one.waiting[0][0]
        return max(earliest, self._idle_at)

    def advance(self, now: float) -> list[Delivery]:
        """Deliver everything that controllers get until ``now`` (s), in order."""
        deliveries: list[Delivery] = []
        while (due := self.due()) <= now:
            if self._current is None:
                self._current = self._begin(due, deliveries)
            else:
                self._end(self._current, deliveries)
                self._current = None
        return deliveries

    def _is_able(self, name: Hashable, one: WireController) -> bool:
        """Return whether a controller with a waiting frame may send: not one that has learnt that it is alone."""
        return not one.is_off and not (one.unacknowledged and not self._listeners(name))

    def _listeners(self, *senders: Hashable) -> list[Hashable]:
        """Controllers that acknowledge what ``senders`` send."""
        if self.is_cut:
            return []
        return [name for name, c in self.controllers.items() if name not in senders and not c.is_off]

    def _begin(self, start: float, deliveries: list[Delivery]) -> Transmission | None:
        """Arbitrate among the controllers that wait at ``start`` (s); None when the winner is alone."""
        firsts = {
            name: one.waiting[0][1]
            for name, one in self.controllers.items()
            if one.waiting and one.waiting[0][0] <= start and self._is_able(name, one)
        }
        lowest = min(frame.rank for frame in firsts.values())
        winners = {name: frame for name, frame in firsts.items() if frame.rank == lowest}
        senders, frame = tuple(winners), next(iter(winners.values()))
        if not self._listeners(*senders) and len(senders) == 1:
            self._miss_acknowledgement(senders[0], deliveries)
            return None
        same = all(other == frame for other in winners.values())
        understood = not frame.fd or all(self.controllers[name].fd for name in self._listeners(*senders))
        fails = not same or not understood or self.disturbed > 0
        self.disturbed = max(self.disturbed - 1, 0)
        length = self.rates.duration(len(frame.data), fd=frame.fd) + (self.rates.error_duration if fails else 0.0)
        self.busy += length
        return Transmission(senders, frame, start + length, fails)

    def _miss_acknowledgement(self, sender: Hashable, deliveries: list[Delivery]) -> None:
        controller = self.controllers[sender]
        controller.unacknowledged = True
        controller.errors = max(controller.errors, PASSIVE)  # after sixteen repetitions
        deliveries.append(Delivery(sender, error_frame(ERROR_ACK)))

    def _end(self, sent: Transmission, deliveries: list[Delivery]) -> None:
        self._idle_at = sent.end
        senders = [name for name in sent.senders if name in self.controllers]
        if sent.fails:
            for name in senders:
                self._fail(name, deliveries)
            return
        self.frames += 1
        deliveries += [Delivery(name, sent.frame) for name in self._listeners(*sent.senders)]
        for name in senders:
            controller = self.controllers[name]
            controller.waiting.popleft()
            controller.errors = max(controller.errors - SUCCESS, 0)
            controller.unacknowledged = False
            if controller.hears_itself:
                own = CanFrame(sent.frame.can_id, sent.frame.data, sent.frame.fd, own=True)
                deliveries.append(Delivery(name, own))

    def _fail(self, name: Hashable, deliveries: list[Delivery]) -> None:
        controller = self.controllers[name]
        controller.errors += FAILURE
        if controller.errors < BUS_OFF:
            deliveries.append(Delivery(name, error_frame(ERROR_PROTOCOL)))
            return
        controller.is_off = True
        controller.waiting.clear()
        deliveries.append(Delivery(name, error_frame(ERROR_BUS_OFF)))
