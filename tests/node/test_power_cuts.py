"""Power cut at a thousand random instants of the saved state's writing: the old state or the new one, never another."""

import errno
import os
import shutil
import struct
import zlib
from collections import Counter
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from node.firmware.saved_state import FIELDS, layout_name, pack_state_slot
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import NODE_LAYOUT, new_node
from node.process.counter import LOTS, BootCounter
from node.process.journal import SLOTS, Journal
from node.process.tube_process import TubeProcess
from telemetry.runtime import disk as disk_module

CUTS = (250, 1000)  # in `make test` and in `make study`
SECTOR = 512
BOUNDARY = 1500  # weight of the instant between two calls, against 1 of a byte


class PowerCutError(Exception):
    """The node has no power."""


class Disk:
    """``os`` of a machine whose cache is lost with the power: what was not forced may be there, or in part, or not."""

    O_RDWR, O_CREAT, O_RDONLY, POSIX_FADV_DONTNEED = os.O_RDWR, os.O_CREAT, os.O_RDONLY, os.POSIX_FADV_DONTNEED

    def __init__(self, folder: Path, random: np.random.Generator) -> None:
        self._folder, self._random = folder, random
        self.forced: dict[str, bytes] = {p.name: p.read_bytes() for p in folder.iterdir()}
        self.names = set(self.forced)
        self._cached: dict[str, bytearray] = {}
        self._open: dict[int, str] = {}
        self.left: float = np.inf
        self.spent = 0

    @property
    def written(self) -> set[str]:
        return set(self._cached)

    def open(self, path: Path, flags: int, mode: int = 0o777) -> int:
        self._spend(BOUNDARY)
        descriptor = os.open(path, flags, mode)
        name = "" if path == self._folder else path.name
        self._open[descriptor] = name
        if name and flags & os.O_RDWR:
            self._cached.setdefault(name, bytearray(self.forced.get(name, b"")))
        return descriptor

    def posix_fallocate(self, descriptor: int, begin: int, length: int) -> None:
        os.posix_fallocate(descriptor, begin, length)
        cached = self._cached[self._open[descriptor]]
        cached.extend(bytes(max(begin + length - len(cached), 0)))
        self._spend(BOUNDARY)

    def pwrite(self, descriptor: int, data: memoryview, at: int) -> int:
        length = min(len(data), int(self._random.integers(1, 2 * len(data) + 1)))  # a call may write less
        allowed = min(length, int(min(self.left, 2**40)))
        os.pwrite(descriptor, data[:allowed], at)
        self._cached[self._open[descriptor]][at : at + allowed] = data[:allowed]
        self._spend(length)
        return length

    def fsync(self, descriptor: int) -> None:
        self._spend(BOUNDARY)
        name = self._open[descriptor]
        if name:
            self.forced[name] = bytes(self._cached.pop(name))
        else:
            self.names = {p.name for p in self._folder.iterdir()}
        self._spend(BOUNDARY)

    def posix_fadvise(self, descriptor: int, begin: int, length: int, advice: int) -> None:
        os.posix_fadvise(descriptor, begin, length, advice)

    def pread(self, descriptor: int, length: int, at: int) -> bytes:
        self._spend(BOUNDARY)
        return os.pread(descriptor, length, at)

    def close(self, descriptor: int) -> None:
        os.close(descriptor)
        self._open.pop(descriptor)

    def after_cut(self) -> None:
        """Leave in the folder what a disk may hold."""
        for name, cached in self._cached.items():
            self._leave(name, bytes(cached))
        for path in self._folder.iterdir():
            if path.name not in self.names and self._random.random() < 0.5:
                path.unlink()

    def _leave(self, name: str, cached: bytes) -> None:
        before = self.forced.get(name, b"")
        length = int(self._random.choice([0, len(before), len(cached), self._random.integers(0, len(cached) + 1)]))
        image = bytearray(before[:length].ljust(length, b"\0"))
        for begin in range(0, min(length, len(cached)), SECTOR):
            if self._random.random() < 0.7:
                image[begin : begin + SECTOR] = cached[begin : begin + SECTOR][: length - begin]
        (self._folder / name).write_bytes(bytes(image))

    def _spend(self, cost: int) -> None:
        self.spent += cost
        self.left -= cost
        if self.left < 0:
            raise PowerCutError


