"""What payloads on a chip are made of: msgpack, levels of variances, BLAKE2b, beside libraries that know them."""

from __future__ import annotations

import ctypes
import hashlib
import math
from fractions import Fraction
from pathlib import Path

import msgspec
import pytest
from c_library import load_checked
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

FIRMWARE = Path(__file__).parents[2] / "firmware"
ANGLES, TIMES = (-215, 255), (-331, 511)  # first level, highest
LARGEST = 1 << 61
pytestmark = needs_gcc


class Writer(ctypes.Structure):
    _fields_ = [("room", ctypes.c_char_p), ("size", ctypes.c_uint32), ("length", ctypes.c_uint32)]


class Reader(ctypes.Structure):
    _fields_ = [("at", ctypes.c_void_p), ("left", ctypes.c_uint32)]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    sources = [FIRMWARE / f"{name}.c" for name in ("msgpack", "levels", "blake2b")]
    loaded = load_checked(tmp_path_factory.mktemp("words"), sources, f"-I{FIRMWARE}")
    loaded.variance_of_level.restype = ctypes.c_int64
    loaded.level_of_variance.restype = ctypes.c_uint32
    for name in ("read_past", "read_integer", "read_quantity"):
        getattr(loaded, name).restype = ctypes.c_bool
    return loaded


def written(call: object, *given: object) -> bytes:
    """Bytes that a call of the writer leaves."""
    room = ctypes.create_string_buffer(300)
    writer = Writer(ctypes.cast(room, ctypes.c_char_p), 300, 0)
    call(ctypes.byref(writer), *given)  # type: ignore[operator]
    return room.raw[: writer.length]


@given(st.integers(-(2**63), 2**63 - 1))
@example(-32)
@example(-33)
@example(-128)
@example(-129)
@example(127)
@example(128)
@example(255)
@example(65536)
def test_integers_are_written_and_read_as_the_codec_has_them(library: ctypes.CDLL, value: int) -> None:
    payload = msgspec.msgpack.encode(value)
    assert written(library.pack_integer, ctypes.c_int64(value)) == payload
    reader, found = reader_of(payload), ctypes.c_int64()
    assert library.read_integer(ctypes.byref(reader), ctypes.byref(found))
    assert (found.value, reader.left) == (value, 0)


@given(st.integers(-(2**63) + 1, 2**63 - 1), st.integers(0, 62))
@example(2**54 - 1, 10)
@example(2**53 + 1, 0)
@example(2**53 + 3, 0)
@example(2**54 + 2, 0)
@example(2**62 + 2**8, 0)
def test_a_quantity_is_the_nearest_float(library: ctypes.CDLL, value: int, q: int) -> None:
    nearest = float(Fraction(value, 1 << q))
    assert written(library.pack_float, ctypes.c_int64(value), q) == msgspec.msgpack.encode(nearest)


@given(st.floats(-1e6, 1e6) | st.integers(-(2**30), 2**30), st.integers(0, 32))
def test_a_float_is_read_to_the_nearest_step(library: ctypes.CDLL, value: float, q: int) -> None:
    payload = msgspec.msgpack.encode(value)
    reader, found = reader_of(payload), ctypes.c_int64()
    assert library.read_quantity(ctypes.byref(reader), q, ctypes.byref(found))
    assert abs(Fraction(found.value) - Fraction(value) * (1 << q)) <= Fraction(1, 2)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf, "text", None, b"1", [1]])
def test_what_is_no_quantity_is_refused(library: ctypes.CDLL, value: object) -> None:
    payload = msgspec.msgpack.encode(value)
    reader, found = reader_of(payload), ctypes.c_int64()
    assert not library.read_quantity(ctypes.byref(reader), 10, ctypes.byref(found))
    assert reader.left == len(payload)


@given(st.text(max_size=60))
def test_texts_are_written_as_the_codec_has_them(library: ctypes.CDLL, text: str) -> None:
    if "\0" not in text and len(text.encode()) < 256:
        assert written(library.pack_text, text.encode()) == msgspec.msgpack.encode(text)


VALUES = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(2**63), 2**63 - 1)
    | st.floats()
    | st.text(max_size=40)
    | st.binary(max_size=40),
    lambda inner: st.lists(inner, max_size=20) | st.dictionaries(st.text(max_size=5), inner, max_size=20),
    max_leaves=20,
)


@given(VALUES, st.binary(max_size=5), st.integers(1, 400))
def test_whatever_value_there_is_is_passed_over_and_a_cut_one_is_not(
    library: ctypes.CDLL, value: object, behind: bytes, cut: int
) -> None:
    payload = msgspec.msgpack.encode(value)
    reader = reader_of(payload + behind)
    assert library.read_past(ctypes.byref(reader))
    assert reader.left == len(behind)
    if cut < len(payload):
        reader = reader_of(payload[:-cut])
        assert not library.read_past(ctypes.byref(reader))


@given(st.binary(max_size=80))
def test_garbage_ends(library: ctypes.CDLL, garbage: bytes) -> None:
    reader = reader_of(garbage)
    library.read_past(ctypes.byref(reader))
    assert reader.left <= len(garbage)


def reader_of(payload: bytes) -> Reader:
    reader = Reader(ctypes.cast(ctypes.c_char_p(payload), ctypes.c_void_p), len(payload))
    reader.payload = payload  # kept alive
    return reader


@pytest.mark.parametrize(("first", "highest"), [ANGLES, TIMES])
def test_levels_are_half_decibels(library: ctypes.CDLL, first: int, highest: int) -> None:
    assert library.variance_of_level(0, first) == 0
    for level in range(1, highest + 1):
        true = 10.0 ** (0.05 * (first + level)) * 2.0**56
        found = library.variance_of_level(level, first)
        assert abs(found - min(true, LARGEST)) <= 2e-6 * true + 12.0, level


@given(st.integers(1, LARGEST), st.sampled_from([ANGLES, TIMES]))
def test_a_variance_is_never_said_smaller(library: ctypes.CDLL, variance: int, levels: tuple[int, int]) -> None:
    first, highest = levels
    level = library.level_of_variance(ctypes.c_int64(variance), first, highest)
    if level < highest:
        assert library.variance_of_level(level, first) >= variance
    assert level == 1 or library.variance_of_level(level - 1, first) < variance


@given(st.binary(max_size=700), st.integers(1, 64))
def test_a_hash_is_that_of_the_library(library: ctypes.CDLL, content: bytes, size: int) -> None:
    made = ctypes.create_string_buffer(size)
    library.blake2b_hash(content, len(content), made, size)
    assert made.raw == hashlib.blake2b(content, digest_size=size).digest()
