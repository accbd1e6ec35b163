"""What is printed of recordings, merges and answers, and files of a calibration, whole whenever the power goes."""

from __future__ import annotations

import contextlib
import errno
import os
from collections.abc import Iterator
from pathlib import Path

import pytest
from printed_output import printed, query_reply, run_command

from borechain.cli.calibrate import calibration_output
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.ground import merge_command, record_command
from borechain.cli.ground.query import csv_of, known_keys, query, show_answers, value_of
from groundstation.recording.recorder import RecordingSummary
from groundstation.service.disk.merged_database import DatabaseMerge
from telemetry.media.zenoh_bus import QueryReply


def test_a_replay_line_by_line() -> None:
    station = {"station": 4, "md_m": 8.5, "inclination_deg": 1.2345, "azimuth_deg": 67.891}
    result = {
        "stations": [station], "verdict": {"line": "WATCH: x"}, "events": 12, "missing": 3, "whole": True,
        "damage": [], "digest": "d2",
    }  # fmt: skip
    assert printed(record_command.print_replay, result) == [
        "station 4 at 8.50 m: 1.234 deg to 67.89 deg", "WATCH: x", "12 events, 3 missing; whole file", "digest d2",
    ]  # fmt: skip
    assert "12 events, 3 missing; cut file" in printed(record_command.print_replay, result | {"whole": False})
    damaged = printed(record_command.print_replay, result | {"damage": ["row 7"]})
    assert "12 events, 3 missing; damaged file" in damaged


@pytest.mark.parametrize(("count", "more"), [(19, ""), (20, ""), (21, "and 1 more damaged parts")])
def test_of_damage_the_first_twenty_parts_are_told_and_the_rest_counted(
    capsys: pytest.CaptureFixture[str], count: int, more: str
) -> None:
    record_command.tell_damage([f"part {k}" for k in range(count)])
    told = capsys.readouterr().err.splitlines()
    assert told == [f"part {k}" for k in range(min(count, 20))] + ([more] if more else [])


@pytest.mark.parametrize(
    ("summary", "told"),
    [
        (RecordingSummary(7, 1, 9, 0, 0), ["7 samples, 9 events taken in by the ground station"]),
        (
            RecordingSummary(7, 3, 9, 0, 4),
            ["7 samples, 9 events taken in by the ground station",
             "not whole: the recording begins at event 3; a replay knows what it has"],
        ),
        (
            RecordingSummary(7, 1, 9, 2, 5),
            ["7 samples, 9 events taken in by the ground station",
             "not whole: the recording begins at event 1, 2 events and 5 samples were lost; "
             "a replay knows what it has"],
        ),
        (
            RecordingSummary(7, 0, 0, 0, 0),
            ["7 samples, 0 events taken in by the ground station",
             "not whole: the recording holds no event of the ground station; a replay knows what it has"],
        ),
    ],
)  # fmt: skip
def test_a_recording_says_what_it_lacks(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, summary: RecordingSummary, told: list[str]
) -> None:
    monkeypatch.setattr(record_command, "record_rig", lambda *_given: summary)
    done = run_command(record_command.record, str(tmp_path / "shift.mcap"))
    assert done.stderr.splitlines() == told


def test_a_merge_says_what_each_has_had_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    twice = tuple((tube, 100 + tube) for tube in range(1, 8))
    done = DatabaseMerge(shared=11, first_alone=22, second_alone=33, stands=44, damaged=5, twice=twice)
    monkeypatch.setattr("groundstation.service.disk.merged_database.merge_databases", lambda *_given: done)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first, second, into = (str(tmp_path / name) for name in ("a", "b", "c"))
    told = run_command(merge_command.merge, first, second, "--into", into)
    named = ", ".join(f"number {100 + tube} of tube {tube}" for tube in range(1, 6))
    text = " ".join(told.output.split())
    assert f"{into}: 11 messages of both, 22 of {first} alone, 33 of {second} alone; 44 stands of the bit more" in text
    assert "5 rows are damaged and were left out; the tubes are asked for lost messages again" in text
    assert f"7 numbers have two contents, both are kept: {named}; are there two tubes of one number?" in text


class Bus:
    """A bus that gives the replies of a test."""

    def __init__(self, *replies: QueryReply) -> None:
        self.replies = list(replies)
        self.asked: list[str] = []

    def get(self, selector: str, timeout: float) -> list[QueryReply]:
        del timeout
        self.asked.append(selector)
        return self.replies


A, B = query_reply("borechain/a/ground/status", b'{"x": 1}'), query_reply("borechain/b/ground/status", b'{"x": 2}')


WRONG, LATE = query_reply("", error="no such path"), query_reply("", error="Timeout")


