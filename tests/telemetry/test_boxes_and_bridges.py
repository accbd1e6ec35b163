"""What waits in a box of a loop, what a bridge of a chip counts, where a log is written and which queue a port gets."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can
import pytest

from telemetry.media import can_medium
from telemetry.media.can_frame import ERROR, EXTENDED, OWN_FRAME
from telemetry.media.can_log import CanLog, log_path
from telemetry.media.can_medium import CanMedium, CanSettings
from telemetry.media.chip_bridge import ChipBridge
from telemetry.media.port import STEPPER, TubeEnd
from telemetry.messages import Side
from telemetry.runtime.inbox import Inbox, Mailbox


async def test_a_box_gives_the_oldest_first_counts_what_it_cannot_take_and_is_empty_once_closed() -> None:
    box: Mailbox[int] = Mailbox(lambda: None, limit=3)
    assert [box.put(k) for k in range(5)] == [True, True, True, False, False]
    assert (len(box), box.dropped) == (3, 2)
    assert [box.take(), box.put(9), box.take(), box.take(), box.take(), box.take()] == [0, True, 1, 2, 9, None]
    box.put(1)
    assert not box.is_closed
    box.close()
    assert (box.is_closed, box.take()) == (True, None)


async def test_who_is_told_is_told_once_for_all_that_came_since() -> None:
    told: list[int] = []
    box: Mailbox[int] = Mailbox(lambda: told.append(len(box)))
    for k in range(3):
        box.put(k)
    assert told == []
    await asyncio.sleep(0)
    assert told == [3]
    box.put(3)
    await asyncio.sleep(0)
    assert told == [3, 4]
    box.close()
    await asyncio.sleep(0)
    assert told == [3, 4, 4]


async def test_a_wait_is_over_at_once_where_something_is_there_or_nothing_will_come() -> None:
    """Each of the three reasons by itself: an item, a box that was closed, no time."""
    async with asyncio.timeout(60.0):
        for reason in ("item", "closed", "no time", "less than none"):
            box: Inbox[int] = Inbox()
            if reason == "item":
                box.put(1)
            elif reason == "closed":
                box.close()
            turns: list[int] = []
            other = asyncio.create_task(_note(turns))
            await box.wait(*{"no time": (0.0,), "less than none": (-1.0,)}.get(reason, ()))
            assert turns == [1], reason  # others on the loop had their turn
            await other


async def _note(turns: list[int]) -> None:
    turns.append(1)


async def test_a_wait_ends_with_its_time_or_with_what_comes_from_another_thread() -> None:
    async with asyncio.timeout(60.0):
        box: Inbox[str] = Inbox()
        await box.wait(0.001)
        assert len(box) == 0
        waiting = asyncio.create_task(box.get())
        await asyncio.sleep(0)
        sender = threading.Thread(target=box.put, args=("late",))
        sender.start()
        assert await waiting == "late"
        sender.join()
        again = asyncio.create_task(box.get())
        await asyncio.sleep(0)
        box.close()
        assert await again is None


class Line:
    """The chip's end: what it says next, and what it is told."""

    def __init__(self, *said: bytes) -> None:
        self.said = list(said)
        self.told: list[bytes] = []
        self.takes = True
        self.at_end: Callable[[], None] = lambda: None

    def receive(self, patience: float) -> bytes:
        del patience
        if self.said:
            return self.said.pop(0)
        self.at_end()
        return b""

    def send(self, content: bytes) -> bool:
        self.told.append(content)
        return self.takes


class Controller:
    """The segment: what arrives next, and what was sent."""

    def __init__(self, *arrivals: tuple[int, bytes]) -> None:
        self.arrivals = list(arrivals)
        self.sent: list[tuple[int, bytes]] = []
        self.refuses: list[Exception] = []
        self.at_end: Callable[[], None] = lambda: None

    def send(self, identifier: int, data: bytes) -> None:
        if self.refuses:
            raise self.refuses.pop(0)
        self.sent.append((identifier, bytes(data)))

    def receive(self) -> tuple[int, bytes] | None:
        if self.arrivals:
            return self.arrivals.pop(0)
        self.at_end()
        return None


OPENING = b"\r\rC\rS6\rO\r"


def bridged(line: Line, controller: Controller) -> tuple[ChipBridge, list[str]]:
    told: list[str] = []
    bridge = ChipBridge(line, controller, fd=False, tell=told.append)  # type: ignore[arg-type]
    ended = [threading.Event(), threading.Event()]

    def end(which: int) -> None:
        ended[which].set()
        if all(event.is_set() for event in ended):
            bridge.stop()

    line.at_end, controller.at_end = lambda: end(0), lambda: end(1)
    bridge.run()
    return bridge, told


