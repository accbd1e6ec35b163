"""The link of a joint in C: its frames byte for byte, and Python's link at the other end where frames are lost."""

from __future__ import annotations

import ctypes
import zlib
from itertools import pairwise
from pathlib import Path

import msgpack
import pytest
from c_library import load_checked
from c_link import ROOM, SLOTS, CLink, Entries, Entry, Guarded, Header, PythonLink
from hypothesis import example, given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from telemetry.transport.hop import ENTRY_BYTES, HEADER_BYTES, pack_frame, parse_frame

FIRMWARE = Path(__file__).parents[2] / "firmware"
SOURCES = [FIRMWARE / name for name in ("hop_link.c", "link_frame.c", "crc32.c")]


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    loaded = load_checked(tmp_path_factory.mktemp("link"), SOURCES)
    for name in ("link_parse", "link_next_entry", "link_send", "link_holds", "link_is_up"):
        getattr(loaded, name).restype = ctypes.c_bool
    for name in ("link_pack", "link_next_numbered", "link_best_effort", "link_acknowledgement"):
        getattr(loaded, name).restype = ctypes.c_uint32
    return loaded


U64 = st.integers(0, 2**64 - 1) | st.sampled_from([0, 127, 128, 255, 256, 65535, 65536, 2**32 - 1, 2**32, 2**64 - 1])
NUMBERS = st.integers(0, 2**53 - 1) | st.sampled_from([0, 2**53 - 1])
PAYLOADS = st.binary(max_size=300)
ENTRIES = st.lists(st.tuples(NUMBERS, PAYLOADS), max_size=4) | st.lists(
    st.tuples(NUMBERS, st.just(b"x")), min_size=14, max_size=18
)


def parsed_in_c(library: ctypes.CDLL, frame: bytes) -> tuple[list[int], list[list[object]]] | None:
    header, entries, entry = Header(), Entries(), Entry()
    content = ctypes.create_string_buffer(frame, max(len(frame), 1))
    if not library.link_parse(content, len(frame), ctypes.byref(header), ctypes.byref(entries)):
        return None
    found: list[list[object]] = []
    while library.link_next_entry(ctypes.byref(entries), ctypes.byref(entry)):
        found.append([entry.number, ctypes.string_at(entry.payload, entry.length)])
    return [getattr(header, name) for name, *_ in Header._fields_], found


def parsed_in_python(frame: bytes) -> tuple[list[int], list[list[object]]] | None:
    parsed = parse_frame(frame)
    return None if parsed is None else (list(parsed[0]), [list(entry) for entry in parsed[1]])


@needs_gcc
@given(st.lists(U64, min_size=6, max_size=6), ENTRIES)
def test_a_frame_is_pythons_byte_for_byte(
    library: ctypes.CDLL, numbers: list[int], entries: list[tuple[int, bytes]]
) -> None:
    frame = pack_frame(numbers, entries)
    contents = [ctypes.create_string_buffer(payload, max(len(payload), 1)) for _, payload in entries]
    array = (Entry * max(len(entries), 1))(
        *(
            Entry(number, ctypes.addressof(content), len(payload))
            for (number, payload), content in zip(entries, contents, strict=True)
        )
    )
    for size in (len(frame), len(frame) + 5, len(frame) - 1, 3):
        room = Guarded(size)
        length = library.link_pack(ctypes.byref(Header(*numbers)), array, len(entries), room.begin, size)
        assert length == (len(frame) if size >= len(frame) else 0)
        assert room.content(length) == frame[:length]
    assert parsed_in_c(library, frame) == parsed_in_python(frame) == (numbers, [list(entry) for entry in entries])


@needs_gcc
@pytest.mark.parametrize("length", [0, 1, 31, 32, 254, 255, 256, 257, 1500])
def test_a_payload_has_the_shortest_form_of_its_length(library: ctypes.CDLL, length: int) -> None:
    numbers, payload = (1, 2**24, 3, 4, 5, 6), bytes(range(256)) * 6
    kept = ctypes.create_string_buffer(payload[:length], max(length, 1))
    entry, room = Entry(7, ctypes.cast(kept, ctypes.c_void_p), length), Guarded()
    found = library.link_pack(ctypes.byref(Header(*numbers)), ctypes.byref(entry), 1, room.begin, ROOM)
    assert room.content(found) == pack_frame(numbers, [(7, payload[:length])])


