"""Cyclic messages out of frames in C: parts in any order, what is refused, and no header that has to be heard first."""

from __future__ import annotations

import ctypes
from pathlib import Path
from typing import Any

import pytest
from c_library import load_checked, struct_of
from hypothesis import example, given
from hypothesis import strategies as st
from messages_of_schema import MESSAGES
from needed_programs import needs_gcc

from telemetry.errors import DecodeError, EncodeError
from telemetry.media.can_identifier import packed_identifier
from telemetry.messages import Hello, NodeMode, TimeRequest
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec
from telemetry.presentation.can_forms import FD_PART
from telemetry.presentation.can_messages import NATIVE
from telemetry.presentation.can_native import NativeProfile, native_parts
from telemetry.presentation.msgpack_codec import encode_message
from telemetry.schema import MessageKind
from telemetry.transport.hop import Header, LinkFrame, pack_frame
from telemetry.unwritten import Content

FIRMWARE = Path(__file__).parents[2] / "firmware"
CYCLIC = sorted(NATIVE)
NEIGHBOUR = 9
NAMES = {-1: "unknown_identifier", -2: "bad_length", -3: "refused"}


class Part(ctypes.Structure):
    _fields_ = [
        ("data", ctypes.c_uint8 * 8 * 10),
        ("lengths", ctypes.c_uint8 * 10),
        ("present", ctypes.c_uint16),
        ("count", ctypes.c_uint8),
    ]


class CState(ctypes.Structure):
    _fields_ = [
        ("parts", Part * 5), ("number", ctypes.c_uint32), ("source", ctypes.c_uint8), ("refused", ctypes.c_int),
    ]  # fmt: skip


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder, written = tmp_path_factory.mktemp("receiver"), write_native_codec()
    (folder / NATIVE_HEADER).write_text(written.header)
    (folder / NATIVE_CODE).write_text(written.code)
    loaded = load_checked(folder, [NATIVE_CODE, FIRMWARE / "native_receiver.c"], "-I.")
    words = ("aiding", "hello", "time_request", "time_reply", "node_state")
    structs = [struct_of(written.header, f"borechain_native_{word}") for word in words]
    return loaded.native_hear, dict(zip(CYCLIC, structs, strict=True))


class CReceiver:
    """One end in C."""

    def __init__(self, library: Any) -> None:
        self._hear, self._structs = library
        self.state = CState()

    def hear(self, identifier: int, data: bytes) -> tuple[MessageKind, dict[str, int]] | str | None:
        """Message that is whole, or the name of what is wrong."""
        heard = (ctypes.c_uint8 * 512)()
        given = (ctypes.c_uint8 * max(len(data), 1))(*data)
        answer = self._hear(ctypes.byref(self.state), identifier, given, ctypes.c_size_t(len(data)), heard)
        if answer <= 0:
            return NAMES.get(answer)
        kind = MessageKind(answer)
        values = self._structs[kind].from_buffer(heard)
        return kind, {name: getattr(values, name) for name, *_ in values._fields_}


def told() -> NativeProfile:
    """A profile that has heard a header of the neighbour."""
    profile = NativeProfile()
    profile.observe(pack_frame(Header(NEIGHBOUR, 1 << 24 | NEIGHBOUR, 1, 0, 0, 0), []))
    return profile


def python_hears(profile: NativeProfile, identifier: int, data: bytes) -> Content | str | None:
    try:
        return profile.join(NEIGHBOUR, identifier >> 21 & 0x1F, identifier & 0x1F, data)
    except DecodeError as error:
        return str(error)


def assert_same(heard: Any, said: Content | str | None) -> None:
    """Both have the same message, or refuse the frame for the same reason."""
    if said is None:
        assert heard is None
    elif isinstance(said, str):
        name = said if said in NAMES.values() else "bad_length" if " bytes, got " in said else "refused"
        assert heard == name
    else:
        assert isinstance(said, LinkFrame)
        ((_, payload),) = said.entries
        kind, members = heard
        native = NATIVE[kind]
        assert payload.codec.kind == kind  # type: ignore[union-attr]
        raws = native.raws_of_values(payload.values)  # type: ignore[union-attr]
        assert list(members) == list(native.signals)
        for (name, value), raw in zip(members.items(), raws, strict=True):
            assert value in (raw, raw + native.signals[name].first)


