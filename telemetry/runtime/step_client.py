"""A process's end of a stepper, for a plain loop (``serve_steps``) or an asyncio loop (``serve_stepped``).

Steps come and answers go by keys of the bus, or on a stream where the stepper is on the same machine.

Frames wait until a step names them, so that neither the load of the machine nor the order of arrival has any
influence on what the process does.
"""

from __future__ import annotations

import asyncio
import queue
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from functools import partial

from telemetry import keys
from telemetry.errors import DecodeError
from telemetry.media.port import Port, PortFrame
from telemetry.media.zenoh_bus import ZenohBus
from telemetry.media.zenoh_port import ZenohPort
from telemetry.messages import Side, address_name
from telemetry.runtime.inbox import Inbox
from telemetry.runtime.marked_frames import MarkedFrames, mark_frame
from telemetry.runtime.process_interface import Process
from telemetry.runtime.step_stream import StepStream
from telemetry.runtime.stepped import Done, Due, DueEvent, Sent, pack_done, run_step, unpack_step
from telemetry.unwritten import Content

ABSENT_LIMIT = 60.0  # wall s without a first step until that is reported
UP_LIMIT, UP_TICK = 5.0, 0.001  # wall s that the other end of a port may take to be there, and between two looks
STEP, STOP = -1, -2  # channels beside those of the frames
CHANNELS = (Due.UPPER_FRAME, Due.LOWER_FRAME)
Arrival = tuple[int, bytes]  # channel, payload
Step = tuple[int, list[tuple[DueEvent, bytes]]]  # number, events and the bytes of each
Report = Callable[[str], None]


class StepAssembler:
    """Puts steps together with the frames they name, in whatever order these arrive; what is foreign is dropped."""

    def __init__(self) -> None:
        self._steps: deque[bytes] = deque()
        self._junk = 0
        self._frames: dict[int, MarkedFrames] = {channel: MarkedFrames() for channel in CHANNELS}
        self._step: tuple[int, list[DueEvent]] | None = None

    @property
    def has_step(self) -> bool:
        """Whether a step is here, with or without its frames."""
        return self._step is not None or bool(self._steps)

    @property
    def foreign(self) -> int:
        """Steps that are none, and frames that were dropped because no step named them."""
        return self._junk + sum(frames.foreign for frames in self._frames.values())

    def add(self, channel: int, payload: bytes) -> None:
        """Add what arrived on a channel."""
        if channel == STEP:
            self._steps.append(payload)
        else:
            self._frames[channel].add(payload)

    def take_step(self) -> Step | None:
        """The next step once all its frames are here."""
        if self._step is None:
            if not self._steps:
                return None
            try:
                self._step = unpack_step(self._steps.popleft())
            except DecodeError:
                self._junk += 1
                return self.take_step()
        number, events = self._step
        marks = {channel: [event.mark for event in events if event.kind == channel] for channel in CHANNELS}
        if not all(self._frames[channel].has_all(wanted) for channel, wanted in marks.items()):
            return None
        self._step = None
        taken = {channel: self._frames[channel].take(is_marked=any(wanted)) for channel, wanted in marks.items()}
        return number, [(e, taken[e.kind].popleft() if e.kind in CHANNELS else b"") for e in events]


class StepEnd:
    """Common part of both clients: ports, steps in, answers out, token of life.

    Parameters
    ----------
    bus, rig, address : who this is, and where its token of life is
    ports : the ends of the tube, on whatever medium carries frames
    arrive : takes arrivals on foreign threads
    stream : on which steps come and answers go; by keys of the bus where there is none
    """

    def __init__(
        self,
        bus: ZenohBus,
        rig: str,
        address: int,
        ports: Mapping[Side, Port],
        arrive: Callable[[Arrival], object],
        stream: StepStream | None,
    ) -> None:
        name = address_name(address)
        self.absence = f"{name}: no step came in {ABSENT_LIMIT:.0f} s; is the medium of {rig} running?"
        self.assembler = StepAssembler()
        self._ports = ports
        self._stream = stream
        self._unheard = set(ports)  # ends that have sent nothing yet
        for side, port in ports.items():
            port.listen(partial(_put_frame, arrive, int(side)))
        if stream is not None:
            self._answer: Callable[[bytes], object] = stream.send
        else:
            self._answer = bus.publisher(keys.DONE.format(rig=rig, process=name)).put
            bus.subscribe(keys.STEP.format(rig=rig, process=name), lambda _key, step: arrive((STEP, step)))
        bus.liveliness_token(keys.LIVELINESS.format(rig=rig, process=name))

    def run(self, process: Process, step: Step) -> None:
        """Run a step of ``process`` and send its answer."""
        number, events = step
        sent: list[Sent] = []

        def send(what: Sent, frame: PortFrame) -> None:
            if what.side in self._unheard:
                self._unheard.discard(what.side)
                wait_until_up(self._ports[what.side])
            port = self._ports[what.side]
            # the stepper waits for every frame and in this order, so none may replace or overtake another
            if port.send(PortFrame(frame.payload)):
                is_compared = isinstance(port, ZenohPort)
                sent.append(what._replace(mark=mark_frame(bytes(frame.payload))) if is_compared else what)

        wake_at = run_step(process, events, send)
        self._answer(pack_done(Done(number, sent, wake_at, self.assembler.foreign)))


