"""A recording with a flipped bit gives no other number: the damage is skipped and told, what lies behind it is read."""

import io
import random
import struct
import tracemalloc
import zlib
from pathlib import Path

import pytest
import zstandard
from click.testing import CliRunner
from hand_fed import Rig
from hypothesis import given, settings
from hypothesis import strategies as st
from mcap.reader import make_reader
from tapes import INTAKE, write

from borechain.cli.ground.record_command import replay as replay_command
from groundstation.recording.recording_file import RecordedSample, Recording, RecordingError, RecordingWriter

SAMPLES = 400
APART = 1_000_000_000  # ns
BEGUN = 1_790_000_000 * APART
CHUNK, DATA_END, FOOTER, METADATA = 6, 15, 2, 12


def written(path: Path) -> list[RecordedSample]:
    """A recording of many chunks; its second key begins in the middle of it."""
    draw = random.Random(3)
    made = [
        RecordedSample(
            INTAKE if k % 2 or k < SAMPLES // 2 else "borechain/rig-1/ground/late",
            BEGUN + k * APART,
            b"%d:" % k + draw.randbytes(90),
        )
        for k in range(SAMPLES)
    ]
    with RecordingWriter(path, "rig-1", {}) as writer:
        for sample in made:
            writer.write(sample)
    return made


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[bytes, list[RecordedSample], Path]:
    folder = tmp_path_factory.mktemp("recorded")
    samples = written(folder / "whole.mcap")
    return (folder / "whole.mcap").read_bytes(), samples, folder / "damaged.mcap"


@pytest.fixture(scope="module")
def largest(recorded: tuple[bytes, list[RecordedSample], Path]) -> int:
    """Samples of the chunk that has most."""
    content, every, _ = recorded
    return max(sum(begin <= at < end for at in places(content, every)) for _, begin, end in records_of(content))


def records_of(content: bytes) -> list[tuple[int, int, int]]:
    """Opcode, first byte and end of each record of an undamaged file, by the layout of the specification."""
    found, at = [], 8
    while at < len(content) - 8:
        opcode, length = struct.unpack_from("<BQ", content, at)
        found.append((opcode, at, at + 9 + length))
        at += 9 + length
    return found


def read(path: Path, content: bytes) -> tuple[list[RecordedSample], Recording]:
    path.write_bytes(content)
    recording = Recording(path)
    return list(recording.samples()), recording


def flipped(content: bytes, byte: int, bit: int) -> bytes:
    return content[:byte] + bytes([content[byte] ^ (1 << bit)]) + content[byte + 1 :]


@settings(max_examples=200, deadline=None)
@given(st.data())
def test_a_flipped_bit_is_told_and_costs_one_chunk(
    recorded: tuple[bytes, list[RecordedSample], Path], largest: int, data: st.DataObject
) -> None:
    content, every, path = recorded
    byte = data.draw(st.integers(8, len(content) - 1))
    try:
        found, recording = read(path, flipped(content, byte, data.draw(st.integers(0, 7))))
    except RecordingError as error:
        assert str(error).startswith(str(path))  # noqa: PT017 - of its version or its name, in a line
        assert next(kind for kind, begin, end in records_of(content) if begin <= byte < end) == METADATA
        return
    assert not recording.whole
    assert recording.damage or byte >= len(content) - 60
    there = set(found)
    assert found == [sample for sample in every if sample in there]
    assert len(every) - len(found) <= largest


def places(content: bytes, every: list[RecordedSample]) -> list[int]:
    """Begin of the chunk that each sample is in, as the tables of another reader tell."""
    summary = make_reader(io.BytesIO(content)).get_summary()
    assert summary is not None
    chunks = [(one.message_start_time, one.message_end_time, one.chunk_start_offset) for one in summary.chunk_indexes]
    return [next(at for first, last, at in chunks if first <= sample.at <= last) for sample in every]


@pytest.mark.parametrize("kind", [DATA_END, FOOTER], ids=["data end", "footer"])
def test_each_byte_of_the_end_is_watched(recorded: tuple[bytes, list[RecordedSample], Path], kind: int) -> None:
    content, every, path = recorded
    begin, end = next((begin, end) for opcode, begin, end in records_of(content) if opcode == kind)
    for byte in [*range(begin, end), *range(len(content) - 8, len(content))]:
        for bit in (0, 7):
            found, recording = read(path, flipped(content, byte, bit))
            assert (found, recording.whole) == (every, False), byte


