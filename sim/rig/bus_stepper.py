"""The stepper's end of the stepped ports: hands steps to processes and gathers their answers.

Frames travel on the bus or on CAN; steps and answers on keys of the bus or on streams of this machine.
"""

from __future__ import annotations

import contextlib
import queue
import time
from collections import deque
from collections.abc import Callable, Iterable, Mapping
from functools import cached_property, partial
from pathlib import Path

from sim.rig.stepper import Acted, Answer, FrameEvent
from telemetry import keys
from telemetry.errors import DecodeError
from telemetry.media.media_table import open_medium
from telemetry.media.port import STEPPER, Port, PortFrame, TubeEnd
from telemetry.media.zenoh_bus import Publisher, ZenohBus
from telemetry.messages import BASE, Side, address_name
from telemetry.runtime.marked_frames import UNMARKED, MarkedFrames, mark_frame
from telemetry.runtime.step_stream import StepListener, StepStream
from telemetry.runtime.stepped import Done, Due, DueEvent, pack_step, unpack_done
from telemetry.unwritten import Content

FRAME_TICK = 0.05  # wall s
SIDES = tuple(Side)  # read at every step: an enumeration takes longer
Arrival = tuple[str, int, int, bytes]  # what, address, side or whether it lives, payload
MediumOf = Callable[[int, Side], str | None]


class FarEnds:
    """Ports that face those ends of one process that are not on the steps' zenoh session.

    They are opened when the process comes and closed when it goes, so that nothing of a life before is left in them.
    """

    def __init__(self, rig: str, address: int, media: Mapping[Side, str]) -> None:
        self._ends = {side: TubeEnd(rig, address, side, STEPPER).facing for side in media}
        self._media = media
        self._opened = contextlib.ExitStack()
        self.ports: dict[Side, Port] = {}

    def open(self, arrive: Callable[[Side, bytes], object]) -> None:
        """Join the process's ends; ``arrive`` takes what they send, on foreign threads."""
        self.close()
        for side, end in self._ends.items():
            port = self._opened.enter_context(open_medium(self._media[side])).open_port(end)
            port.listen(partial(_hand_bytes, arrive, side))
            self.ports[side] = port

    def close(self) -> None:
        """Leave them."""
        self.ports.clear()
        self._opened.close()


def _hand_bytes(arrive: Callable[[Side, bytes], object], side: Side, frame: Content) -> None:
    arrive(side, bytes(frame))


class Seat:
    """The stepper's view of one process; ``media`` names those of its ends that are not on the bus."""

    def __init__(self, bus: ZenohBus, rig: str, address: int, media: Mapping[Side, str]) -> None:
        self.address = address
        self.has_token = False  # of its life, on the bus
        self.far = FarEnds(rig, address, media)
        self.alive = False
        self.step_number = 0
        self.tx = (MarkedFrames(), MarkedFrames())
        self.foreign_there = 0  # frames that the process has dropped
        self.done: deque[Done] = deque()
        self.stream: StepStream | None = None
        self._key = keys.STEP.format(rig=rig, process=address_name(address))
        self._bus = bus
        self.rx: tuple[Publisher, Publisher] = (
            bus.publisher(keys.port_key(rig, address, Side.UPPER, "rx")),
            bus.publisher(keys.port_key(rig, address, Side.LOWER, "rx")),
        )

    @cached_property
    def _publisher(self) -> Publisher:
        return self._bus.publisher(self._key)

    def step(self, events: Iterable[DueEvent]) -> None:
        """Hand the process a step."""
        self.step_number += 1
        payload = pack_step(self.step_number, events)
        if self.stream is not None:
            self.stream.send(payload)
        else:
            self._publisher.put(payload)

    def marked(self, event: DueEvent, frame: Content) -> DueEvent:
        """An event with the mark of its frame, where that goes by the bus."""
        if event.kind > Side.LOWER or Side(event.kind) in self.far.ports:
            return event
        return event._replace(mark=mark_frame(bytes(frame)))

    def put(self, side: Side, frame: bytes) -> None:
        """Hand a frame to an end of the process."""
        if side in self.far.ports:
            self.far.ports[side].send(PortFrame(frame))
        else:
            self.rx[side].put(frame)

    def reset(self) -> None:
        """Forget what a dead process left half-said."""
        self.done.clear()
        for waiting in self.tx:
            waiting.clear()

    @property
    def foreign(self) -> int:
        """Frames at either end that no process of the rig sent."""
        return self.foreign_there + sum(waiting.foreign for waiting in self.tx)


