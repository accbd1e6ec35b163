"""SLCAN in C with Python's adapter at the other end of the line."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from c_library import load_checked
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from telemetry.media.can_timing import FD_LENGTHS
from telemetry.media.slcan import SlcanAdapter, SlcanFrame

FIRMWARE = Path(__file__).parents[2] / "firmware"
NOTHING, FRAME, ACKNOWLEDGED, DONE, REFUSED, GARBAGE = 0, 1, 2, 3, -1, -2


class CFrame(ctypes.Structure):
    _fields_ = [("identifier", ctypes.c_uint32), ("length", ctypes.c_uint8), ("data", ctypes.c_uint8 * 64)]


class CLine(ctypes.Structure):
    _fields_ = [("line", ctypes.c_uint8 * 139), ("length", ctypes.c_uint8), ("is_overlong", ctypes.c_bool)]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    return load_checked(tmp_path_factory.mktemp("slcan"), [FIRMWARE / "slcan_line.c"])


def heard(library: ctypes.CDLL, content: bytes) -> list[SlcanFrame | int]:
    """What comes of bytes: frames and events."""
    line, frame, events = CLine(), CFrame(), list[SlcanFrame | int]()
    for byte in content:
        event = library.slcan_take(ctypes.byref(line), ctypes.c_uint8(byte), ctypes.byref(frame))
        if event == FRAME:
            events.append(SlcanFrame(frame.identifier, bytes(frame.data)[: frame.length]))
        elif event != NOTHING:
            events.append(event)
    return events


def opened(*, fd: bool) -> SlcanAdapter:
    adapter = SlcanAdapter(fd=fd)
    adapter.take(b"O\r")
    return adapter


FRAMES = st.builds(
    lambda identifier, length, byte: SlcanFrame(identifier, bytes((byte + k) & 0xFF for k in range(length))),
    st.integers(0, 2**29 - 1),
    st.sampled_from(FD_LENGTHS),
    st.integers(0, 255),
)


@needs_gcc
@given(FRAMES, st.booleans())
def test_each_end_reads_what_the_other_writes(library: ctypes.CDLL, frame: SlcanFrame, fd: bool) -> None:
    adapter, room = opened(fd=fd), (ctypes.c_uint8 * 150)(*[0xA5] * 150)
    content = CFrame(frame.identifier, len(frame.data), (ctypes.c_uint8 * 64)(*frame.data))
    length = library.slcan_write(ctypes.byref(content), ctypes.c_bool(fd), room)
    assert bytes(room)[139:] == b"\xa5" * 11
    if not fd and len(frame.data) > 8:
        assert length == 0
        return
    assert adapter.take(bytes(room)[:length]) == ([frame], b"")
    assert bytes(room)[:length] == adapter.told(frame)
    assert heard(library, adapter.told(frame) + b"Z\r\r\a" + adapter.told(frame)) == [
        frame, ACKNOWLEDGED, DONE, REFUSED, frame,
    ]  # fmt: skip


@needs_gcc
@given(st.sampled_from([b"T", b"D", b"B", b"Z", b"x", b""]), st.text("0123456789abcdefABCDEFgz/:@G`\0", max_size=40))
@example(b"T", "042020009" + "00" * 12)
@example(b"T", "20000000" + "0")
@example(b"T", "0420200020G00")
@example(b"T", "0420200G0")
@example(b"T", "04202000G")
@example(b"T", "1FFFFFFF" + "0")
@example(b"B", "0" * 400)
@example(b"B", "1FFFFFFFF" + "5a" * 64)
@example(b"B", "1FFFFFFFF" + "5a" * 64 + "0")
@example(b"B", "1FFFFFFFF" + "5a" * 63)
@example(b"T", "00000000")
def test_a_line_is_a_frame_where_pythons_end_says_so(library: ctypes.CDLL, letter: bytes, digits: str) -> None:
    line = letter + digits.encode() + b"\r"
    frames, _ = opened(fd=letter != b"T").take(line)
    events = heard(library, line)
    if frames:
        assert events == frames
    else:
        assert events == [{b"\r": DONE, b"Z\r": ACKNOWLEDGED}.get(line, GARBAGE)]
    assert heard(library, line + b"T042020000\r")[1:] == [SlcanFrame(0x04202000, b"")]


@needs_gcc
def test_no_frame_has_nine_bytes(library: ctypes.CDLL) -> None:
    room = (ctypes.c_uint8 * 139)()
    assert library.slcan_write(ctypes.byref(CFrame(1, 9)), ctypes.c_bool(True), room) == 0
