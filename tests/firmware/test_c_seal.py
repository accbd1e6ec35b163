"""Seals in C: the known answers of RFC 4493 and FIPS 197, and Python's tags and window for anything else."""

from __future__ import annotations

import ctypes
from pathlib import Path

import pytest
from c_library import load_checked
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from telemetry.transport.seal import ReplayWindow, SealKey

FIRMWARE = Path(__file__).parents[2] / "firmware"
KEY = bytes.fromhex("2b7e151628aed2a6abf7158809cf4f3c")
MESSAGE = bytes.fromhex(
    "6bc1bee22e409f96e93d7e117393172aae2d8a571e03ac9c9eb76fac45af8e51"
    "30c81c46a35ce411e5fbc1191a0a52eff69f2445df4f9b17ad2b417be66c3710"
)
TAGS = {
    0: "bb1d6929e95937287fa37d129b756746",
    16: "070a16b46b4d4144f79bdd9dd04a287c",
    40: "dfa66747de9ae63030ca32611497c827",
    64: "51f0bebf7e3b9d92fc49741779363cfe",
}  # RFC 4493, section 4
SUBKEYS = ("fbeed618357133667c85e08f7236a8de", "f7ddac306ae266ccf90bc11ee46d513b")
LAST_ROUND = "d014f9a8c9ee2589e13f0cc8b6630ca6"  # FIPS 197, appendix A.1


class CKey(ctypes.Structure):
    _fields_ = [
        ("rounds", ctypes.c_uint8 * 16 * 11), ("whole_last", ctypes.c_uint8 * 16), ("cut_last", ctypes.c_uint8 * 16),
    ]  # fmt: skip


class CWindow(ctypes.Structure):
    _fields_ = [("seen", ctypes.c_uint64), ("largest", ctypes.c_uint32)]


@pytest.fixture(scope="module")
def seal(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    library = load_checked(tmp_path_factory.mktemp("seal"), [FIRMWARE / "seal.c"])
    library.seal_fits.restype = library.seal_admit.restype = ctypes.c_bool
    return library


def key_of(seal: ctypes.CDLL, secret: bytes) -> CKey:
    key = CKey()
    seal.seal_set_key(ctypes.byref(key), secret)
    return key


def tag_of(seal: ctypes.CDLL, key: CKey, message: bytes) -> bytes:
    tag = (ctypes.c_uint8 * 16)()
    seal.seal_tag(ctypes.byref(key), message, ctypes.c_size_t(len(message)), tag)
    return bytes(tag)


@needs_gcc
@pytest.mark.parametrize("length", TAGS)
def test_known_answers(seal: ctypes.CDLL, length: int) -> None:
    key = key_of(seal, KEY)
    assert tag_of(seal, key, MESSAGE[:length]).hex() == TAGS[length]
    assert (bytes(key.whole_last).hex(), bytes(key.cut_last).hex()) == SUBKEYS
    assert bytes(key.rounds[10]).hex() == LAST_ROUND


@needs_gcc
@given(st.binary(min_size=16, max_size=16), st.binary(max_size=100))
def test_tags_are_those_of_python(seal: ctypes.CDLL, secret: bytes, message: bytes) -> None:
    assert tag_of(seal, key_of(seal, secret), message)[:8] == SealKey(secret).tag(message)


@needs_gcc
@given(st.binary(max_size=40), st.integers(0, 63))
def test_a_tag_with_one_bit_changed_does_not_fit(seal: ctypes.CDLL, message: bytes, bit: int) -> None:
    key, tag = key_of(seal, KEY), SealKey(KEY).tag(message)
    changed = (int.from_bytes(tag) ^ 1 << bit).to_bytes(8)
    length = ctypes.c_size_t(len(message))
    assert seal.seal_fits(ctypes.byref(key), message, length, tag)
    assert not seal.seal_fits(ctypes.byref(key), message, length, changed)


@needs_gcc
@given(st.lists(st.integers(0, 200) | st.integers(2**32 - 100, 2**32 - 1), max_size=40))
@example([0, 0, 63, 0, 64, 1, 0, 127, 63, 64, 128])
@example([2**32 - 1, 2**32 - 65, 2**32 - 64, 2**32 - 63, 0])
def test_the_window_admits_what_pythons_admits(seal: ctypes.CDLL, numbers: list[int]) -> None:
    window, pythons = CWindow(), ReplayWindow()
    for number in numbers:
        assert seal.seal_admit(ctypes.byref(window), ctypes.c_uint32(number)) == pythons.admit(number)
