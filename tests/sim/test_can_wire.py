"""A simulated CAN segment: pace, arbitration, acknowledgement, errors and bus-off, alone and under python-can."""

from __future__ import annotations

import contextlib
import itertools
import multiprocessing
from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.can.can_hub import CanHub, running_hub
from sim.can.wire import SEND_BUFFER, CanWire, Delivery
from sim.errors import RigError
from telemetry.media.can_frame import (
    ERROR,
    ERROR_ACK,
    ERROR_BUS_OFF,
    ERROR_CONTROLLER,
    ERROR_PROTOCOL,
    EXTENDED,
    CanFrame,
    unpack_frame,
)
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_timing import FD_LENGTHS, BitRates, classic_bits, fd_bits, fd_length

PATIENCE = 30.0
SLOW = BitRates(125_000.0, 500_000.0)


def frame(identifier: int, data: bytes = b"", *, fd: bool = False) -> CanFrame:
    return CanFrame(EXTENDED | identifier, data, fd)


def heard(deliveries: list[Delivery], name: str) -> list[bytes]:
    """Data of the frames of others that a controller got."""
    return [d.frame.data for d in deliveries if d.to == name and not d.frame.own and not d.frame.is_error]


def errors(deliveries: list[Delivery], name: str) -> list[int]:
    return [d.frame.can_id & ~ERROR for d in deliveries if d.to == name and d.frame.is_error]


def pair(rates: BitRates | None = None, **options: bool) -> CanWire:
    wire = CanWire(rates)
    wire.attach("a", **options)
    wire.attach("b", **options)
    return wire


def test_a_classic_frame_is_as_long_as_the_response_time_analysis_says() -> None:
    """Davis, Burns, Bril and Lukkien 2007: 160 bits for eight bytes under an identifier of 29 bit, 80 for none."""
    assert classic_bits(8) == 160
    assert classic_bits(0) == 80
    assert BitRates(1e6).duration(8, fd=False) == pytest.approx(160e-6)


def test_an_fd_frame_is_counted_field_by_field() -> None:
    nominal, data = fd_bits(64)
    assert nominal == 36 + 8 + 13
    assert data == (5 + 512) + 129 + (4 + 21 + 7)
    assert BitRates(500e3, 2e6).duration(64, fd=True) == pytest.approx(57 / 500e3 + 678 / 2e6)


@given(st.integers(0, 64))
def test_an_fd_frame_is_the_shortest_that_holds_its_data(length: int) -> None:
    assert fd_length(length) in FD_LENGTHS
    assert fd_length(length) == min(known for known in FD_LENGTHS if known >= length)


def test_more_than_an_fd_frame_holds_is_refused() -> None:
    with pytest.raises(ValueError, match="at most 64 bytes, got 65"):
        fd_length(65)


@given(st.integers(0, 2**29 - 1), st.binary(max_size=64), st.integers(0, 1000), st.booleans())
def test_a_frame_survives_its_layout(identifier: int, data: bytes, count: int, own: bool) -> None:
    before = CanFrame(EXTENDED | identifier, data, len(data) > 8, own)
    assert unpack_frame(before.pack(count)) == (before, count % 256)


@given(st.binary(max_size=100))
def test_bytes_that_are_no_frame_are_refused(datagram: bytes) -> None:
    try:
        found, _ = unpack_frame(datagram)
    except ValueError:
        return
    assert len(datagram) in (16, 72)
    assert len(found.data) <= 64


def test_the_lower_identifier_goes_first_and_each_frame_takes_its_time() -> None:
    wire = pair(SLOW)
    for identifier, data in ((0x300, b"late"), (0x200, b"more")):
        wire.submit("a", frame(identifier, data), 0.0)
    wire.submit("b", frame(0x100, b"first"), 0.0)
    first, second = SLOW.duration(5, fd=False), SLOW.duration(4, fd=False)
    assert wire.advance(first - 1e-9) == []
    assert heard(wire.advance(first), "a") == [b"first"]
    assert wire.due() == pytest.approx(first + second)
    assert heard(wire.advance(1.0), "b") == [b"late", b"more"]  # of one controller the oldest first
    assert wire.busy == pytest.approx(first + 2 * second)


def test_a_sender_waits_for_the_end_of_a_frame_and_no_longer() -> None:
    wire = pair(SLOW)
    wire.submit("a", frame(0x1FFFFFFF, bytes(64), fd=True), 0.0)
    wire.advance(0.0)
    wire.submit("b", frame(1, b"aiding"), 0.0001)
    wire.submit("a", frame(0x1FFFFFFF, bytes(64), fd=True), 0.0)
    block = SLOW.duration(64, fd=True)
    arrived = wire.advance(block + SLOW.duration(6, fd=False))
    assert heard(arrived, "a") == [b"aiding"]
    assert heard(arrived, "b") == [bytes(64)]


