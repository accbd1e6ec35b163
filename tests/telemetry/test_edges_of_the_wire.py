"""Bounds and changes on the wire that no example would meet by chance: each with a number on either side of it."""

from __future__ import annotations

import itertools
from collections import Counter
from pathlib import Path

import msgpack
import pytest
from sealed_string import make_folder

from telemetry.application.depth_source import DepthSource
from telemetry.application.end_seal import BaseEnd, SealingEnd
from telemetry.application.place import StringPlace
from telemetry.application.seals import Keys
from telemetry.frozen import replace
from telemetry.media.can_exchange import BUDGET_BURST, BUDGETS, Budget
from telemetry.media.can_profile import NativePart
from telemetry.media.isotp import Sender
from telemetry.media.port import Priority
from telemetry.messages import (
    BASE,
    MAX_TUBE,
    Aiding,
    BlockStatus,
    Hello,
    NodeMode,
    Side,
    Stand,
    TimeRequest,
    UploadPhase,
)
from telemetry.presentation.can_native import HEADER_EVERY, NativeProfile, native_parts
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.transport.hop import Header, pack_frame, parse_frame
from telemetry.transport.key_ring import key_file
from telemetry.transport.nearest import SETTLE, SILENT_AFTER, Nearest
from telemetry.transport.upload import Assembly, Upload, split_block

KEY = bytes(range(32))


@pytest.mark.parametrize(
    ("length", "largest", "head"),
    [
        # ISO 15765-2: a length up to 4095 in 12 bits, a longer one in 32 bits behind an escape
        (4095, 8, "1fff"),
        (4096, 8, "100000001000"),
        (4095, 64, "1fff"),
        (4096, 64, "100000001000"),
        (7, 8, "07"),
        (8, 8, "1008"),
        (7, 64, "07"),
        (8, 64, "0008"),
        (62, 64, "003e"),
        (63, 64, "103f"),
    ],
)
def test_a_first_frame_begins_as_the_standard_says(length: int, largest: int, head: str) -> None:
    frame = Sender(bytes([0xAA]) * length, largest).next_frame()
    assert frame.hex().startswith(head + "aa" * min(2, length))


@pytest.mark.parametrize("priority", list(Priority))
def test_a_budget_gives_exactly_what_it_has(priority: Priority) -> None:
    budget, rate = Budget(), BUDGETS[priority]
    allowed = [budget.allows(priority, 0.0) for _ in range(int(BUDGET_BURST * rate) + 2)]
    assert allowed == [True] * int(BUDGET_BURST * rate) + [False, False]
    assert [budget.allows(priority, 3.0 / rate) for _ in range(4)] == [True, True, True, False]


def status(**change: object) -> BlockStatus:
    digest = split_block(b"block", 3, 77, 5, KEY)[0].digest
    return replace(BlockStatus(3, 77, digest, UploadPhase.APPLIED, 1, 4, bytes(32), ""), **change)  # type: ignore[arg-type]


@pytest.mark.parametrize("sequence", [76, 78])
def test_a_status_of_another_upload_of_the_same_block_ends_nothing(sequence: int) -> None:
    upload = Upload(split_block(b"block", 3, 77, 5, KEY), 0.0)
    assert not upload.on_status(status(sequence=sequence))
    assert not upload.on_status(status(sequence=sequence, phase=UploadPhase.REFUSED))
    assert upload.on_status(status())


@pytest.mark.parametrize("change", [{"version": 4}, {"version": 6}, {"count": 2}, {"digest": bytes(32)}])
def test_a_segment_of_another_version_or_block_does_not_belong(change: dict[str, object]) -> None:
    (segment,) = split_block(b"block", 3, 77, 5, KEY)
    assembly = Assembly(5, segment.digest, 1)
    assert assembly.belongs(segment)
    assert not assembly.belongs(replace(segment, **change))  # type: ignore[arg-type]


@pytest.mark.parametrize(("index", "is_one"), [(-1, False), (0, True), (2, True), (3, False)])
def test_a_restored_segment_has_a_number_below_that_of_all(index: int, is_one: bool) -> None:
    saved = msgpack.packb([5, bytes(32), 3, [(index, b"part")]])
    assert (Assembly.restore(saved) is not None) == is_one


@pytest.mark.parametrize("starts", [1, 2])
def test_signals_of_a_sender_that_started_again_are_numbered_anew(starts: int) -> None:
    profile = NativeProfile()
    request = encode_message(TimeRequest(1.0))
    for boot in range(1, 2 + starts):
        epoch = boot << 24 | 2
        before = 5000 if boot <= starts else 3
        profile.observe(pack_frame(Header(2, epoch, before, 0, 0, 0), []))
        (part,) = native_parts(request, before + 1, fd=True) or []
        joined = profile.join(2, part.identifier >> 21 & 0x1F, part.identifier & 0x1F, part.data)
        assert joined is not None
        parsed = parse_frame(bytes(joined))
        assert parsed is not None
        assert (parsed[0].epoch, parsed[0].number) == (epoch, before + 1)


