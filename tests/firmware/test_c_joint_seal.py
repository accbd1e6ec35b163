"""Seals of a joint, of an end and of measurements in C, each with Python's own at the other end."""

from __future__ import annotations

import ctypes
import random
import struct
from collections import Counter
from functools import partial
from pathlib import Path

import pytest
from c_library import load_checked
from needed_programs import needs_gcc
from seal_keys import REASONS, ring_of

from node.process.key_page import KEY_PAGE, pack_key_page, write_key_page
from telemetry.application.end_seal import BaseEnd, SealFinding
from telemetry.application.measurement_seal import MeasurementSeal
from telemetry.frozen import replace
from telemetry.messages import BASE, ENCODER, Aiding
from telemetry.transport.joint_seal import HEAD, JointSeal
from telemetry.transport.key_ring import KeyRing, pack_ring
from telemetry.transport.seal import TAG_SIZE

FIRMWARE = Path(__file__).parents[2] / "firmware"
SOURCES = [FIRMWARE / "seal.c", FIRMWARE / "crc32.c"]
SOURCES += [FIRMWARE / "tube" / name for name in ("key_page.c", "seal_counts.c", "joint_seal.c", "end_seal.c")]
SHIM = Path(__file__).parent / "seal_shim.c"
CHIP, TUBE, OTHER = 2, 3, 4
ROOM = 600
pytestmark = needs_gcc


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    places = (f"-I{FIRMWARE}", f"-I{FIRMWARE / 'tube'}")
    loaded = load_checked(tmp_path_factory.mktemp("seals"), [*SOURCES, SHIM], *places)
    for name in ("shim_keys", "shim_end_open", "shim_admits"):
        getattr(loaded, name).restype = ctypes.c_bool
    for name in ("shim_open", "shim_close", "shim_own", "shim_end_close", "shim_count"):
        getattr(loaded, name).restype = ctypes.c_uint32
    loaded.shim_told.restype = ctypes.c_char_p
    return loaded


class ChipSeals:
    """The seals of a chip's process, begun with a page of keys; times in s."""

    def __init__(self, library: ctypes.CDLL, ring: KeyRing, boots: int = 1, begin_ms: int = 0) -> None:
        self._library, self._page, self._begin = library, pack_key_page(ring), begin_ms
        assert library.shim_keys(self._page, len(self._page), CHIP, boots)
        library.shim_begin(CHIP)

    def _ms(self, now: float) -> ctypes.c_uint32:
        return ctypes.c_uint32(round(1e3 * now) + self._begin & 0xFFFFFFFF)

    def open(self, frame: bytes, now: float) -> bytes | None:
        content = ctypes.create_string_buffer(frame, len(frame))  # of its very length: no byte behind it is read
        length = self._library.shim_open(content, len(frame), self._ms(now))
        return frame[HEAD.size : HEAD.size + length] or None if length else None

    def close(self, payload: bytes) -> bytes | None:
        room = ctypes.create_string_buffer(bytes(HEAD.size) + payload, HEAD.size + len(payload) + TAG_SIZE)
        length = self._library.shim_close(room, len(payload), len(room))
        return room.raw[:length] or None

    def own_frames(self, now: float) -> list[bytes]:
        frames, room = [], (ctypes.c_uint8 * ROOM)()
        while length := self._library.shim_own(room, ROOM, self._ms(now)):
            frames.append(bytes(room)[:length])
        return frames

    def end_close(self, content: bytes) -> bytes:
        head = (ctypes.c_uint8 * 27)()
        return bytes(head)[: self._library.shim_end_close(content, len(content), head)] and bytes(head) + content

    def end_open(self, payload: bytes, now: float, *, is_offer: bool) -> bool:
        return bool(self._library.shim_end_open(payload, len(payload), is_offer, self._ms(now)))

    def admits(self, aiding: Aiding, epoch: int, rig_now: float) -> bool:
        numbers = (aiding.yaw, aiding.yaw_var, aiding.rate, aiding.valid_at, aiding.sequence, aiding.torque)
        bits = struct.unpack("<6Q", struct.pack("<4dQd", *numbers))
        words = (ctypes.c_uint64 * 6)(*bits)
        told = (words, aiding.epoch, aiding.under_torque, aiding.seal, len(aiding.seal))
        times = (ctypes.c_int64(round(1e6 * aiding.valid_at)), epoch, ctypes.c_int64(round(1e6 * rig_now)))
        return bool(self._library.shim_admits(*told, *times))

    @property
    def counters(self) -> Counter[str]:
        counts = {f"seal_{name}": self._library.shim_count(k) for k, name in enumerate(REASONS)}
        return Counter({name: count for name, count in counts.items() if count})

    def told(self, now: float) -> tuple[str, int] | None:
        refused = ctypes.c_uint32()
        name = self._library.shim_told(self._ms(now), ctypes.byref(refused))
        return None if name is None else (name.decode(), refused.value)


