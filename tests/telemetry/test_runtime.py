"""What drives a process: steps on a bus and in memory, the inbox of a loop, an end without a neighbour."""

from __future__ import annotations

import asyncio
import contextlib
import math
import os
import signal
import socket
import subprocess
import sys
import threading
import time
from collections.abc import AsyncIterator, Callable, Iterator
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.rig.bus_stepper import BusStepper
from sim.rig.stepper import Answer, FrameEvent
from telemetry import keys
from telemetry.application.endpoint import Endpoint
from telemetry.errors import MediumError
from telemetry.media.neighbours import neighbour_ports, stepped_ports
from telemetry.media.port import Port, PortFrame, Priority, TubeEnd
from telemetry.media.zenoh_bus import JSON, Query, ZenohBus, open_client, open_router
from telemetry.media.zenoh_port import ZenohMedium
from telemetry.messages import ENCODER, Message, Side, TimeReply, TimeRequest
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.runtime import step_client
from telemetry.runtime.hosting import Place
from telemetry.runtime.inbox import INBOX_LIMIT, Inbox
from telemetry.runtime.marked_frames import mark_frame
from telemetry.runtime.own_clock import ABSENT_LIMIT, AbsenceWatch, OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.step_client import STEP, AsyncStepClient, StepAssembler, StepClient, serve_stepped, serve_steps
from telemetry.runtime.step_stream import StepStream
from telemetry.runtime.stepped import Due, DueEvent, pack_step, run_step, unpack_step
from telemetry.runtime.timing import CycleTiming
from telemetry.transport.hop import HopLink, parse_frame

PATIENCE = 30.0
RIG = "runtime"


class Plain(Process):
    """The encoder's conversation and nothing else; keeps the depths it hears."""

    def __init__(self) -> None:
        self.endpoint = Endpoint(ENCODER, frozenset(Side), boot_count=1, is_clock_root=True)
        self.depths: list[tuple[float, float]] = []

    def on_depth(self, rig_time: float, md: float) -> None:
        self.depths.append((rig_time, md))


class Watched(Plain):
    """Keeps on which threads frames are handled, and refuses those that say so."""

    def __init__(self) -> None:
        super().__init__()
        self.threads: list[int] = []

    def on_frame(self, side: Side, frame: bytes, now: float, margin: float = math.inf) -> None:
        self.threads.append(threading.get_ident())
        if frame == b"refuse":
            raise RuntimeError("no more")
        super().on_frame(side, frame, now, margin)


class HastyClock(OwnClock):
    """Shows a minute every 0.3 s."""

    def now(self) -> float:
        return 200.0 * time.monotonic()


@dataclass(frozen=True)
class Router:
    endpoint: str
    bus: ZenohBus


@pytest.fixture
def router() -> Iterator[Router]:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    with open_router(endpoint) as bus:
        yield Router(endpoint, bus)


def steps() -> list[list[FrameEvent]]:
    """Timers and frames of a neighbour at both ends."""
    below = Endpoint(1, frozenset(Side), boot_count=1)
    below.advance(10.0)
    hellos = dict(below.take_frames(10.0))
    return [
        [(DueEvent(Due.TIMER, 10.0), b"")],
        [
            (DueEvent(Due.LOWER_FRAME, 10.1), hellos[Side.UPPER].payload),
            (DueEvent(Due.UPPER_FRAME, 10.2), hellos[Side.LOWER].payload),
            (DueEvent(Due.TIMER, 10.3), b""),
        ],
        [(DueEvent(Due.CYCLE, 11.4, [10.8, 1, 11.0, 1]), b""), (DueEvent(Due.TIMER, 11.4), b"")],
    ]


def answers_of(stepper: BusStepper) -> list[Answer]:
    assert stepper.wait_for(ENCODER, alive=True, timeout=PATIENCE)
    return [stepper.round({ENCODER: step})[ENCODER] for step in steps()]


def answers_in_memory() -> list[Answer]:
    process, answers = Plain(), []
    for step in steps():
        frames: list[tuple[object, bytes]] = []
        wake_at = run_step(process, step, lambda sent, frame, to=frames: to.append((sent, frame.payload)))
        answers.append(Answer(frames, wake_at))  # type: ignore[arg-type]
    return answers


@pytest.fixture(params=["by keys", "by stream"])
def steps_at(request: pytest.FixtureRequest, tmp_path: Path) -> Path | None:
    return tmp_path / "steps" if request.param == "by stream" else None


