"""Cyclic messages in C against Python: bytes of every value both ways, and what is refused, by the DBC file."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import cantools
import pytest
from c_library import C_TYPES, compile_strictly, load_checked, renamed, struct_of
from click.testing import CliRunner
from hypothesis import example, given
from hypothesis import strategies as st
from messages_of_schema import MESSAGES
from needed_programs import needs, needs_clang, needs_gcc

from borechain.cli.firmware.firmware import firmware
from telemetry.errors import DecodeError, EncodeError
from telemetry.presentation.can_c_codec import NATIVE_CODE, NATIVE_HEADER, write_native_codec
from telemetry.presentation.can_messages import NATIVE, UNSAID, NativeMessage
from telemetry.schema import SPEC_OF, MessageKind

DBC = Path(__file__).parents[2] / "docs" / "borechain.dbc"
WORDS = {
    MessageKind.AIDING: "aiding",
    MessageKind.HELLO: "hello",
    MessageKind.TIME_REQUEST: "time_request",
    MessageKind.TIME_REPLY: "time_reply",
    MessageKind.NODE_STATE: "node_state",
}
KINDS = sorted(WORDS)
GUARD = 0xA5


@dataclass
class Member:
    """A signal as the DBC file has it."""

    name: str
    bits: int
    first: int  # steps of raw number 0; of a level in dB the raw number itself is told
    scale: float


class Codec:
    """The functions in C of one message."""

    def __init__(self, library: ctypes.CDLL, header: str, kind: MessageKind) -> None:
        self.native: NativeMessage = NATIVE[kind]
        self.struct = struct_of(header, f"borechain_native_{WORDS[kind]}")
        names = renamed(header)
        verbs = ("pack", "unpack")
        self._one, self._many = (
            [getattr(library, names[f"borechain_native_{verb}_{WORDS[kind]}{form}"]) for verb in verbs]
            for form in ("", "_classic")
        )
        database = cantools.database.load_file(str(DBC))
        self.members = [
            Member(s.name, s.length, 0 if (s.unit or "").startswith("dB") else round(s.offset / s.scale), s.scale)
            for s in database.get_message_by_name(self.native.name).signals
            if s.name != "count"
        ]

    def pack(self, values: Any, count: int, *, fd: bool) -> list[bytes] | int:
        """Frames, or the answer where it is not zero."""
        lengths = self.lengths(fd=fd)
        room = lengths[0] if fd else 8 * len(lengths)
        data = (ctypes.c_uint8 * (room + 8))(*[GUARD] * (room + 8))
        answer = int((self._one if fd else self._many)[0](ctypes.byref(values), ctypes.c_uint8(count), data))
        assert bytes(data)[room:] == bytes([GUARD] * 8)
        if answer != 0:
            return answer
        frames = [bytes(data)[:room]] if fd else [bytes(data)[8 * k : 8 * k + 8] for k in range(len(lengths))]
        assert all(set(frame[length:]) <= {0} for frame, length in zip(frames, lengths, strict=True))
        return [frame[:length] for frame, length in zip(frames, lengths, strict=True)]

    def unpack(self, frames: list[bytes], *, fd: bool) -> Any:
        """Struct of the frames, or the answer where it is not zero; what is refused leaves the struct as it was."""
        values = self.struct()
        ctypes.memset(ctypes.byref(values), GUARD, ctypes.sizeof(values))
        if fd:
            data = (ctypes.c_uint8 * len(frames[0]))(*frames[0])
            answer = int(self._one[1](data, ctypes.c_size_t(len(frames[0])), ctypes.byref(values)))
        else:
            data = (ctypes.c_uint8 * (8 * len(frames)))(*b"".join(frame.ljust(8, b"\xff")[:8] for frame in frames))
            lengths = (ctypes.c_uint8 * len(frames))(*map(len, frames))
            answer = int(self._many[1](data, lengths, ctypes.byref(values)))
        if answer != 0:
            assert bytes(values) == bytes([GUARD] * ctypes.sizeof(values))
            return answer
        return values

    def lengths(self, *, fd: bool) -> list[int]:
        """Bytes of each frame."""
        return [layout.length for layout in self.native.form(fd=fd).layouts]

    def steps_of(self, raws: list[int]) -> dict[str, int]:
        """Members that raw numbers stand for."""
        return {one.name: one.first + raw for one, raw in zip(self.members, raws, strict=True)}


@pytest.fixture(scope="module")
def codecs(tmp_path_factory: pytest.TempPathFactory) -> dict[MessageKind, Codec]:
    folder, written = tmp_path_factory.mktemp("native"), write_native_codec()
    (folder / NATIVE_HEADER).write_text(written.header)
    (folder / NATIVE_CODE).write_text(written.code)
    library = load_checked(folder, [NATIVE_CODE])
    return {kind: Codec(library, written.header, kind) for kind in KINDS}


def as_dict(values: ctypes.Structure) -> dict[str, int]:
    return {name: getattr(values, name) for name, *_ in values._fields_}  # type: ignore[misc]


def edges(codec: Codec) -> list[list[int]]:
    """Raw numbers of each signal at the ends of what it can say and of what the schema admits, and one beyond."""
    fields = {f.name: f for f in SPEC_OF[codec.native.message].fields}
    found = []
    for one in codec.members:
        field = fields.get(one.name) or fields[one.name.rpartition("_")[0]]
        largest = (1 << one.bits) - 1
        ends = [0, largest]
        for bound in (field.low, field.high):
            if abs(bound) < 1e15:
                ends.append(round(bound / one.scale) - one.first)
        found.append(sorted({raw + more for raw in ends for more in (-1, 0, 1) if 0 <= raw + more <= largest}))
    return found


def middle(codec: Codec) -> list[int]:
    """Raw numbers of a message that any codec takes: zeros, or the nearest to them."""
    least = {"rig_rate": 1.0}
    return [round(least.get(one.name, 0.0) / one.scale) - one.first for one in codec.members]


def all_edges(codec: Codec) -> Iterator[list[int]]:
    """A message for each edge of each signal, and for every value of the narrow ones."""
    usual = middle(codec)
    for place, (one, ends) in enumerate(zip(codec.members, edges(codec), strict=True)):
        for raw in range(1 << one.bits) if one.bits <= 9 else ends:
            yield [*usual[:place], raw, *usual[place + 1 :]]


def python_hears(native: NativeMessage, frames: list[bytes], *, fd: bool) -> list[Any] | str:
    """Values of the frames, or the name of the field that is refused."""
    try:
        return native.unpack(frames, fd=fd)
    except DecodeError as error:
        return str(error).split(": ")[1]


def assert_alike(codec: Codec, raws: list[int], count: int, *, fd: bool) -> bool:
    """Both codecs say the same of raw numbers; returns whether they take them."""
    native = codec.native
    frames = native.form(fd=fd).pack(raws, count)
    heard = codec.unpack(frames, fd=fd)
    values = python_hears(native, frames, fd=fd)
    if isinstance(values, str):
        assert isinstance(heard, int), f"C takes what Python refuses: {values}"
        assert heard > 0
        assert codec.members[heard - 1].name in {values, f"{values}_x", f"{values}_y", f"{values}_z"}
        return False
    assert not isinstance(heard, int), f"C refuses what Python takes: {heard} of {values}"
    assert as_dict(heard) == codec.steps_of(raws)
    assert codec.pack(heard, count, fd=fd) == native.pack(values, count, fd=fd) == frames
    return True


@needs_gcc
@pytest.mark.parametrize("fd", [True, False], ids=["fd", "classic"])
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
def test_every_end_of_every_signal_is_read_and_written_as_python_does(
    codecs: dict[MessageKind, Codec], kind: MessageKind, fd: bool
) -> None:
    codec = codecs[kind]
    taken = [assert_alike(codec, raws, 7 * k & 0xFF, fd=fd) for k, raws in enumerate(all_edges(codec))]
    assert any(taken)
    assert kind == MessageKind.TIME_REQUEST or not all(taken)


@needs_gcc
@given(data=st.data(), count=st.integers(0, 255), fd=st.booleans())
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
def test_any_bits_are_the_same_message_or_the_same_refusal(
    codecs: dict[MessageKind, Codec], kind: MessageKind, data: st.DataObject, count: int, fd: bool
) -> None:
    codec = codecs[kind]
    raws = [
        data.draw(st.integers(0, (1 << one.bits) - 1) | st.sampled_from(ends))
        for one, ends in zip(codec.members, edges(codec), strict=True)
    ]
    usual = middle(codec)
    keep = data.draw(
        st.sets(st.integers(0, len(raws) - 1))
    )  # most of a message within its ranges, so that some is taken
    assert_alike(codec, [raw if k in keep else usual[k] for k, raw in enumerate(raws)], count, fd=fd)


@needs_gcc
@given(data=st.data(), count=st.integers(0, 255), fd=st.booleans())
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
def test_what_python_says_is_heard_in_c_and_said_on_unchanged(
    codecs: dict[MessageKind, Codec], kind: MessageKind, data: st.DataObject, count: int, fd: bool
) -> None:
    codec = codecs[kind]
    message = data.draw(MESSAGES[codec.native.message])
    try:
        raws = codec.native.raws_of(message)
    except EncodeError:
        return
    frames = codec.native.form(fd=fd).pack(raws, count)
    heard = codec.unpack(frames, fd=fd)
    assert as_dict(heard) == codec.steps_of(raws)
    assert codec.pack(heard, count, fd=fd) == frames


def beyond(codec: Codec) -> Iterator[tuple[int, Member, int]]:
    """Members with values at and beyond the ends of their types and of the schema."""
    kinds = dict(codec.struct._fields_)  # type: ignore[arg-type]
    named = {value: name for name, value in C_TYPES.items()}
    for place, (one, ends) in enumerate(zip(codec.members, edges(codec), strict=True)):
        name = named[kinds[one.name]]
        bits = int(name.strip("uint_"))
        low, high = (0, 2**bits - 1) if name.startswith("u") else (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1)
        values = {low, high, *(one.first + raw + more for raw in ends for more in (-1, 0, 1))}
        yield from ((place, one, value) for value in sorted(values) if low <= value <= high)


@needs_gcc
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
def test_a_value_that_no_frame_can_say_is_refused_by_its_number(
    codecs: dict[MessageKind, Codec], kind: MessageKind
) -> None:
    codec = codecs[kind]
    form = codec.native.form(fd=True)
    usual = middle(codec)
    for place, one, value in beyond(codec):
        raw = value - one.first
        can_be_said = 0 <= raw < 1 << one.bits
        if can_be_said:
            frames = form.pack([*usual[:place], raw, *usual[place + 1 :]], 0)
            can_be_said = not isinstance(python_hears(codec.native, frames, fd=True), str)
        values = codec.struct(**(codec.steps_of(usual) | {one.name: value}))
        for fd in (True, False):
            answer = codec.pack(values, 3, fd=fd)
            assert isinstance(answer, list) if can_be_said else answer == place + 1, (one.name, value)


@needs_gcc
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
@given(length=st.integers(0, 80))
@example(length=0)
def test_a_frame_of_another_length_is_refused_as_python_refuses_it(
    codecs: dict[MessageKind, Codec], kind: MessageKind, length: int
) -> None:
    codec = codecs[kind]
    raws = middle(codec)
    for fd in (True, False):
        frames = codec.native.form(fd=fd).pack(raws, 0)
        for place in range(len(frames)):
            if length == len(frames[place]):
                continue
            other = [*frames[:place], frames[place].ljust(length, b"\0")[:length], *frames[place + 1 :]]
            with pytest.raises(DecodeError, match="bytes"):
                codec.native.unpack(other, fd=fd)
            assert codec.unpack(other, fd=fd) == -1


@needs_gcc
@pytest.mark.parametrize("kind", KINDS, ids=WORDS.get)
def test_bits_behind_the_last_signal_mean_nothing_as_in_python(
    codecs: dict[MessageKind, Codec], kind: MessageKind
) -> None:
    codec = codecs[kind]
    raws = middle(codec)
    for fd in (True, False):
        frames = codec.native.form(fd=fd).pack(raws, 0)
        ends = [max(start + s.bits for s, start in layout.places) for layout in codec.native.form(fd=fd).layouts]
        filled = [
            (int.from_bytes(frame, "little") | (1 << 8 * len(frame)) - (1 << end)).to_bytes(len(frame), "little")
            for frame, end in zip(frames, ends, strict=True)
        ]
        assert codec.native.unpack(filled, fd=fd) == codec.native.unpack(frames, fd=fd)
        assert as_dict(codec.unpack(filled, fd=fd)) == codec.steps_of(raws)


def test_members_are_the_signals_of_the_file_and_no_message_is_missing() -> None:
    header = write_native_codec().header
    assert sorted(WORDS) == sorted(NATIVE)
    for kind, native in NATIVE.items():
        names = [name for name, *_ in struct_of(header, f"borechain_native_{WORDS[kind]}")._fields_]  # type: ignore[misc]
        assert names == [name for name in native.signals if name not in UNSAID]


def test_identifiers_are_those_of_the_file() -> None:
    header, database = write_native_codec().header, cantools.database.load_file(str(DBC))
    for kind, native in NATIVE.items():
        for suffix, layout in (("", native.fd.layouts[0]), ("_CLASSIC", native.classic.layouts[0])):
            identifier = database.get_message_by_name(layout.name).frame_id
            assert f"{WORDS[kind].upper()}_IDENTIFIER{suffix} UINT32_C(0x{identifier:08X})\n" in header


def write(folder: Path) -> str:
    done = CliRunner().invoke(firmware, ["codec", "--out", str(folder)])
    assert done.exit_code == 0, done.output
    return done.output


def test_the_command_writes_the_same_bytes_again(tmp_path: Path) -> None:
    said = write(tmp_path / "here")
    again = "from borechain.cli.firmware.firmware import firmware; firmware()"
    environment = os.environ | {"PYTHONHASHSEED": "1"}
    words = [sys.executable, "-c", again, "codec", "--out", str(tmp_path / "there")]
    subprocess.run(words, check=True, env=environment, capture_output=True)
    for name in (NATIVE_HEADER, NATIVE_CODE):
        assert (tmp_path / "here" / name).read_bytes() == (tmp_path / "there" / name).read_bytes()
        assert str(tmp_path / "here" / name) in said
    assert f'"{said.split()[-1]}"' in (tmp_path / "here" / NATIVE_HEADER).read_text()


@pytest.mark.parametrize("level", ["-O0", "-O2"])
@pytest.mark.parametrize("compiler", [pytest.param("gcc", marks=needs_gcc), pytest.param("clang", marks=needs_clang)])
def test_two_compilers_take_it_without_a_warning(compiler: str, level: str, tmp_path: Path) -> None:
    write(tmp_path)
    done = compile_strictly(tmp_path, compiler, level, "-c", NATIVE_CODE, "-o", "native.o")
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""


CALLER = """\
#include "borechain_native.h"
int main(void)
{
    struct borechain_native_hello values = {1u, 1u, 1, 4u, 100u};
    uint8_t data[BORECHAIN_NATIVE_HELLO_LENGTH];
    return borechain_native_pack_hello(&values, 1u, data);
}
"""


@needs_gcc
def test_a_header_of_another_table_does_not_link(tmp_path: Path) -> None:
    digest = write(tmp_path).split()[-1]
    (tmp_path / "caller.c").write_text(CALLER)
    assert compile_strictly(tmp_path, "gcc", NATIVE_CODE, "caller.c", "-o", "caller").returncode == 0
    compile_strictly(tmp_path, "gcc", "-c", NATIVE_CODE, "-o", "native.o")
    header = tmp_path / NATIVE_HEADER
    header.write_text(header.read_text().replace(digest, "0123456789abcdef"))
    done = compile_strictly(tmp_path, "gcc", "native.o", "caller.c", "-o", "caller")
    assert done.returncode != 0
    assert "borechain_native_pack_hello_0123456789abcdef" in done.stderr


@needs("arm-none-eabi-gcc", "gcc-arm-none-eabi")
def test_it_takes_little_of_a_small_chip(tmp_path: Path) -> None:
    write(tmp_path)
    words = ("-mcpu=cortex-m4", "-mthumb", "-Os", "-ffreestanding", "-c", NATIVE_CODE, "-o", "native.o")
    done = compile_strictly(tmp_path, "arm-none-eabi-gcc", *words)
    assert done.returncode == 0, done.stderr
    shown = subprocess.run(["arm-none-eabi-size", "native.o"], cwd=tmp_path, check=True, capture_output=True, text=True)
    flash, data, zeroed = map(int, shown.stdout.splitlines()[1].split()[:3])
    assert flash <= 6000
    assert data + zeroed == 0
