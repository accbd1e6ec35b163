"""What the machine's disk asks of the system: which file is forced, when, and every byte where it belongs."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from telemetry.runtime import disk as disk_room
from telemetry.runtime.disk import MACHINE, MachineDisk, replace_file


class Watched:
    """``os`` that notes what is forced and renamed, by the name of the file or folder, and does it."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.calls: list[tuple[str, str]] = []
        fsync, replace = os.fsync, Path.replace

        def noted_fsync(descriptor: int) -> None:
            fsync(descriptor)
            self.calls.append(("force", Path(f"/proc/self/fd/{descriptor}").readlink().name))

        def noted_replace(old: Path, new: Path) -> Path:
            self.calls.append(("rename", new.name))
            return replace(old, new)

        patch.setattr(disk_room.os, "fsync", noted_fsync)
        patch.setattr(disk_room.Path, "replace", noted_replace)


def test_forcing_reaches_the_file_and_the_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    watched = Watched(monkeypatch)
    for name in ("one", "two"):
        MACHINE.write(tmp_path / name, b"bytes")
    assert watched.calls == []
    MACHINE.force(tmp_path / "two")
    MACHINE.force_names(tmp_path)
    assert watched.calls == [("force", "two"), ("force", tmp_path.name)]


@pytest.mark.parametrize("there", [None, b"a longer file than the one that comes"])
def test_a_file_is_replaced_by_bytes_name_and_folder_in_this_order(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, there: bytes | None
) -> None:
    if there is not None:
        (tmp_path / "file").write_bytes(there)
    watched = Watched(monkeypatch)
    for content in (b"first", b"second"):
        watched.calls.clear()
        replace_file(MACHINE, tmp_path / "file", content)
        assert watched.calls == [("force", "file.new"), ("rename", "file"), ("force", tmp_path.name)]
        assert (tmp_path / "file").read_bytes() == content


@pytest.mark.parametrize("most", [1, 3, 1000])
def test_a_write_that_takes_less_than_it_was_given_goes_on_where_it_stopped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, most: int
) -> None:
    """POSIX lets a write take a first part only, and a nearly full disk does so."""
    pwrite = os.pwrite
    monkeypatch.setattr(disk_room.os, "pwrite", lambda d, data, at: pwrite(d, bytes(data[:most]), at))
    (tmp_path / "file").write_bytes(bytes(8))
    MachineDisk().write(tmp_path / "file", b"0123456789", 5)
    assert (tmp_path / "file").read_bytes() == bytes(5) + b"0123456789"
