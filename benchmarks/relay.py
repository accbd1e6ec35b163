"""A node that relays an aiding over zenoh, beside a process that puts the same bytes on as it hears them."""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
import queue
import socket
import statistics
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from borechain.load.rounds import compare_rounds
from node.kernels.step.precompile import warm_up
from node.process.drivers.timed import TimedImu
from node.process.node_host import run_node
from sim.rig.realtime_run import clock_offset
from sim.world.recording import record_sensors, turning_once
from sim.world.world import World
from telemetry.application.endpoint import Endpoint
from telemetry.media.port import Port, TubeEnd
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router, use_few_threads
from telemetry.media.zenoh_port import CONNECT_TIMEOUT, ZenohMedium
from telemetry.messages import ENCODER, Aiding, Side
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.runtime.event_loop import run_event_loop as run_loop
from telemetry.runtime.hosting import OwnTime, Place
from telemetry.runtime.inbox import Inbox
from telemetry.transport.hop import parse_frame

ROUNDS, EXCHANGES = 25, 40
RIG, TUBE, BELOW = "relay", 1, 2
BARE, LOOP = "bare", "loop"  # beginnings of the keys of either process that puts on
PATIENCE, TURN = 60.0, 0.05  # s
NUMBER = 8  # bytes, by which the bare exchange knows its own
RECORDED = 600.0  # s, for which the string rests; the benchmark takes a few
context = multiprocessing.get_context("fork")  # before any session is opened


def run() -> dict[str, Any]:
    """From a put above to its arrival below: of the encoder's aiding through a node, and of bytes through a process.

    Both stand between the same two ends, on the same router, and take one put in and one put out. The node judges the
    aiding on the way, keeps it for its filter and writes the path anew.

    Returns
    -------
    dict
        ``ratios``: ours beside the peer, with how many times ``slower`` and the interval of that; and what it takes to
        hand the same bytes to an asyncio loop on the way, as a node does, beside the same peer.
    """
    warm_up()  # before time counts: a fresh machine compiles for half a minute
    with tempfile.TemporaryDirectory(prefix="borechain-") as place, contextlib.ExitStack() as stack:
        folder, endpoint = Path(place), free_endpoint()
        world = turning_once(TUBE, time.monotonic(), RECORDED, 1.0, 2.0 * RECORDED, 1, 0.0)
        record_sensors(world, folder)
        stack.enter_context(running(relay_as_node, world, folder, endpoint))
        stack.enter_context(running(put_on, endpoint))
        stack.enter_context(running(put_on_by_loop, endpoint))
        bus = stack.enter_context(open_router(endpoint))
        encoder = stack.enter_context(contextlib.closing(EncoderEnd(bus)))
        bare, loop = Exchange(bus, BARE), Exchange(bus, LOOP)
        for end in (encoder, bare, loop):
            end.meet()
        acts: dict[str, Callable[[], float]] = {
            "relay": encoder.exchange,
            "loop": lambda: loop.exchange(encoder.length),
            "bare": lambda: bare.exchange(encoder.length),
        }
        times: dict[str, list[float]] = {f"{name}{how}": [] for name in acts for how in ("", " in turn")}
        for _ in range(ROUNDS):
            for name, act in acts.items():
                times[name].append(statistics.median(act() for _ in range(EXCHANGES)))
            turns = [[act() for act in acts.values()] for _ in range(EXCHANGES)]
            for name, found in zip(acts, zip(*turns, strict=True), strict=True):
                times[f"{name} in turn"].append(statistics.median(found))
    ratios = {
        "relay over zenoh": compare_rounds(times["relay"], times["bare"]),
        "handed to an asyncio loop": compare_rounds(times["loop"], times["bare"]),
        "relay over zenoh, in turn with the peer": compare_rounds(times["relay in turn"], times["bare in turn"]),
        "handed to an asyncio loop, in turn with the peer": compare_rounds(
            times["loop in turn"], times["bare in turn"]
        ),
    }
    return {"bench": "relay", "ratios": ratios}


def free_endpoint() -> str:
    """Return an endpoint on loopback with a free TCP port."""
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@contextlib.contextmanager
def running(target: Callable[..., None], *arguments: Any) -> Iterator[None]:
    """A process beside this one; it finds the router once there is one."""
    process = context.Process(target=target, args=arguments, daemon=True)
    process.start()
    try:
        yield
    finally:
        process.terminate()
        process.join()


def relay_as_node(world: World, folder: Path, endpoint: str) -> None:
    """Be the node of the tube, between the encoder and a tube below."""
    own_time = OwnTime({Side.UPPER: ENCODER, Side.LOWER: BELOW}, clock_offset(world, TUBE))
    imu = TimedImu(folder / f"tube-{TUBE}.npy")
    run_node(Place(RIG, endpoint, folder / "node"), world.tube_settings(TUBE), [imu], own_time)


def put_on(endpoint: str) -> None:
    """Put on what is heard, on the thread that hears it."""
    use_few_threads()  # as a node does
    with open_client(endpoint, CONNECT_TIMEOUT) as bus:
        onward = bus.publisher(f"{BARE}/back")
        bus.subscribe_at_once(f"{BARE}/there", lambda _key, payload: onward.put(payload))
        threading.Event().wait()


