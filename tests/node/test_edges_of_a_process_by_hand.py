"""Readings, frames, lines, blocks and what is saved of a node's process, each at its edge."""

from __future__ import annotations

import math
import os
from dataclasses import astuple
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from noted_parts import NotedPart, bare

from node.errors import SensorCause, SensorError
from node.firmware import chip_node
from node.process import reading, tube_process
from node.process.block_updater import BlockUpdater
from node.process.drivers import frame_clock, gpio_lines, vn100
from node.process.drivers.frame_clock import FrameClock, is_moved
from node.process.saver import Saver
from telemetry.messages import Severity

Noted = list[Any]
NAN = math.nan


# a reading


@pytest.mark.parametrize("count", range(22))
def test_a_reading_has_six_to_ten_numbers_or_the_eighths_of_its_cycle_as_well(count: int) -> None:
    numbers = [float(k) for k in range(1, count + 1)]
    found = reading.imu_reading(numbers, 1.0, 2.0)
    if not (6 <= count <= 10 or count == 19):
        assert all(math.isnan(x) for x in (*found.rate, *found.force))
        return
    assert (found.start, found.end, found.rate, found.force) == (1.0, 2.0, (1.0, 2.0, 3.0), (4.0, 5.0, 6.0))
    assert found.temperature == (7.0 if count > 6 else 25.0)
    assert (found.saturated, found.late, found.late_std) == (
        8 if count > 7 else 0, 9.0 if count > 8 else 0.0, 10.0 if count > 9 else 0.0,
    )  # fmt: skip
    assert found.parts == tuple(numbers[10:])


def test_what_is_no_number_of_a_reading_is_nothing_of_it() -> None:
    found = reading.imu_reading([1, 2, 3, 4, 5, 6, NAN, NAN, NAN, math.inf], 1.0, 2.0)
    assert math.isnan(found.temperature)
    assert (found.saturated, found.late, found.late_std) == (0, 0.0, 0.0)
    for rubbish in (None, [], ["x"], 7, [10**400, 1.0]):
        nothing = reading.reading_of(rubbish, 50.0)
        assert (nothing.end, all(map(math.isnan, nothing.rate))) == (50.0, True)
    assert reading.reading_of(7, 50.0).start == pytest.approx(50.0 - 10.0 / 19.0)
    cluster = reading.reading_of([49.0, [1.0] * 6, [2.0] * 6], 50.0)
    assert (cluster.rate[0], [other.rate[0] for other in cluster.others], cluster.start) == (1.0, [2.0], 49.0)


# frames


def test_the_time_of_reads_has_moved_where_the_newest_exceed_to_one_side() -> None:
    """Sixteen of value e among n - 16 that exceed nothing: (16 e)^2 against 25 * 16 * 16 e^2 / n, so from n = 26 on.

    At least 33 are looked at. With the others off by d to both sides the mean square is more, so e has its bound:
    (16 e)^2 > 400 (16 e^2 + 48 d^2) / 64 is e > 1.4142 d.
    """
    others = np.tile([0.0103, -0.0003], 24)  # 0.3 ms beyond a period of 10 ms, and before its frame
    for by, moved in ((0.4e-3, False), (0.43e-3, True), (-0.4e-3, False), (-0.43e-3, True)):
        newest = np.full(16, 0.01 + by if by > 0.0 else by)
        assert is_moved(np.concatenate([others, newest]), 0.01) is moved
        assert is_moved(np.concatenate([newest, others]), 0.01) is False  # of long ago
    quiet, late = np.full(17, 0.005), np.full(16, 0.011)
    assert is_moved(np.concatenate([quiet, late]), 0.01) is True
    assert is_moved(np.concatenate([quiet[1:], late]), 0.01) is False  # too few to say
    assert is_moved(np.full(64, 0.005), 0.01) is False


