"""One end of a CAN joint by hand: each wait at its bound and a hair beyond, each count once, each state twice."""

from __future__ import annotations

import contextlib
import math
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from telemetry.application import arguments
from telemetry.application.commands import COMMANDS
from telemetry.errors import CommandError, EncodeError, RadioError
from telemetry.media import can_exchange, chip_bridge
from telemetry.media.can_exchange import (
    ACKNOWLEDGE_LIMIT,
    BUDGET_BURST,
    BUDGETS,
    FLOW_LIMIT,
    PAUSE_LIMIT,
    PRESENCE_EVERY,
    PRIORITIES,
    SILENCE,
    Budget,
    BusLoadMeter,
    CanExchange,
)
from telemetry.media.can_identifier import FLOW_CONTROL, PRESENCE, TUNNEL
from telemetry.media.can_timing import BitRates
from telemetry.media.chip_bridge import ChipBridge
from telemetry.media.port import PortFrame, Priority
from telemetry.media.send_queue import SendQueue
from telemetry.messages import DepthReading, NodeFlag, Stand
from telemetry.presentation.can_native import Split
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.quantities import ValueKind
from telemetry.radio.waveguide import HIGHEST, WaveguideMode
from telemetry.runtime.disk import MachineDisk
from telemetry.runtime.step_stream import StepStream

Noted = list[Any]


def end(address: int = 2, *, nonce: int = 7, begun: float = 0.0, profile: Any = None, largest: int = 8) -> CanExchange:
    return CanExchange(address, largest, SendQueue(16384), nonce, begun, profile)


def up(one: CanExchange, now: float = 0.0) -> CanExchange:
    """Have an end's first sign of life acknowledged."""
    assert one.next_frame(now) is not None
    one.on_acknowledged(now)
    return one


def bits(priority: Priority, kind: int, source: int, part: int = 0) -> int:
    """29 bits: 3 of urgency, 5 of the kind, 8 of the source, 13 of a part."""
    return PRIORITIES.index(priority) << 26 | kind << 21 | source << 13 | part


FIRST = PRIORITIES[0]


def test_a_sign_of_life_has_its_age_in_milliseconds_and_its_nonce_and_comes_again() -> None:
    one = end(nonce=0x01020304, begun=10.0)
    frame = one.next_frame(12.5)
    assert frame is not None
    assert frame.data == (2500).to_bytes(4, "big") + bytes([1, 2, 3, 4])
    assert frame.identifier >> 13 & 0xFF == 2
    assert frame.identifier >> 21 & 0x1F == PRESENCE
    assert one.next_frame(12.6) is None  # one is on its way
    one.on_acknowledged(13.0)
    assert one.next_frame(13.0 + PRESENCE_EVERY) is None
    again = one.next_frame(13.0 + PRESENCE_EVERY + 1e-6)
    assert again is not None
    assert again.data[:4] == int(1e3 * (3.0 + PRESENCE_EVERY)).to_bytes(4, "big")
    old = end(begun=0.0).next_frame(5e6)
    assert old is not None
    assert old.data[:4] == b"\xff" * 4


def test_an_end_is_alone_from_beyond_the_silence_on() -> None:
    one = end()
    assert one.is_alone(0.0)  # it has never heard anything
    up(one, 100.0)
    assert not one.is_alone(1e9)
    one.on_refused()
    assert [one.is_alone(100.0 + SILENCE), one.is_alone(100.0 + SILENCE + 1e-6)] == [False, True]


def test_a_frame_that_is_not_acknowledged_takes_the_end_down_and_then_begins_anew() -> None:
    one = up(end())
    assert one.queue.offer(PortFrame(bytes(100), FIRST))
    assert one.next_frame(0.1) is not None
    for now, is_up, under_way in (
        (0.1 + ACKNOWLEDGE_LIMIT, True, 1), (0.1 + ACKNOWLEDGE_LIMIT + 1e-6, False, 1),
        (0.1 + PAUSE_LIMIT, False, 1), (0.1 + PAUSE_LIMIT + 1e-6, False, 0),
    ):  # fmt: skip
        one.advance(now)
        assert (one.is_up, len(one._outgoing)) == (is_up, under_way)
    assert len(one.queue) == 1  # put back, to begin anew