def with_checksum(body: bytes) -> bytes:
    return zlib.crc32(body).to_bytes(4, "little") + body


ODD = [
    None,
    [2, 1, 1, 1, 1, 1, 1, []], [1, -1, 1, 1, 1, 1, 1, []], [1, 1, 1, 1, 1, 1, True, []], [1, 1, 1, 1, 1, 1, 1, {}],
    [1, 1, 1, 1, 1, 1, []], [1, 1, 1, 1, 1, 1, 1, [], 1], [1, 1, 1, 1, 1, 1, 1, [[2**53, b""]]], {1: 1}, 7, "text",
    [1, 1, 1, 1, 1, 1, 1, [[1, "text"]]], [1, 1, 1, 1, 1, 1, 1, [[1, b"", 1]]], [1, 1.0, 1, 1, 1, 1, 1, []],
    [1, 1, 1, 1, 1, 1, 1, [[-1, b""]]], [1, 1, 1, 1, 1, 1, 1, [7]], [1, 1, 1, 1, 1, 1, 1, [[1, b"a"], [1]]],
]  # fmt: skip
LONG_FORMS = b"\xdc\x00\x08\xcc\x01\xd0\x05\xd1\x00\x05\xd2\x00\x00\x00\x05\xd3" + bytes(7) + b"\x05\xcd\x00\x01\xcf"
LONG_FORMS += bytes(7) + b"\x07\xdd\x00\x00\x00\x01\xdc\x00\x02\xce\x00\x00\x00\x01\xc6\x00\x00\x00\x02ab"
USUAL = pack_frame([1, 2**24, 3, 4, 5, 6], [(0, b""), (7, b"payload")])


@needs_gcc
@pytest.mark.parametrize("said", ODD, ids=repr)
def test_what_is_packed_and_no_frame_is_refused(library: ctypes.CDLL, said: object) -> None:
    frame = with_checksum(msgpack.packb(said))
    assert parsed_in_c(library, frame) is parsed_in_python(frame) is None


@needs_gcc
@given(st.integers(0, len(USUAL) - 5), st.binary(max_size=4), st.integers(0, 4))
@example(len(USUAL) - 5, b"", 1)
@example(0, LONG_FORMS, len(USUAL))
@example(0, LONG_FORMS.replace(b"\xd0\x05", b"\xd0\x85"), len(USUAL))
@example(0, LONG_FORMS.replace(b"\xd1\x00", b"\xd1\x80"), len(USUAL))
@example(0, LONG_FORMS + b"\x00", len(USUAL))
@example(0, b"\x98\x01\x01\x01\x01\x01\x01\x01\xdd\xff\xff\xff\xff", len(USUAL))
@example(0, b"\x98\x01\x01\x01\x01\x01\x01\x01\x91\x92\x01\xc6\xff\xff\xff\xff", len(USUAL))
def test_changed_bytes_are_a_frame_where_python_says_so(
    library: ctypes.CDLL, place: int, bytes_: bytes, taken: int
) -> None:
    body = USUAL[4:]
    frame = with_checksum(body[:place] + bytes_ + body[place + taken :])
    assert parsed_in_c(library, frame) == parsed_in_python(frame)
    assert parsed_in_c(library, frame[:-1]) is None
    wrong = bytes([frame[0] ^ 1]) + frame[1:]
    assert parsed_in_c(library, wrong) is None


ELEVEN = 11  # ms: no sum of them is a time at which something is due, where floats and integers might part
WHAT = ("send", "ours", "theirs", "again", "old", "wait", "silence", "reset", "best", "meets", "made", "made")
SESSIONS = (0, 1, 2, 5, 0x7FFF, 0x8000, 0xFFFF)
STEPS = st.lists(st.tuples(st.sampled_from(WHAT), st.integers(0, 4899)), min_size=20, max_size=80)