class BusStepper:
    """Steps processes, see ``sim.rig.stepper.Stepper``.

    One that hangs is dropped from the barrier at the end of a round, one that dies at once. Where steps go by stream a
    process is there with its stream and its token: the token of a new life comes after every frame of the one before.

    Parameters
    ----------
    bus, rig : where the keys are
    hang_limit : wall seconds after which a process that does not answer is taken for dead
    medium_of : medium of an end, None where its frames travel on ``bus``
    steps : socket to listen at for the streams of this machine; steps go by keys of the bus where there is none
    """

    def __init__(
        self,
        bus: ZenohBus,
        rig: str,
        *,
        hang_limit: float = 20.0,
        medium_of: MediumOf = lambda _address, _side: None,
        steps: Path | None = None,
    ) -> None:
        self._bus = bus
        self._medium_of = medium_of
        self._rig = rig
        self._hang_limit = hang_limit
        self._seats: dict[int, Seat] = {}
        self._events: queue.SimpleQueue[Arrival] = queue.SimpleQueue()
        self._hung: list[int] = []
        self._junk = 0
        self._cues: dict[str, Acted] = {}  # that the operator has answered
        self._depth = bus.publisher(keys.DEPTH.format(rig=rig))
        self._addresses = {address_name(a): a for a in range(BASE + 1)}
        self._listener = None if steps is None else StepListener(steps, self._on_stream, self._on_answer)
        bus.subscribe_at_once(keys.PORT.format(rig=rig, tube="*", side="*", direction="tx"), self._on_tx)
        if steps is None:
            bus.subscribe(keys.DONE.format(rig=rig, process="*"), self._on_done)
        bus.subscribe(keys.CUE.format(rig=rig), lambda _key, name: self._tell(("cue", 0, 0, name)))
        bus.liveliness_subscribe(keys.LIVELINESS.format(rig=rig, process="*"), self._on_token)

    def alive(self) -> list[int]:
        """Addresses that answer, in ascending order."""
        return sorted(a for a, seat in self._seats.items() if seat.alive)

    def wait_for(self, address: int, *, alive: bool, timeout: float) -> bool:
        """Wait (wall seconds) until a process has come or gone; returns whether it did."""
        deadline = time.monotonic() + timeout
        while (address in self._seats and self._seats[address].alive) != alive:
            if not self._pump(deadline - time.monotonic()):
                return False
        return True

    def wait_for_cue(self, name: str, timeout: float) -> Acted:
        """See ``stepper.Stepper``."""
        deadline = time.monotonic() + timeout
        while name not in self._cues:
            if not self._pump(deadline - time.monotonic()):
                return Acted.NO_ANSWER
        return self._cues.pop(name)

    def drain_hung(self) -> list[int]:
        """Addresses that did not answer a step and were dropped for it since the last call."""
        hung, self._hung = self._hung, []
        return hung

    def drop(self, address: int) -> None:
        """Take a process out of the barrier."""
        if address in self._seats:
            self._seats[address].alive = False
            self._seats[address].far.close()
            self._seats[address].reset()

    def close(self) -> None:
        """Leave every end."""
        for seat in self._seats.values():
            seat.far.close()
        if self._listener is not None:
            self._listener.close()

    def round(self, steps: Mapping[int, list[FrameEvent]]) -> dict[int, Answer]:
        """Give each process its events and wait until all have answered; those that died are missing."""
        waiting: set[int] = set()
        for address in sorted(steps):
            seat = self._seats.get(address)
            if seat is not None and seat.alive:
                self._send(seat, steps[address])
                waiting.add(address)
        answers: dict[int, Answer] = {}
        deadline = time.monotonic() + self._hang_limit
        while waiting:
            for address in sorted(waiting):
                seat = self._seats[address]
                if not seat.alive:
                    waiting.discard(address)
                elif (answer := self._answer(seat)) is not None:
                    answers[address] = answer
                    waiting.discard(address)
            if waiting and not self._pump(deadline - time.monotonic()):
                for address in sorted(waiting):
                    self.drop(address)
                    self._hung.append(address)
                break
        return answers

    def _send(self, seat: Seat, events: list[FrameEvent]) -> None:
        for event, frame in events:
            if event.kind <= Side.LOWER:
                seat.put(Side(event.kind), bytes(frame))
            elif event.kind is Due.DEPTH:
                self._depth.put(event.data)  # for watchers; the ground station has it in its step
        seat.step(seat.marked(event, frame) for event, frame in events)

    def _answer(self, seat: Seat) -> Answer | None:
        while seat.done:
            done = seat.done[0]
            if done.number != seat.step_number:
                seat.done.popleft()
                continue
            if not all(seat.tx[side].has_all([s.mark for s in done.sent if s.side == side]) for side in SIDES):
                return None
            seat.done.popleft()
            seat.foreign_there = done.foreign
            taken = [seat.tx[side].take(is_marked=side not in seat.far.ports) for side in SIDES]
            return Answer([(s._replace(mark=UNMARKED), taken[s.side].popleft()) for s in done.sent], done.wake_at)
        return None

    @property
    def foreign(self) -> int:
        """Frames, answers and cues that no process of this rig sent; they were dropped."""
        return self._junk + sum(seat.foreign for seat in self._seats.values())

    def _pump(self, timeout: float) -> bool:
        """Take what came from the bus's threads or on a stream; False when nothing did in time."""
        is_for_frames = self._listener is None or any(seat.done for seat in self._seats.values())
        try:
            if self._listener is None or timeout <= 0.0:
                arrival = self._events.get(timeout=max(timeout, 0.0))
            elif is_for_frames:  # that have left with the answer, on the bus
                arrival = self._events.get(timeout=min(timeout, FRAME_TICK))
            else:
                arrival = self._events.get_nowait()
        except queue.Empty:
            if self._listener is None or timeout <= 0.0:
                return False
            return self._listener.wait(0.0 if is_for_frames else timeout) or is_for_frames
        self._take(*arrival)
        return True

    def _tell(self, arrival: Arrival) -> None:
        """Take an arrival that is not waited for, on a thread of the bus."""
        self._events.put(arrival)
        if self._listener is not None:
            self._listener.wake()

    def _take(self, what: str, address: int, side: int, payload: bytes) -> None:
        seat = self._seats.get(address)
        if what == "token":
            self._seat_of(address).has_token = bool(side)
            self._settle(address)
        elif what == "cue":
            acted, _, name = payload.decode(errors="replace").partition(" ")
            if acted in set(Acted):
                self._cues[name] = Acted(acted)
            else:
                self._junk += 1
        elif seat is not None and seat.alive:
            if what == "done":
                self._take_answer(seat, payload)
            else:
                seat.tx[side].add(payload)

    def _take_answer(self, seat: Seat, payload: bytes) -> None:
        try:
            seat.done.append(unpack_done(payload))
        except DecodeError:
            self._junk += 1

    def _seat_of(self, address: int) -> Seat:
        seat = self._seats.get(address)
        if seat is None:
            media = {side: medium for side in Side if (medium := self._medium_of(address, side)) is not None}
            seat = self._seats[address] = Seat(self._bus, self._rig, address, media)
        return seat

    def _settle(self, address: int) -> None:
        """See whether a process is there now; nothing of a life before is left."""
        seat = self._seats[address]
        seat.far.close()
        seat.reset()
        alive = seat.has_token and (self._listener is None or seat.stream is not None)
        if alive:
            seat.far.open(partial(self._on_frame, address))
        seat.alive = alive

    def _on_stream(self, name: str, stream: StepStream) -> None:
        if name in self._addresses:
            self._seat_of(self._addresses[name]).stream = stream
            self._settle(self._addresses[name])

    def _on_answer(self, name: str, payload: bytes | None) -> None:
        if name not in self._addresses:
            return
        address = self._addresses[name]
        if payload is not None:
            self._take("done", address, 0, payload)
            return
        seat = self._seats[address]
        seat.stream, seat.has_token = None, False
        self._settle(address)

    def _on_frame(self, address: int, side: Side, frame: bytes) -> None:
        self._events.put(("tx", address, int(side), frame))

    def _on_tx(self, key: str, payload: bytes) -> None:
        _, _, _, name, side, _ = key.split("/")
        if name in self._addresses:
            self._events.put(("tx", self._addresses[name], int(side == "lower"), payload))

    def _on_done(self, key: str, payload: bytes) -> None:
        name = key.split("/")[3]
        if name in self._addresses:
            self._events.put(("done", self._addresses[name], 0, payload))

    def _on_token(self, key: str, alive: bool) -> None:
        name = key.rsplit("/", 1)[1]
        if name in self._addresses:
            self._tell(("token", self._addresses[name], int(alive), b""))