def test_a_transfer_without_an_answer_is_given_up_beyond_the_limit_and_counted() -> None:
    for since, left in ((FLOW_LIMIT, 1), (FLOW_LIMIT + 1e-6, 0)):
        one = up(end())
        assert one.queue.offer(PortFrame(bytes(100), FIRST))
        one.next_frame(0.1)
        if not one._outgoing:
            one.next_frame(0.1)
        one.on_acknowledged(0.1)
        if not next(iter(one._outgoing.values())).awaits_flow:
            assert one.next_frame(0.1) is not None
            one.on_acknowledged(0.1)
        moved = next(iter(one._outgoing.values())).moved_at
        one.advance(moved + since)
        assert (len(one._outgoing), one.counters["no_flow_control"]) == (left, 1 - left)


@pytest.mark.parametrize(
    ("source", "kind", "name"),
    [(1, 3, "unknown_identifier"), (2, TUNNEL, "same_address"), (1, FLOW_CONTROL, "bad_flow_control")],
)
def test_what_cannot_be_is_counted_by_its_name_and_gives_nothing(source: int, kind: int, name: str) -> None:
    one = end()
    for count in (1, 2):
        assert one.on_frame(bits(FIRST, kind, source), b"\0", 1.0) is None
        assert dict(one.counters) == {name: count}
    assert end().on_frame(len(PRIORITIES) << 26, b"", 1.0) is None


def test_a_third_talker_is_heard_once_the_partner_is_silent_for_longer_than_it_may() -> None:
    one = end()
    one.on_frame(bits(FIRST, PRESENCE, 1), bytes(8), 5.0)
    for now, partner, counted in ((5.0 + SILENCE, 1, 1), (5.0 + SILENCE + 1e-6, 9, 1), (5.0 + SILENCE + 0.1, 9, 1)):
        one.on_frame(bits(FIRST, PRESENCE, 9), bytes(8), now)
        assert (one.partner, one.counters["third_talker"]) == (partner, counted)
    one.on_frame(bits(FIRST, PRESENCE, 1), bytes(8), 5.0 + SILENCE + 0.2)
    assert (one.partner, one.counters["third_talker"]) == (9, 2)


@pytest.mark.parametrize(
    ("age_ms", "nonce", "is_mute"),
    [(9000, 0, False), (10000, 6, False), (10000, 7, False), (10000, 8, True), (10001, 0, True)],
)
def test_of_two_ends_of_one_address_the_younger_is_mute_and_at_one_age_the_smaller_number(
    age_ms: int, nonce: int, is_mute: bool
) -> None:
    one = up(end(begun=0.0, nonce=7))
    one.on_frame(bits(FIRST, PRESENCE, 2), age_ms.to_bytes(4, "big") + nonce.to_bytes(4, "big"), 10.0)
    assert (one.is_mute, one.is_up, one._presence_is_due) == (is_mute, not is_mute, not is_mute)
    if is_mute:
        assert one.queue.offer(PortFrame(b"x", FIRST))
        assert one.next_frame(10.0) is None
        one.on_acknowledged(10.1)
        assert not one.is_up
        one.on_frame(bits(FIRST, TUNNEL, 2), b"\0", 10.2)
        assert not one._presence_is_due  # a mute end does not show itself


@pytest.mark.parametrize("data", [bytes(7), bytes(9), b""])
def test_a_double_that_says_no_age_has_this_end_show_itself(data: bytes) -> None:
    one = up(end())
    one.on_frame(bits(FIRST, PRESENCE, 2), data, 1.0)
    assert (one.is_mute, one._presence_is_due) == (False, True)


@pytest.mark.parametrize("priority", list(BUDGETS))
def test_a_budget_is_its_rate_and_its_burst_and_each_class_has_its_own(priority: Priority) -> None:
    rate, budget = BUDGETS[priority], Budget()
    burst = int(BUDGET_BURST * rate)
    assert [budget.allows(priority, 100.0) for _ in range(burst + 2)] == [True] * burst + [False] * 2
    assert not budget.allows(priority, 100.0 + 0.999 / rate)
    assert budget.allows(priority, 100.0 + 1.001 / rate)
    assert not budget.allows(priority, 50.0)  # a clock that steps back gives nothing
    for other in BUDGETS:
        if other is not priority:
            assert budget.allows(other, 100.0)
    assert [budget.allows(priority, 1e6) for _ in range(burst + 1)] == [True] * burst + [False]


