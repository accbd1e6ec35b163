"""Ports and what lies about them: each frame in its order, each bound at its value, each wait grown once and reset."""

from __future__ import annotations

import math
import threading
import time
from collections import Counter, deque
from types import SimpleNamespace
from typing import Any

import pytest

from telemetry.application.seal_watch import TELL_EVERY, SealWatch
from telemetry.errors import MediumError
from telemetry.media.can_frame import EXTENDED, OWN_FRAME
from telemetry.media.can_port import FIRST_PAUSE, LAST_PAUSE, UNHEARD_LIMIT, CanPort
from telemetry.media.memory import MemoryMedium, MemoryPort, joined_ports
from telemetry.media.port import PortFrame, Priority, TubeEnd
from telemetry.messages import Severity, Side
from telemetry.runtime.stepped import CYCLE, DEPTH, Due, DueEvent, Sent, run_step
from telemetry.unwritten import Unwritten


@pytest.mark.parametrize("side", list(Side))
def test_the_end_that_an_end_faces_is_the_other_side_of_its_neighbour(side: Side) -> None:
    end = TubeEnd("r", 5, side, 4)
    other = Side.LOWER if side is Side.UPPER else Side.UPPER
    assert end.facing == TubeEnd("r", 4, other, 5)
    assert end.facing.facing == end
    with pytest.raises(ValueError, match="expected a neighbour"):
        _ = TubeEnd("r", 5, side).facing


@pytest.mark.parametrize(("size", "largest", "is_larger"), [(9, 10, False), (10, 10, False), (11, 10, True)])
def test_a_frame_may_be_exactly_as_large_as_it_may(size: int, largest: int, is_larger: bool) -> None:
    assert PortFrame(bytes(size)).is_larger_than(largest) == is_larger


def test_frames_arrive_after_their_latency_in_the_order_in_which_they_were_sent() -> None:
    upper, lower = joined_ports(latency=0.5)
    heard: list[bytes] = []
    upper.listen(lambda _: None)
    lower.listen(lambda content: heard.append(bytes(content)))
    for number in range(5):
        upper.send(PortFrame(bytes([number])))
    lower.advance(0.499)
    assert heard == []
    lower.advance(0.5)
    assert heard == [bytes([number]) for number in range(5)]
    upper.advance(2.0)
    upper.send(PortFrame(b"later"))
    lower.advance(2.4)
    assert len(heard) == 5
    lower.advance(2.5)
    assert heard[-1] == b"later"


def test_what_is_lost_comes_never_what_is_doubled_twice_and_what_is_damaged_with_one_bit_off() -> None:
    for faults, expected in (({"loss": 1.0}, 0), ({"duplicate": 1.0}, 2), ({"corrupt": 1.0}, 1)):
        upper, lower = joined_ports(3, 0.1, **faults)
        heard: list[bytes] = []
        upper.listen(lambda _: None)
        lower.listen(lambda content, heard=heard: heard.append(bytes(content)))
        upper.send(PortFrame(b"\x00\x00\x00"))
        lower.advance(1.0)
        assert len(heard) == expected
        bits = [sum(bin(byte).count("1") for byte in one) for one in heard]
        assert bits == ([1] if "corrupt" in faults else [0] * expected)


def test_an_end_is_taken_until_its_port_is_closed() -> None:
    medium = MemoryMedium()
    end = TubeEnd("r", 5, Side.UPPER, 6)
    first = medium.open_port(end)
    with pytest.raises(MediumError, match="the upper end of 5 is taken"):
        medium.open_port(end)
    first.close()
    again = medium.open_port(end)
    facing = medium.open_port(end.facing)
    assert (again.other, facing.other) == (facing, again)
    assert [type(one) for one in (first, again)] == [MemoryPort, MemoryPort]


def can_port() -> Any:
    """A port without its thread and its controller."""
    port = CanPort.__new__(CanPort)
    port._exchange = SimpleNamespace(
        on_refused=lambda: None, on_acknowledged=lambda _: None, on_frame=lambda *_: None,
    )  # fmt: skip
    port._lock, port._closed, port._controller = threading.RLock(), False, None
    port._queue = SimpleNamespace(counters=Counter(), limit=0)
    port._unheard = deque(maxlen=UNHEARD_LIMIT)
    port._pause, port._reopen_at = FIRST_PAUSE, math.inf
    return port