def lots_of(seed: int) -> partial[int]:
    return partial(random.Random(seed).getrandbits, 64)


def joined(chip: ChipSeals, tube: JointSeal, now: float = 1.0) -> None:
    """Let both ends prove each other."""
    for _ in range(3):
        for frame in tube.own_frames(now):
            assert chip.open(frame, now) is None
        for frame in chip.own_frames(now):
            assert tube.open(frame, now) is None
        now += 0.2
    assert tube.partner is not None
    assert tube.partner.address == CHIP


def tube_of(*numbers: int, address: int = TUBE, seed: int = 1) -> JointSeal:
    ring = ring_of(address, *numbers)
    return JointSeal(address, lambda: ring, lots_of(seed))


@pytest.mark.parametrize(("theirs", "ours"), [((1,), (1,)), ((1, 2), (1,)), ((1,), (1, 2)), ((2, 3), (1, 2))])
@pytest.mark.parametrize("begin_ms", [0, 2**32 - 2000])
def test_both_ends_believe_each_other_and_use_the_newest_keys_of_both(
    library: ctypes.CDLL, theirs: tuple[int, ...], ours: tuple[int, ...], begin_ms: int
) -> None:
    tube, chip = tube_of(*theirs), ChipSeals(library, ring_of(CHIP, *ours), begin_ms=begin_ms)
    if min(theirs) > min(ours):  # their call is under keys that the chip has, the chip's is not
        for frame in tube.own_frames(1.0):
            assert chip.open(frame, 1.0) is None
    joined(chip, tube)
    common = max(set(theirs) & set(ours))
    for k in range(5):
        for length in (1, 15, 16, 300):
            content = bytes([k]) * length
            down, up = tube.close(content), chip.close(content)
            assert down is not None
            assert up is not None
            assert down[1] == up[1] == common
            assert chip.open(down, 2.0) == content
            assert tube.open(up, 2.0) == content