def test_a_bus_is_busy_by_what_it_carries_and_forgets() -> None:
    rates = BitRates(125_000, 0)
    assert rates.is_paced
    meter = BusLoadMeter(rates, fd=False)
    one_frame = rates.duration(8, fd=False)
    for _ in range(10):
        meter.add(8, 5.0)
    assert meter._busy == pytest.approx(10.0 * one_frame)
    assert meter._busy_at(5.0 + can_exchange.MEMORY) == pytest.approx(10.0 * one_frame / math.e)
    assert meter._busy_at(4.0) == pytest.approx(10.0 * one_frame)
    frames = can_exchange.HEAVY * can_exchange.MEMORY / one_frame
    whole = BusLoadMeter(rates, fd=False)
    assert not whole.is_heavy(5.0)
    for _ in range(int(frames)):
        whole.add(8, 5.0)
    assert not whole.is_heavy(5.0)
    whole.add(8, 5.0)
    assert whole.is_heavy(5.0)


def test_a_message_of_one_part_goes_at_once_and_one_of_more_is_under_way() -> None:
    parts = [SimpleNamespace(identifier=5 << 21, data=b"one"), SimpleNamespace(identifier=6 << 21, data=b"two")]
    for count, rest, at_once in ((1, None, True), (2, None, False), (1, b"rest", False)):
        split = Split(parts[:count], rest)  # type: ignore[arg-type]
        profile: Any = SimpleNamespace(split=lambda *_a, split=split, **_k: split)
        one = up(end(profile=profile))
        assert one.queue.offer(PortFrame(b"payload", FIRST))
        frame = one._start(1.0)
        assert (frame is not None, len(one._outgoing)) == (at_once, 0 if at_once else 1)
        if frame is None:
            frame = one._continue(FIRST, 1.0)
        assert (frame.data, frame.identifier) == (b"one", 5 << 21 | 2 << 13)
        if count == 2:
            assert one._continue(FIRST, 1.0).data == b"two"
            assert not one._outgoing


# a chip's bridge


@pytest.mark.parametrize(("gap", "told"), [(5.0, 0), (5.001, 1)])
def test_a_chip_that_is_silent_is_told_beyond_five_seconds_and_again_after_ten(
    monkeypatch: pytest.MonkeyPatch, gap: float, told: int
) -> None:
    now, said = [100.0], list[str]()
    steps = iter([0.1, gap, 0.1, 9.8, 0.2])
    bridge: Any = ChipBridge(None, None, fd=False, tell=said.append)  # type: ignore[arg-type]
    counts: Noted = []

    def receive(patience: float) -> bytes:
        counts.append(len(said))
        step = next(steps, None)
        if step is None:
            bridge.stop()
            return b""
        now[0] += step
        return b"\r" if len(counts) == 1 else b""

    bridge._line = SimpleNamespace(receive=receive, send=lambda _content: True)
    monkeypatch.setattr(chip_bridge, "time", SimpleNamespace(monotonic=lambda: now[0]))
    bridge._obey()
    assert counts[2] == told
    assert counts[3] == 1  # 5.1 s at the latest
    assert len(said) == 2
    assert said[0] == "nothing heard from the chip for 5 s; is it on, at this speed?"


def test_the_first_failure_of_a_bus_is_the_one_that_is_raised() -> None:
    bridge: Any = ChipBridge(None, None, fd=False, tell=lambda _line: None)  # type: ignore[arg-type]
    first, second = RuntimeError("first"), RuntimeError("second")
    bridge._fail(first)
    bridge._fail(second)
    assert (bridge._failure, bridge._is_ending) == (first, True)


def test_garbage_is_told_by_its_newest_with_all_that_was_wrong() -> None:
    said: Noted = []
    bridge: Any = ChipBridge(None, None, fd=False, tell=said.append)  # type: ignore[arg-type]
    bridge.counters.update({"garbage": 3, "other_frames": 2, "not_open": 1, "to_chip": 50})
    bridge._show_garbage(100.0)
    assert said == []
    bridge._adapter.garbage.extend([b"old", b"new"])
    bridge._show_garbage(100.0)
    assert said == ["expected an order of SLCAN, got b'new' (6 so far)"]
    assert not bridge._adapter.garbage
    for now, count in ((109.9, 1), (110.0, 2)):
        bridge._adapter.garbage.append(b"x")
        bridge._show_garbage(now)
        assert len(said) == count


