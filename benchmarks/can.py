"""A hop over CAN beside a bare exchange of python-can, over the same simulated bus in one run; and the codecs' cost."""

from __future__ import annotations

import contextlib
import multiprocessing
import statistics
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import can
import isotp

from borechain.load.rounds import compare_rounds
from sim.can.can_hub import CanHub
from telemetry.application.can_load import AIDING, HEADER, steady_traffic
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.isotp import Receiver, Sender
from telemetry.media.media_table import open_medium
from telemetry.media.port import STEPPER, Port, PortFrame, Priority, TubeEnd
from telemetry.messages import Message, Side
from telemetry.presentation.can_messages import NATIVE, NativeMessage
from telemetry.presentation.msgpack_codec import encode_message, unwritten_message
from telemetry.schema import SPEC_OF
from telemetry.transport.hop import Header, LinkFrame
from telemetry.unwritten import Content

EXCHANGES, ROUNDS = 1000, 15
PAYLOADS, DECODED = 20, 2000
PATIENCE, TURN, TRIES = 60.0, 1.0, 10  # s
AIDING_BYTES = len(encode_message(AIDING))
NATIVE_AIDING = NATIVE[SPEC_OF[type(AIDING)].kind]
context = multiprocessing.get_context("fork")  # before any thread is started


def run() -> dict[str, Any]:
    """Exchanges of one aiding there and back, s each; medians of rounds in turn.

    A joint's controllers report own frames, since that is the acknowledgement, so every frame has two listeners: the
    peer's ends are set up alike, and read theirs. That is the peer on the same bus; beside it stands one whose ends are
    deaf to their own frames, which has the bus do half as much.

    Returns
    -------
    dict
        ``ratios``: ours beside bare python-can (peer), ``slower`` says how many times, with its interval, and of
        ISO-TP ours beside can-isotp's; ``decode_us`` of every cyclic message.
    """
    register_loopback()
    with served() as port, contextlib.ExitStack() as stack:
        for own in (True, False):
            stack.enter_context(echoing(echo_bare, port, own))
        for profile in ("native", "tunnel"):
            stack.enter_context(echoing(echo_hop, *joint(port, profile)))
        exchanges = {
            "bare": stack.enter_context(bare(port, own=True)),
            "deaf": stack.enter_context(bare(port, own=False)),
            "native FD": stack.enter_context(hop(*joint(port, "native"))),
            "tunnel FD": stack.enter_context(hop(*joint(port, "tunnel"))),
        }
        times: dict[str, list[float]] = {name: [] for name in exchanges}
        for _ in range(ROUNDS):
            for name, exchange in exchanges.items():
                begun = time.perf_counter()
                exchange(EXCHANGES)
                times[name].append((time.perf_counter() - begun) / EXCHANGES)
    ratios: dict[str, Any] = {}
    for name in ("native FD", "tunnel FD"):
        ratios[name] = compare_rounds(times[name], times["bare"])
        ratios[f"{name}, peer deaf to its own"] = compare_rounds(times[name], times["deaf"])
    theirs = their_isotp()
    pairs = [(seconds_of(ours_isotp, PAYLOADS), seconds_of(theirs, PAYLOADS)) for _ in range(ROUNDS)]
    ratios["ISO-TP, 169 bytes, FD"] = compare_rounds([ours for ours, _ in pairs], [peer for _, peer in pairs])
    return {"bench": "can", "ratios": ratios, "decode_us": decode_times()}


@contextlib.contextmanager
def served() -> Iterator[int]:
    """Hub of segments in a process of its own; its port."""
    ours, theirs = context.Pipe()
    process = context.Process(target=serve, args=(theirs,), daemon=True)
    process.start()
    try:
        yield ours.recv()
    finally:
        process.kill()
        process.join()


def serve(pipe: Any) -> None:
    """Be the hub."""
    hub = CanHub()
    pipe.send(hub.port)
    hub.serve()


@contextlib.contextmanager
def echoing(target: Callable[..., None], *arguments: Any) -> Iterator[None]:
    """The other end in a process of its own."""
    ready = context.Event()
    process = context.Process(target=target, args=(*arguments, ready), daemon=True)
    process.start()
    try:
        if not ready.wait(PATIENCE):
            raise RuntimeError("the other end did not start")
        yield
    finally:
        process.kill()
        process.join()


@contextlib.contextmanager
def bare(port: int, *, own: bool) -> Iterator[Callable[[int], None]]:
    """Exchanges by python-can alone, of a frame as long as an aiding's, between ends that hear their own or do not."""
    data = bytes(NATIVE_AIDING.fd.layouts[0].length)
    message = can.Message(arbitration_id=0x1234567, data=data, is_fd=True, bitrate_switch=True)
    with bare_bus(port, own=own) as bus:

        def exchange(count: int) -> None:
            for _ in range(count):
                bus.send(message)
                next_heard(bus, PATIENCE)

        exchange(10)
        yield exchange


def bare_bus(port: int, *, own: bool) -> can.BusABC:
    """One end of the peer."""
    return can.Bus(f"{port}/bare {own}", interface=INTERFACE, ignore_config=True, receive_own_messages=own)


