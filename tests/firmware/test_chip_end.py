"""A chip's end of a joint on this machine, with the product's exchange and link at the other end of a lossy bus."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from c_library import load_checked
from hypothesis import given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from telemetry.media.can_exchange import CanExchange
from telemetry.media.port import MAX_FRAME, Priority
from telemetry.media.send_queue import SendQueue
from telemetry.messages import Hello, NodeMode, TimeRequest
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec
from telemetry.presentation.can_native import NativeProfile, native_parts
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.schema import MessageKind
from telemetry.transport.hop import HopLink

FIRMWARE = Path(__file__).parents[2] / "firmware"
SOURCES = [
    FIRMWARE / f"{name}.c" for name in ("chip_end", "hop_link", "link_frame", "crc32", "isotp", "native_receiver")
]
CHIP, TUBE, NOTHING = 2, 1, 255
ON_PAYLOAD = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.POINTER(ctypes.c_uint8), ctypes.c_uint32)
ON_SIGNALS = ctypes.CFUNCTYPE(None, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)
HAS_ROOM = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p)
STEP_MS = 3


class Calls(ctypes.Structure):
    _fields_ = [
        ("own", ctypes.c_void_p),
        ("on_payload", ON_PAYLOAD),
        ("on_signals", ON_SIGNALS),
        ("has_room", HAS_ROOM),
        *((name, ctypes.c_void_p) for name in ("next_word", "close_payload", "seal", "joint")),
    ]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder, written = tmp_path_factory.mktemp("end"), write_native_codec()
    (folder / NATIVE_HEADER).write_text(written.header)
    (folder / NATIVE_CODE).write_text(written.code)
    loaded = load_checked(folder, [NATIVE_CODE, *SOURCES], "-I.", f"-I{FIRMWARE}")
    loaded.chip_end_next_frame.restype = ctypes.c_uint8
    loaded.link_send.restype = ctypes.c_bool
    return loaded


class ChipSide:
    """The end in C; its link is what it begins with."""

    def __init__(self, library: ctypes.CDLL, largest: int, has_room: Callable[[], bool] = lambda: True) -> None:
        self._has_room = has_room
        self._library, self._state = library, (ctypes.c_uint64 * 1024)()
        self.payloads: list[bytes] = []
        self.kinds: list[int] = []
        self._kept: list[Any] = []
        self._calls = Calls(
            None,
            ON_PAYLOAD(lambda _, payload, length: self.payloads.append(bytes(payload[:length]))),
            ON_SIGNALS(lambda _, kind, heard: self.kinds.append(kind)),
            HAS_ROOM(lambda _: self._has_room()),
        )
        library.chip_end_begin(self._state, ctypes.byref(self._calls), CHIP, 5, largest, 77, 0)

    def send(self, payload: bytes) -> None:
        content = ctypes.create_string_buffer(payload, len(payload))
        self._kept.append(content)
        assert self._library.link_send(self._state, content, len(payload))

    def say(self, identifier: int, data: bytes, topic: int = 0) -> None:
        self._library.chip_end_say(self._state, identifier, topic, data, len(data))

    def next_frame(self, now_ms: int) -> tuple[int, bytes] | None:
        identifier, data = ctypes.c_uint32(), (ctypes.c_uint8 * 72)()
        length = self._library.chip_end_next_frame(self._state, ctypes.byref(identifier), data, now_ms)
        assert bytes(data)[64:] == bytes(8)
        return None if length == NOTHING else (identifier.value, bytes(data)[:length])

    def on_frame(self, identifier: int, data: bytes, now_ms: int) -> None:
        self._library.chip_end_on_frame(self._state, identifier, data, len(data), now_ms)

    def on_acknowledged(self) -> None:
        self._library.chip_end_on_acknowledged(self._state)


class TubeSide:
    """The product's exchange and link."""

    def __init__(self, largest: int) -> None:
        self.exchange = CanExchange(TUBE, largest, SendQueue(MAX_FRAME), 9, 0.0, NativeProfile())
        self.link = HopLink(TUBE, 1)
        self.link.bundle_limit = 0
        self.payloads: list[bytes] = []

    def next_frame(self, now: float) -> tuple[int, bytes] | None:
        for frame in self.link.take_frames(now):
            self.exchange.queue.offer(frame)
        self.exchange.advance(now)
        found = self.exchange.next_frame(now)
        return None if found is None else (found.identifier, found.data)

    def on_frame(self, identifier: int, data: bytes, now: float) -> None:
        content = self.exchange.on_frame(identifier, data, now)
        if content is not None:
            self.payloads += [bytes(payload) for payload in self.link.receive(content, now)]