def marked(number: int) -> np.ndarray:
    state = new_node(default_config())
    state[0]["filter"]["now_yaw"] = number
    state[0]["filter"]["ring_rate"] = number
    return state


def found(folder: Path) -> tuple[int, bytes] | None:
    loaded = Journal(folder).load()
    return None if loaded is None else (int(loaded[0][0]["filter"]["now_yaw"]), loaded[1])


def fill(folder: Path, newest: int, earlier: int, random: np.random.Generator) -> tuple[int, bytes]:
    """Leave a ring whose newest save is in slot ``newest``, with ``earlier`` slots before it; what the newest holds."""
    folder.mkdir()
    for age in range(earlier, -1, -1):
        generation, blob = 1000 - age, random.bytes(int(random.integers(0, 3000)))
        (folder / f"slot-{(newest - age) % SLOTS}").write_bytes(pack_state_slot(marked(generation), blob, generation))
    return generation, blob


@pytest.mark.slow
@pytest.mark.parametrize("many", [CUTS[0], pytest.param(CUTS[1], marks=pytest.mark.statistical)])
def test_a_cut_at_any_instant_leaves_the_old_or_the_new_node(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, many: int
) -> None:
    random = np.random.default_rng(20261121)
    new, old, cuts = 0, 0, Counter[int]()
    for cut in range(many):
        folder = tmp_path / str(cut)
        place = cut % SLOTS
        before = fill(folder, place, SLOTS - 1 if cut % 10 == 0 else int(random.integers(0, 5)), random)
        for life in range(int(random.integers(1, 4))):
            wanted = (100 + life, random.bytes(int(random.integers(0, 3000))))
            disk = Disk(folder, random)
            total = len(pack_state_slot(marked(0), wanted[1], 0)) + 8 * BOUNDARY
            disk.left = float(random.integers(0, total + BOUNDARY))
            survivor = Journal(folder)
            loaded = survivor.load()
            assert loaded is not None
            assert (int(loaded[0][0]["filter"]["now_yaw"]), loaded[1]) == before
            target = (place + 1) % SLOTS
            with monkeypatch.context() as patch:
                patch.setattr(disk_module, "os", disk)
                try:
                    survivor.save(marked(wanted[0]), wanted[1])
                    done = True
                except PowerCutError:
                    done = False
                    cuts[target] += 1
            assert disk.written <= {f"slot-{target}"}, "every other slot is spared"
            disk.after_cut()
            after = found(folder)
            assert after in (before, wanted)
            assert after == wanted or not done, "what was saved is not lost"
            new, old = new + (after == wanted), old + (after == before)
            place = target if after == wanted else place
            before = after
        shutil.rmtree(folder)
    assert min(new, old) > many / 10
    assert cuts.total() >= many
    assert set(cuts) == set(range(SLOTS))
    assert min(cuts.values()) > many / SLOTS / 2


def test_the_first_state_ever_is_on_the_disk_with_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for cut in range(100):
        folder = tmp_path / str(cut)
        journal = Journal(folder)
        disk = Disk(folder, np.random.default_rng(cut))
        with monkeypatch.context() as patch:
            patch.setattr(disk_module, "os", disk)
            journal.save(marked(7), b"first")
        disk.after_cut()
        assert found(folder) == (7, b"first")


@pytest.mark.parametrize("error", [errno.ENOSPC, errno.EIO])
def test_a_disk_that_is_full_spares_the_state_before(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, error: int
) -> None:
    journal = Journal(tmp_path)
    journal.save(marked(1), b"one")

    def refuse(*_: object) -> int:
        raise OSError(error, os.strerror(error))

    monkeypatch.setattr(disk_module.os, "pwrite", refuse)
    with pytest.raises(OSError, match=os.strerror(error)):
        journal.save(marked(2), b"two")
    monkeypatch.undo()
    assert found(tmp_path) == (1, b"one")


