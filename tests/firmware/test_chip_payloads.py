"""Payloads that a chip writes, read back by the codec of the product and byte for byte what that would have written;
orders and receipts as the product writes them, read by the chip in any order of their keys."""

from __future__ import annotations

import ctypes
import hashlib
import itertools
import math
from pathlib import Path
from typing import Any

import msgspec
import pytest
from c_library import load_checked
from hypothesis import given
from hypothesis import strategies as st
from needed_programs import needs_gcc

from node.firmware.event_table import EVENT_TABLE
from node.firmware.event_words import EVENTS_HEADER, KINDS, WORDS, arguments_in_c, write_event_table
from node.translation.c_file import write_c_files
from telemetry.messages import BASE, Command, Event, NodeFlag, Receipt, Reply, Severity, SurveyMeasurement
from telemetry.presentation.msgpack_codec import decode_message, encode_message

FIRMWARE = Path(__file__).parents[2] / "firmware"
TUBE, ROOM = 7, 512
NO_NUMBER = 1 << 60
GRAVITY = 9.80665
pytestmark = needs_gcc


class Origin(ctypes.Structure):
    _fields_ = [
        ("number", ctypes.c_int64), ("rig_at", ctypes.c_int64), ("epoch", ctypes.c_uint32), ("tube", ctypes.c_uint8),
    ]  # fmt: skip


class Survey(ctypes.Structure):
    _fields_ = [
        ("yaw_var", ctypes.c_int64), ("systematic_var", ctypes.c_int64), ("settle_time", ctypes.c_int64),
        ("samples", ctypes.c_int64), ("yaw", ctypes.c_uint32), ("hops", ctypes.c_int32), ("flags", ctypes.c_uint16),
    ]  # fmt: skip


class Order(ctypes.Structure):
    _fields_ = [
        ("kind", ctypes.c_int64), ("target", ctypes.c_int64), ("number", ctypes.c_int64), ("name", ctypes.c_void_p),
        ("content", ctypes.c_void_p), ("method", ctypes.c_void_p), ("turns", ctypes.c_int64),
        ("seconds", ctypes.c_int64), ("name_length", ctypes.c_uint32), ("content_length", ctypes.c_uint32),
        ("method_length", ctypes.c_uint32),
    ]  # fmt: skip

    def text(self, name: str) -> bytes:
        at = getattr(self, name)
        return b"" if at is None else ctypes.string_at(at, getattr(self, f"{name}_length"))


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> ctypes.CDLL:
    folder = tmp_path_factory.mktemp("payloads")
    (folder / "borechain_step.h").write_text(write_c_files().header)
    (folder / EVENTS_HEADER).write_text(write_event_table())
    sources = [FIRMWARE / "tube" / "chip_words.c", FIRMWARE / "msgpack.c", FIRMWARE / "blake2b.c"]
    includes = (f"-I{folder}", f"-I{FIRMWARE}", f"-I{FIRMWARE / 'tube'}")
    loaded = load_checked(folder, [*sources, Path(__file__).parent / "words_shim.c"], *includes)
    for name in ("word_event", "word_start", "word_reply", "shim_survey"):
        getattr(loaded, name).restype = ctypes.c_uint32
    for name in ("word_event_is_error", "word_open", "word_read"):
        getattr(loaded, name).restype = ctypes.c_bool
    return loaded


def origin(number: int = 4711, at: float = 1234.5, epoch: int = 3) -> Origin:
    return Origin(number, round(at * 2**28), epoch, TUBE)


def written(call: Any, *given: Any) -> Any:
    """The message of a payload, whose bytes are those that the product writes; in less room it is not written."""
    room = ctypes.create_string_buffer(ROOM)
    length = call(*given, room, ROOM)
    payload = room.raw[:length]
    assert call(*given, ctypes.create_string_buffer(length), length) == length
    assert call(*given, ctypes.create_string_buffer(length), length - 1) == 0
    message = decode_message(payload)
    assert encode_message(message) == payload
    return message