def test_the_time_of_what_is_lost_is_told(recorded: tuple[bytes, list[RecordedSample], Path]) -> None:
    content, every, path = recorded
    chunks = [(begin, end) for opcode, begin, end in records_of(content) if opcode == CHUNK]
    begin, end = chunks[2]
    found, recording = read(path, flipped(content, (begin + end) // 2, 4))
    (damage,) = recording.damage
    lost = [sample.at for sample in every if sample not in found]
    assert lost == [at for at in (sample.at for sample in every) if lost[0] <= at <= lost[-1]]
    assert (damage.position, damage.after, damage.before) == (begin, lost[0] - APART, lost[-1] + APART)
    assert damage.line == (
        f"damaged at byte {begin}, between {utc(lost[0] - APART)} and {utc(lost[-1] + APART)}: "
        "expected the chunk that its checksum is of"
    )


def utc(at: int) -> str:
    """A time of the samples as text, by whole seconds since the begin of the day they are of (2026-09-21 14:13:20)."""
    second = (at - BEGUN) // APART + 20
    return f"2026-09-21 14:{13 + second // 60:02d}:{second % 60:02d}+00:00"


def test_a_key_that_a_damaged_chunk_has_named_is_known_by_the_tables_at_the_end(
    recorded: tuple[bytes, list[RecordedSample], Path],
) -> None:
    content, every, path = recorded
    late = "borechain/rig-1/ground/late"
    first_late = next(k for k, sample in enumerate(every) if sample.key == late)
    begin = places(content, every)[first_late]
    _, end = next((one, end) for opcode, one, end in records_of(content) if opcode == CHUNK and one == begin)
    found, recording = read(path, flipped(content, end - 20, 1))
    assert len(recording.damage) == 1
    assert sum(sample.key == late for sample in found) > 50
    found, recording = read(path, flipped(content, end - 20, 1)[: end + 30_000])
    assert found
    assert not recording.whole


@pytest.mark.parametrize("claimed", [1000, 1 << 26, 1 << 40], ids=["little", "the most", "too much"])
def test_a_chunk_that_unpacks_to_gigabytes_takes_no_memory(tmp_path: Path, claimed: int) -> None:
    path = tmp_path / "bomb.mcap"
    made = written(path)
    content = path.read_bytes()
    packer = zstandard.ZstdCompressor(level=3, write_content_size=False).compressobj()
    packed = b"".join(packer.compress(bytes(1 << 20)) for _ in range(300)) + packer.flush()
    assert len(packed) < 40_000
    body = struct.pack("<QQQI", 1, 2, claimed, zlib.crc32(b"")) + struct.pack("<I", 4) + b"zstd"
    body += struct.pack("<Q", len(packed)) + packed
    at = next(begin for opcode, begin, _ in records_of(content) if opcode == CHUNK)
    path.write_bytes(content[:at] + struct.pack("<BQ", CHUNK, len(body)) + body + content[at:])
    recording = Recording(path)
    tracemalloc.start()
    found = list(recording.samples())
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert found == made
    assert not recording.whole
    assert recording.damage[0].position == at
    assert peak < 200e6


def test_the_command_ends_with_1_and_names_the_damage(tmp_path: Path) -> None:
    rig = Rig(tmp_path / "rig", target=20.0)
    rig.run(60.0)
    for stop in (1, 2, 3):
        rig.drill(stop, 0.3)
    path = tmp_path / "shift.mcap"
    write(path, rig.ground)
    rig.ground.close()
    content = path.read_bytes()
    assert CliRunner().invoke(replay_command, [str(path)]).exit_code == 0
    begin, end = [(begin, end) for opcode, begin, end in records_of(content) if opcode == CHUNK][1]
    path.write_bytes(flipped(content, (begin + end) // 2, 0))
    done = CliRunner().invoke(replay_command, [str(path)])
    assert done.exit_code == 1, done.output
    assert " missing; damaged file" in done.stdout
    assert f"damaged at byte {begin}, between " in done.stderr
    path.write_bytes(content[: len(content) * 3 // 4])
    done = CliRunner().invoke(replay_command, [str(path)])
    assert (done.exit_code, "missing; cut file" in done.stdout) == (1, True), done.output