@st.composite
def mixed_frames(draw: st.DrawFn) -> list[tuple[int, bytes]]:
    """Identifiers and data of the parts of some messages, in any order, some lost, some again, some changed."""
    frames: list[tuple[int, bytes]] = []
    for count in range(draw(st.integers(1, 3))):
        native = NATIVE[draw(st.sampled_from(CYCLIC))]
        try:
            raws = native.raws_of(draw(MESSAGES[native.message]))
        except EncodeError:
            continue
        form = native.form(fd=draw(st.booleans()))
        number = draw(st.integers(0, 300)) + count
        for layout, data in zip(form.layouts, form.pack(raws, number), strict=True):
            frames.append((packed_identifier(1, int(native.kind), NEIGHBOUR, layout.part), data))
    if not frames:
        return frames
    if draw(st.booleans()):
        frames = draw(st.permutations(frames))
    for _ in range(draw(st.integers(0, 3))):
        place = draw(st.integers(0, len(frames) - 1))
        identifier, data = frames[place]
        match draw(st.integers(0, 3)):
            case 0 if len(frames) > 1:
                frames = frames[:place] + frames[place + 1 :]
            case 1:
                frames = [*frames, frames[place]]
            case 2:
                frames[place] = identifier, draw(st.binary(max_size=64))
            case _:
                frames[place] = (
                    identifier & ~0x3E0001F | draw(st.integers(0, 31)) << 21 | draw(st.integers(0, 31)),
                    data,
                )
    return frames


EMPTY_PART = (packed_identifier(1, 1, NEIGHBOUR, 9), b"")
FIRST, SECOND, THIRD = (packed_identifier(2, 2, NEIGHBOUR, part) for part in range(3))  # of a hello, which has two


@needs_gcc
@given(mixed_frames())
@example([EMPTY_PART])
@example([(FIRST, bytes(8)), (THIRD, bytes(8)), (SECOND, bytes(2))])
@example([(FIRST, bytes(12)), (SECOND, bytes(2))])
@example([(FIRST, bytes(264)), (SECOND, bytes(2))])
@example([(FIRST, b"\5" + bytes(7)), (SECOND, b"\6\0"), (FIRST, b"\6" + bytes(7))])  # of two messages
@example([(FIRST, b"\5" + bytes(7)), (SECOND, b"\6\0"), (FIRST, b"\5" + bytes(7)), (SECOND, b"\5\0")])
@example([(packed_identifier(5, 5, NEIGHBOUR, 10), bytes(8))])
@example([(packed_identifier(1, 6, NEIGHBOUR, 0), b"x")])
@example([(packed_identifier(1, 2, NEIGHBOUR, FD_PART), b"x" * 12)])
def test_any_frames_are_heard_as_python_hears_them(library: Any, frames: list[tuple[int, bytes]]) -> None:
    receiver, profile = CReceiver(library), told()
    receiver.state.source, receiver.state.number = NEIGHBOUR, 1  # the header said so
    for identifier, data in frames:
        said = python_hears(profile, identifier, data)
        assert_same(receiver.hear(identifier, data), said)
        if isinstance(said, LinkFrame):
            assert receiver.state.number == profile._count[NEIGHBOUR]


@needs_gcc
@pytest.mark.parametrize("fd", [True, False])
def test_nothing_waits_for_a_header_of_the_link(library: Any, fd: bool) -> None:
    receiver, profile = CReceiver(library), NativeProfile()
    parts = native_parts(encode_message(Hello(NEIGHBOUR, 77, 3, NodeMode.STILL, 1.0)), 5, fd=fd)
    assert parts is not None
    for part in parts:
        identifier = part.identifier | NEIGHBOUR << 13
        heard = receiver.hear(identifier, part.data)
        assert_same(heard, python_hears(profile, identifier, part.data))
    kind, values = heard  # type: ignore[misc]
    assert kind is MessageKind.HELLO
    assert values == {"tube": NEIGHBOUR, "boot_count": 77, "hops": 3, "mode": 4, "link_quality": 100}


@needs_gcc
def test_counts_run_over_and_another_sender_counts_anew(library: Any) -> None:
    receiver = CReceiver(library)
    (part,) = native_parts(encode_message(TimeRequest(1.0)), 0, fd=True) or []
    numbers = []
    for count in (100, 200, 250, 3, 1, 2, 90, 200):
        receiver.hear(part.identifier | NEIGHBOUR << 13, bytes([count]) + part.data[1:])
        numbers.append(receiver.state.number)
    assert numbers == [100, 200, 250, 259, 259, 259, 346, 456]
    receiver.hear(part.identifier | 4 << 13, b"\x05" + part.data[1:])
    assert receiver.state.number == 5