@pytest.mark.parametrize("epoch", [0, 1, 3, 65535, 65536, 2**32 - 1])
def test_a_survey_has_every_number_in_its_unit_and_its_place(library: ctypes.CDLL, epoch: int) -> None:
    survey = Survey(
        round(3e-6 * 2**56), round(7e-6 * 2**56), round(12.25 * 2**28), 37, 0x60000000, 5, int(NodeFlag.RESTORED)
    )
    force = [0.25, -0.5, -0.875]
    cov = [[3e-6, 1e-7, 2e-7], [1e-7, 4e-6, 3e-7], [2e-7, 3e-7, 5e-6]]
    force_q = (ctypes.c_int64 * 3)(*(round(x * 2**26) for x in force))
    cov_q = (ctypes.c_int64 * 9)(*(round(x * 2**52) for row in cov for x in row))
    said = written(
        library.shim_survey, ctypes.byref(origin(at=997.75, epoch=epoch)), ctypes.byref(survey), force_q, cov_q
    )
    assert isinstance(said, SurveyMeasurement)
    assert (said.tube, said.sequence, said.station_at, said.hops, said.epoch) == (TUBE, 4711, 997.75, 5, epoch)
    assert said.yaw == pytest.approx(0x60000000 / 2**32 * math.tau, rel=1e-9)
    assert (said.yaw_var, said.systematic_var) == pytest.approx((3e-6, 7e-6), rel=1e-9)
    assert (said.samples, said.settle_time, said.flags) == (37, 12.25, NodeFlag.RESTORED)
    (imu,) = said.imus
    assert imu.force == pytest.approx([x * GRAVITY for x in force], rel=1e-7)
    for found, row in zip(imu.force_cov, cov, strict=True):
        assert found == pytest.approx([x * GRAVITY**2 for x in row], rel=1e-6)


def numbers_of(values: list[float]) -> Any:
    return (ctypes.c_int64 * 10)(*(round(value * 2**24) for value in values), *[0] * (10 - len(values)))


@pytest.mark.parametrize("code", EVENT_TABLE, ids=lambda code: EVENT_TABLE[code].name)
def test_an_event_is_that_of_the_table_with_every_argument_of_its_own(library: ctypes.CDLL, code: int) -> None:
    spec, arguments = EVENT_TABLE[code], arguments_in_c(EVENT_TABLE[code])
    values, expected = [], {}
    for k, argument in enumerate(arguments):
        if argument.kind == "EVENT_WORD":
            word = max(n for n, said in enumerate(argument.words) if said)
            values.append(float(word))
            expected[argument.name] = argument.words[word]
        elif argument.kind == "EVENT_FLOAT":
            values.append(k + 1.625)
            expected[argument.name] = k + 1.625
        else:
            values.append(float(k + 3))
            expected[argument.name] = True if argument.kind == "EVENT_FLAG" else k + 3
    said = written(library.word_event, ctypes.byref(origin()), ctypes.c_int64(int(code)), numbers_of(values))
    assert said == Event(TUBE, 4711, 1234.5, spec.severity, spec.name, expected, 3)
    assert {name: type(value) for name, value in said.arguments.items()} == {n: type(v) for n, v in expected.items()}
    assert library.word_event_is_error(ctypes.c_int64(int(code))) == (spec.severity is Severity.ERROR)


def test_words_of_the_table_in_c_are_those_of_the_table() -> None:
    """Every list of words stands once, under a name of its own, and each argument names the list that is its own."""
    text = write_event_table()
    lists = dict(_list_of(part) for part in text.split("static const char *const ")[1:])
    assert len(set(lists.values())) == len(lists)
    for code, spec in EVENT_TABLE.items():
        (line,) = [line for line in text.splitlines() if line.startswith(f"    [{int(code)}] = ")]
        assert line.startswith(f'    [{int(code)}] = {{"{spec.name}", {{')
        for argument in arguments_in_c(spec):
            (_, rest) = line.split(f'{{"{argument.name}", ', 1)
            name, kind, count = rest.partition("}")[0].split(", ")
            assert (lists.get(name, ()), kind, int(count)) == (argument.words, argument.kind, len(argument.words))
        for (name, made), argument in zip(spec.arguments, arguments_in_c(spec), strict=spec.words is None):
            if made in KINDS:
                assert (argument.name, argument.kind) == (name, KINDS[made])
            elif spec.words is None:
                assert argument.words == WORDS[made]
                assert all(str(made(float(k))) == word for k, word in enumerate(argument.words) if word)
    assert f"#define EVENT_CODES {max(EVENT_TABLE) + 1}\n" in text


