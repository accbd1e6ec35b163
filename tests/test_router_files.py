"""When the router takes what its files say: once they have settled, and only what it can serve."""

from __future__ import annotations

from pathlib import Path

import pytest
from sealed_string import NOW, make_folder

from borechain.drilling.router_host import RouterFiles
from borechain.pki.access import ACCESS_FILE
from borechain.pki.rig_keys import add_person, renew_certificate

ENDPOINT = "tls/127.0.0.1:1"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    return make_folder(tmp_path / "stick", 1)


def test_files_that_have_settled_are_taken_once(folder: Path) -> None:
    files = RouterFiles(ENDPOINT, folder)
    assert not files.have_changed()
    add_person(folder, "anna", "driller", NOW)
    assert not files.have_changed()  # they may be half written
    assert files.have_changed()
    assert not files.have_changed()
    renew_certificate(folder, "router", NOW)
    assert [files.have_changed() for _ in range(3)] == [False, True, False]


@pytest.mark.parametrize("damage", ["access", "pair", "certificate"])
def test_files_that_cannot_be_served_are_told_once_and_left(
    folder: Path, damage: str, capsys: pytest.CaptureFixture[str]
) -> None:
    files = RouterFiles(ENDPOINT, folder)
    spoilt = folder / {"access": ACCESS_FILE, "pair": "router.key", "certificate": "router.pem"}[damage]
    before = spoilt.read_bytes()
    spoilt.write_bytes((folder / "base.key").read_bytes() if damage == "pair" else b"{half")
    assert [files.have_changed() for _ in range(4)] == [False] * 4
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("borechain router: ")
    assert line.endswith("; the files of before stay in use")
    spoilt.write_bytes(before)
    assert [files.have_changed() for _ in range(3)] == [False, True, False]


def test_a_router_without_tls_has_no_files() -> None:
    files = RouterFiles("tcp/127.0.0.1:1", None)
    assert [files.have_changed() for _ in range(3)] == [False] * 3