# a disk


def test_a_disk_reads_from_an_offset_writes_in_place_and_makes_what_is_not_there(tmp_path: Path) -> None:
    disk, file = MachineDisk(), tmp_path / "a"
    disk.write(file, b"0123456789")
    assert file.stat().st_mode & 0o777 == 0o600
    disk.write(file, b"AB", 4)
    assert file.read_bytes() == b"0123AB6789"
    assert (disk.read(file, 4), disk.read(file, 4, 2), disk.read(file, 8, 99)) == (b"AB6789", b"AB", b"89")
    disk.write(file, b"Z", 12)
    assert file.read_bytes() == b"0123AB6789\0\0Z"
    disk.reserve(tmp_path / "b", 5000)
    assert (tmp_path / "b").stat().st_size == 5000
    disk.reserve(file, 4)
    assert file.read_bytes() == b"0123AB6789\0\0Z"  # what is there stays
    assert (disk.identity(file), disk.stamp(file)[1]) == (file.stat().st_ino, 13)
    assert (disk.identity(tmp_path / "none"), disk.stamp(tmp_path / "none")) == (0, ())
    disk.rename(file, tmp_path / "b")
    assert (tmp_path / "b").read_bytes().endswith(b"Z")
    for call in (disk.read, disk.force, disk.remove):
        with pytest.raises(FileNotFoundError):
            call(file)


# streams, flags and arguments


def test_what_a_stream_brought_before_its_end_is_taken_and_then_its_end() -> None:
    ours, theirs = socket.socketpair()
    with ours, theirs:
        stream = StepStream(ours)
        theirs.sendall(b"\0\0\0\x03abc\0\0")
        assert stream.arrived() == [b"abc"]
        theirs.sendall(b"\0")
        assert stream.arrived() == []  # a part of a length, and it is alive
        theirs.sendall(b"\x02de\0\0\0\x01f")
        assert stream.arrived() == [b"de", b"f"]
        theirs.close()
        assert stream.arrived() is None


def test_flags_of_a_node_are_a_bit_each_in_the_order_of_the_wire() -> None:
    assert [flag.value for flag in NodeFlag] == [1 << k for k in range(11)]
    names = "YAW_UNTRUSTED AIDING_OLD INNOVATION_REJECTED RATE_EXCEEDED RESTORED CLOCK_UNSYNCHRONISED BIAS_UNKNOWN"
    assert [flag.name for flag in NodeFlag] == [
        *names.split(),
        "SENSOR_FAULT",
        "NOT_SAVED",
        "DRIVE_UNTOLD",
        "LOWER_UNTOLD",
    ]


def test_whole_numbers_of_orders_are_checked_by_their_quantity() -> None:
    kinds = [one for spec in COMMANDS for one in spec.arguments if one.quantity.kind is ValueKind.INTEGER]
    assert len(kinds) >= 2
    for argument in kinds:
        low = int(argument.quantity.low)
        assert arguments._check(argument, low) == low
        with pytest.raises(CommandError, match=argument.quantity.name):
            arguments._check(argument, low - 1)


def test_a_stand_of_the_bit_has_a_depth_of_the_bit() -> None:
    for md, is_depth in ((0.0, True), (50.0, True), (-1e-3, False), (math.inf, False)):
        reading = DepthReading(7, 10.0, 50.0, stands=(Stand(3, 1.0, 2.0, md),))
        if is_depth:
            assert decode_message(encode_message(reading)) == reading
        else:
            with pytest.raises(EncodeError, match="stands"):
                encode_message(reading)


def test_modes_of_a_guide_have_their_largest_numbers_and_none_beyond() -> None:
    for m, n, is_mode in (
        (HIGHEST, HIGHEST, True), (0, 1, True), (HIGHEST + 1, 1, False), (0, HIGHEST + 1, False), (0, 0, False),
    ):  # fmt: skip
        with contextlib.nullcontext() if is_mode else pytest.raises(RadioError, match="expected m of"):
            WaveguideMode("TE", m, n)
