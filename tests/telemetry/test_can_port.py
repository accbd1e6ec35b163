"""A CAN port on a bus that goes off, goes away, is too fast or speaks another dialect."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import can
import cantools
import pytest
from waiting import until

from sim.can.can_hub import CanHub, running_hub
from sim.can.wire import CanWire
from telemetry.errors import MediumError
from telemetry.media.can_controller import CanController, LibraryController, LoopbackController, controller_of
from telemetry.media.can_frame import (
    ERROR,
    ERROR_CONTROLLER,
    EXTENDED,
    IDENTIFIER,
    OWN_FRAME,
    RX_OVERFLOW,
    Arrival,
)
from telemetry.media.can_identifier import TUNNEL, Identifier
from telemetry.media.can_log import CanLog
from telemetry.media.can_loopback import register_loopback
from telemetry.media.can_loopback_protocol import INTERFACE
from telemetry.media.can_medium import segment_of
from telemetry.media.can_port import CanPort
from telemetry.media.can_timing import BitRates
from telemetry.media.media_table import open_medium
from telemetry.media.port import PortFrame, Priority, TubeEnd
from telemetry.messages import Aiding, Side
from telemetry.presentation.can_dbc import IDENTIFIER_MASK
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.runtime.joint_watch import JointWatch
from telemetry.transport.hop import HopLink

DBC = Path(__file__).parents[2] / "docs" / "borechain.dbc"
UPPER, LOWER = TubeEnd("rig", 2, Side.LOWER, 1), TubeEnd("rig", 1, Side.UPPER, 2)


class Ends:
    """Both ends of a joint on a hub, and what each has heard."""

    def __init__(self, stack: contextlib.ExitStack, port: int, frames: tuple[str, str] = ("fd", "fd")) -> None:
        self.ports: list[CanPort] = []
        self.heard: tuple[list[bytes], list[bytes]] = ([], [])
        for end, heard, kind in zip((UPPER, LOWER), self.heard, frames, strict=True):
            medium = stack.enter_context(open_medium(f"can:{port},interface={INTERFACE},frames={kind}"))
            opened = medium.open_port(end)
            assert isinstance(opened, CanPort)
            opened.listen(heard.append)
            self.ports.append(opened)
        self.upper, self.lower = self.ports


@pytest.fixture
def stack() -> Iterator[contextlib.ExitStack]:
    with contextlib.ExitStack() as opened:
        yield opened


@pytest.fixture
def hub(stack: contextlib.ExitStack) -> CanHub:
    return stack.enter_context(running_hub())


def test_a_controller_that_goes_bus_off_comes_back_and_is_counted(stack: contextlib.ExitStack, hub: CanHub) -> None:
    ends = Ends(stack, hub.port)
    until(lambda: ends.upper.is_up and ends.lower.is_up)

    def disturb(wire: CanWire) -> None:
        wire.disturbed = 32

    hub.act(disturb, segment_of(UPPER))
    until(lambda: ends.upper.counters["bus_off"] + ends.lower.counters["bus_off"] == 1)
    ends.upper.send(PortFrame(b"survey" * 50))
    until(lambda: ends.heard[1] == [b"survey" * 50])
    assert ends.upper.is_up


def test_a_bus_that_goes_away_and_comes_back_stops_nobody(stack: contextlib.ExitStack) -> None:
    with running_hub() as hub:
        ends = Ends(stack, hub.port)
        until(lambda: ends.upper.is_up)
        port = hub.port
    until(lambda: not ends.upper.is_up)
    for k in range(100):
        ends.upper.send(PortFrame(b"%d" % k, Priority.AIDING, "aiding"))
        ends.upper.flush()
    with running_hub(port=port):
        until(lambda: ends.heard[1] == [b"99"])
        assert ends.upper.counters["bus_lost"] >= 1
        for end in ends.ports:
            end.close()


def test_a_bus_that_goes_away_with_a_frame_stops_nobody(stack: contextlib.ExitStack) -> None:
    """Nothing tells either end of it: the frame was taken, and it is not acknowledged any more."""
    hub = CanHub()
    serving = threading.Thread(target=hub.serve)
    serving.start()
    ends = Ends(stack, hub.port)
    until(lambda: ends.upper.is_up and ends.lower.is_up)
    hub.stop()
    serving.join()
    ends.upper.send(PortFrame(b"lost", Priority.AIDING, "aiding"))
    until(lambda: not ends.upper.is_up and not ends.lower.is_up)
    hub.close()
    ends.upper.send(PortFrame(b"kept", Priority.AIDING, "aiding"))
    with running_hub(port=hub.port):
        until(lambda: ends.heard[1] == [b"kept"])
        for end in ends.ports:
            end.close()


def test_a_bus_that_stands_still_for_a_moment_loses_nothing(stack: contextlib.ExitStack, hub: CanHub) -> None:
    """As on a machine at work: both ends see an open joint for a moment, with transfers and answers on their way."""
    ends = Ends(stack, hub.port, ("classic", "classic"))
    until(lambda: ends.upper.is_up and ends.lower.is_up)
    frames = [b"%d takes several frames" % k for k in range(300)]

    def give(some: list[bytes]) -> None:
        for frame in some:
            for end in ends.ports:
                end.send(PortFrame(frame))

    def stand_still(_wire: CanWire) -> None:
        until(lambda: not ends.upper.is_up and not ends.lower.is_up)
        give(frames[150:])

    give(frames[:150])
    hub.act(stand_still, segment_of(UPPER))
    until(lambda: ends.heard == (frames, frames))
    assert not {"dropped", "no_flow_control"} & (set(ends.upper.counters) | set(ends.lower.counters))


def test_a_neighbour_without_fd_throws_the_controller_off_and_nobody_raises(
    stack: contextlib.ExitStack, hub: CanHub
) -> None:
    ends = Ends(stack, hub.port, ("fd", "classic"))
    ends.upper.send(PortFrame(b"hello"))
    until(lambda: ends.upper.counters["bus_off"] >= 2)
    assert ends.heard[1] == []


def test_a_node_of_the_same_number_is_found(stack: contextlib.ExitStack, hub: CanHub) -> None:
    ends = Ends(stack, hub.port)
    until(lambda: ends.upper.is_up)
    twin = stack.enter_context(open_medium(f"can:{hub.port}/{segment_of(UPPER)},interface={INTERFACE}")).open_port(
        UPPER
    )
    until(lambda: twin.counters["same_address"] and ends.upper.counters["same_address"])
    until(lambda: not twin.is_up)
    twin.send(PortFrame(b"from the twin"))
    ends.upper.send(PortFrame(b"from the older"))
    until(lambda: ends.heard[1])
    assert ends.heard[1] == [b"from the older"]


def test_a_flood_of_strangers_is_counted_and_the_neighbour_is_heard(stack: contextlib.ExitStack, hub: CanHub) -> None:
    ends = Ends(stack, hub.port)
    until(lambda: ends.upper.is_up and ends.lower.is_up)
    channel = f"{hub.port}/{segment_of(UPPER)}"
    stranger = can.Bus(channel, interface=INTERFACE, ignore_config=True)
    stack.callback(stranger.shutdown)
    identifier = Identifier(Priority.SURVEY, TUNNEL, 77).pack()
    for k in range(300):
        stranger.send(can.Message(arbitration_id=identifier, data=b"\x02" + k.to_bytes(2), is_extended_id=True))
        stranger.send(can.Message(arbitration_id=k, data=b"x", is_extended_id=False))
    ends.upper.send(PortFrame(b"sound"))
    until(lambda: ends.heard[1] == [b"sound"])
    until(lambda: ends.lower.counters["third_talker"] == 300 and ends.lower.counters["unknown_identifier"] == 300)


def test_a_paced_bus_carries_an_aiding_between_the_parts_of_a_block(stack: contextlib.ExitStack) -> None:
    hub = stack.enter_context(running_hub(BitRates(125_000.0)))
    ends = Ends(stack, hub.port, ("classic", "classic"))
    until(lambda: ends.upper.is_up and ends.lower.is_up)
    for k in range(8):
        ends.upper.send(PortFrame(bytes([k]) * 310, Priority.BLOCK))
    ends.upper.send(PortFrame(b"aiding", Priority.AIDING, "aiding"))
    until(lambda: len(ends.heard[1]) == 9)
    assert ends.heard[1].index(b"aiding") <= 1  # before the second block
    assert not {"dropped", "interrupted", "no_flow_control"} & set(ends.upper.counters)


def test_no_hub_is_one_line_and_so_is_a_channel_that_is_not_there() -> None:
    with running_hub() as gone:
        port = gone.port
    with open_medium(f"can:{port},interface={INTERFACE}") as medium, pytest.raises(MediumError, match="no hub answers"):
        medium.open_port(UPPER)
    with open_medium("can:none0") as medium, pytest.raises(MediumError, match=r"CAN port none0 \(lower end of 2\)"):
        medium.open_port(UPPER)


@pytest.mark.parametrize(
    ("where", "says"),
    [
        ("", "expected a channel"),
        ("can0,frames=8", "expected fd or classic, got 8"),
        ("can0,profile=fast", "expected tunnel or native, got fast"),
        ("can0,log=joint.txt", "log: expected a file .blf or .asc, got joint.txt"),
        ("can0,bitrate=fast", "bitrate: expected bit/s, got fast"),
        ("can0,colour=red", "got colour=red"),
    ],
)
def test_settings_that_are_none_are_named(where: str, says: str) -> None:
    with pytest.raises(MediumError, match=says):
        open_medium(f"can:{where}").__enter__()


def test_both_ends_of_a_joint_are_on_one_segment() -> None:
    assert segment_of(UPPER) == segment_of(LOWER) == "rig/2-1"


@pytest.mark.parametrize("suffix", [".blf", ".asc"])
def test_a_log_of_a_joint_is_read_by_foreign_tools_from_the_file_alone(
    stack: contextlib.ExitStack, hub: CanHub, tmp_path: Path, suffix: str
) -> None:
    where = f"can:{hub.port},interface={INTERFACE},profile=native"
    upper = stack.enter_context(open_medium(f"{where},log={tmp_path / 'joint'}{suffix}")).open_port(UPPER)
    lower = stack.enter_context(open_medium(where)).open_port(LOWER)
    until(lambda: upper.is_up and lower.is_up)
    link, other = HopLink(2, 1), HopLink(1, 2)
    arrived: list[Any] = []  # aidings alone: the header of the link comes in a frame of its own
    lower.listen(lambda frame: arrived.extend(other.receive(frame, 0.0)))
    link.bundle_limit = 0
    sent = [Aiding(0.5 + k, 2e-6, 3e-7, -0.3, 1.2, 1000.0 + k, k, 3) for k in range(5)]
    for k, aiding in enumerate(sent):
        link.send_best_effort(encode_message(aiding), "aiding", Priority.AIDING)
        for frame in link.take_frames(float(k)):
            upper.send(frame)
        until(lambda k=k: len(arrived) > k)  # type: ignore[misc]
    heard: list[bytes] = []
    upper.listen(heard.append)
    lower.send(PortFrame(b"the last of them has been on the bus"))  # and is in the log before what came later
    until(lambda: b"the last of them has been on the bus" in heard)
    upper.close()
    database = cantools.database.load_file(str(DBC), frame_id_mask=IDENTIFIER_MASK)
    found = []
    for message in can.LogReader(tmp_path / f"joint-2-lower{suffix}"):
        with contextlib.suppress(KeyError):
            known = database.get_message_by_frame_id(message.arbitration_id)
            found.append((known.name, known.decode(bytes(message.data))))
    aidings = [values for name, values in found if name == "Aiding"]
    assert [values["yaw"] for values in aidings] == pytest.approx([a.yaw for a in sent], abs=4e-7)
    assert [values["valid_at"] for values in aidings] == pytest.approx([a.valid_at for a in sent], abs=1e-5)


def test_a_log_that_cannot_be_written_is_one_line(hub: CanHub, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    where = f"can:{hub.port},interface={INTERFACE},log={tmp_path}/file/joint.blf"
    with open_medium(where) as medium, pytest.raises(MediumError, match=r"log .*joint-2-lower\.blf"):
        medium.open_port(UPPER)


def test_faults_of_a_joint_are_told_once_a_minute() -> None:
    with open_medium("memory:watched") as medium:
        port = medium.open_port(UPPER)
        watch, ports = JointWatch(), {Side.LOWER: port}
        assert watch.find(ports, 0.0) == []
        port.counters["bus_off"] += 1
        (fault,) = watch.find(ports, 1.0)
        assert fault.arguments == {"side": "lower", "fault": "bus_off", "count": 1}
        assert fault.line.startswith("lower end: bus_off (1): the controller left the bus")
        port.counters["bus_off"] += 1
        assert watch.find(ports, 30.0) == []
        assert [f.times for f in watch.find(ports, 61.5)] == [2]
        assert watch.find(ports, 200.0) == []
        port.close()


@pytest.mark.parametrize("is_fd", [True, False])
def test_a_controller_says_the_same_with_and_without_messages_of_the_library(
    stack: contextlib.ExitStack, hub: CanHub, tmp_path: Path, is_fd: bool
) -> None:
    register_loopback()
    log = CanLog(tmp_path / "joint.asc", "end")
    stack.callback(log.close)
    ends = [controller_of(bus_on(hub.port, fd=is_fd), is_fd=is_fd, log=one) for one in (None, log)]
    assert [type(end) for end in ends] == [LoopbackController, LibraryController]
    for end in ends:
        stack.callback(end.shutdown)
    data = bytes(range(64 if is_fd else 8))
    for end in ends:
        end.send(0x1ABCDEF5, data)
        heard = [arrived(one) for one in ends]
        own = [OWN_FRAME if one is end else 0 for one in ends]
        assert heard == [(0x1ABCDEF5 | EXTENDED | flag, data) for flag in own]
    assert [end.receive() for end in ends] == [None, None]


def test_a_controller_tells_overruns_and_a_hub_that_has_gone(stack: contextlib.ExitStack) -> None:
    register_loopback()
    with running_hub() as hub:
        small = bus_on(hub.port, fd=True, receive_buffer=4096)
        slow = controller_of(small, is_fd=True, log=None)
        stack.callback(slow.shutdown)
        quick = controller_of(bus_on(hub.port, fd=True), is_fd=True, log=None)
        stack.callback(quick.shutdown)
        for _ in range(300):
            quick.send(1, bytes(64))
            arrived(quick)
        errors = [arrival for arrival in iter(slow.receive, None) if arrival[0] & ERROR]
        quick.send(2, b"")  # by whose count the gap shows
        errors += [arrival for arrival in iter(slow.receive, None) if arrival[0] & ERROR]
    assert [(identifier & IDENTIFIER, data[1]) for identifier, data in errors] == [(ERROR_CONTROLLER, RX_OVERFLOW)]
    with pytest.raises((can.CanError, OSError)):
        until(slow.receive)


def bus_on(port: int, **options: Any) -> can.BusABC:
    """A controller of the segment ``joint``."""
    return can.Bus(f"{port}/joint", interface=INTERFACE, ignore_config=True, **{"receive_own_messages": True} | options)


def arrived(controller: CanController) -> Arrival:
    """The next frame."""
    found: list[Arrival | None] = []
    until(lambda: found.append(controller.receive()) or found[-1])
    assert found[-1] is not None
    return found[-1]