def test_every_bit_of_a_frame_is_guarded(library: ctypes.CDLL) -> None:
    tube, chip = tube_of(1), ChipSeals(library, ring_of(CHIP, 1))
    joined(chip, tube)
    frame = tube.close(b"the yaw")
    assert frame is not None
    before = chip.counters
    for bit in range(8 * len(frame)):
        changed = bytearray(frame)
        changed[bit // 8] ^= 1 << bit % 8
        assert chip.open(bytes(changed), 2.0) is None, bit
    added = chip.counters - before
    in_tag = 8 * TAG_SIZE + 8 * len(b"the yaw")
    assert added.total() == 8 * len(frame)
    assert added["seal_wrong_tag"] >= in_tag  # of the tag each single bit, and of the content
    assert chip.open(frame, 2.0) == b"the yaw"
    assert chip.told(3.0) == ("wrong_tag", chip.counters.total() - chip.counters["seal_before_joined"])


def test_each_way_to_be_refused_has_its_name(library: ctypes.CDLL) -> None:
    tube, chip = tube_of(1), ChipSeals(library, ring_of(CHIP, 1))
    joined(chip, tube)
    first = tube.close(b"one")
    assert first is not None
    assert chip.open(first, 2.0) == b"one"
    assert chip.open(first, 2.3) is None
    assert chip.counters["seal_duplicate"] == 1
    assert chip.open(first, 2.8) is None
    assert chip.counters["seal_repeated"] == 1
    frames = [tube.close(bytes([k])) for k in range(70)]
    assert all(chip.open(frame or b"", 3.0) is not None for frame in frames[6:])
    assert chip.open(frames[5] or b"", 3.0) is None  # 64 behind
    assert chip.open(frames[6] or b"", 3.0) is None
    assert chip.counters["seal_repeated"] == 3

    forger = tube_of(2)  # a generation that the chip has not got
    (call,) = forger.own_frames(3.0)
    assert chip.open(call, 3.0) is None
    assert chip.counters["seal_wrong_tag"] == 1
    stranger = tube_of(1, address=OTHER)
    for frame in stranger.own_frames(3.0):
        assert chip.open(frame, 3.0) is None  # a call proves nothing
    to_another = bytearray(first)
    to_another[4] = OTHER
    assert chip.open(bytes(to_another), 6.9) is None
    assert chip.counters["seal_before_joined"] == 1
    assert chip.open(tube.close(b"x") or b"", 6.9) == b"x"
    assert chip.open(bytes(to_another), 7.2) is None
    assert chip.counters["seal_wrong_joint"] == 1
    assert chip.open(b"\x01" + bytes(31), 7.2) is None
    assert chip.open(b"\x00" + first[1:], 7.2) is None
    assert chip.counters["seal_unsealed"] == 2


def test_what_names_another_session_is_old_and_a_new_one_is_proven_first(library: ctypes.CDLL) -> None:
    tube, chip = tube_of(1), ChipSeals(library, ring_of(CHIP, 1))
    joined(chip, tube)
    recorded = [tube.close(b"old") for _ in range(3)]
    again = ChipSeals(library, ring_of(CHIP, 1), boots=2)  # the power was cut
    for frame in recorded:
        assert again.open(frame or b"", 9.0) is None
    assert again.own_frames(9.0)[0][4] == TUBE  # an answer, which names its new session
    assert again.own_frames(13.0)
    assert again.counters == {"seal_old_session": 3}  # not proven in three seconds
    joined(again, tube, 20.0)
    fresh = tube.close(b"new")
    assert again.open(fresh or b"", 21.0) == b"new"
    assert again.open(recorded[0] or b"", 21.0) is None
    assert again.counters["seal_late"] == 1
    assert again.open(recorded[0] or b"", 27.0) is None
    assert again.counters["seal_old_session"] == 4


def test_sessions_never_come_again(library: ctypes.CDLL) -> None:
    seen = []
    for boots in range(1, 20):
        (call,) = ChipSeals(library, ring_of(CHIP, 1), boots=boots).own_frames(1.0)
        seen.append(HEAD.unpack_from(call)[5])
    assert len(set(seen)) == len(seen)
    assert min(seen) > 2**40


def test_who_is_revoked_is_not_heard_and_not_answered(library: ctypes.CDLL) -> None:
    tube, chip = tube_of(1), ChipSeals(library, ring_of(CHIP, 1, revoked=frozenset({TUBE})))
    (call,) = tube.own_frames(1.0)
    assert chip.open(call, 1.0) is None
    assert chip.counters == {"seal_wrong_tag": 1}
    assert [frame[4] for frame in chip.own_frames(1.0)] == [255]


@pytest.mark.parametrize("seed", range(6))
def test_of_drawn_frames_both_say_the_same(library: ctypes.CDLL, seed: int) -> None:
    """The chip's end and Python's of the same session and keys get the same frames: lost, late, repeated, changed; two
    neighbours take turns. What both send is one to the byte."""
    drawn = random.Random(seed)
    chip = ChipSeals(library, ring_of(CHIP, 1, 2))
    (call,) = chip.own_frames(1.0)
    ring = ring_of(CHIP, 1, 2)
    twin = JointSeal(CHIP, lambda: ring, lambda: HEAD.unpack_from(call)[5])
    assert twin.own_frames(1.0) == [call]
    neighbours = [tube_of(1, address=TUBE, seed=8), tube_of(1, 2, address=OTHER, seed=9)]
    now, kept, delivered, talker = 1.0, [b"", b"\x01"], 0, neighbours[0]
    for _ in range(600):
        now += drawn.choice((0.0, 0.125, 0.25, 1.25))  # no rounding: whole milliseconds
        if drawn.random() < 0.02:
            talker = drawn.choice(neighbours)
        said = chip.own_frames(now)
        assert said == twin.own_frames(now)
        closed = chip.close(b"from the chip")
        assert closed == twin.close(b"from the chip")
        for frame in (*said, closed or b""):
            if drawn.random() < 0.8:
                talker.open(frame, now)
        frame = drawn.choice(kept)
        if drawn.random() < 0.8:
            made = [*talker.own_frames(now), *filter(None, [talker.close(b"content")])]
            kept += made
            frame = drawn.choice(made or [b""])
        if drawn.random() < 0.1 and frame:
            changed = bytearray(frame)
            changed[drawn.randrange(len(frame))] ^= 1 << drawn.randrange(8)
            frame = bytes(changed)
        content = chip.open(frame, now)
        assert content == twin.open(frame, now)
        delivered += content is not None
    assert delivered > 100
    assert merged(chip.counters) == merged(twin.counters)


def merged(counters: Counter[str]) -> Counter[str]:
    """Counts with those of repeated frames in one: the chip keeps no time of each, and calls the newest a duplicate."""
    both = Counter(counters)
    both["seal_repeated"] += both.pop("seal_duplicate", 0)
    return both


def test_a_tube_and_the_base_end_to_end(library: ctypes.CDLL) -> None:
    chip, base = ChipSeals(library, ring_of(CHIP, 1, 2)), BaseEnd(partial(ring_of, BASE, 1, 2), lots_of(3))
    content = bytes(range(200))
    assert base.open(chip.end_close(content), CHIP, 1.0) is SealFinding.NOTHING
    ((_, offer),) = base.due_offers(lambda _: b"offer")
    for bit in range(8 * len(offer)):
        changed = bytearray(offer)
        changed[bit // 8] ^= 1 << bit % 8
        assert not chip.end_open(bytes(changed), 1.0, is_offer=True), bit
    assert chip.counters.keys() <= {"seal_end_wrong_tag", "seal_end_unsealed"}
    assert chip.end_open(offer, 1.0, is_offer=True)
    assert not chip.end_open(offer, 2.0, is_offer=True)
    assert chip.counters["seal_late"] == 1
    assert not chip.end_open(offer, 12.0, is_offer=True)
    assert chip.counters["seal_end_old_session"] == 1
    assert base.open(chip.end_close(content), CHIP, 2.0) is SealFinding.BEGINS
    sealed = chip.end_close(content)
    assert sealed[1:3] == bytes([2, 2])  # the newest that both have
    assert base.open(sealed, CHIP, 2.0) is SealFinding.BELIEVED
    assert base.open(sealed, OTHER, 2.0) is SealFinding.NOTHING
    order = base.close(b"an order", CHIP)
    assert order is not None
    assert chip.end_open(order, 3.0, is_offer=False)
    assert not chip.end_open(order, 3.0, is_offer=True)
    assert not chip.end_open(b"an order without a seal, of some length", 3.0, is_offer=False)
    assert chip.counters["seal_end_unsealed"] > 0


def test_a_measurement_is_the_encoders(library: ctypes.CDLL) -> None:
    chip, encoder = ChipSeals(library, ring_of(CHIP, 1)), MeasurementSeal(partial(ring_of, ENCODER, 1))
    twin = MeasurementSeal(partial(ring_of, CHIP, 1))
    aiding = encoder.close(Aiding(1.25, 1e-8, 0.0, 0.0, 0.1, 1000.5, 70, 0, 3.0, 0.0, True, epoch=70_000))
    path = replace(aiding, offset=0.3, hops=4, systematic_var=1e-6, torsion_var=1e-7)  # what relays change
    cases = [
        (path, 70_000, 1001.0), (path, 70_000, 1001.0), (replace(path, seal=b""), 70_000, 1001.0),
        *((replace(path, **{name: value}), 70_000, 1001.0) for name, value in {
            "yaw": 1.26, "yaw_var": 1.1e-8, "rate": 0.2, "valid_at": 1000.6, "sequence": 71, "torque": 2.0,
            "under_torque": False, "epoch": 70_001,
        }.items()),
        *((replace(path, seal=bytes(b ^ (1 << bit % 8 if k == bit // 8 else 0) for k, b in enumerate(path.seal))),
           70_000, 1001.0) for bit in range(72)),
        (path, 70_001, 1001.0), (path, 70_000, 1005.4), (path, 70_000, 1005.6),
        (encoder.close(replace(aiding, sequence=69)), 70_000, 1001.0),
        (encoder.close(replace(aiding, sequence=3, epoch=70_001)), 70_001, 1001.0),
    ]  # fmt: skip
    for case, epoch, now in cases:
        assert chip.admits(case, epoch, now) == twin.admits(case, epoch, now), (case, epoch, now)
    assert chip.counters == twin.counters
    assert chip.counters == {
        "seal_measurement_unsealed": 1,
        "seal_measurement_wrong_tag": 80,
        "seal_measurement_repeated": 2,
    }


def test_refusals_are_told_once_a_minute(library: ctypes.CDLL) -> None:
    chip = ChipSeals(library, ring_of(CHIP, 1), begin_ms=2**32 - 30_000)
    assert chip.told(1.0) is None
    for _ in range(3):
        chip.open(b"", 1.0)
    assert chip.told(1.0) == ("unsealed", 3)
    chip.end_open(b"x", 2.0, is_offer=False)
    assert chip.told(60.9) is None
    assert chip.told(61.0) == ("end_unsealed", 4)
    assert chip.told(200.0) is None


def test_a_page_of_keys_is_that_of_its_tube_and_whole(library: ctypes.CDLL, tmp_path: Path) -> None:
    path = tmp_path / f"tube-{CHIP}.keys"
    path.touch(mode=0o600)
    path.write_text(pack_ring(ring_of(CHIP, 1, 2)))
    page = write_key_page(tmp_path, CHIP, tmp_path / "out").read_bytes()
    assert page == pack_key_page(ring_of(CHIP, 1, 2))
    assert (tmp_path / "out" / KEY_PAGE).stat().st_mode & 0o077 == 0
    assert library.shim_keys(page, len(page), CHIP, 1)
    assert not library.shim_keys(page, len(page), TUBE, 1)
    assert not library.shim_keys(page, len(page) - 1, CHIP, 1)
    assert not library.shim_keys(bytes(len(page)), len(page), CHIP, 1)
    for at in (0, 4, 6, 8, 20, 60, 5000, len(page) - 1):
        changed = bytearray(page)
        changed[at] ^= 1
        assert not library.shim_keys(bytes(changed), len(page), CHIP, 1), at