def _list_of(part: str) -> tuple[str, tuple[str, ...]]:
    head, _, body = part.partition(" = {")
    words = tuple(word.strip().strip('"') for word in body.partition("};")[0].split('",\n'))
    name, _, count = head.partition("[")
    assert int(count.rstrip("]")) == len(words)
    return name, words


def test_what_no_table_knows_is_not_said(library: ctypes.CDLL) -> None:
    known = {int(code) for code in EVENT_TABLE}
    for code in {-1, 0, max(known) + 1, max(known) + 2, *range(max(known))} - known:
        assert library.word_event(ctypes.byref(origin()), ctypes.c_int64(code), numbers_of([]), bytes(ROOM), ROOM) == 0
        assert not library.word_event_is_error(ctypes.c_int64(code))


def test_a_number_that_is_none_is_left_out(library: ctypes.CDLL) -> None:
    code = next(code for code in EVENT_TABLE if len(arguments_in_c(EVENT_TABLE[code])) > 1)
    names = [argument.name for argument in arguments_in_c(EVENT_TABLE[code])]
    for left in range(len(names)):
        numbers = numbers_of([0.0] * len(names))
        numbers[left] = NO_NUMBER
        said = written(library.word_event, ctypes.byref(origin()), ctypes.c_int64(int(code)), numbers)
        assert list(said.arguments) == names[:left] + names[left + 1 :]


@pytest.mark.parametrize(("yaw", "deg"), [(0, 0.0), (0x40000000, 90.0), (0xFFFFFFFF, 360.0)])
def test_a_start_says_the_yaw_and_what_it_is_worth(library: ctypes.CDLL, yaw: int, deg: float) -> None:
    for worth, hours in ((-1, None), (0, 0.0), (round(5400.0 * 2**28), 1.5)):
        said = written(library.word_start, ctypes.byref(origin(epoch=0)), ctypes.c_uint32(yaw), ctypes.c_int64(worth))
        assert (said.code, said.severity, said.epoch) == ("booted" if hours is None else "restored", Severity.INFO, 0)
        assert list(said.arguments) == ["yaw_deg"] + ([] if hours is None else ["worth_h"])
        assert said.arguments["yaw_deg"] == pytest.approx(deg, abs=1e-6)
        assert said.arguments.get("worth_h") == (None if hours is None else pytest.approx(hours, abs=1e-7))


@pytest.mark.parametrize("is_done", [True, False])
@pytest.mark.parametrize("detail", ["", "at the next settled cycle", "x" * 90])
def test_a_reply_names_its_order(library: ctypes.CDLL, is_done: bool, detail: str) -> None:
    said = written(library.word_reply, ctypes.c_uint8(TUBE), ctypes.c_int64(2**40 + 1), is_done, detail.encode())
    assert said == Reply(TUBE, 2**40 + 1, is_done, detail)


def read(library: ctypes.CDLL, payload: bytes) -> tuple[bool, Order]:
    order = Order()
    is_read = library.word_read(payload, len(payload), ctypes.byref(order))
    return bool(is_read), order


def test_orders_and_receipts_are_read_as_they_are_written(library: ctypes.CDLL) -> None:
    arguments = {"method": "circle", "turns": 2.25, "seconds": 30.5, "other": [1, "a", {"b": 2.5}]}
    command = encode_message(Command(TUBE, 99, "align", {"method": "circle", "turns": 2.25, "seconds": 30.5}))
    for payload in (command, _with_arguments(command, arguments)):
        is_read, order = read(library, payload)
        assert is_read
        assert (order.kind, order.target, order.number, order.text("name")) == (8, TUBE, 99, b"align")
        assert (order.text("method"), order.turns, order.seconds) == (b"circle", 9 << 22, 61 << 27)
    is_read, order = read(library, encode_message(Receipt(TUBE, 2**40, bytes(range(16)))))
    assert is_read
    assert (order.kind, order.target, order.number) == (7, TUBE, 2**40)
    assert order.text("content") == bytes(range(16))
    assert (order.text("name"), order.text("method"), order.turns) == (b"", b"", 0)


