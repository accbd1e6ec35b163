"""Files that are written whole: each is on the disk before it gets its name, and what fails leaves the old one."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest
from matplotlib.figure import Figure

from borechain.cli.calibrate.calibration_output import write_files_whole
from borechain.pki.private_files import write_private
from groundstation.report.style import save_figure
from sim.campaign.campaign_folder import write_whole

Write = Callable[[Path, str], None]


def write_figure(path: Path, text: str) -> None:
    figure = Figure()
    figure.text(0.5, 0.5, text)
    save_figure(figure, path)


WRITERS: dict[str, tuple[Write, str]] = {
    "keys": (write_private, "tube.keys"),
    "a figure": (write_figure, "figure.svg"),
    "a chunk of a campaign": (lambda path, text: write_whole(path, text.encode()), "chunk.parquet"),
    "files of a calibration": (
        lambda path, text: write_files_whole({path: text.encode(), path.with_name("sheet.pdf"): b"sheet"}), "block.json"
    ),
}  # fmt: skip


class Watched:
    """Notes what is forced and renamed, in its order, and does it; ``fails`` are forces that are refused."""

    def __init__(self, patch: pytest.MonkeyPatch) -> None:
        self.calls: list[tuple[str, str]] = []
        self.fails = False
        fsync, replace = os.fsync, Path.replace

        def noted_fsync(descriptor: int) -> None:
            if self.fails:
                raise OSError(28, "No space left on device")
            fsync(descriptor)
            self.calls.append(("force", Path(f"/proc/self/fd/{descriptor}").readlink().name))

        def noted_replace(old: Path, new: Path) -> Path:
            self.calls.append(("rename", old.name))
            return replace(old, new)

        patch.setattr(os, "fsync", noted_fsync)
        patch.setattr(Path, "replace", noted_replace)


@pytest.mark.parametrize("name", WRITERS)
def test_a_file_has_its_bytes_on_the_disk_before_it_has_its_name(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, file = WRITERS[name]
    watched = Watched(monkeypatch)
    for text in ("first", "second"):
        watched.calls.clear()
        write(tmp_path / file, text)
        renamed = [draft for kind, draft in watched.calls if kind == "rename"]
        assert renamed
        for draft in renamed:
            assert watched.calls.index(("force", draft)) < watched.calls.index(("rename", draft))
        forces = [place for place, (kind, _) in enumerate(watched.calls) if kind == "force"]
        assert max(forces) < watched.calls.index(("rename", renamed[0])), "none is renamed before all are whole"


@pytest.mark.parametrize("name", WRITERS)
def test_a_disk_that_refuses_leaves_the_old_file_and_no_draft(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write, file = WRITERS[name]
    write(tmp_path / file, "first")
    before = {path.name: path.read_bytes() for path in tmp_path.iterdir()}
    watched = Watched(monkeypatch)
    watched.fails = True
    with pytest.raises(Exception, match="No space left on device"):
        write(tmp_path / file, "second")
    after = {path.name: path.read_bytes() for path in tmp_path.iterdir() if not path.name.endswith(".new")}
    assert after == before


@pytest.mark.parametrize("there", [False, True])
def test_keys_are_for_their_owner_alone_from_the_first_byte_on(tmp_path: Path, there: bool) -> None:
    path = tmp_path / "tube.keys"
    if there:
        path.write_text("old")
        path.chmod(0o644)
    write_private(path, "secret")
    assert path.stat().st_mode & 0o777 == 0o600
    assert path.read_text() == "secret"