def test_a_short_identifier_wins_against_a_long_one_with_the_same_start() -> None:
    wire = pair(SLOW)
    wire.submit("a", CanFrame(EXTENDED | 0x100 << 18, b"long"), 0.0)
    wire.submit("b", CanFrame(0x100, b"short"), 0.0)
    arrived = [d.frame.data for d in wire.advance(1.0) if not d.frame.own]
    assert arrived == [b"short", b"long"]


def test_nobody_acknowledges_until_somebody_comes() -> None:
    wire = CanWire(SLOW)
    wire.attach("a")
    wire.submit("a", frame(5, b"hello"), 0.0)
    assert errors(wire.advance(1.0), "a") == [ERROR_ACK]
    assert wire.controllers["a"].state == "passive"
    assert wire.due() == float("inf")
    assert wire.advance(1000.0) == []
    wire.attach("b")
    arrived = wire.advance(1001.0)
    assert heard(arrived, "b") == [b"hello"]
    assert [d.frame.own for d in arrived if d.to == "a"] == [True]


def test_a_cut_wire_is_an_absent_partner() -> None:
    wire = pair()
    wire.is_cut = True
    wire.submit("a", frame(5, b"x"), 0.0)
    assert errors(wire.advance(1.0), "a") == [ERROR_ACK]
    wire.is_cut = False
    assert heard(wire.advance(1.0), "b") == [b"x"]


def test_disturbed_frames_are_repeated_and_counted() -> None:
    wire = pair(SLOW)
    wire.disturbed = 3
    wire.submit("a", frame(5, b"x"), 0.0)
    arrived = wire.advance(1.0)
    assert errors(arrived, "a") == [ERROR_PROTOCOL] * 3
    assert heard(arrived, "b") == [b"x"]
    assert wire.controllers["a"].errors == 3 * 8 - 1
    assert wire.busy == pytest.approx(4 * SLOW.duration(1, fd=False) + 3 * SLOW.error_duration)


def test_32_failures_are_bus_off_and_a_restart_ends_it() -> None:
    wire = pair()
    wire.disturbed = 40
    wire.submit("a", frame(5, b"x"), 0.0)
    arrived = wire.advance(1.0)
    assert errors(arrived, "a") == [ERROR_PROTOCOL] * 31 + [ERROR_BUS_OFF]
    assert heard(arrived, "b") == []
    assert not wire.submit("a", frame(5, b"y"), 1.0)
    wire.restart("a")
    wire.disturbed = 0
    assert wire.submit("a", frame(5, b"z"), 2.0)
    assert heard(wire.advance(2.0), "b") == [b"z"]


def test_two_of_one_identifier_with_other_data_throw_each_other_off() -> None:
    wire = pair()
    wire.submit("a", frame(5, b"one"), 0.0)
    wire.submit("b", frame(5, b"two"), 0.0)
    arrived = wire.advance(1.0)
    assert errors(arrived, "a")[-1] == ERROR_BUS_OFF
    assert errors(arrived, "b")[-1] == ERROR_BUS_OFF


def test_a_controller_without_fd_destroys_fd_frames() -> None:
    wire = CanWire()
    wire.attach("a", fd=True)
    wire.attach("b", fd=False)
    wire.submit("a", frame(5, bytes(64), fd=True), 0.0)
    assert errors(wire.advance(1.0), "a")[-1] == ERROR_BUS_OFF


def test_a_send_buffer_is_bounded() -> None:
    wire = CanWire(SLOW)
    wire.attach("a")
    accepted = [wire.submit("a", frame(5), 0.0) for _ in range(SEND_BUFFER + 3)]
    assert accepted == [True] * SEND_BUFFER + [False] * 3
    assert wire.overruns == 3


events = st.lists(st.tuples(st.sampled_from("ab"), st.integers(0, 2**29 - 1), st.binary(max_size=8)), max_size=30)


@given(events)
def test_every_frame_arrives_once_and_of_one_sender_in_order(sent: list[tuple[str, int, bytes]]) -> None:
    wire = pair(SLOW)
    for name, identifier, data in sent:
        wire.submit(name, frame(2 * (identifier >> 1) + (name == "b"), data), 0.0)
    arrived = wire.advance(1e3)
    for name, other in (("a", "b"), ("b", "a")):
        assert heard(arrived, other) == [data for sender, _, data in sent if sender == name]
    assert wire.due() == float("inf")


names = itertools.count()
Open = Callable[..., Any]


@pytest.fixture
def hub() -> Iterator[CanHub]:
    with running_hub() as running:
        yield running


@pytest.fixture
def open_bus(hub: CanHub) -> Iterator[Open]:
    register_loopback()
    with contextlib.ExitStack() as stack:

        def opened(segment: str = "joint", **options: Any) -> Any:
            bus = can.Bus(f"{hub.port}/{segment}", interface=INTERFACE, ignore_config=True, **options)
            stack.callback(bus.shutdown)
            return bus

        yield opened