@pytest.mark.parametrize(
    ("replies", "status", "out", "err"),
    [
        ([A], 0, '{"x": 1}\n', ""),
        ([A, B], 0, '{"borechain/a/ground/status": {"x": 1}, "borechain/b/ground/status": {"x": 2}}\n', ""),
        ([A, WRONG], 0, '{"x": 1}\n', ""),
        ([WRONG, B, LATE], 0, '{"x": 2}\n', ""),
        ([LATE, WRONG], 2, "", "no such path"),
        ([LATE, LATE], 1, "", "no answer within 5 s; a longer --timeout may help"),
    ],
)
def test_answers_count_before_refusals_and_these_before_silence(
    monkeypatch: pytest.MonkeyPatch, replies: list[QueryReply], status: int, out: str, err: str
) -> None:
    @contextlib.contextmanager
    def opened(*_given: object) -> Iterator[Bus]:
        yield Bus(*replies)

    monkeypatch.setattr("telemetry.media.zenoh_bus.open_client", opened)
    done = run_command(query, "borechain/*/ground/status", "--json")
    assert (done.exit_code, done.stdout) == (status, out)
    assert err in done.stderr


def test_of_several_answers_there_is_no_table() -> None:
    with pytest.raises(InputFault, match="expected one answer, got 2: borechain/a/ground/status, borechain/b"):
        csv_of([A, B])


@pytest.mark.parametrize(
    ("payload", "value"),
    [
        (b'{"a": 1}', {"a": 1}), (b"\x81\xa1a\x01", {"a": 1}), (b"\xc1\x00", {"hex": "c100"}),
        (b"\x91\xc4\x01a", {"hex": "91c40161"}),
    ],
)  # fmt: skip
def test_a_value_is_json_msgpack_or_hex(payload: bytes, value: object) -> None:
    assert value_of(payload) == value


def test_keys_are_named_by_what_can_be_done_with_them() -> None:
    asked, published = known_keys(), known_keys("publish")
    assert "ground/verdict" in asked
    assert asked.startswith("keys are ")
    assert "cmd/" in asked
    assert "cmd/" not in published
    assert printed(lambda: show_answers({"k": {"a": 1}}, as_json=True)) == ['{"a": 1}']
    assert printed(lambda: show_answers({"k": {"a": 1}}, as_json=False)) == ["{", '  "a": 1', "}"]


class CutError(Exception):
    """The power went."""


@pytest.mark.parametrize("last", range(8))
def test_files_of_a_calibration_are_all_old_or_whole_and_forced_whenever_the_power_goes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, last: int
) -> None:
    """Every call that changes the disk may be the last; no name is given before the bytes of all files are forced."""
    files = {tmp_path / name: name.encode() for name in ("one.json", "two.json", "three.json")}
    for path in files:
        path.write_bytes(b"old")
    forced: set[int] = set()
    done: list[str] = []

    def count(what: str) -> None:
        if len(done) == last:
            raise CutError
        done.append(what)

    def force(descriptor: int) -> None:
        count("force")
        forced.add(os.fstat(descriptor).st_ino)

    rename = Path.replace

    def replaced(draft: Path, path: Path) -> Path:
        count("rename")
        assert len(forced) == len(files), "a name before all bytes are on the disk"
        assert draft.stat().st_ino in forced
        return rename(draft, path)

    monkeypatch.setattr(os, "fsync", force)
    monkeypatch.setattr(Path, "replace", replaced)
    with contextlib.suppress(CutError):
        calibration_output.write_files_whole(files)
    kept = [path.read_bytes() for path in files]
    renamed = done.count("rename")
    assert kept == [path.name.encode() for path in files][:renamed] + [b"old"] * (len(files) - renamed)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(path.name for path in files)
    assert last < 6 or done == 3 * ["force"] + 3 * ["rename"]


def test_a_disk_that_is_full_is_named_and_keeps_what_was_there(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "one.json").write_bytes(b"old")

    def full(descriptor: int) -> None:
        del descriptor
        raise OSError(errno.ENOSPC, "No space left on device", "draft")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(EnvironmentFault, match=r"/one\.json: No space left on device; nothing was written"):
        calibration_output.write_files_whole({tmp_path / "one.json": b"new"})
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("one.json", b"old")]


def test_a_certificate_names_its_numbers_and_is_due_after_its_day() -> None:
    import datetime

    day = datetime.datetime(2026, 5, 4, tzinfo=datetime.UTC)

    def wanted(due: datetime.datetime | None) -> calibration_output.WantedFiles:
        return calibration_output.WantedFiles(
            Path("r.csv"), None, None, None, day, None, False, serial="S-1", number="C-2", due=due
        )

    assert wanted(None).papers == (("Certificate", "C-2"), ("Serial number", "S-1"))
    assert wanted(day).papers[2] == ("Next due", "2026-05-04")
    for due, is_taken in ((day, False), (day + datetime.timedelta(days=1), True)):
        with contextlib.nullcontext() if is_taken else pytest.raises(InputFault, match="--due: expected a day after"):
            wanted(due).check()