@pytest.mark.parametrize("left", ["", "1", "12", "12\n"])
def test_a_cut_while_the_starts_are_counted_leaves_the_last_number(tmp_path: Path, left: str) -> None:
    BootCounter(tmp_path)
    (tmp_path / "boots.new").write_text(left)
    assert BootCounter(tmp_path).boots == 2


@pytest.mark.parametrize("count", ["many", "-1", "", "1e9", "9" * 30])
def test_a_damaged_count_of_starts_gives_a_number_that_counting_never_reaches(tmp_path: Path, count: str) -> None:
    (tmp_path / "boots").write_text(count)
    first = BootCounter(tmp_path)
    assert LOTS <= first.boots < 2 * LOTS
    assert "boots" in first.fault
    second = BootCounter(tmp_path)
    assert (second.boots, second.fault) == (first.boots + 1, "")


def test_a_folder_that_takes_nothing_gives_a_number_by_lot(tmp_path: Path) -> None:
    (tmp_path / "folder").write_text("a file")
    counter = BootCounter(tmp_path / "folder", lot=lambda _below: 7)
    assert counter.boots == LOTS + 7
    assert counter.fault


def other_version(slot: bytes) -> bytes:
    return slot[:4] + (NODE_LAYOUT + 1).to_bytes(2, "little") + slot[6:]


def other_fields(slot: bytes) -> bytes:
    return slot[:8] + (FIELDS ^ 1).to_bytes(4, "little") + slot[12:]


def before_checksums(version: int) -> Callable[[bytes], bytes]:
    """The earlier header, with the version alone: magic, version, 0, generation, bytes of state and blob."""

    def slot_of(slot: bytes) -> bytes:
        state, blob = bytes(4096), b"blob"
        head = struct.pack("<4sHHQII", b"BCSS", version, 0, 7, len(state), len(blob))
        return head + zlib.crc32(state + blob, zlib.crc32(head)).to_bytes(4, "little") + state + blob

    return slot_of


NOT_TOLD = "without a checksum of its fields"


@pytest.mark.parametrize(
    ("spoil", "reason"),
    [
        (other_version, f"expected layout {layout_name()}, got {layout_name(NODE_LAYOUT + 1)}"),
        (other_fields, f"expected layout {layout_name()}, got {layout_name(fields=FIELDS ^ 1)}"),
        *((before_checksums(v), f"expected layout {layout_name()}, got {v} {NOT_TOLD}") for v in (1, 2, 3)),
        (lambda slot: slot[:-9], "checksum does not fit"),
        (lambda slot: b"", "expected at least"),
        (lambda slot: b"\xff" * 9999, "expected b'BCSS'"),
    ],
)
def test_a_state_that_cannot_be_read_is_an_event_and_a_safe_start(tmp_path: Path, spoil, reason: str) -> None:
    random = np.random.default_rng(1)

    def cycles(process: TubeProcess, count: int, now: float) -> float:
        for _ in range(count):
            now += PERIOD
            noise = random.normal(0.0, 1e-4, 6)
            process.on_cycle([now - PERIOD, *noise[:3], *noise[3:5], noise[5] - 9.8], now)
        return now

    process = TubeProcess(TubeSettings(3), tmp_path)
    cycles(process, 110, 1000.0)
    assert process.state[0]["static_bias_var"].any()
    for path in tmp_path.glob("slot-*"):
        path.write_bytes(spoil(path.read_bytes()))
    again = TubeProcess(TubeSettings(3), tmp_path)
    assert not again.state[0]["static_bias_var"].any()
    assert again.state[0]["yaw_known"] == 0
    told: list[tuple[str, object]] = []
    again._send_event = lambda severity, code, arguments: told.append((code, arguments))  # type: ignore[method-assign]
    again._announce(5.0, 5.0)
    assert [code for code, _ in told] == ["saved_state_lost"]
    assert "saved state" in str(told[0][1])
    assert reason in str(told[0][1])
    cycles(again, 3, 2000.0)
