"""Lines of link and keys on which a rig's trust rests, each of which a drawn defect had changed unnoticed."""

from __future__ import annotations

from pathlib import Path

import pytest

from telemetry.errors import KeyFileError
from telemetry.media.port import MAX_FRAME
from telemetry.runtime.marked_frames import MarkedFrames, mark_frame
from telemetry.transport.authentication import read_key
from telemetry.transport.hop import ENTRY_BYTES, Header, HopLink, pack_frame


def test_what_a_dead_process_left_half_said_is_forgotten_found_or_waiting() -> None:
    frames = MarkedFrames()
    for frame in (b"one", b"two"):
        frames.add(frame)
    assert not frames.has_all([mark_frame(b"one"), mark_frame(b"three")])  # one of the two is found by now
    frames.add(b"four")
    frames.clear()
    frames.add(b"new")
    assert frames.has_all([mark_frame(b"new")])
    assert list(frames.take(is_marked=True)) == [b"new"]


@pytest.mark.parametrize(("make", "reason"), [(None, "No such file"), (b"\xff\xfe" * 32, "not text")])
def test_a_key_file_that_is_not_there_or_no_text_is_one_line_with_its_reason(
    tmp_path: Path, make: bytes | None, reason: str
) -> None:
    path = tmp_path / "rig.key"
    if make is not None:
        path.write_bytes(make)
        path.chmod(0o600)
    with pytest.raises(KeyFileError, match=reason):
        read_key(path)


@pytest.mark.parametrize("beyond", [0, 1])
def test_payloads_share_a_frame_as_large_as_one_may_be_less_a_kibibyte(beyond: int) -> None:
    link = HopLink(1, 1)
    for topic, size in (("a", 20_000), ("b", MAX_FRAME - 1024 - 2 * ENTRY_BYTES - 20_000 + beyond)):
        link.send_best_effort(bytes(size), topic)
    assert len(link.take_frames(100.0)) == 1 + beyond


@pytest.mark.parametrize("address", [3, 200])
def test_an_earlier_session_of_another_tube_of_the_same_start_is_none_of_before(address: int) -> None:
    """Two tubes count their starts alike: only the address tells whose session it is."""
    link = HopLink(1, 1)
    for sender, session, number in ((2, 5, 1), (address, 3, 1)):
        header = Header(sender, 4 << 24 | session << 8 | sender, number, link.epoch, 0, 0)
        found = link.receive(pack_frame(header, [(1, b"kept")]), 100.0 + session)
        assert [bytes(one) for one in found] == [b"kept"]
    assert link.peer == (address, 4)
