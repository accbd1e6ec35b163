"""Segments of a block: who made them, how they are gathered and what the sender repeats."""

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from telemetry.errors import KeyFileError
from telemetry.frozen import replace
from telemetry.messages import MAX_SEGMENTS, SEGMENT_SIZE, BlockSegment, BlockStatus, UploadPhase
from telemetry.transport.authentication import is_authentic, new_key, read_key, sealed_segment
from telemetry.transport.upload import FIRST_RETRY, LAST_RETRY, UNTRUSTED_LIMIT, Assembly, Upload, split_block

KEY = bytes(range(32))
BLOCK = bytes(k % 251 for k in range(800))


def segments(block: bytes = BLOCK) -> tuple[BlockSegment, ...]:
    return split_block(block, 3, 77, 5, KEY)


def status(phase: UploadPhase, received: int = 0, **change: object) -> BlockStatus:
    plain = BlockStatus(3, 77, segments()[0].digest, phase, received, 4, bytes(32), "")
    return replace(plain, **change)  # type: ignore[arg-type]


@given(st.binary(min_size=1, max_size=MAX_SEGMENTS * SEGMENT_SIZE), st.randoms())
def test_segments_in_any_order_and_twice_are_the_block(block: bytes, random: object) -> None:
    parts = list(segments(block)) * 2
    random.shuffle(parts)  # type: ignore[attr-defined]
    assembly = Assembly(5, parts[0].digest, parts[0].count)
    for part in parts:
        assert assembly.belongs(part)
        assembly.add_segment(part)
        restored = Assembly.restore(assembly.export())
        assert restored is not None
        assert restored.received == assembly.received
        assembly = restored
    assert assembly.complete
    assert assembly.block() == block


@pytest.mark.parametrize("size", [0, MAX_SEGMENTS * SEGMENT_SIZE + 1])
def test_a_block_of_no_size_is_not_split(size: int) -> None:
    with pytest.raises(ValueError, match="block"):
        segments(b"x" * size)


def test_a_segment_swapped_for_another_is_not_the_block() -> None:
    first, second = segments()[:2]
    assembly = Assembly(5, first.digest, 2)
    assembly.add_segment(replace(first, data=second.data))
    assembly.add_segment(second)
    assert assembly.block() is None


@given(st.binary(max_size=200))
def test_saved_segments_that_are_none_are_not_restored(saved: bytes) -> None:
    restored = Assembly.restore(saved)
    assert restored is None or 1 <= restored.count <= MAX_SEGMENTS


@pytest.mark.parametrize(
    "change",
    [
        {"tube": 4},
        {"sequence": 78},
        {"version": 6},
        {"digest": bytes(32)},
        {"count": 6},
        {"index": 1},
        {"data": b"other"},
        {"data": b""},
        {"tag": bytes(32)},
        {"tag": b""},
    ],
)
def test_a_change_of_anything_breaks_the_tag(change: dict) -> None:
    segment = segments()[0]
    assert is_authentic(segment, KEY)
    assert not is_authentic(replace(segment, **change), KEY)


@pytest.mark.parametrize("byte", range(32))
def test_every_byte_of_a_tag_counts(byte: int) -> None:
    segment = segments()[0]
    tag = bytearray(segment.tag)
    for bit in range(8):
        tag[byte] ^= 1 << bit
        assert not is_authentic(replace(segment, tag=bytes(tag)), KEY)
        tag[byte] ^= 1 << bit
    assert is_authentic(replace(segment, tag=bytes(tag)), KEY)
    assert not is_authentic(replace(segment, tag=segment.tag[: byte + 1] if byte < 31 else segment.tag + b"x"), KEY)


def test_another_key_makes_another_tag() -> None:
    assert not is_authentic(sealed_segment(segments()[0], bytes(32)), KEY)


def test_all_are_sent_once_and_then_what_is_missing() -> None:
    upload = Upload(segments(), 100.0)
    assert upload.due_segments(100.0) == list(segments())
    assert upload.due_segments(100.0 + FIRST_RETRY - 0.1) == []
    assert not upload.on_status(status(UploadPhase.PARTIAL, 0b10101))
    assert [s.index for s in upload.due_segments(100.0 + FIRST_RETRY)] == [1, 3]
    assert not upload.on_status(status(UploadPhase.PARTIAL, 0))  # the node lost them
    assert len(upload.due_segments(1000.0)) == 5
    assert not upload.on_status(status(UploadPhase.WAITING, 0b11111))
    assert [s.index for s in upload.due_segments(2000.0)] == [0]
    for _ in range(10):
        upload.due_segments(upload.next_due)
    before = upload.next_due
    upload.due_segments(before)
    assert upload.next_due - before == LAST_RETRY


@pytest.mark.parametrize("phase", [UploadPhase.APPLIED, UploadPhase.REFUSED])
def test_the_last_word_ends_an_upload_and_only_of_its_own_block(phase: UploadPhase) -> None:
    upload = Upload(segments(), 100.0)
    for change in ({"tube": 4}, {"sequence": 76}, {"digest": bytes(32)}):
        assert not upload.on_status(status(phase, **change))
    assert upload.on_status(status(phase))


def test_a_damaged_tag_is_repeated_and_a_wrong_key_given_up() -> None:
    upload = Upload(segments(), 100.0)
    assert [upload.on_status(status(UploadPhase.UNTRUSTED)) for _ in range(UNTRUSTED_LIMIT)] == [False, False, True]


def test_a_key_is_made_once_and_read_back(tmp_path: Path) -> None:
    path = new_key(tmp_path / "rig.key")
    key = read_key(path)
    assert len(key) == 32
    assert path.stat().st_mode & 0o777 == 0o600
    with pytest.raises(KeyFileError, match="exists"):
        new_key(path)
    assert read_key(path) == key


@pytest.mark.parametrize(
    ("text", "mode", "reason"),
    [
        ("ab" * 32, 0o644, "0600"),
        ("ab" * 32, 0o620, "0600"),
        ("ab" * 31, 0o600, "64 hex"),
        ("secretsecret", 0o600, "64 hex"),
    ],
)
def test_a_key_file_that_is_open_or_holds_none_is_refused(tmp_path: Path, text: str, mode: int, reason: str) -> None:
    path = tmp_path / "rig.key"
    path.write_text(text)
    path.chmod(mode)
    with pytest.raises(KeyFileError, match=reason) as refused:
        read_key(path)
    assert text not in str(refused.value)


def test_a_key_file_that_is_not_there_is_refused(tmp_path: Path) -> None:
    with pytest.raises(KeyFileError, match=r"rig\.key"):
        read_key(tmp_path / "rig.key")
