"""What a chip keeps until its receipt: whose place is taken, when it is sent again, and which receipt settles it."""

from __future__ import annotations

import ctypes
import hashlib
from pathlib import Path

import pytest
from c_library import load_checked
from needed_programs import needs_gcc

FIRMWARE = Path(__file__).parents[2] / "firmware"
ITEMS, ALL = 8, 0xFF
pytestmark = needs_gcc


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    sources = [FIRMWARE / "tube" / "chip_mail.c", FIRMWARE / "blake2b.c", Path(__file__).parent / "mail_link.c"]
    loaded = load_checked(tmp_path_factory.mktemp("mail"), sources, f"-I{FIRMWARE}", f"-I{FIRMWARE / 'tube'}")
    for name in ("shim_number", "shim_next"):
        getattr(loaded, name).restype = ctypes.c_int64
    return loaded


class Mail:
    """Eight items that are begun anew."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library
        library.shim_begin()

    def keep(self, *, is_needed: bool = False, now_ms: int = 0, payload: bytes | None = None) -> int:
        said = f"payload {self.next}".encode() if payload is None else payload
        return int(self._library.shim_place(int(is_needed), said, len(said), ctypes.c_uint32(now_ms)))

    def fill(self, *needed: bool, now_ms: int = 0) -> None:
        for k in range(ITEMS):
            assert self.keep(is_needed=k < len(needed) and needed[k], now_ms=now_ms) == k

    @property
    def next(self) -> int:
        return int(self._library.shim_next())

    @property
    def numbers(self) -> list[int]:
        return [int(self._library.shim_number(k)) for k in range(ITEMS)]

    @property
    def dropped(self) -> int:
        return int(self._library.shim_dropped())

    def sent(self, now_ms: int) -> list[int]:
        """Items that go to the link now."""
        given = self._library.shim_send(ctypes.c_uint32(now_ms & 0xFFFFFFFF))
        return [k for k in range(ITEMS) if given >> k & 1]

    def link(self, held: set[int], takes: int = 1000) -> None:
        self._library.shim_link(sum(1 << k for k in held), takes)

    def receipt(self, number: int, content: bytes) -> bool:
        return bool(self._library.shim_receipt(ctypes.c_int64(number), content, len(content)))

    def settle(self, number: int) -> None:
        assert self.receipt(number, content_of(number))

    def resume(self, now_ms: int) -> None:
        self._library.shim_resume(ctypes.c_uint32(now_ms))


def content_of(number: int) -> bytes:
    return hashlib.blake2b(f"payload {number}".encode(), digest_size=16).digest()


@pytest.fixture
def mail(library: ctypes.CDLL) -> Mail:
    return Mail(library)


def test_numbers_go_up_by_one_whatever_becomes_of_their_payloads(mail: Mail) -> None:
    mail.fill()
    assert (mail.numbers, mail.next, mail.dropped) == ([1, 2, 3, 4, 5, 6, 7, 8], 9, 0)
    assert mail.keep(payload=b"") == 0  # given back
    assert (mail.numbers, mail.next, mail.dropped) == ([0, 2, 3, 4, 5, 6, 7, 8], 10, 1)
    assert mail.keep() == 0
    assert (mail.numbers[0], mail.dropped) == (10, 1)


@pytest.mark.parametrize(
    ("needed", "held", "place"),
    [
        ("........", set(), 0),  # the oldest
        ("X.......", set(), 1),  # of those that may be lost
        ("X.......", {1, 2}, 3),  # that the link has let go of
        ("XXXXXXX.", set(), 7),  # the newest before any that is needed
        ("XXXXXXX.", {7}, 0),
        ("XXXXXXXX", set(), 0),
        ("XXXXXXXX", {0}, 1),
        (".X.X.X.X", {0, 2}, 4),
        ("........", set(range(7)), 7),
    ],
)
def test_the_place_is_that_of_the_oldest_that_may_be_lost(mail: Mail, needed: str, held: set[int], place: int) -> None:
    mail.fill(*(mark == "X" for mark in needed))
    mail.link(held)
    assert mail.keep() == place
    assert (mail.numbers[place], mail.dropped) == (9, 1)


def test_the_oldest_is_that_of_the_least_number_wherever_it_lies(mail: Mail) -> None:
    mail.fill()
    assert [mail.keep() for _ in range(10)] == [0, 1, 2, 3, 4, 5, 6, 7, 0, 1]
    mail.link({2})
    assert mail.keep() == 3
    mail.link(set())
    assert mail.keep() == 2
    assert mail.dropped == 12


def test_there_is_no_place_while_the_link_has_all_and_no_number_is_given_out(mail: Mail) -> None:
    mail.fill()
    mail.link(set(range(ITEMS)))
    assert mail.keep() == -1
    assert (mail.next, mail.dropped, mail.numbers) == (9, 1, [1, 2, 3, 4, 5, 6, 7, 8])


def test_what_was_receipted_makes_room_without_a_loss_once_the_link_lets_go_of_it(mail: Mail) -> None:
    mail.fill(True, True, True, True, True, True, True, True)
    mail.settle(6)
    mail.link({5})
    assert mail.keep(is_needed=True) == 0  # the link has it still
    assert mail.dropped == 1
    mail.link(set())
    assert mail.keep() == 5
    assert mail.dropped == 1


def test_what_has_no_receipt_is_sent_after_ten_seconds_and_then_twice_as_late_up_to_a_minute(mail: Mail) -> None:
    begin = 2**32 - 15_000  # the counter of milliseconds runs over on the way
    assert mail.keep(now_ms=begin) == 0
    times = [k for k in range(0, 250_000, 500) if mail.sent(begin + k)]
    assert times == [0, 10_000, 30_000, 70_000, 130_000, 190_000]


def test_nothing_is_due_before_its_millisecond(mail: Mail) -> None:
    mail.keep(now_ms=1000)
    assert mail.sent(999) == []
    assert mail.sent(1000) == [0]
    assert mail.sent(10_999) == []
    assert mail.sent(11_000) == [0]


def test_what_the_link_has_or_does_not_take_waits_as_it_was(mail: Mail) -> None:
    mail.fill()
    mail.link({1}, takes=2)
    assert mail.sent(0) == [0, 2]
    mail.link({0, 2}, takes=0)
    assert mail.sent(5) == []
    mail.link({0, 2, 3})
    assert mail.sent(6) == [1, 4, 5, 6, 7]
    mail.link(set())
    assert mail.sent(7) == [3]
    assert mail.sent(9_999) == []
    assert mail.sent(10_000) == [0, 2]
    assert mail.sent(10_006) == [1, 4, 5, 6, 7]


@pytest.mark.parametrize("byte", range(16))
def test_a_receipt_settles_what_it_names_by_every_byte(mail: Mail, byte: int) -> None:
    mail.fill()
    right = content_of(3)
    wrong = bytes(value ^ (k == byte) for k, value in enumerate(right))
    assert not mail.receipt(3, wrong)
    assert not mail.receipt(3, right[:15])
    assert not mail.receipt(3, right + b"\0")
    assert not mail.receipt(4, right)
    assert not mail.receipt(99, right)
    assert mail.sent(0) == list(range(8))
    assert mail.receipt(3, right)
    assert mail.sent(10_000) == [0, 1, 3, 4, 5, 6, 7]
    assert mail.numbers == [1, 2, 0, 4, 5, 6, 7, 8]
    assert not mail.receipt(3, right)  # nothing is kept of it
    mail.settle(8)


def test_what_was_receipted_is_kept_as_long_as_the_link_has_it_and_never_sent(mail: Mail) -> None:
    mail.fill()
    mail.settle(1)
    mail.link({0})
    assert mail.sent(0) == list(range(1, 8))
    assert mail.numbers[0] == 1
    mail.link(set())
    assert mail.sent(1) == []
    assert mail.numbers[0] == 0


@pytest.mark.parametrize("starts", [1, 2])
def test_after_a_start_all_is_due_but_what_was_receipted(mail: Mail, starts: int) -> None:
    mail.fill()
    mail.sent(0)
    mail.sent(10_000)
    mail.settle(2)
    for k in range(starts):
        mail.resume(500_000 + k)
    assert mail.numbers == [1, 0, 3, 4, 5, 6, 7, 8]
    assert mail.sent(500_000 - 1) == []
    assert mail.sent(500_000 + starts - 1) == [0, 2, 3, 4, 5, 6, 7]
    assert mail.sent(510_000 + starts - 2) == []
    assert mail.sent(510_000 + starts - 1) == [0, 2, 3, 4, 5, 6, 7]  # and the pauses begin anew
    assert mail.next == 9