@pytest.mark.parametrize("kept", [1, 2])
def test_what_is_left_of_a_message_is_not_filled_up_by_the_next(kept: int) -> None:
    """The first part of one is lost, and then all but the first of the next: no frame is made of the two."""
    profile = NativeProfile()
    profile.observe(pack_frame(Header(2, 1 << 24 | 2, 1, 0, 0, 0), []))
    one, other = (
        native_parts(encode_message(Aiding(yaw, 2e-6, 3e-7, -0.3, 1.24, 1234.5, 5, 3)), count, fd=False) or []
        for yaw, count in ((1.0, 1), (2.0, 2))
    )
    assert len(one) == len(other) > kept

    def join(part: NativePart) -> object:
        return profile.join(2, part.identifier >> 21 & 0x1F, part.identifier & 0x1F, part.data)

    for _ in range(2):
        assert [join(part) for part in (*one[kept:], *other[:kept])] == [None] * len(one)
        found = [join(part) for part in other[kept:]]
        assert found[:-1] == [None] * (len(found) - 1)
        assert found[-1] is not None


def test_the_header_goes_again_exactly_when_it_is_due() -> None:
    profile = NativeProfile()
    frame = pack_frame(Header(2, 1 << 24 | 2, 1, 0, 0, 0), [(0, encode_message(TimeRequest(1.0)))])
    assert profile.split(frame, 10.0, fd=True).rest is not None
    assert profile.split(frame, 10.0 + HEADER_EVERY - 1e-6, fd=True).rest is None
    assert profile.split(frame, 10.0 + HEADER_EVERY, fd=True).rest is not None


@pytest.mark.parametrize(("hops", "is_taken"), [(MAX_TUBE - 2, True), (MAX_TUBE - 1, True), (MAX_TUBE, False)])
def test_the_lowest_tube_of_the_longest_string_has_its_place(hops: int, is_taken: bool) -> None:
    place = StringPlace(1, 1, Counter())
    assert place.meet(Side.UPPER, Hello(2, 1, hops, NodeMode.STILL, 1.0), 2, 1.0, 0.0) == is_taken
    assert (place.told_hops == hops + 1) == is_taken


@pytest.mark.parametrize(("upper", "hops"), [(4, 8), (5, 9), (6, 10)])
def test_silent_tubes_above_count_as_hops(upper: int, hops: int) -> None:
    place = StringPlace(3, 3, Counter())
    place.meet(Side.UPPER, Hello(upper, 1, 7, NodeMode.STILL, 1.0), upper, 1.0, 0.0)
    assert place.told_hops == hops


@pytest.mark.parametrize(("silent", "is_second_chosen"), [(SILENT_AFTER, False), (SILENT_AFTER + 1e-6, True)])
def test_a_neighbour_counts_until_it_was_silent_for_exactly_so_long(silent: float, is_second_chosen: bool) -> None:
    nearest = Nearest(float)
    for at in (0.0, SETTLE):
        nearest.is_chosen(1, at)
    for at in (SETTLE, SETTLE + 1.0, SETTLE + 2.0):
        assert not nearest.is_chosen(2, at)
    assert nearest.is_chosen(2, SETTLE + silent) == is_second_chosen


def test_a_stand_begins_with_its_first_reading_and_ends_with_its_last() -> None:
    source = DepthSource()
    for at in (10.0, 11.0, 13.0, 17.0):
        reading = source.measure(at, 4.0, 1)
    assert reading.stands == (Stand(1, 10.0, 17.0, 4.0),)
    assert source.measure(18.0, 5.0, 1).stands == (Stand(1, 10.0, 17.0, 4.0),)


@pytest.mark.parametrize("times", [1, 2])
def test_stands_of_a_time_before_are_forgotten_when_rig_time_counts_anew(times: int) -> None:
    source = DepthSource()
    for _ in range(times):
        for at in (100.0, 101.0):
            source.measure(at, 4.0)
        assert source.measure(1.0, 4.0).stands == ()
        assert source.measure(2.0, 4.0).stands == (Stand(0, 1.0, 2.0, 4.0),)


def test_a_key_file_is_mended_as_often_as_it_breaks(tmp_path: Path) -> None:
    path = key_file(make_folder(tmp_path / "stick"), 1)
    keys, good = Keys(path, 1), path.read_text()
    for turn in range(3):
        path.write_text("broken " * (turn + 1))
        assert not keys.refresh()
        assert "expected keys as borechain pki writes them" in keys.fault
        assert not keys.refresh()
        path.write_text(good + "# mended\n" * (turn + 1))
        assert keys.refresh()
        assert keys.fault == ""


def test_a_state_counts_once_and_none_that_is_older(tmp_path: Path) -> None:
    folder = make_folder(tmp_path / "stick")
    numbers = itertools.count(7)
    base = BaseEnd(lambda: Keys(key_file(folder, BASE), BASE).ring, lambda: next(numbers))
    tube = SealingEnd(1, lambda: Keys(key_file(folder, 1), 1).ring, lambda: next(numbers))
    for _ in range(2):  # a second session begins anew
        base.open(tube.close(b"hello"), 1, 0.0)
        for _, offer in base.due_offers(lambda tube: b"offer"):
            tube.open(offer, 0.1, is_offer=True)
        assert base.open(tube.close(b"first"), 1, 0.2).begins_session
        assert [base.is_next_state(1, cycles) for cycles in (0, 0, 5, 5, 4, 6)] == [
            True, False, True, False, False, True,
        ]  # fmt: skip
        tube = SealingEnd(1, lambda: Keys(key_file(folder, 1), 1).ring, lambda: next(numbers))
    assert base.counters["seal_end_repeated"] == 6