def put_on_by_loop(endpoint: str) -> None:
    """Put on what is heard, on the loop of a process, where a node handles everything."""
    use_few_threads()
    run_loop(live_by_loop(endpoint))


async def live_by_loop(endpoint: str) -> None:
    """``put_on_by_loop`` on the running loop."""
    with open_client(endpoint, CONNECT_TIMEOUT) as bus:
        onward = bus.publisher(f"{LOOP}/back")
        inbox: Inbox[bytes] = Inbox()
        bus.subscribe_at_once(f"{LOOP}/there", lambda _key, payload: inbox.put(payload))
        while (payload := await inbox.get()) is not None:
            onward.put(payload)


class Exchange:
    """Both ends around a process that puts on what it hears; ``keys`` is the beginning of its keys."""

    def __init__(self, bus: ZenohBus, keys: str) -> None:
        self._keys = keys
        self._there = bus.publisher(f"{keys}/there")
        self._arrivals: queue.SimpleQueue[tuple[float, bytes]] = queue.SimpleQueue()
        self._numbers = itertools.count()
        bus.subscribe_at_once(f"{keys}/back", lambda _key, payload: self._arrivals.put((time.perf_counter(), payload)))

    def meet(self) -> None:
        """Wait until the other process answers."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                self.exchange(NUMBER, TURN)
                return
        raise RuntimeError(f"{self._keys}: the message sent was not passed on")

    def exchange(self, length: int, patience: float = PATIENCE) -> float:
        """Time of ``length`` bytes there and back, s."""
        payload = next(self._numbers).to_bytes(NUMBER).ljust(length, b"\0")
        begun = time.perf_counter()
        self._there.put(payload)
        until = begun + patience
        while True:
            arrived, heard = self._arrivals.get(timeout=max(until - time.perf_counter(), 0.0))
            if heard == payload:
                return arrived - begun


class EncoderEnd:
    """The encoder's end above the node, and the listener below it."""

    def __init__(self, bus: ZenohBus) -> None:
        medium = ZenohMedium(bus)
        self.length = 0  # bytes of the newest frame with an aiding
        self._endpoint = Endpoint(ENCODER, frozenset({Side.LOWER}), boot_count=1, is_clock_root=True)
        self._above: queue.SimpleQueue[bytes] = queue.SimpleQueue()
        self._below: queue.SimpleQueue[tuple[float, bytes]] = queue.SimpleQueue()
        self._upper: Port = medium.open_port(TubeEnd(RIG, ENCODER, Side.LOWER, TUBE))
        self._lower: Port = medium.open_port(TubeEnd(RIG, BELOW, Side.UPPER, TUBE))
        self._upper.listen(self._above.put)
        self._lower.listen(lambda frame: self._below.put((time.perf_counter(), frame)))
        self._sequence = 1 << 32

    def close(self) -> None:
        """Let both ends go."""
        self._upper.close()
        self._lower.close()

    def meet(self) -> None:
        """Wait until the node has its clock and hands an aiding down."""
        until = time.monotonic() + PATIENCE
        while time.monotonic() < until:
            with contextlib.suppress(queue.Empty):
                self._hand_down(TURN)
                return
        raise RuntimeError("the node relayed nothing")

    def exchange(self) -> float:
        """Time from the put of one aiding to the arrival of what the node makes of it, s."""
        try:
            return self._hand_down(PATIENCE)
        except queue.Empty:
            raise RuntimeError(f"aiding {self._sequence}: the node did not relay it") from None

    def _hand_down(self, patience: float) -> float:
        self._attend()
        now = time.monotonic()
        self._sequence += 1
        clock = self._endpoint.clock
        aiding = Aiding(0.0, 1e-8, 0.0, 0.0, 0.0, clock.rig_from_local(now), self._sequence, 0, epoch=clock.epoch)
        self._endpoint.send_aiding(aiding, now)
        ((_, frame),) = self._endpoint.take_frames(now)
        self.length = len(frame.payload)
        begun = time.perf_counter()
        self._upper.send(frame)
        until = begun + patience
        while True:
            arrived, heard = self._below.get(timeout=max(until - time.perf_counter(), 0.0))
            if self._sequence in sequences(heard):
                return arrived - begun

    def _attend(self) -> None:
        """Answer the node's questions, such as for the time, and say hello."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._endpoint.receive(Side.LOWER, self._above.get_nowait(), time.monotonic())
        now = time.monotonic()
        self._endpoint.advance(now)
        for _, frame in self._endpoint.take_frames(now):
            self._upper.send(frame)


def sequences(frame: bytes) -> list[int]:
    """Sequence numbers of the aidings in a frame of the link."""
    parsed = parse_frame(frame)
    if parsed is None:
        raise RuntimeError("expected a frame of the link")
    messages = [decode_message(content) for _, content in parsed[1]]
    return [message.sequence for message in messages if isinstance(message, Aiding)]
