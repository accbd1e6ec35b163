"""Keys of a rig from generation to generation: which are kept, which end, who is out, and what is written last."""

from __future__ import annotations

import datetime
import itertools
import random
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from borechain.pki import rig_keys
from borechain.pki.rig_keys import add_tube, init_rig, read_secret, retire_keys, revoke_tube, rotate_keys
from telemetry.errors import KeyFileError
from telemetry.messages import BASE, ENCODER
from telemetry.transport.key_ring import KeyRing, key_file, read_ring

NOW = datetime.datetime(2026, 5, 4, 6, tzinfo=datetime.UTC)
HOUR = datetime.timedelta(hours=1)


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Keys of a rig with three tubes; certificates, which take long, are left out."""
    monkeypatch.setattr(rig_keys, "make_certificate", lambda *_: None)
    init_rig(tmp_path / "stick", "rig-1", NOW, random.Random(1).randbytes)
    for tube in (1, 2, 3):
        add_tube(tmp_path / "stick", tube, NOW)
    return tmp_path / "stick"


def ring(folder: Path, address: int) -> KeyRing:
    return read_ring(key_file(folder, address), address, NOW)


def numbers(folder: Path, address: int) -> list[int]:
    return [generation.number for generation in ring(folder, address).generations]


def test_each_rotation_keeps_the_newest_and_the_one_before_it(folder: Path) -> None:
    secrets = {read_secret(folder).generations[-1].secret}
    for turn in range(1, 4):
        rotate_keys(folder, NOW + turn * HOUR)
        found = read_secret(folder).generations
        assert [one.number for one in found] == [turn, turn + 1]
        assert found[0].secret in secrets
        assert found[1].secret not in secrets
        assert found[0].retires_at is not None
        assert found[1].retires_at is None
        secrets.add(found[1].secret)
        for address in (BASE, ENCODER, 1, 2, 3):
            assert numbers(folder, address) == [turn, turn + 1]


def test_what_is_retired_is_the_old_and_the_new_goes_on(folder: Path) -> None:
    for turn in range(1, 3):
        rotate_keys(folder, NOW + turn * HOUR)
        newest = read_secret(folder).generations[-1].secret
        retire_keys(folder)
        (left,) = read_secret(folder).generations
        assert (left.number, left.secret) == (turn + 1, newest)
        for address in (BASE, ENCODER, 1, 2, 3):
            assert numbers(folder, address) == [turn + 1]


def test_who_was_revoked_stays_out_however_often_keys_change(folder: Path) -> None:
    revoke_tube(folder, 2, NOW)
    revoke_tube(folder, 1, NOW + HOUR)
    rotate_keys(folder, NOW + 2 * HOUR)
    assert read_secret(folder).revoked == {1, 2}
    for address in (BASE, ENCODER, 3):
        found = ring(folder, address)
        assert found.revoked == {1, 2}
        for generation, out in itertools.product(found.generations, (1, 2)):
            assert not [name for name in generation.keys if name[1] == out and name[0] != "block"]
            assert ("block", out) not in generation.keys
            assert found.block_key(out) is None
    assert ("end", 3) in ring(folder, BASE).generations[-1].keys


def test_the_secret_of_a_generation_is_written_last(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A cut before it leaves the old secret, of which the files can be made again; after it all files are there."""
    written: list[str] = []
    plain = rig_keys.write_private

    def noted(path: Path, text: str) -> None:
        plain(path, text)
        written.append(path.name)

    monkeypatch.setattr(rig_keys, "write_private", noted)
    for change in changes(folder):
        written.clear()
        change()
        assert written[-1] == rig_keys.SECRET_FILE
        assert written.count(rig_keys.SECRET_FILE) == 1
        assert len(written) >= 6


def changes(folder: Path) -> Iterator[Callable[[], object]]:
    yield lambda: rotate_keys(folder, NOW + HOUR)
    yield lambda: retire_keys(folder)
    yield lambda: rotate_keys(folder, NOW + 2 * HOUR)


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("[[generation]]", "[[generations]]", "expected what borechain pki wrote"),
        ("revoked = []", "revoked = []\ngeneration = []", "expected a generation of keys, got none"),
        ("revoked = []", 'revoked = ["x"]', "expected what borechain pki wrote"),
        ('rig = "rig-1"', "", "expected what borechain pki wrote"),
        ('secret = "', 'secret = "00', "expected what borechain pki wrote"),
        ("number = 1", 'number = "one"', "expected what borechain pki wrote"),
    ],
)
def test_a_secret_that_was_changed_by_hand_is_refused_in_a_line(folder: Path, old: str, new: str, told: str) -> None:
    path = folder / rig_keys.SECRET_FILE
    text = path.read_text(encoding="utf-8")
    if "generation = []" in new:
        text = text[: text.index("[[generation]]")]
    assert old in text
    path.write_text(text.replace(old, new, 1), encoding="utf-8")
    with pytest.raises(KeyFileError, match=told):
        read_secret(folder)


def test_a_role_that_is_none_is_refused_before_anything_is_written(folder: Path) -> None:
    before = (folder / rig_keys.SECRET_FILE).read_bytes()
    with pytest.raises(KeyFileError, match="person guest: expected a role of operator, driller, got 'viewer'"):
        rig_keys.add_person(folder, "guest", "viewer", NOW)
    assert (folder / rig_keys.SECRET_FILE).read_bytes() == before