def message(identifier: int, data: bytes = b"", *, fd: bool = False) -> can.Message:
    return can.Message(arbitration_id=identifier, data=data, is_fd=fd, is_extended_id=True)


def test_messages_cross_a_segment_and_no_other(open_bus: Open) -> None:
    a, b, stranger = open_bus(receive_own_messages=True), open_bus(), open_bus("other")
    a.send(message(0x1ABCDEF, b"12345678"))
    a.send(message(0x1ABCDEE, bytes(range(64)), fd=True))
    first, second = b.recv(PATIENCE), b.recv(PATIENCE)
    assert (first.arbitration_id, bytes(first.data), first.is_fd) == (0x1ABCDEF, b"12345678", False)
    assert (second.arbitration_id, bytes(second.data), second.is_fd) == (0x1ABCDEE, bytes(range(64)), True)
    assert [a.recv(PATIENCE).is_rx for _ in range(2)] == [False, False]
    assert stranger.recv(0.0) is None


def test_a_message_waits_for_the_first_to_listen(open_bus: Open) -> None:
    a = open_bus(receive_own_messages=True)
    a.send(message(7, b"early"))
    missed = a.recv(PATIENCE)
    assert (missed.is_error_frame, missed.arbitration_id) == (True, ERROR_ACK)
    b = open_bus()
    assert bytes(b.recv(PATIENCE).data) == b"early"
    assert not a.recv(PATIENCE).is_rx


def test_bus_off_is_seen_and_ends_with_a_restart(hub: CanHub, open_bus: Open) -> None:
    a, b = open_bus(), open_bus()

    def disturb(wire: CanWire) -> None:
        wire.disturbed = 32

    hub.act(disturb, "joint")
    a.send(message(7, b"lost"))
    reports = [a.recv(PATIENCE).arbitration_id for _ in range(32)]
    assert reports == [ERROR_PROTOCOL] * 31 + [ERROR_BUS_OFF]
    a.restart()
    a.send(message(7, b"again"))
    assert bytes(b.recv(PATIENCE).data) == b"again"


def test_what_finds_no_room_is_an_overrun_that_is_counted(open_bus: Open) -> None:
    a, b = open_bus(receive_own_messages=True), open_bus(receive_buffer=4096)
    sent = 100
    for _ in range(sent):
        a.send(message(7, bytes(8)))
        assert not a.recv(PATIENCE).is_rx
    kept = 0
    while b.recv(0.0) is not None:
        kept += 1
    a.send(message(7, b"last"))
    assert bytes(b.recv(PATIENCE).data) == b"last"
    report = b.recv(PATIENCE)
    assert (report.is_error_frame, report.arbitration_id) == (True, ERROR_CONTROLLER)
    assert 0 < kept < sent
    assert b.overruns == sent - kept


def listen_until_killed(port: int, ready: Any) -> None:
    register_loopback()
    with can.Bus(f"{port}/joint", interface=INTERFACE, ignore_config=True) as bus:
        ready.set()
        while True:
            bus.recv()


def test_a_process_that_dies_leaves_the_segment(hub: CanHub, open_bus: Open) -> None:
    context = multiprocessing.get_context("spawn")
    ready = context.Event()
    process = context.Process(target=listen_until_killed, args=(hub.port, ready))
    process.start()
    assert ready.wait(PATIENCE)
    a = open_bus(receive_own_messages=True)
    process.kill()
    process.join()
    a.send(message(7))  # delivered to the dead: the hub learns of it
    a.send(message(8))
    while not (arrived := a.recv(PATIENCE)).is_error_frame:
        assert arrived.arbitration_id == 7
    assert arrived.arbitration_id == ERROR_ACK


def test_no_hub_is_one_line() -> None:
    register_loopback()
    with running_hub() as gone:
        port = gone.port
    with pytest.raises(can.CanInitializationError, match="no hub answers"):
        can.Bus(f"{port}/joint", interface=INTERFACE, ignore_config=True)


@pytest.mark.parametrize("channel", ["can0", "7800", "/joint", "7800/"])
def test_a_channel_that_is_none_is_named(channel: str) -> None:
    register_loopback()
    with pytest.raises(can.CanInitializationError, match="expected the channel PORT/SEGMENT, got"):
        can.Bus(channel, interface=INTERFACE, ignore_config=True)


def test_a_taken_port_is_one_line(hub: CanHub) -> None:
    with pytest.raises(RigError, match=f"UDP port {hub.port}: Address already in use"):
        CanHub(hub.port)


def test_an_fd_frame_on_a_controller_without_it_is_refused(open_bus: Open) -> None:
    with pytest.raises(can.CanOperationError, match="without FD"):
        open_bus(fd=False).send(message(1, bytes(64), fd=True))
