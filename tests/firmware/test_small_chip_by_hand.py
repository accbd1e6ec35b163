"""The small program of a chip on this machine, its registers memory: time, echoes, states, hello, serial line."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import pytest
from c_library import load_checked
from needed_programs import needs_gcc

from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec

ROOT = Path(__file__).parents[2]
FIRMWARE = ROOT / "firmware"
IN_PLACE = "#define REGISTER(place) (*(volatile uint32_t *)(place))"
WORDS = (
    "in_length", "in_at", "out_length", "timer", "boots", "identifier", "said_length", "said_count", "topic",
    "acknowledged", "heard_at", "heard_length", "heard_identifier", "sent_length", "sent_slot", "next_length", "held",
)  # fmt: skip
TRACKING, STILL = 3, 4
WHOLE = 2**32
pytestmark = needs_gcc


class Shim(ctypes.Structure):
    _fields_ = [
        *((name, ctypes.c_uint8 * size) for name, size in (("in", 512), ("out", 512), ("said", 64), ("sent", 64))),
        *((name, ctypes.c_uint32) for name in WORDS),
    ]


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("small-chip")
    source = (FIRMWARE / "mps2" / "chip_tube.c").read_text()
    assert source.count(IN_PLACE) == 1
    changed = source.replace(IN_PLACE, "#define REGISTER(place) (*shim_register(place))")
    (folder / "chip_tube_in_memory.c").write_text(changed)
    codec = write_native_codec()
    (folder / NATIVE_HEADER).write_text(codec.header)
    (folder / NATIVE_CODE).write_text(codec.code)
    sources = [Path(__file__).with_name("tube_shim.c"), folder / NATIVE_CODE, FIRMWARE / "slcan_line.c"]
    loaded = load_checked(folder, sources, f"-I{folder}", f"-I{FIRMWARE}", f"-I{FIRMWARE / 'mps2'}")
    loaded.shim_state.restype = ctypes.POINTER(Shim)
    loaded.shim_now.restype = loaded.shim_spoken.restype = ctypes.c_uint32
    return loaded


@pytest.fixture
def chip(program: ctypes.CDLL) -> Any:
    program.shim_begin()
    return program


def state_of(chip: Any) -> Any:
    return chip.shim_state().contents


def written(chip: Any) -> bytes:
    """What the chip has written on its line."""
    state = state_of(chip)
    return bytes(bytes(state.out)[4 * k] for k in range(state.out_length))


def hear(chip: Any, content: bytes) -> int:
    state = state_of(chip)
    getattr(state, "in")[: len(content)] = content
    state.in_at, state.in_length = 0, len(content)
    return int(chip.shim_hear())


def test_time_goes_on_by_whole_milliseconds_of_a_timer_that_counts_down_and_begins_again(chip: Any) -> None:
    """25 000 ticks a millisecond from 2^32 - 1 down; what is left of one counts for the next."""
    timer = WHOLE - 1
    assert chip.shim_now(timer) == 0
    for ticks, ms in ((24999, 0), (1, 1), (24999, 1), (25000, 2), (1, 3), (25000 * 7 + 3, 10), (24997, 11)):
        timer -= ticks
        assert chip.shim_now(timer) == ms
    begun = timer
    for count in range(1, 5):  # around twice: each step is less than a whole round
        timer = (timer - 25000 * 60000) % WHOLE
        assert chip.shim_now(timer) == 11 + 60000 * count
    assert timer != begun


def test_what_comes_by_the_link_is_sent_back_from_the_first_place_that_is_free(chip: Any) -> None:
    state = state_of(chip)
    for held, slot in ((0, 0), (1, 1), (0b1011, 2), (0x7F, 7)):
        state.held, state.sent_length = held, 0
        chip.shim_payload(b"payload", 7)
        assert (state.sent_slot, state.sent_length, bytes(state.sent[:7])) == (slot, 7, b"payload")
    state.held, state.sent_length = 0xFF, 0
    chip.shim_payload(b"payload", 7)
    assert state.sent_length == 0  # none is free
    state.held = 0
    for length, sent in ((400, 400), (401, 0)):
        state.sent_length = 0
        chip.shim_payload(bytes(401), length)
        assert state.sent_length == sent


@pytest.mark.parametrize(
    ("yaw", "offset", "told"),
    [(1000, 24, 1024), (0xFFFFFF, 1, 0), (5, -6, 0xFFFFFF), (0x800000, -0x800000, 0), (0, 0x800000 - 1, 0x7FFFFF)],
)
def test_a_state_is_the_aiding_turned_by_the_joints_one_tube_farther(
    chip: Any, yaw: int, offset: int, told: int
) -> None:
    state, numbers = state_of(chip), (ctypes.c_int64 * 9)()
    kind = next(
        int(line.split()[2]) for line in write_native_codec().header.splitlines() if "NATIVE_AIDING_TYPE" in line
    )
    chip.shim_aiding(kind, yaw, offset, 6)
    assert state.said_count == 1
    assert chip.shim_unpack_state(numbers) == 0
    assert list(numbers) == [2, 123456, 7, TRACKING, told, 50, 60, 4, 2]
    for other in range(32):
        if other != kind:
            chip.shim_aiding(other, yaw, offset, 6)
    assert state.said_count == 1


def test_a_hello_has_its_starts_and_knows_no_place(chip: Any) -> None:
    numbers = (ctypes.c_int64 * 5)()
    chip.shim_frames(0x1FF)
    chip.shim_hello(77)
    assert chip.shim_unpack_hello(numbers) == 0
    assert list(numbers) == [2, 77, -1, STILL, 100]
    assert state_of(chip).topic == 0


def test_the_bridge_is_opened_each_half_second_until_it_speaks(chip: Any) -> None:
    chip.shim_is_open(1)
    for now, times, acknowledged in ((499, 0, 0), (500, 1, 1), (999, 1, 1), (1000, 2, 2)):
        chip.shim_open(now)
        assert written(chip) == b"\r\rC\rO\r" * times
        assert state_of(chip).acknowledged == acknowledged
        assert chip.shim_is_open(0) == 0
    assert chip.shim_spoken() == 1000


def test_what_the_bridge_says_is_taken_by_its_kind(chip: Any) -> None:
    state = state_of(chip)
    assert hear(chip, b"\r\r") == 1  # an order was obeyed
    chip.shim_is_open(0)
    assert (hear(chip, b"Z\r"), state.acknowledged) == (0, 1)
    assert (hear(chip, b"\a"), state.acknowledged) == (0, 2)
    assert (hear(chip, b"rubbish\r"), state.acknowledged) == (0, 2)
    state.timer = WHOLE - 1 - 25000 * 9
    assert hear(chip, b"T042020002A1B2\r") == 1
    assert (state.heard_identifier, state.heard_length, state.heard_at) == (0x04202000, 2, 9)


def test_a_frame_that_is_due_is_handed_over_and_dates_what_was_said(chip: Any) -> None:
    state = state_of(chip)
    chip.shim_speak(70)
    assert (written(chip), chip.shim_spoken()) == (b"", 0)
    state.next_length = 2
    chip.shim_speak(80)
    assert (written(chip), chip.shim_spoken()) == (b"B0420200025A5A\r", 80)