def test_the_time_of_reads_that_moved_begins_anew_with_the_last_of_them(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(frame_clock, "least_excess", lambda *_: (5.0, 0.02, 4e-6))
    clock = FrameClock(50.0)
    clock._reads.extend([(1.0, 10.0), (2.0, 60.0)])
    clock.newest = 1.99
    t, n = np.array(clock._reads).T
    monkeypatch.setattr(frame_clock, "is_moved", lambda *_: False)
    clock._fit_to(t, n)
    assert (clock.newest, clock.period, clock.std, len(clock._reads)) == (5.0, 0.02, pytest.approx(2e-3), 2)
    monkeypatch.setattr(frame_clock, "is_moved", lambda *_: True)
    monkeypatch.setattr(clock, "_look_at", lambda *given: seen.append([part.tolist() for part in given]))
    seen: Noted = []
    clock._fit_to(t, n)
    assert (list(clock._reads), seen) == ([(2.0, 60.0)], [[[2.0], [60.0]]])
    monkeypatch.setattr(frame_clock, "least_excess", lambda *_: (7.0, 0.03, 0.0))
    clock._fit_to(t, n)
    assert (clock.period, len(seen)) == (0.02, 1)  # what tells nothing changes nothing


# lines


def test_levels_are_asked_of_each_line_and_told_in_their_order(monkeypatch: pytest.MonkeyPatch) -> None:
    asked: Noted = []

    def answer(file: int, call: int, request: bytes) -> bytes:
        asked.append((file, call, gpio_lines.VALUES.unpack(request)))
        return gpio_lines.VALUES.pack(0b101, 0)

    monkeypatch.setattr(gpio_lines.fcntl, "ioctl", answer)
    lines = bare(gpio_lines.ChipLines, _file=9, _lines=(17, 4, 22), _chip=Path("chip"))
    assert lines.levels() == (1, 0, 1)
    assert asked == [(9, gpio_lines.GET_VALUES, (0, 0b111))]

    def gone(*_: Any) -> bytes:
        raise OSError(19, "No such device")

    monkeypatch.setattr(gpio_lines.fcntl, "ioctl", gone)
    with pytest.raises(SensorError, match=r"^gpio: chip: No such device$") as ended:
        lines.levels()
    assert ended.value.cause is SensorCause.BUS


@pytest.mark.parametrize("beyond", [0, 1])
def test_edges_are_whole_events_with_their_time_in_seconds(monkeypatch: pytest.MonkeyPatch, beyond: int) -> None:
    kinds = (gpio_lines.RISING, gpio_lines.RISING + 1)
    events = b"".join(gpio_lines.EVENT.pack(2_500_000_000 + k, kind, 4, 70 + k, 0) for k, kind in enumerate(kinds))
    monkeypatch.setattr(gpio_lines, "read_waiting", lambda _file: events + b"\0" * beyond)
    if beyond:
        with pytest.raises(SensorError, match=r"^gpio: 1 bytes beyond whole events") as ended:
            gpio_lines.read_edges(9)
        assert ended.value.cause is SensorCause.LOST_BYTES
        return
    rising, falling = gpio_lines.read_edges(9)
    assert astuple(rising) == (pytest.approx(2.5), 4, 1, 70)
    assert astuple(falling) == (pytest.approx(2.500000001), 4, 0, 71)


# a block, and what is saved


def test_a_block_is_in_use_once_what_was_learnt_before_is_forgotten_and_the_block_is_kept() -> None:
    for error in (None, OSError(28, "No space left on device")):
        noted: Noted = []
        block = SimpleNamespace(version=7, sha256=lambda: b"\x07" * 32)
        in_use = SimpleNamespace(version=6, sha256=lambda: b"\x06" * 32)
        node = NotedPart(noted, "tube", parameters=in_use, settings=SimpleNamespace(tube=3))
        one = bare(
            BlockUpdater, _tube=node, _save=lambda noted=noted: noted.append(("saved",)), _sequence=9, _refused=None,
            _store=NotedPart(noted, "store", {"keep_block": error}), _assembly=None, _trial="a trial",
            _say=lambda *given, noted=noted: noted.append(given),
        )  # fmt: skip
        status = one._apply(block)
        first = [("tube.prepare", block), ("saved",), ("store.keep_block", block)]
        if error is None:
            applied = {"version": 7, "before": 6, "hash": "07" * 32}
            told = (Severity.INFO, "parameters_applied", applied)
            assert noted == [*first, ("tube.use", block), ("store.drop_upload",), told]
            assert status.detail == ""
        else:
            reason = "disk: No space left on device"
            told = (Severity.ERROR, "parameters_refused", {"version": 7, "reason": reason, "in_use": 6})
            assert noted == [*first, ("store.drop_upload",), told]
            assert (status.detail, one._refused) == (reason, (b"\x07" * 32, 9, reason))
        assert (one._trial, status.digest, status.tube, status.sequence) == (None, b"\x07" * 32, 3, 9)


def test_what_a_disk_refused_is_told_once_until_it_takes_something_again(tmp_path: Path) -> None:
    saver = Saver(tmp_path)
    saver._journal = SimpleNamespace(worn=set(), save=lambda *_: None)
    said: Noted = []
    nodes = np.zeros(1, [("filter", [("still_cycles", int)])])

    def refuse(*_: Any) -> None:
        raise OSError("x" * 300)

    for save, told in ((refuse, 1), (refuse, 0), (lambda *_: None, 0), (refuse, 1)):
        saver._journal.save = save
        saver.save(nodes, b"")
        said.clear()
        saver.report(lambda *given: said.append(given))
        saver.report(lambda *given: said.append(given))
        assert said == [(Severity.ERROR, "state_not_saved", {"detail": "x" * 200})] * told
        assert saver.is_refused is (save is refuse)
    assert tube_process.MAX_CLOCK_STD == 3600.0


def test_what_is_sent_at_once_has_its_bound() -> None:
    assert tube_process.RESENT_TOGETHER == 64


# a sensor on a line, and an emulated chip


@pytest.mark.parametrize(("reads", "spread"), [(15, 0.2), (16, 1e-3), (17, 1e-3)])
def test_a_crystal_is_known_from_sixteen_reads_on(reads: int, spread: float) -> None:
    clock = FrameClock(50.0)
    for k in range(1, reads + 1):
        clock.on_read(0.5 * k + 0.01, 25)
        assert clock._spread == (0.2 if k < 16 else 1e-3)
    assert clock._spread == spread


def test_a_line_that_is_gone_or_says_other_things_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    def told(text: str) -> bytes:
        check = 0
        for byte in text.encode():
            check ^= byte
        return f"${text}*{check:02X}\r\n".encode()

    waiting: Noted = [told("VNYMR,1,2"), told("VNWRG,06,19") + told("VNIMU,1"), OSError(5, "Input/output error")]

    def read_waiting(_file: int, _follows: float) -> bytes:
        found = waiting.pop(0)
        if isinstance(found, Exception):
            raise found
        return bytes(found)

    monkeypatch.setattr(vn100, "read_waiting", read_waiting)
    line = bare(vn100.Vn100, _file=7, _path=Path("tty"), _rest=b"", _fresh=True, dropped=0)
    for said in (
        r"^vn100: tty: expected lines \$VNIMU, got \$VNYMR$", r"^vn100: tty: expected about 25 lines, got 0$",
        r"^vn100: tty: Input/output error: the line is gone$",
    ):  # fmt: skip
        with pytest.raises(SensorError, match=said):
            line.read(1.0, 1.0 + 25.0 / vn100.RATE)
    line._file = -1
    with pytest.raises(SensorError, match=r"^vn100: tty: not started$"):
        line.read(1.0, 1.5)


def test_an_emulated_chip_is_told_by_kind_and_length_and_answers_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    """Two pipes of its folder, which end with it; requests are a kind, a length and so many bytes, little-endian."""
    begun: Noted = []
    process = SimpleNamespace(poll=lambda: None, kill=lambda: begun.append("killed"), wait=lambda: None)
    monkeypatch.setattr(chip_node, "chip_program", lambda: "a program")
    monkeypatch.setattr(chip_node, "start_chip", lambda *given: begun.append(given) or process)
    chip = chip_node.EmulatedChip()
    (program, folder), *_ = begun
    assert program == "a program"
    assert sorted(path.name for path in folder.iterdir()) == ["from_chip", "to_chip"]
    chip.put(3, b"body")
    assert os.read(chip._to, 100) == b"\x03\0\0\0\x04\0\0\0body"
    monkeypatch.setattr(chip_node, "ANSWER", 6)
    os.write(chip._from, b"answer")
    assert chip.answer() == b"answer"
    process.poll = lambda: 3
    with pytest.raises(chip_node.ChipError, match=r"it has ended with status 3$"):
        chip.put(3, b"body")
    chip._end()
    assert begun[1:] == ["killed"]
    assert not folder.exists()