def carry(chip: ChipSide, tube: TubeSide, lost: set[int], steps: int) -> None:
    """Frames both ways, each acknowledged; some of the first do not reach the other end's program."""
    count = 0
    for step in range(steps):
        now_ms = step * STEP_MS
        if (out := chip.next_frame(now_ms)) is not None:
            chip.on_acknowledged()
            if count not in lost:
                tube.on_frame(*out, now_ms / 1e3)
            count += 1
        if (into := tube.next_frame(now_ms / 1e3)) is not None:
            tube.exchange.on_acknowledged(now_ms / 1e3)
            if count not in lost:
                chip.on_frame(*into, now_ms)
            count += 1


PAYLOADS = st.lists(st.binary(min_size=1, max_size=400), max_size=6, unique=True)


@needs_gcc
@given(PAYLOADS, PAYLOADS, st.sets(st.integers(0, 120), max_size=25), st.sampled_from([8, 64]))
def test_whatever_frames_are_lost_every_payload_arrives_once(
    library: ctypes.CDLL, ours: list[bytes], theirs: list[bytes], lost: set[int], largest: int
) -> None:
    chip, tube = ChipSide(library, largest), TubeSide(largest)
    hello = encode_message(Hello(TUBE, 1, 1, NodeMode.STILL, 1.0))
    tube.link.send_best_effort(hello, "hello")
    for payload in ours:
        chip.send(payload)
    for number, payload in enumerate(theirs):
        tube.link.send_reliable(payload, (Priority.SURVEY, Priority.BLOCK, Priority.COMMAND)[number % 3])
    carry(chip, tube, lost, 6000)
    assert sorted(chip.payloads) == sorted(theirs)
    assert sorted(tube.payloads) == sorted(ours)
    assert tube.link.waiting == 0


@needs_gcc
@pytest.mark.parametrize("largest", [8, 64])
def test_signals_go_both_ways(library: ctypes.CDLL, largest: int) -> None:
    chip, tube = ChipSide(library, largest), TubeSide(largest)
    (part,) = native_parts(encode_message(TimeRequest(12.5)), 3, fd=largest == 64) or []
    chip.say(part.identifier, part.data)
    tube.link.send_best_effort(encode_message(TimeRequest(13.5)), "time", Priority.TIME)
    carry(chip, tube, set(), 40)
    assert tube.payloads == [encode_message(TimeRequest(12.5))]
    assert chip.kinds == [MessageKind.TIME_REQUEST]


@needs_gcc
def test_a_payload_without_room_comes_again_and_once(library: ctypes.CDLL) -> None:
    """While there is none, what the other end acknowledges still counts."""
    looks = iter([False] * 4 + [True] * 1000)
    chip, tube = ChipSide(library, 64, lambda: next(looks)), TubeSide(64)
    tube.link.send_best_effort(encode_message(Hello(TUBE, 1, 1, NodeMode.STILL, 1.0)), "hello")
    chip.send(b"from below")
    tube.link.send_reliable(b"from above", Priority.BLOCK)
    carry(chip, tube, set(), 4000)
    assert (chip.payloads, tube.payloads) == ([b"from above"], [b"from below"])
    assert tube.link.waiting == 0


@needs_gcc
def test_signals_wait_by_topic_and_the_most_urgent_goes_first(library: ctypes.CDLL) -> None:
    chip = ChipSide(library, 64)
    chip.next_frame(0)  # the sign of life
    state, hello, time = 0x14A01FFF, 0x08401FFF, 0x00601FFF
    for identifier, topic, data in (
        (state, 3, b"old"), (state, 4, b"four"), (hello, 0, b"hello"), (state, 3, b"new"), (time, 0, b"time"),
    ):  # fmt: skip
        chip.say(identifier, data, topic)
    chip.on_acknowledged()
    said = []
    while (frame := chip.next_frame(1)) is not None:
        said.append(frame[1])
        chip.on_acknowledged()
    assert said[:2] == [b"time", b"hello"]
    assert sorted(said[2:4]) == [b"four", b"new"]
    for tube in range(20):  # more than there is room for: none displaces what is more urgent
        chip.say(state, bytes([tube]), tube)
    chip.say(time, b"time", 0)
    assert chip.next_frame(2) == (time | CHIP << 13, b"time")
