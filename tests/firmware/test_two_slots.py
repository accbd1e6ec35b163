"""Two slots of flash: the power is cut after and in every single write and erasure, and one whole save is read."""

from __future__ import annotations

import ctypes
import random
import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from c_library import load_checked
from hypothesis import given
from hypothesis import strategies as st
from needed_programs import needs_gcc

FIRMWARE = Path(__file__).parents[2] / "firmware"
SIZE, WORD, HEADER = 128, 8, 16
ROOM = SIZE - HEADER
NONE, SAVED, TOO_LONG, WORN = 2, 0, -1, -2
ERASE = ctypes.CFUNCTYPE(ctypes.c_bool, ctypes.c_void_p, ctypes.c_uint32)
WRITE = ctypes.CFUNCTYPE(
    ctypes.c_bool, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint8)
)
READ = ctypes.CFUNCTYPE(
    None, ctypes.c_void_p, ctypes.c_uint32, ctypes.c_uint32, ctypes.POINTER(ctypes.c_uint8), ctypes.c_uint32
)


class Board(ctypes.Structure):
    _fields_ = [
        ("own", ctypes.c_void_p), ("size", ctypes.c_uint32), ("erase", ERASE), ("write", WRITE), ("read", READ),
    ]  # fmt: skip


class Found(ctypes.Structure):
    _fields_ = [("slot", ctypes.c_uint32), ("generation", ctypes.c_uint32), ("length", ctypes.c_uint32)]