def _with_arguments(command: bytes, arguments: dict[str, Any]) -> bytes:
    envelope = msgspec.msgpack.decode(command)
    return msgspec.msgpack.encode(envelope | {"b": envelope["b"] | {"a": arguments}})


def test_keys_may_come_in_any_order_and_each_that_is_needed_must_come(library: ctypes.CDLL) -> None:
    envelope = msgspec.msgpack.decode(encode_message(Command(TUBE, 99, "take_survey", {})))
    for names in itertools.islice(itertools.permutations(envelope), 0, None, 7):
        payload = msgspec.msgpack.encode({name: envelope[name] for name in names} | {"new": [1, 2]})
        is_read, order = read(library, payload)
        assert is_read
        assert (order.kind, order.target, order.number, order.text("name")) == (8, TUBE, 99, b"take_survey")
    for name in envelope:
        payload = msgspec.msgpack.encode({key: value for key, value in envelope.items() if key != name})
        assert read(library, payload)[0] == (name not in ("k", "t", "b")), name
        kind, target = ctypes.c_int64(), ctypes.c_int64()
        is_open = library.word_open(payload, len(payload), ctypes.byref(kind), ctypes.byref(target))
        assert is_open == (name not in ("k", "t", "b"))
    for name, is_needed in (("s", True), ("n", True), ("a", False), ("t", False)):
        body = {key: value for key, value in envelope["b"].items() if key != name}
        assert read(library, msgspec.msgpack.encode(envelope | {"b": body}))[0] != is_needed, name
    receipt = msgspec.msgpack.decode(encode_message(Receipt(TUBE, 5)))
    assert read(library, msgspec.msgpack.encode(receipt))[0]  # a receipt has no name


def test_what_is_cut_or_goes_on_is_none(library: ctypes.CDLL) -> None:
    payload = encode_message(Command(TUBE, 99, "align", {"method": "circle", "turns": 2.0}))
    for length in range(len(payload)):
        assert not read(library, payload[:length])[0]
    assert not read(library, payload + b"\xc0")[0]
    kind, target = ctypes.c_int64(), ctypes.c_int64()
    assert library.word_open(payload, len(payload), ctypes.byref(kind), ctypes.byref(target))
    assert (kind.value, target.value) == (8, TUBE)
    reply = encode_message(Reply(3, 1, True, ""))
    assert library.word_open(reply, len(reply), ctypes.byref(kind), ctypes.byref(target))
    assert (kind.value, target.value) == (9, BASE)


@pytest.mark.parametrize("size", [1, 8, 16, 64])
def test_every_word_of_a_block_is_hashed_in_its_turn(library: ctypes.CDLL, size: int) -> None:
    """Bytes that all differ, over every length of up to two blocks and a half: a word that is left out shows."""
    content = bytes((7 * k + k // 256) % 256 for k in range(320))
    for length in range(0, 321, 1 if size == 16 else 32):
        out = ctypes.create_string_buffer(size)
        library.blake2b_hash(content[:length], ctypes.c_uint32(length), out, ctypes.c_uint32(size))
        assert out.raw == hashlib.blake2b(content[:length], digest_size=size).digest(), length


@given(st.binary(min_size=100, max_size=256))
def test_a_whole_block_of_anything_is_hashed(library: ctypes.CDLL, content: bytes) -> None:
    out = ctypes.create_string_buffer(16)
    library.blake2b_hash(content, ctypes.c_uint32(len(content)), out, ctypes.c_uint32(16))
    assert out.raw == hashlib.blake2b(content, digest_size=16).digest()