class StepClient(StepEnd):
    """Client of a process without a loop of its own: ``next_step`` blocks."""

    def __init__(
        self,
        bus: ZenohBus,
        rig: str,
        address: int,
        ports: Mapping[Side, Port],
        stream: StepStream | None = None,
    ) -> None:
        self._arrived: queue.SimpleQueue[Arrival] = queue.SimpleQueue()
        super().__init__(bus, rig, address, ports, self._arrived.put, stream)

    def stop(self) -> None:
        """Make ``next_step`` return None; may be called from a signal handler or another thread."""
        self._arrived.put((STOP, b""))
        if self._stream is not None:
            self._stream.shut()

    def next_step(self, timeout: float | None = None) -> Step | None:
        """Next step with the frame of each frame event, or None after ``stop``.

        Raises
        ------
        TimeoutError
            When nothing arrived for ``timeout`` wall seconds.
        """
        while (step := self.assembler.take_step()) is None:
            if self._stream is not None and not self.assembler.has_step:
                received = self._stream.receive(timeout)
                if received is not None:
                    self.assembler.add(STEP, received)
                    continue
                timeout = None  # the stepper is gone: the launcher ends this process
            try:
                channel, payload = self._arrived.get(timeout=timeout)
            except queue.Empty:
                raise TimeoutError from None
            if channel == STOP:
                return None
            self.assembler.add(channel, payload)
        return step


class AsyncStepClient(StepEnd):
    """Client of a process whose asyncio loop has other work too, such as operators' questions."""

    def __init__(
        self,
        bus: ZenohBus,
        rig: str,
        address: int,
        ports: Mapping[Side, Port],
        stream: StepStream | None = None,
    ) -> None:
        self.inbox: Inbox[Arrival] = Inbox()
        super().__init__(bus, rig, address, ports, self.inbox.put, stream)
        if stream is not None:
            asyncio.get_running_loop().add_reader(stream, self._read, stream)

    def stop(self) -> None:
        """Make ``next_step`` return None; may be called from another thread."""
        self.inbox.close()

    def leave(self) -> None:
        """Stop reading."""
        if self._stream is not None:
            asyncio.get_running_loop().remove_reader(self._stream)

    def _read(self, stream: StepStream) -> None:
        payloads = stream.arrived()
        if payloads is None:
            self.leave()
        for payload in payloads or ():
            self.inbox.put((STEP, payload))

    async def next_step(self) -> Step | None:
        """Next step with the frame of each frame event, or None after ``stop``."""
        while (step := self.assembler.take_step()) is None:
            arrival = await self.inbox.get()
            if arrival is None:
                return None
            self.assembler.add(*arrival)
        return step


def wait_until_up(port: Port) -> None:
    """Wait for the other end of a port that sends for the first time.

    A step on a stream may be here before the bus has told that the stepper listens there; what is sent before that
    waits in the port, and the stepper for it.
    """
    deadline, tick = time.monotonic() + UP_LIMIT, threading.Event()
    while not port.is_up and time.monotonic() < deadline:
        tick.wait(UP_TICK)


def serve_steps(process: Process, client: StepClient, report: Report = lambda line: None) -> None:
    """Run ``process`` step by step until ``client.stop`` ends it; ``report`` takes a line when no first step comes.

    Raises
    ------
    MediumError
        When the bus is lost.
    """
    try:
        step = client.next_step(ABSENT_LIMIT)
    except TimeoutError:
        report(client.absence)
        step = client.next_step()
    while step is not None:
        client.run(process, step)
        step = client.next_step()


async def serve_stepped(process: Process, client: AsyncStepClient, report: Report = lambda line: None) -> None:
    """``serve_steps`` on the running loop, whose other tasks get their turn between two steps.

    Raises
    ------
    MediumError
        When the bus is lost.
    """
    try:
        await client.inbox.wait(ABSENT_LIMIT)
        if not client.inbox and not client.inbox.is_closed:
            report(client.absence)
        while (step := await client.next_step()) is not None:
            client.run(process, step)
    finally:
        client.leave()


def _put_frame(arrive: Callable[[Arrival], object], channel: int, frame: Content) -> None:
    arrive((channel, bytes(frame)))