@needs_gcc
@given(STEPS, st.sampled_from([0, 2**32 - 500]))
def test_both_ends_do_the_same_of_the_same_frames(
    library: ctypes.CDLL, steps: list[tuple[str, int]], begin_ms: int
) -> None:
    """A link in C and one in Python at the same end; at the other one a tube that starts anew, is late, and repeats."""
    ours, pythons, other = CLink(library, 2, 5, begin_ms), PythonLink(2, 5), PythonLink(1, 1)
    now, sent, boots, best = ELEVEN, 0, 1, list[bytes]()
    history: list[bytes] = []
    for what, much in steps:
        match what:
            case "send" if ours.state.count < SLOTS:
                payload = b"ours %d" % (sent - much % 2)  # now and then one that may wait already
                sent += 1
                assert ours.send(payload)
                pythons.link.send_reliable(payload)
            case "theirs":
                other.link.send_reliable(b"theirs %d" % (much % 31))
                for frame in other.frames(now, [b"state"])[: 1 + much % 3]:
                    history.append(frame)
                    assert ours.receive(frame, now) == pythons.receive(frame, now)
            case "again" if history:
                assert ours.receive(history[-1], now) == pythons.receive(history[-1], now)
            case "old" if history:
                frame = history[max(0, len(history) - 1 - much % 31)]
                assert ours.receive(frame, now) == pythons.receive(frame, now)
            case "meets":  # another process, for which it begins a session, and another one with us after that
                for frame in PythonLink(9, 1 + much % 2).frames(now, [b"hello"]):
                    other.receive(frame, now)
            case "made":  # of any boot and session of the other end, to any of ours, any number
                boot, session, known, ahead = much % 2, much // 2 % 7, much // 14 % 5, much // 70 % 70
                header = [1, 1 + boot << 24 | SESSIONS[session] << 8 | 1, 1000, 0, 0, 0]
                header[3] = (ours.state.epoch, 0, 4 << 24 | 2, 5 << 24 | 7 << 8 | 2, 5 << 24 | 9)[known]
                number = ours.state.received + ahead
                history.append(pack_frame(header, [(number, b"made %d" % number)]))
                assert ours.receive(history[-1], now) == pythons.receive(history[-1], now)
            case "best":
                best.append(b"best %d" % much)
            case "wait":
                now += ELEVEN * (1 + much % 31)
            case "silence":
                now += ELEVEN * 400
            case "reset":
                boots += 1
                other = PythonLink(1 + much % 2 * 8, boots)
            case _:
                pass
        frames = ours.frames(now, best)
        assert frames == pythons.frames(now, best)
        best.clear()
        if what == "ours":
            for frame in frames:
                other.receive(frame, now)
        assert ours.state.count == pythons.link.waiting
        assert ours.state.epoch == pythons.link.epoch


@needs_gcc
@given(
    st.lists(st.tuples(st.booleans(), st.sets(st.integers(0, 7))), min_size=1, max_size=60),
    st.lists(st.sampled_from(["ours", "theirs"]), max_size=14),
)
def test_whatever_is_lost_all_arrives_once(
    library: ctypes.CDLL, losses: list[tuple[bool, set[int]]], sends: list[str]
) -> None:
    ours, other, now = CLink(library, 2, 5), PythonLink(1, 1), 0
    sent: dict[str, list[bytes]] = {"ours": [], "theirs": []}
    got: dict[str, list[bytes]] = {"ours": [], "theirs": []}
    waiting = list(enumerate(sends))
    for round_ in range(120):
        is_late, lost = losses[round_] if round_ < len(losses) else (False, set[int]())
        now += 11 * 4
        while waiting and ours.state.count < SLOTS:
            number, side = waiting.pop()
            payload = b"%d" % number
            assert side == "theirs" or ours.send(payload)
            if side == "theirs":
                other.link.send_reliable(payload)
            sent[side].append(payload)
        up, down = ours.frames(now, [b"hello"]), other.frames(now, [b"hello"])
        for place, frame in enumerate(reversed(up) if is_late else up):
            if place not in lost:
                got["ours"] += other.receive(frame, now) or []
        for place, frame in enumerate(reversed(down) if is_late else down):
            if place not in lost:
                got["theirs"] += ours.receive(frame, now) or []
    for side in ("ours", "theirs"):
        assert sorted(payload for payload in got[side] if payload != b"hello") == sorted(sent[side])
    assert ours.state.count == other.link.waiting == 0