def next_heard(bus: can.BusABC, patience: float | None) -> can.Message:
    """The next frame of the other end."""
    while (arrived := bus.recv(patience)) is not None:
        if arrived.is_rx:
            return arrived
    raise RuntimeError("no answer")


def echo_bare(port: int, own: bool, ready: Any) -> None:
    """Send back what comes."""
    register_loopback()
    with bare_bus(port, own=own) as bus:
        ready.set()
        while True:
            bus.send(next_heard(bus, None))


def joint(port: int, profile: str) -> tuple[str, str]:
    """Medium and rig of the joint of a profile."""
    return f"can:{port},interface={INTERFACE},profile={profile}", profile


def ends(name: str) -> tuple[TubeEnd, TubeEnd]:
    """Both ends of a joint without a budget."""
    lower = TubeEnd(name, 1, Side.UPPER, STEPPER)
    return lower.facing, lower


def frame_of(number: int, sender: int) -> PortFrame:
    """The aiding as the link hands it to its port."""
    header = Header(sender, HEADER.epoch, number, *HEADER[3:])
    return PortFrame(LinkFrame(header, [(0, unwritten_message(AIDING))]), Priority.AIDING, "aiding")


@contextlib.contextmanager
def hop(where: str, name: str) -> Iterator[Callable[[int], None]]:
    """Exchanges from port to port, both codecs included."""
    with open_medium(where) as medium:
        mine = medium.open_port(ends(name)[0])
        pinger = Pinger(mine)
        pinger.meet()
        pinger.exchange(10)
        yield pinger.exchange


class Pinger:
    """Sends the next one from the callback of the last, so that no other thread is in the way."""

    def __init__(self, port: Port) -> None:
        self._port, self._number, self._left = port, 0, 0
        self._done = threading.Event()
        port.listen(self._on_frame)

    def meet(self) -> None:
        """Send until the other end answers: the first as signals tell neither end yet who sends them."""
        for _ in range(TRIES):
            self._begin(1)
            if self._done.wait(TURN):
                return
        raise RuntimeError("no answer")

    def exchange(self, count: int) -> None:
        """There and back ``count`` times."""
        self._begin(count)
        if not self._done.wait(PATIENCE):
            raise RuntimeError("no answer")

    def _begin(self, count: int) -> None:
        self._left = count
        self._done.clear()
        self._send()

    def _send(self) -> None:
        self._number += 1
        self._port.send(frame_of(self._number, STEPPER))

    def _on_frame(self, frame: Content) -> None:
        if not holds_aiding(frame):
            return
        self._left -= 1
        if self._left > 0:
            self._send()
        else:
            self._done.set()


def echo_hop(where: str, name: str, ready: Any) -> None:
    """Answer each frame with one."""
    with open_medium(where) as medium:
        port = medium.open_port(ends(name)[1])
        numbers = iter(range(1, 1 << 30))

        def answer(frame: Content) -> None:
            if holds_aiding(frame):
                port.send(frame_of(next(numbers), 1))

        port.listen(answer)
        ready.set()
        threading.Event().wait()


def holds_aiding(frame: Content) -> bool:
    """Whether a frame of the link is more than its header, which the native profile says again now and then."""
    return bool(frame.entries) if isinstance(frame, LinkFrame) else len(frame) > AIDING_BYTES


def ours_isotp() -> None:
    """169 bytes through our machines."""
    sender, receiver = Sender(bytes(169), 64), Receiver(4096)
    while not sender.is_done:
        receiver.on_frame(sender.next_frame())
        if receiver.flow is not None:
            sender.on_flow(receiver.flow)
            receiver.flow = None


def their_isotp() -> Callable[[], None]:
    """169 bytes through can-isotp's without its thread, in layers that stand already."""
    queues: tuple[list[isotp.CanMessage], list[isotp.CanMessage]] = ([], [])

    def layer(own: int) -> isotp.TransportLayerLogic:
        address = isotp.Address(isotp.AddressingMode.Normal_29bits, rxid=1 + own, txid=2 - own)
        return isotp.TransportLayerLogic(
            lambda timeout: queues[own].pop(0) if queues[own] else None,
            queues[1 - own].append,
            address,
            params={"tx_data_length": 64, "can_fd": True, "stmin": 0},
        )

    first, second = layer(0), layer(1)

    def carry() -> None:
        first.send(bytes(169))
        while second.recv() is None:
            first.process()
            second.process()

    return carry


def seconds_of(act: Callable[[], object], count: int) -> float:
    """Median duration of ``act``, s."""
    times = []
    for _ in range(count):
        begun = time.perf_counter()
        act()
        times.append(time.perf_counter() - begun)
    return statistics.median(times)


def decode_times() -> dict[str, float]:
    """Median time (us) from the data of a frame to each cyclic message."""
    found = {}
    for traffic in steady_traffic(1):
        native = NATIVE[SPEC_OF[type(traffic.message)].kind]
        data = native.fd.pack(native.raws_of(traffic.message), 1)
        decode = partial(decoded, native, data)
        found[native.name] = 1e6 * seconds_of(decode, DECODED)
    return found


def decoded(native: NativeMessage, frames: list[bytes]) -> Message:
    """Message of the data of its frames on CAN FD."""
    message: Message = native.message(*native.unpack(frames, fd=True))
    return message


if __name__ == "__main__":
    print(run())