@contextlib.contextmanager
def stepping(router: Router, steps_at: Path | None) -> Iterator[BusStepper]:
    with contextlib.closing(BusStepper(router.bus, RIG, steps=steps_at)) as stepper:
        yield stepper


def stream_to(steps_at: Path | None) -> contextlib.AbstractContextManager[StepStream | None]:
    return Place(RIG, "", Path(), steps=steps_at).step_stream("encoder")


class TestSteps:
    def test_a_plain_loop_answers_as_an_object_does(self, router: Router, steps_at: Path | None) -> None:
        with (
            stepping(router, steps_at) as stepper,
            open_client(router.endpoint, PATIENCE) as bus,
            stream_to(steps_at) as stream,
        ):
            client = StepClient(bus, RIG, ENCODER, stepped_ports(ZenohMedium(bus), RIG, ENCODER, Side), stream)
            thread = threading.Thread(target=serve_steps, args=(Plain(), client))
            thread.start()
            try:
                assert answers_of(stepper) == answers_in_memory()
            finally:
                client.stop()
                thread.join()

    async def test_an_asyncio_loop_does_too_and_answers_operators_meanwhile(
        self, router: Router, steps_at: Path | None
    ) -> None:
        with (
            stepping(router, steps_at) as stepper,
            open_client(router.endpoint, PATIENCE) as bus,
            stream_to(steps_at) as stream,
        ):
            questions: Inbox[Query] = Inbox()
            bus.queryable_kept("operator/question", questions.put)
            client = AsyncStepClient(bus, RIG, ENCODER, stepped_ports(ZenohMedium(bus), RIG, ENCODER, Side), stream)
            serving = asyncio.create_task(serve_stepped(Plain(), client))
            answering = asyncio.create_task(answer(questions))
            assert await asyncio.to_thread(answers_of, stepper) == answers_in_memory()
            (reply,) = await asyncio.to_thread(router.bus.get, "operator/question", PATIENCE)
            assert reply.payload == b"on the loop"
            client.stop()
            questions.close()
            await asyncio.wait_for(asyncio.gather(serving, answering), PATIENCE)

    async def test_a_stepper_that_never_comes_is_reported(
        self, router: Router, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        monkeypatch.setattr(step_client, "ABSENT_LIMIT", 0.01)
        reported: Inbox[str] = Inbox()
        with open_client(router.endpoint, PATIENCE) as bus:
            plain, other = StepClient(bus, RIG, 1, {}), AsyncStepClient(bus, RIG, 2, {})
            thread = threading.Thread(target=serve_steps, args=(Plain(), plain, reported.put))
            thread.start()
            serving = asyncio.create_task(serve_stepped(Plain(), other, reported.put))
            lines = [await asyncio.wait_for(reported.get(), PATIENCE) for _ in range(2)]
            plain.stop()
            other.stop()
            await asyncio.wait_for(serving, PATIENCE)
            thread.join()
        assert sorted(str(line).partition(":")[0] for line in lines) == ["1", "2"]
        assert all("is the medium of runtime running?" in str(line) for line in lines)

    def test_a_process_is_there_with_its_stream_and_its_token_and_gone_with_its_stream(
        self, router: Router, tmp_path: Path
    ) -> None:
        place = tmp_path / "steps"
        with stepping(router, place) as stepper:
            for _ in range(2):
                with open_client(router.endpoint, PATIENCE) as bus, stream_to(place) as stream:
                    assert not stepper.wait_for(ENCODER, alive=True, timeout=0.2)
                    bus.liveliness_token(keys.LIVELINESS.format(rig=RIG, process="encoder"))
                    assert stepper.wait_for(ENCODER, alive=True, timeout=PATIENCE)
                    assert stream is not None
                    stream.shut()
                    assert stepper.wait_for(ENCODER, alive=False, timeout=PATIENCE)

    def test_one_that_dies_in_a_step_is_missing_from_the_round(self, router: Router, tmp_path: Path) -> None:
        place = tmp_path / "steps"
        with (
            stepping(router, place) as stepper,
            open_client(router.endpoint, PATIENCE) as bus,
            stream_to(place) as stream,
        ):
            assert stream is not None
            bus.liveliness_token(keys.LIVELINESS.format(rig=RIG, process="encoder"))
            assert stepper.wait_for(ENCODER, alive=True, timeout=PATIENCE)
            threading.Thread(target=lambda: (stream.receive(PATIENCE), stream.shut())).start()
            assert stepper.round({ENCODER: [(DueEvent(Due.TIMER, 10.0), b"")]}) == {}
            assert stepper.drain_hung() == []

    @pytest.mark.parametrize("said", [b"", b"\xff\xff\xff\xff", b"\0\0\0\7nobody!", b"\0\0\0\2\xff\xfe"])
    def test_a_stranger_at_the_socket_stops_nobody(self, router: Router, tmp_path: Path, said: bytes) -> None:
        place = tmp_path / "steps"
        with stepping(router, place) as stepper, socket.socket(socket.AF_UNIX) as stranger:
            stranger.connect(str(place))
            stranger.sendall(said)
            stranger.shutdown(socket.SHUT_WR)
            with open_client(router.endpoint, PATIENCE) as bus, stream_to(place) as stream:
                client = StepClient(bus, RIG, ENCODER, stepped_ports(ZenohMedium(bus), RIG, ENCODER, Side), stream)
                thread = threading.Thread(target=serve_steps, args=(Plain(), client))
                thread.start()
                try:
                    assert answers_of(stepper) == answers_in_memory()
                finally:
                    client.stop()
                    thread.join()

    def test_a_stepper_that_is_not_there_is_one_line(self, tmp_path: Path) -> None:
        with pytest.raises(MediumError, match=r"encoder: no stepper at .*is the medium running"), stream_to(tmp_path):
            pass

    def test_a_step_waits_for_its_frames_in_any_order_of_arrival(self) -> None:
        assembler = StepAssembler()
        assembler.add(Due.LOWER_FRAME, b"early")
        assert assembler.take_step() is None
        events = [DueEvent(Due.LOWER_FRAME, 1.0), DueEvent(Due.UPPER_FRAME, 2.0), DueEvent(Due.TIMER, 3.0)]
        assembler.add(STEP, pack_step(7, events))
        assert assembler.take_step() is None
        assembler.add(Due.UPPER_FRAME, b"late")
        assert assembler.take_step() == (7, list(zip(events, [b"early", b"late", b""], strict=True)))
        assert assembler.take_step() is None

    @given(st.lists(st.binary(max_size=3), max_size=6), st.data())
    def test_a_step_takes_its_own_frames_out_of_any_number_of_foreign_ones(
        self, frames: list[bytes], data: st.DataObject
    ) -> None:
        """Foreign frames are put between, before and behind; one that has the bytes of the next is that one."""
        assembler = StepAssembler()
        for number in (1, 2):
            events = [DueEvent(Due.UPPER_FRAME, 1.0, None, mark_frame(frame)) for frame in frames]
            assembler.add(STEP, pack_step(number, events))
            for frame in frames:
                for foreign in data.draw(st.lists(st.binary(min_size=4, max_size=6), max_size=3)):
                    assembler.add(Due.UPPER_FRAME, foreign)
                    assembler.add(STEP, foreign)
                assembler.add(Due.UPPER_FRAME, frame)
            step = assembler.take_step()
            assert step is not None
            assert (step[0], [frame for _, frame in step[1]]) == (number, frames)

    def test_what_waits_for_no_step_is_bounded(self) -> None:
        assembler = StepAssembler()
        for number in range(10_000):
            assembler.add(Due.UPPER_FRAME, b"foreign %d" % number)
        assembler.add(Due.UPPER_FRAME, b"own")
        assembler.add(Due.UPPER_FRAME, b"behind")
        assembler.add(STEP, pack_step(1, [DueEvent(Due.UPPER_FRAME, 1.0, None, mark_frame(b"own"))]))
        assert assembler.take_step() is not None
        assert assembler.foreign == 10_001
        assembler.add(Due.UPPER_FRAME, b"own")
        assembler.add(STEP, pack_step(2, [DueEvent(Due.UPPER_FRAME, 1.0, None, mark_frame(b"own"))]))
        assert assembler.take_step() is not None
        assert assembler.foreign == 10_001  # what was behind has gone with its step

    def test_a_step_of_another_version_is_one_line(self) -> None:
        with pytest.raises(MediumError, match="step 3: 99 is not a valid Due; is it of another version"):
            unpack_step(pack_step(3, [DueEvent(99, 1.0)]))  # type: ignore[arg-type]


async def answer(questions: Inbox[Query]) -> None:
    while (query := await questions.get()) is not None:
        query.reply("operator/question", b"on the loop", JSON)
        query.finish()


class TestInbox:
    async def test_what_finds_it_full_is_counted(self) -> None:
        inbox: Inbox[int] = Inbox(limit=10)
        threads = [threading.Thread(target=lambda: [inbox.put(k) for k in range(100)]) for _ in range(4)]
        for thread in threads:
            thread.start()
        for thread in threads:
            thread.join()
        assert (len(inbox), inbox.dropped) == (10, 390)
        assert await inbox.get() == 0
        assert inbox.put(5)

    async def test_order_is_kept_and_nothing_is_lost_while_it_is_taken(self) -> None:
        inbox: Inbox[int] = Inbox()
        thread = threading.Thread(target=lambda: [inbox.put(k) for k in range(1000)])
        thread.start()
        got = [await asyncio.wait_for(inbox.get(), PATIENCE) for _ in range(1000)]
        thread.join()
        assert all(b - a == 1 for a, b in pairwise(k for k in got if k is not None))
        assert (len(got), inbox.dropped) == (1000, 0)

    async def test_it_waits_no_longer_than_asked(self) -> None:
        inbox: Inbox[int] = Inbox()
        await asyncio.wait_for(inbox.wait(0.01), PATIENCE)
        assert inbox.take() is None

    async def test_a_closed_one_gives_nothing(self) -> None:
        inbox: Inbox[int] = Inbox()
        inbox.put(1)
        waiting = asyncio.create_task(inbox.get())
        inbox.close()
        assert await asyncio.wait_for(waiting, PATIENCE) is None

    def test_one_whose_loop_has_ended_is_let_alone(self) -> None:
        async def make() -> Inbox[int]:
            return Inbox()

        inbox = asyncio.run(make())
        inbox.put(1)
        inbox.close()


class TestOwnClock:
    async def test_frames_that_find_the_loop_full_are_counted(self, router: Router) -> None:
        flood = 3000
        medium = ZenohMedium(router.bus)
        ports = neighbour_ports(medium, RIG, ENCODER, {Side.LOWER: 1})
        process = Plain()
        loop = OwnClockLoop(process, ports, OwnClock(), CycleTiming(), 0.5)
        sender = medium.open_port(TubeEnd(RIG, 1, Side.UPPER, ENCODER))
        await until(lambda: sender.is_up)
        for k in range(flood):
            sender.send(PortFrame(b"%d" % k))
        await until(lambda: loop.losses()["inbox_dropped"] == flood - INBOX_LIMIT)
        assert loop.losses()["ports"]["lower"] == {"is_up": False, "not_sent": {}}
        running = asyncio.create_task(loop.run())
        await until(lambda: process.endpoint.link_counters().get("bad_frames") == INBOX_LIMIT)
        loop.stop()
        await asyncio.wait_for(running, PATIENCE)

    async def test_calls_come_to_the_process_in_order_on_the_loop(self, router: Router) -> None:
        process = Plain()
        loop = OwnClockLoop(process, {}, OwnClock(), CycleTiming(), 0.5)
        running = asyncio.create_task(loop.run())
        await asyncio.to_thread(loop.call, lambda p, now: p.on_depth(1.0, 2.0))
        await asyncio.to_thread(loop.call, lambda p, now: loop.stop())
        await asyncio.wait_for(running, PATIENCE)
        assert process.depths == [(1.0, 2.0)]

    async def test_a_neighbour_that_never_comes_is_a_line_and_no_hang(self, router: Router) -> None:
        reported: Inbox[str] = Inbox()
        ports = neighbour_ports(ZenohMedium(router.bus), RIG, ENCODER, {Side.LOWER: 1})
        loop = OwnClockLoop(Plain(), ports, HastyClock(), CycleTiming(), 0.5, reported.put)
        running = asyncio.create_task(loop.run())
        line = await asyncio.wait_for(reported.get(), PATIENCE)
        loop.stop()
        await asyncio.wait_for(running, PATIENCE)
        assert line is not None
        assert line.startswith("lower end: no neighbour heard for 60 s, the port is down")
        assert not loop.losses()["ports"]["lower"]["is_up"]

    async def test_an_idle_process_answers_on_the_thread_that_hears(self, router: Router) -> None:
        process = Watched()
        async with running_at_once(process, router.bus) as (loop, sender):
            answers: list[bytes] = []
            sender.listen(answers.append)
            await until(lambda: loop.losses()["ports"]["lower"]["is_up"])
            while set(process.threads) <= {threading.get_ident()}:  # until no cycle was due just then
                asking = HopLink(1, 1)
                asking.send_best_effort(encode_message(TimeRequest(1.0)), "time", Priority.TIME)
                (frame,) = asking.take_frames(1.0)
                answers.clear()
                await asyncio.to_thread(sender.send, frame)
            await until(lambda: any(isinstance(said, TimeReply) for frame in answers for said in messages_of(frame)))

    async def test_a_frame_that_finds_the_process_at_work_waits_for_the_loop(self, router: Router) -> None:
        process = Watched()
        async with running_at_once(process, router.bus) as (loop, sender):
            meanwhile: list[int] = []

            def work(_process: Process, _now: float) -> None:
                thread = threading.Thread(target=sender.send, args=(PortFrame(b"no frame"),))
                thread.start()
                thread.join(PATIENCE)
                meanwhile.extend(process.threads)

            loop.call(work)
            await until(lambda: process.endpoint.link_counters().get("bad_frames") == 1)
        assert meanwhile == []
        assert process.threads == [threading.get_ident()]

    async def test_an_error_on_the_thread_that_hears_ends_the_loop(self, router: Router) -> None:
        with pytest.raises(RuntimeError, match="no more"):
            async with running_at_once(Watched(), router.bus) as (_, sender):
                await asyncio.to_thread(sender.send, PortFrame(b"refuse"))

    def test_a_silent_end_is_named_once_until_somebody_is_heard(self) -> None:
        watch = AbsenceWatch(Side, begin=100.0)
        silent: dict[Side, object] = dict.fromkeys(Side)
        upper = silent | {Side.UPPER: "encoder"}
        assert watch.find(upper, 101.0) == []
        assert watch.find(upper, 100.0 + ABSENT_LIMIT) == [Side.LOWER]
        assert watch.find(silent, 101.0 + ABSENT_LIMIT) == []
        assert watch.find(silent, 101.0 + 2.0 * ABSENT_LIMIT) == [Side.UPPER]
        assert watch.find(silent | {Side.LOWER: "tube"}, 102.0 + 2.0 * ABSENT_LIMIT) == []
        assert watch.find(silent, 103.0 + 3.0 * ABSENT_LIMIT) == [Side.LOWER]


@contextlib.asynccontextmanager
async def running_at_once(process: Process, bus: ZenohBus) -> AsyncIterator[tuple[OwnClockLoop, Port]]:
    """Loop of a process whose frames are handled on the threads that hear them, and the end that it listens to."""
    medium = ZenohMedium(bus)
    ports = neighbour_ports(medium, RIG, ENCODER, {Side.LOWER: 1})
    loop = OwnClockLoop(process, ports, OwnClock(), CycleTiming(), 0.5, at_once=True)
    sender = medium.open_port(TubeEnd(RIG, 1, Side.UPPER, ENCODER))
    running = asyncio.create_task(loop.run())
    began = asyncio.Event()
    loop.call(lambda p, now: began.set())
    await asyncio.wait_for(began.wait(), PATIENCE)
    await until(lambda: sender.is_up)
    try:
        yield loop, sender
        loop.stop()
    finally:
        await asyncio.wait_for(running, PATIENCE)


def messages_of(frame: bytes) -> list[Message]:
    """What a frame of the link says."""
    parsed = parse_frame(frame)
    assert parsed is not None
    return [decode_message(payload) for _, payload in parsed[1]]


async def until(probe: Callable[[], bool]) -> None:
    """Wait until ``probe`` holds."""

    async def poll() -> None:
        while not probe():
            await asyncio.sleep(0.005)

    await asyncio.wait_for(poll(), PATIENCE)


@pytest.mark.slow
def test_a_router_goes_although_an_end_lives_and_reads_nothing() -> None:
    """Its line is full, so that no farewell passes."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        endpoint = f"tcp/127.0.0.1:{probe.getsockname()[1]}"
    watching = [sys.executable, "-m", "borechain", "watch", "full/**", "--endpoint", endpoint]
    with open_router(endpoint) as bus, subprocess.Popen(watching, stdout=subprocess.PIPE) as watcher:
        try:
            publisher = bus.publisher("full/line", JSON, droppable=True)
            while not publisher.is_heard:
                assert watcher.poll() is None
                bus.tokens("full/*", 0.05)
            publisher.put(b"{}")
            assert watcher.stdout is not None
            assert watcher.stdout.readline()
            os.kill(watcher.pid, signal.SIGSTOP)
            for _ in range(400):
                publisher.put(b"1" * 100_000)
            bus.close()
        finally:
            watcher.kill()