def test_a_bus_is_opened_again_after_pauses_that_double_and_begin_anew_once_it_works(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    port, now = can_port(), [100.0]
    monkeypatch.setattr("telemetry.media.can_port.time.monotonic", lambda: now[0])

    def fail() -> None:
        raise MediumError("no bus")

    port._open = fail
    for _ in range(2):
        port._lose_bus("bus_off")
        waits = [port._reopen_at - now[0]]
        for _ in range(8):
            now[0] = port._reopen_at
            port._reopen()
            waits.append(port._reopen_at - now[0])
        assert waits == pytest.approx([min(FIRST_PAUSE * 2**k, LAST_PAUSE) for k in range(9)])
        before = port._reopen_at
        now[0] = before - 1e-6
        port._reopen()
        assert port._reopen_at == before
        port._on_arrival(EXTENDED | OWN_FRAME, b"", now[0])
    assert port.counters["bus_off"] == 2


def test_a_step_hands_over_each_event_and_takes_what_is_sent_after_it() -> None:
    done: list[Any] = []

    class Told:
        def on_frame(self, side: Side, frame: Any, at: float, margin: float = math.inf) -> None:
            done.append(("frame", side, frame, at, margin))

        def on_cycle(self, data: Any, at: float) -> None:
            done.append(("cycle", data, at))

        def on_depth(self, data: Any, at: float) -> None:
            done.append(("depth", data, at))

        def on_timer(self, at: float) -> None:
            done.append(("timer", at))

        def take_frames(self, now: float) -> list[Any]:
            return [(Side.LOWER, PortFrame(f"{now}".encode()))]

        def next_wake(self, now: float) -> float:
            return now + 7.0

    sent: list[tuple[Sent, PortFrame]] = []
    events = [
        DueEvent(Due.UPPER_FRAME, 1.0), DueEvent(Due.LOWER_FRAME, 2.0, 12.5), DueEvent(CYCLE, 3.0, [2.5]),
        DueEvent(DEPTH, 4.0, b"d"), DueEvent(Due.TIMER, 5.0),
    ]  # fmt: skip
    told: Any = Told()
    assert (
        run_step(told, [(event, f"f{k}".encode()) for k, event in enumerate(events)], lambda *one: sent.append(one))
        == 12.0
    )
    assert done == [
        ("frame", Side.UPPER, b"f0", 1.0, math.inf), ("frame", Side.LOWER, b"f1", 2.0, 12.5), ("cycle", [2.5], 3.0),
        ("depth", b"d", 4.0), ("timer", 5.0),
    ]  # fmt: skip
    assert [(one.side, one.at, frame.payload) for one, frame in sent] == [
        (Side.LOWER, float(k), f"{float(k)}".encode()) for k in range(1, 6)
    ]
    assert sent[0][1].priority is Priority.SURVEY


def test_refused_seals_are_told_at_most_once_a_minute_with_all_of_them_and_what_most_were() -> None:
    counts: dict[str, int] = {}
    said: list[tuple[Severity, str, dict[str, Any]]] = []
    endpoint: Any = SimpleNamespace(seals=SimpleNamespace(failures=lambda: dict(counts)))
    watch = SealWatch(endpoint, lambda *words: said.append(words))
    watch.look(0.0)
    assert said == []
    counts |= {"seal_tag": 3, "seal_old": 9}
    watch.look(10.0)
    counts["seal_tag"] = 40
    watch.look(10.0 + TELL_EVERY - 1e-6)
    assert len(said) == 1
    watch.look(10.0 + TELL_EVERY)
    assert len(said) == 2
    watch.look(10.0 + 3.0 * TELL_EVERY)
    assert said == [
        (Severity.WARNING, "seal_refused", {"refused": 12, "mostly": "old"}),
        (Severity.WARNING, "seal_refused", {"refused": 49, "mostly": "tag"}),
    ]


class SilentController:
    """Of a bus on which nothing is ever heard."""

    def receive(self) -> None:
        time.sleep(0.005)

    def send(self, identifier: int, data: bytes) -> None:
        """It is never acknowledged."""

    def shutdown(self) -> None:
        """Nothing to close."""


def test_frames_wait_for_who_listens_in_their_order_and_fewer_for_an_end_that_is_absent(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("telemetry.media.can_port.open_controller", lambda *_: SilentController())
    bus: Any = None
    port = CanPort("joint", bus, 7, 8, 40)
    heard: list[bytes] = []
    try:
        with port._lock:
            monkeypatch.setattr(port._exchange, "on_frame", lambda identifier, data, now: data or None)
            sent = [bytes([number]) for number in range(UNHEARD_LIMIT + 3)]
            for payload in (*sent, b""):
                port._on_arrival(EXTENDED | 5, payload, 0.0)
            port.listen(lambda content: heard.append(bytes(content)))
            port._on_arrival(EXTENDED | 5, b"last", 0.0)
            assert heard == [*sent[3:], b"last"]
            for is_alone, limit in ((True, 40), (False, 512), (True, 40)):
                monkeypatch.setattr(port._exchange, "is_alone", lambda now, is_alone=is_alone: is_alone)
                port.send(PortFrame(b"x"))
                assert port._queue.limit == limit
    finally:
        port.close()


class Unasked(Unwritten):
    """Says how large it may be, and minds being written."""

    __slots__ = ("size", "written")

    def __init__(self, size: int) -> None:
        self._written = None
        self.size, self.written = size, 0

    @property
    def most(self) -> int:
        return self.size

    def _write(self) -> bytes:
        self.written += 1
        return bytes(self.size - 2)


@pytest.mark.parametrize(
    ("most", "is_larger", "written"), [(10, False, 0), (11, False, 1), (12, False, 1), (13, True, 1)]
)
def test_a_frame_is_written_to_be_measured_only_where_it_may_be_too_large(
    most: int, is_larger: bool, written: int
) -> None:
    content = Unasked(most)
    frame = PortFrame(content)
    assert [frame.is_larger_than(10), content.written] == [is_larger, written]
    assert (len(frame.payload), len(content), bytes(content), content.written) == (
        most - 2,
        most - 2,
        bytes(most - 2),
        1,
    )
