"""The ring of slots: how evenly it wears, and what it does with slots that are worn out."""

import errno
import os
from collections import Counter
from pathlib import Path

import numpy as np
import pytest

from node.firmware.saved_state import Saved
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import new_node
from node.process import journal as journal_module
from node.process.journal import SLOTS, Journal
from telemetry.runtime import disk as disk_module

SAVES = 100_000
LIFE = 997  # saves between two starts
NODE = new_node(default_config())
NUMBER = 8  # bytes


class Flash:
    """``os`` of a folder in memory that counts the writes of every slot; a slot that is worn gives back other bytes."""

    O_RDWR, O_CREAT, O_RDONLY, POSIX_FADV_DONTNEED = os.O_RDWR, os.O_CREAT, os.O_RDONLY, os.POSIX_FADV_DONTNEED

    def __init__(self) -> None:
        self.slots: dict[str, bytes] = {}
        self.writes = Counter[str]()
        self.worn: dict[str, int] = {}  # and the errno it fails with, 0: other bytes
        self._open = ""
        self._at = 0

    def open(self, path: Path, flags: int, mode: int = 0o777) -> int:
        self._open, self._at = path.name, 0
        if not path.name.startswith("slot-"):
            return 1
        if path.name not in self.slots:
            if not flags & os.O_CREAT:
                raise FileNotFoundError(path)
            self.slots[path.name] = b""
        return 0

    def posix_fallocate(self, descriptor: int, begin: int, length: int) -> None: ...

    def pwrite(self, descriptor: int, data: memoryview, at: int) -> int:
        name = self._open
        self.writes[name] += 1
        if fault := self.worn.get(name, 0):
            raise OSError(fault, os.strerror(fault))
        self.slots[name] = bytes(data) if name not in self.worn else b"worn"
        return len(data)

    def fsync(self, descriptor: int) -> None: ...

    def posix_fadvise(self, descriptor: int, begin: int, length: int, advice: int) -> None: ...

    def pread(self, descriptor: int, length: int, at: int) -> bytes:
        return self.slots[self._open][at : at + length]

    def read(self, descriptor: int, length: int) -> bytes:
        data = self.slots[self._open][self._at : self._at + length]
        self._at += length
        return data

    def close(self, descriptor: int) -> None: ...


def unpacked(data: bytes) -> Saved:
    if len(data) != NUMBER:
        raise journal_module.SavedStateError("damaged")
    return Saved(NODE, data, int.from_bytes(data, "little"), 0.0)


@pytest.fixture
def flash(monkeypatch: pytest.MonkeyPatch) -> Flash:
    """A disk that holds nothing but the number of each save."""
    made = Flash()
    monkeypatch.setattr(disk_module, "os", made)
    monkeypatch.setattr(
        journal_module, "pack_state_slot", lambda state, blob, generation: generation.to_bytes(NUMBER, "little")
    )
    monkeypatch.setattr(journal_module, "unpack_state_slot", unpacked)
    return made


def newest(folder: Path) -> int:
    loaded = Journal(folder).load()
    assert loaded is not None
    return int.from_bytes(loaded[1], "little")


def spread(writes: Counter[str], slots: int) -> float:
    """Largest distance of a slot's share from the mean, of the mean."""
    mean = writes.total() / slots
    assert len(writes) == slots
    return max(abs(count - mean) for count in writes.values()) / mean


@pytest.mark.slow
def test_a_hundred_thousand_saves_wear_all_slots_alike(tmp_path: Path, flash: Flash) -> None:
    random = np.random.default_rng(5)
    journal = Journal(tmp_path)
    for number in range(SAVES):
        if number % LIFE == 0:
            if number:  # the cut that ended this life left one slot torn, sometimes the newest
                flash.slots[f"slot-{random.integers(SLOTS)}"] = b"torn"
            journal = Journal(tmp_path)
        journal.save(NODE, b"")
    assert spread(flash.writes, SLOTS) < 0.1


@pytest.mark.parametrize("fault", [0, errno.EIO])
def test_slots_that_wear_out_are_passed_over_and_the_rest_wears_alike(tmp_path: Path, flash: Flash, fault: int) -> None:
    journal = Journal(tmp_path)
    for number in range(3 * SLOTS):
        journal.save(NODE, number.to_bytes(NUMBER, "little"))
    before = newest(tmp_path)
    flash.worn = dict.fromkeys(("slot-3", "slot-4", f"slot-{SLOTS - 1}"), fault)
    flash.writes.clear()
    saves = 0
    for life in range(4):
        journal = Journal(tmp_path)
        for _ in range(10 * SLOTS):
            journal.save(NODE, b"")
            saves += 1
        assert journal.worn == {3, 4, SLOTS - 1}, life
        assert newest(tmp_path) == before + saves
    assert {flash.writes.pop(name) for name in flash.worn} == {4}, "once in every life"
    assert spread(flash.writes, SLOTS - 3) < 0.1


def test_one_slot_that_is_left_still_works(tmp_path: Path, flash: Flash) -> None:
    journal = Journal(tmp_path)
    for _ in range(2 * SLOTS):
        journal.save(NODE, b"")
    flash.worn = {f"slot-{k}": 0 for k in range(SLOTS) if k != 11}
    for life in range(3):
        journal = Journal(tmp_path)
        for _ in range(5):
            journal.save(NODE, b"")
        assert len(journal.worn) == SLOTS - 1
        assert newest(tmp_path) == 2 * SLOTS + 5 * (life + 1)


def test_a_disk_that_refuses_all_spares_the_newest_and_is_tried_again(tmp_path: Path, flash: Flash) -> None:
    journal = Journal(tmp_path)
    for _ in range(40):
        journal.save(NODE, b"")
    flash.worn = {f"slot-{k}": errno.ENOSPC for k in range(SLOTS)}
    with pytest.raises(OSError, match="No space"):
        journal.save(NODE, b"")
    assert newest(tmp_path) == 40
    flash.worn = {}
    journal.save(NODE, b"")
    assert journal.worn == set()
    assert newest(tmp_path) == 42, "the number of a save that failed is not given to another"


def test_a_slot_that_cannot_be_read_at_the_start_is_passed_by(tmp_path: Path) -> None:
    journal = Journal(tmp_path)
    for k in range(3):
        journal.save(NODE, bytes([k]))
    (tmp_path / "slot-1").unlink()
    (tmp_path / "slot-1").mkdir()
    loaded = Journal(tmp_path).load()
    assert loaded is not None
    assert loaded[1] == b"\x02"


def test_a_ring_that_nobody_has_looked_at_is_gone_on_with(tmp_path: Path) -> None:
    for number in range(5):
        Journal(tmp_path).save(NODE, bytes([number]))
    loaded = Journal(tmp_path).load()
    assert loaded is not None
    assert loaded[1] == b"\x04"
    assert {path.name for path in tmp_path.iterdir()} == {f"slot-{k}" for k in range(5)}