@pytest.fixture(scope="module")
def slots(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    library = load_checked(tmp_path_factory.mktemp("slots"), [FIRMWARE / "two_slots.c", FIRMWARE / "crc32.c"])
    library.crc32_of.restype = ctypes.c_uint32
    return library


class Flash:
    """A flash as strict as a real one: words are written once after an erasure, and a cut leaves any bits."""

    def __init__(self, seed: int = 0) -> None:
        self._bits = random.Random(seed)
        self.content = [bytearray(self._bits.randbytes(SIZE)) for _ in range(2)]  # never erased
        self._erased = [set[int](), set[int]()]
        self.left: int | None = None  # operations until the power goes; that one is done in part
        self.operations = 0
        self.stuck: Callable[[int, int], bool] = lambda slot, at: False  # words that do not take what is written
        self.is_honest = True  # it reports a word that it did not take
        self._keep = ERASE(self._erase), WRITE(self._write), READ(self._read)
        self.board = Board(None, SIZE, *self._keep)

    def _cut(self) -> bool:
        """Whether this operation is the one in which the power goes, or it has gone."""
        self.operations += 1
        if self.left is not None:
            self.left -= 1
        return self.left is not None and self.left <= 0

    def _erase(self, _own: None, slot: int) -> bool:
        if self.left is not None and self.left <= 0:
            return False
        if self._cut():
            for at in range(SIZE):
                self.content[slot][at] |= self._bits.randrange(256)
            self._erased[slot].clear()
            return False
        self.content[slot][:] = b"\xff" * SIZE
        self._erased[slot] = set(range(0, SIZE, WORD))
        return True

    def _write(self, _own: None, slot: int, at: int, word: ctypes._Pointer[ctypes.c_uint8]) -> bool:
        if self.left is not None and self.left <= 0:
            return False
        assert at in self._erased[slot], f"word {at} of slot {slot} is written twice, or was not erased"
        self._erased[slot].discard(at)
        given, is_cut = bytes(word[:WORD]), self._cut()
        for k in range(WORD):
            mask = self._bits.randrange(256) if is_cut else 0
            self.content[slot][at + k] = given[k] | mask
        if self.stuck(slot, at):
            self.content[slot][at] ^= 0x10
            return not self.is_honest
        return not is_cut

    def _read(self, _own: None, slot: int, at: int, into: ctypes._Pointer[ctypes.c_uint8], length: int) -> None:
        assert at + length <= SIZE
        for k in range(length):
            into[k] = self.content[slot][at + k]


class Keeper:
    """What a chip does with it from its start on."""

    def __init__(self, slots: ctypes.CDLL, flash: Flash) -> None:
        self._slots, self._flash, self.found = slots, flash, Found()
        flash.left = None
        slots.slots_find(ctypes.byref(flash.board), ctypes.byref(self.found))

    def load(self) -> bytes | None:
        room = (ctypes.c_uint8 * (SIZE + 8))()
        self._slots.slots_load(ctypes.byref(self._flash.board), ctypes.byref(self.found), room)
        return None if self.found.slot == NONE else bytes(room)[: self.found.length]

    def save(self, content: bytes, cut_in: int | None = None) -> int:
        self._flash.left = cut_in
        board, found = ctypes.byref(self._flash.board), ctypes.byref(self.found)
        return int(self._slots.slots_save(board, found, content, len(content)))


@needs_gcc
@given(st.binary(max_size=300), st.binary(max_size=30))
def test_the_checksum_is_the_usual_one_and_goes_on(slots: ctypes.CDLL, data: bytes, more: bytes) -> None:
    first = slots.crc32_of(0, data, len(data))
    assert first == zlib.crc32(data)
    assert slots.crc32_of(first, more, len(more)) == zlib.crc32(data + more)


@needs_gcc
def test_a_flash_that_was_never_written_has_nothing(slots: ctypes.CDLL) -> None:
    keeper = Keeper(slots, Flash())
    assert keeper.load() is None
    assert keeper.save(bytes(ROOM + 1)) == TOO_LONG
    assert keeper.save(b"x" * ROOM) == SAVED
    assert Keeper(slots, keeper._flash).load() == b"x" * ROOM


SAVES = st.lists(st.tuples(st.binary(max_size=ROOM), st.none() | st.integers(1, 20)), min_size=1, max_size=12)


@needs_gcc
@given(SAVES, st.integers(0, 2**32))
def test_after_any_cuts_the_save_before_or_this_one_is_read(
    slots: ctypes.CDLL, saves: list[tuple[bytes, int | None]], seed: int
) -> None:
    flash = Flash(seed)
    keeper, before = Keeper(slots, flash), None
    for content, cut_in in saves:
        answer = keeper.save(content, cut_in)
        was_cut = cut_in is not None and flash.left is not None and flash.left <= 0
        keeper = Keeper(slots, flash) if was_cut else keeper
        after = keeper.load()
        assert after in (before, content)
        assert answer != SAVED or after == content
        assert was_cut or answer == SAVED
        before = after


@needs_gcc
@pytest.mark.parametrize("length", [0, 1, 8, 37, ROOM])
def test_a_cut_in_every_single_operation_costs_one_save_at_most(slots: ctypes.CDLL, length: int) -> None:
    old, new = bytes(range(length)), bytes(range(1, length + 1))
    whole = Flash()
    Keeper(slots, whole).save(new)
    for cut_in in range(1, whole.operations + 1):
        for seed in range(5):
            flash = Flash(seed)
            keeper = Keeper(slots, flash)
            assert [keeper.save(b"oldest"), keeper.save(old)] == [SAVED, SAVED]
            keeper.save(new, cut_in)
            again = Keeper(slots, flash)
            assert again.load() == old
            assert again.save(new) == SAVED
            assert Keeper(slots, flash).load() == new


@needs_gcc
@pytest.mark.parametrize("is_honest", [True, False])
@pytest.mark.parametrize("at", [0, 8, HEADER, HEADER + 24])
def test_a_slot_that_is_worn_is_reported_and_the_other_one_stays(slots: ctypes.CDLL, at: int, is_honest: bool) -> None:
    flash = Flash()
    keeper = Keeper(slots, flash)
    assert keeper.save(b"good" * 8) == SAVED
    bad = 1 - keeper.found.slot
    flash.stuck, flash.is_honest = lambda slot, place: (slot, place) == (bad, at), is_honest
    for _ in range(3):
        assert keeper.save(b"newer" * 8) == WORN
        assert keeper.load() == b"good" * 8
        assert Keeper(slots, flash).load() == b"good" * 8


@needs_gcc
@given(st.integers(0, 2 * SIZE * 8 - 1))
def test_one_bit_that_has_changed_is_noticed(slots: ctypes.CDLL, bit: int) -> None:
    flash = Flash()
    keeper = Keeper(slots, flash)
    contents = [b"first" * 20, b"second" * 18]
    assert [keeper.save(content) for content in contents] == [SAVED, SAVED]
    slot, place = divmod(bit, SIZE * 8)
    flash.content[slot][place // 8] ^= 1 << place % 8
    assert Keeper(slots, flash).load() in (contents if slot == keeper.found.slot else contents[1:])


@needs_gcc
def test_generations_run_over(slots: ctypes.CDLL) -> None:
    flash = Flash()
    keeper = Keeper(slots, flash)
    keeper.save(b"0")
    keeper.found.generation = 2**32 - 4
    for k in range(6):
        assert keeper.save(b"%d" % k) == SAVED
        assert k == 0 or Keeper(slots, flash).load() == b"%d" % k


@needs_gcc
def test_a_flash_that_is_locked_is_worn(slots: ctypes.CDLL) -> None:
    flash = Flash()
    keeper = Keeper(slots, flash)
    assert [keeper.save(b"a"), keeper.save(b"a")] == [SAVED, SAVED]
    locked, silent = ERASE(lambda *_: True), WRITE(lambda *_: True)
    flash.board.erase, flash.board.write = locked, silent
    assert keeper.save(b"a") == WORN
    assert Keeper(slots, flash).found.generation == 2