@pytest.mark.parametrize("error", [can.CanError("full"), OSError(105, "full"), ValueError("no")])
def test_a_frame_that_the_controller_refuses_is_counted_and_the_next_goes(error: Exception) -> None:
    line = Line(OPENING, b"T042020000\rT0420200010A\rT04202000211FF\r")
    controller = Controller()
    controller.refuses = [error, type(error)("again")]
    bridge, told = bridged(line, controller)
    assert controller.sent == [(0x04202000, b"\x11\xff")]
    assert dict(bridge.counters) == {"refused_by_controller": 2, "from_chip": 1}
    assert told == []


def test_what_is_on_the_bus_is_told_by_its_kind() -> None:
    """Frames of others as lines, own ones as acknowledged, errors counted; frames of the base format are left alone."""
    line = Line(OPENING)
    controller = Controller()
    bridge = ChipBridge(line, controller, fd=False, tell=lambda _: None)  # type: ignore[arg-type]
    closed = ChipBridge(Line(), Controller(), fd=False, tell=lambda _: None)  # type: ignore[arg-type]
    bridge._adapter.take(OPENING)
    line.told.clear()
    for kind in (EXTENDED, EXTENDED | OWN_FRAME, EXTENDED | ERROR, ERROR, 0):
        bridge._on_arrival(kind | 0x123, b"\x07")
        closed._on_arrival(kind | 0x123, b"\x07")
    assert line.told == [b"T00000123107\r", b"Z\r"]
    assert dict(bridge.counters) == {"to_chip": 1, "bus_errors": 2}
    assert closed.counters["not_open"] == 1


def test_a_chip_that_reads_nothing_is_counted_each_time_and_told_once() -> None:
    line = Line(OPENING)
    line.takes = False
    bridge, told = bridged(line, Controller())
    assert bridge.counters["not_taken"] == len(line.told) == 1
    bridge._on_arrival(EXTENDED | 1, b"")
    bridge._on_arrival(EXTENDED | 2, b"")
    assert bridge.counters["not_taken"] == 3
    assert told == ["the chip does not read what it is told"]


@pytest.mark.parametrize("suffix", [".blf", ".asc"])
def test_a_log_is_written_where_no_folder_is_yet_and_again_where_it_is(tmp_path: Path, suffix: str) -> None:
    path = log_path(str(tmp_path / "new" / "deep" / f"joint{suffix}"))
    for end in ("7-upper", "7-lower"):
        log = CanLog(path, end)
        log.write(can.Message(arbitration_id=0x1234, data=b"\x01\x02", timestamp=5.0))
        log.close()
        log.write(can.Message(arbitration_id=0x99))  # after its end nothing is written, and nothing raised
        log.close()
        assert log.path == tmp_path / "new" / "deep" / f"joint-{end}{suffix}"
        assert [(m.arbitration_id, bytes(m.data)) for m in can.LogReader(log.path)] == [(0x1234, b"\x01\x02")]


class Port:
    """Notes what a medium asks of a port."""

    def __init__(self, *given: Any, **named: Any) -> None:
        self.given, self.named, self.closed = given, named, 0

    def close(self) -> None:
        self.closed += 1


@pytest.mark.parametrize(
    ("address", "neighbour", "is_stepped"), [(7, STEPPER, True), (STEPPER, 7, True), (7, 8, False), (7, None, False)]
)
@pytest.mark.parametrize(("frames", "largest"), [("fd", 64), ("classic", 8)])
def test_a_port_of_a_stepper_keeps_all_that_a_step_sends(
    monkeypatch: pytest.MonkeyPatch, address: int, neighbour: int | None, is_stepped: bool, frames: str, largest: int
) -> None:
    """In a step none may be dropped, so 4096 wait instead of 256; who is at which end makes no difference."""
    monkeypatch.setattr(can_medium, "CanPort", Port)
    medium = CanMedium(CanSettings.parse(f"can0,frames={frames},bitrate=125000"))
    port: Any = medium.open_port(TubeEnd("rig", address, Side.LOWER, neighbour))
    name, _, of, largest_frame, limit, profile, rates, log = port.given
    assert (of, largest_frame, profile, log) == (address, largest, None, None)
    assert (limit, port.named) == (4096 if is_stepped else can_medium.SEND_LIMIT, {"is_stepped": is_stepped})
    assert name == f"can0 (lower end of {address})"
    assert rates.nominal == 125000
    medium.close()
    assert port.closed == 1


async def test_a_box_that_was_closed_is_not_waited_at() -> None:
    """Neither at once nor when the word of its end has come and gone."""
    box: Inbox[int] = Inbox()
    box.close()
    async with asyncio.timeout(20.0):
        await box.wait()
        await asyncio.sleep(0.0)
        await box.wait()
        assert await box.get() is None