def both(library: ctypes.CDLL) -> tuple[CLink, PythonLink, PythonLink]:
    """The end in C and in Python, which have met the other end as it has met them."""
    ours, pythons, other = CLink(library, 2, 5), PythonLink(2, 5), PythonLink(1, 1)
    for frame in pythons.frames(0, [b"hello"]):
        other.receive(frame, 0)
    assert ours.frames(0, [b"hello"]) != []
    for frame in other.frames(0, [b"hello"]):
        assert ours.receive(frame, 0) == pythons.receive(frame, 0) == [b"hello"]
    return ours, pythons, other


@needs_gcc
def test_what_is_not_acknowledged_is_said_again_after_the_same_pauses(library: ctypes.CDLL) -> None:
    ours, pythons, other = both(library)
    ours.send(b"survey")
    pythons.link.send_reliable(b"survey")
    said = []
    for now in range(0, 11 * 1200, 11):
        if now % 990 == 0:
            for frame in other.frames(now, [b"hello"]):
                assert ours.receive(frame, now) == pythons.receive(frame, now)
        frames = ours.frames(now, [])
        assert frames == pythons.frames(now, [])
        said += [now] * len(frames)
    assert len(said) == 11
    assert max(after - before for before, after in pairwise(said)) < 2020


@needs_gcc
def test_an_acknowledgement_goes_alone_as_late_as_pythons(library: ctypes.CDLL) -> None:
    ours, pythons, other = both(library)
    for now in (11, 22):
        other.link.send_reliable(b"%d" % now)
        for frame in other.frames(now, []):
            assert ours.receive(frame, now) == pythons.receive(frame, now) != []
        assert ours.frames(now, []) == pythons.frames(now, []) == []
    assert ours.frames(33, []) == pythons.frames(33, []) != []
    assert ours.frames(44, []) == pythons.frames(44, []) == []


@needs_gcc
def test_nine_payloads_are_one_too_many_and_a_slot_comes_free(library: ctypes.CDLL) -> None:
    ours, other = CLink(library, 2, 5), PythonLink(1, 1)
    assert [ours.send(b"%d" % k) for k in range(9)] == [True] * 8 + [False]
    assert ours.send(b"3")  # waits already
    for now in (0, 44, 88, 132):
        for frame in other.frames(now, [b"hello"]):
            ours.receive(frame, now)
        for frame in ours.frames(now, [b"hello"]):
            other.receive(frame, now)
    assert ours.state.count == 0
    assert ours.send(b"8")
    assert HEADER_BYTES + ENTRY_BYTES < ROOM


@needs_gcc
@pytest.mark.parametrize("meets", ["ours", "other"])
def test_who_met_another_meanwhile_hears_everything_after_it(library: ctypes.CDLL, meets: str) -> None:
    """Beyond the window of 64 numbers, which the one that forgot them never closed."""
    ours, other, now = CLink(library, 2, 5), PythonLink(1, 1), 0
    got: dict[str, list[bytes]] = {"ours": [], "other": []}

    def beat(count: int) -> None:
        nonlocal now
        for _ in range(count):
            now += 44
            for frame in other.frames(now, [b"hello"]):
                got["ours"] += ours.receive(frame, now) or []
            for frame in ours.frames(now, [b"hello"]):
                got["other"] += other.receive(frame, now) or []

    beat(3)
    for number in range(200):
        assert ours.send(b"%d" % number)
        other.link.send_reliable(b"%d" % number)
        beat(3)
        if number == 99:
            for frame in PythonLink(9, 1).frames(now, [b"forged"]):
                (ours if meets == "ours" else other).receive(frame, now)
            beat(6)
    for came in got.values():
        assert [payload for payload in came if payload not in (b"hello", b"forged")] == [b"%d" % k for k in range(200)]
    assert ours.state.count == other.link.waiting == 0
