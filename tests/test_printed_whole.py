"""What commands print, whole: every line and every number of answers in which no two numbers are equal."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import os
import re
import threading
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result
from printed_output import cells, printed, wall_result

from borechain import setup_check
from borechain.cli.calibrate import calibration_output
from borechain.cli.calibrate.record_reader import node_array
from borechain.cli.experiment.study_output import show_study, write_study
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.gauntlet.gauntlet import GauntletRequest, _show_figures
from borechain.cli.ground import check_command, merge_command, record_command
from borechain.cli.ground.query import csv_of, known_keys, query, show_answers, value_of
from borechain.cli.rig.rig_command import chosen_view
from borechain.cli.rig.shown_result import show_calibration, show_column, show_result
from borechain.cli.shared_options import parse_speed
from borechain.cli.survey.clearance_command import show_clearance
from borechain.cli.survey.survey import brought_words, show_survey
from borechain.cli.survey.wall_command import show_wall
from borechain.client import Ground
from borechain.load.page import latency_quantiles
from borechain.load.rounds import compare_rounds
from groundstation.recording.recorder import RecordingSummary
from groundstation.service.disk.merged_database import DatabaseMerge
from sim.studies.study import ResultTable
from telemetry.media.zenoh_bus import QueryReply

SITE = {
    "gravity_mps2": 9.81234, "latitude_deg": 52.4, "field_nt": None, "convergence_deg": None,
    "sources": {"gravity": "told", "latitude_deg": "default"},
}  # fmt: skip
SITE_LINE = "site: gravity 9.81234 m/s^2 (told); latitude 52.4 deg (default); no magnetic field stated"


def ran(command: Any, *words: str) -> Result:
    return CliRunner().invoke(command, list(words))


def test_a_wall_line_by_line() -> None:
    joints = wall_result()["joints"]
    states = ("surveyed", "open", "missing", "unsurveyed")
    for k, (row, state) in enumerate(zip(joints, states, strict=True)):
        row |= {"depth_m": 5.0 + k, "thinnest_at_m": 4.25 + k, "moved_apart_cm": 1.25 + k, "direction_deg": 90.4 + k}
        row["state"] = state
    joints[1]["moved_apart_cm"], joints[3]["tight_to_m"] = None, 8.0
    extra = [
        {"joint": name, "extra_column": {"north_m": n, "east_m": e, "from_m": f, "to_m": t, "closes": closes}}
        for name, n, e, f, t, closes in (("B-C", 1.234, 5.678, 2.5, 7.5, True), ("C-D", -1.0, -5.0, 2.0, 3.0, False))
    ]
    day = {"day": "2026-05-03", "closed_percent": 12.34, "open_joints": 7}
    result = wall_result(
        joints=joints, stations_north="true", margin={"shift_cm": 12.34, "deviation_deg": 0.4567}, extra_columns=extra,
        findings=[{"kind": "head", "text": "A touches B"}],
        warnings=[{"kind": "head", "text": "A touches B"}, {"kind": "toe", "text": "C is short"}],
        closing=[day | {"largest_spacing": {"spacing_m": 0.8765, "joint": "D-E"}}],
    )  # fmt: skip
    lines = printed(show_wall, result)
    assert [line for line in lines if "─" not in line and "━" not in line and "│" not in line and "┃" not in line] == [
        "W: not tight (grid north, depth from heads, stations read from true north)",
        "to be tight from the upper head to the lower toe of each joint",
        "WARNING (toe): C is short",
        "  head: A touches B",
        *(line for line in lines if line.strip() == "the 4 most doubtful of 4 joints"),
        "one column alone may be 12.3 cm off at its toe, 0.457 deg",
        "required 0.25 m: 2 of 4 joints are thinner or open, 3 are so with a probability of more than 0.01; "
        "2 columns beyond their tolerance",
        "2026-05-03: 12.3 % closed, 7 joints open, widest 0.876 m (D-E)",
        "anything open or too thin: probability 0.5",
        "worst joint C-D at 5 m",
        "a column at north 1.23 m, east 5.68 m from 2.5 to 7.5 m closes B-C",
        "a column at north -1.00 m, east -5.00 m from 2 to 3 m does not close C-D",
    ]
    assert [cells(line) for line in lines if "│" in line] == [
        ["C-D", "missing", "7.00", "-", "6.25", "3.00e-01", "3.2", "92"],
        ["B-C", "open", "6.00", "0.200", "5.25", "3.00e-01", "-", "91"],
        ["D-E", "unsurveyed", "8.00", "0.100", "7.25", "2.00e-02", "4.2", "93"],
        ["A-B", "surveyed", "5.00", "0.300", "4.25", "1.00e-04", "1.2", "90"],
    ]
    alike = printed(show_wall, wall_result(columns=[{"used_percent": used} for used in (99.9, 100.0, 100.1)]))
    assert "to be tight from 0 to 9 m" in alike
    assert any(line.endswith("; 2 columns beyond their tolerance") for line in alike)


def survey_result(**change: Any) -> dict[str, Any]:
    stations = [
        {"station": k, "md_m": 1.5 * k, "inclination_deg": 2.5 * k, "azimuth_deg": 3.5 * k, "north_m": 4.5 * k,
         "east_m": 5.5 * k, "tvd_m": 6.5 * k, "dogleg_severity_deg_per_30m": 7.5 * k,
         "uncertainty": {"north_m": 0.085 * k, "east_m": 0.095 * k, "tvd_m": 0.105 * k}}
        for k in (0, 1)
    ]  # fmt: skip
    whole = {
        "read_as": "stations of x.csv", "warnings": [{"kind": "dip", "text": "odd"}], "site": SITE,
        "method": "tangential",
        "instrument": "relay", "north": "grid", "depth_reference": "collar", "height_datum": "NN", "sigma": 2.0,
        "read_from": {"depth_reference": "rotary", "height_m": 4.25}, "file": "x.csv", "stations": stations,
        "at": [{"md_m": 1.25, "north_m": 0.1, "east_m": 0.2, "tvd_m": 0.3}], "closure_m": 7.12345,
        "closure_azimuth_deg": 8.125,
        "sources": [{"source": "N", "north_m": 0.01, "east_m": 0.02, "tvd_m": 0.03}],
    }  # fmt: skip
    return whole | change


def test_a_survey_line_by_line() -> None:
    lines = printed(show_survey, survey_result())
    assert lines[:3] == ["stations of x.csv", "WARNING (dip): odd", SITE_LINE]
    frame = "grid north, depth from collar (read from rotary, 4.25 m above it), height above NN"
    title = f"x.csv: tangential, relay, {frame}, 2 sigma"
    assert title in " ".join(line.strip() for line in lines)
    assert [cells(line) for line in lines if "│" in line] == [
        ["0", "0.00", "0.00", "0.00", "0.0000", "0.0000", "0.0000", "0.00", "0.000", "0.000", "0.000"],
        ["1", "1.50", "2.50", "3.50", "4.5000", "5.5000", "6.5000", "7.50", "8.500", "9.500", "10.500"],
        ["N", "1.0000", "2.0000", "3.0000"],
    ]
    assert "at 1.25 m: 0.1000 0.2000 0.3000 m" in lines
    assert "closure 7.1235 m towards 8.12 deg" in lines
    same = {"depth_reference": "collar", "height_m": 4.25}
    assert brought_words(survey_result(read_from=same)) == ""


def test_a_clearance_line_by_line() -> None:
    row = {
        "md_m": 1.5, "offset_md_m": 2.5, "distance_m": 3.5, "sigma_m": 4.5, "factor": 5.5, "independent_factor": 6.5,
    }  # fmt: skip
    nearest = {key: value + 0.25 for key, value in row.items()}
    result = {"stations": [row], "warnings": [], "site": SITE, "clear": True, "least": row, "nearest": nearest}
    lines = printed(show_clearance, result, "a from b")
    assert [cells(line) for line in lines if "│" in line] == [["1.500", "2.500", "3.500", "4.500", "5.500", "6.500"]]
    assert lines[-3:] == [
        SITE_LINE,
        "clear: least factor 5.50, 3.50 m apart at 1.50 m, 2.50 m of the other hole",
        "nearest: 3.75 m apart at 1.75 m, 2.75 m of the other hole",
    ]


def column_result() -> dict[str, Any]:
    def off(cm: float) -> dict[str, float]:
        return {
            "deviation_cm": cm, "sigma_cm": cm + 0.25, "direction_deg": cm + 1.0, "md_m": cm + 2.0,
            "used_percent": cm + 3.0,
        }  # fmt: skip

    column = {
        "worst": off(1.5),
        "projection": off(7.5),
        "ahead": {"within_percent": 87.6, "half_width_cm": 3.25},
    }
    return {"column": column, "alarms": [{"kind": "deviation", "level_percent": 50, "md_m": 9.25}]}


def test_where_a_column_is_line_by_line() -> None:
    assert printed(show_column, column_result()) == [
        "column worst           1.5 ± 1.75 cm towards 2 deg at 3.5 m, 4 % of the tolerance",
        "column projection      7.5 ± 7.75 cm towards 8 deg at 9.5 m, 10 % of the tolerance",
        "column ends            ± 3.2 cm (95 %), within its limit with 88 %",
        "alarm  deviation       50 % of the tolerance at 9.2 m",
    ]
    nothing = {"column": {"worst": None, "projection": None, "ahead": None}, "alarms": []}
    assert printed(show_column, nothing) == []


def test_a_calibration_in_the_field_names_the_block_of_before_and_the_one_after() -> None:
    tube = {
        "tube": 3, "hash_before": "0123456789", "hash": "abcdefghij", "version": 7, "restarted": True,
        "hash_after_restart": "klmnopqrst",
    }  # fmt: skip
    errors = {"before": 0.12345, "after": None}
    told = {"inclination_rms_deg": errors, "tubes": [tube, tube | {"tube": 12, "restarted": False}]}
    assert printed(show_calibration, told) == [
        "calibration, inclination_rms_deg: before 0.1235, after -",
        "tube 3   block 01234567 -> abcdefgh version 7, after its power cut klmnopqr",
        "tube 12  block 01234567 -> abcdefgh version 7",
    ]


def test_a_run_ends_with_its_figures_alarms_counts_and_files() -> None:
    result = column_result() | {
        "stations": [], "figures": {"azimuth_rms_deg": 0.12345, "nees_by_hop": [1.0, None, 2.5]},
        "rig_alarms": [{"code": "queue", "subject": "tube 3", "detail": "2 dropped"}], "processes": 5,
        "measurements": 17, "rig_s": 123.4, "wall_s": 5.67, "digest": "d1",
        "calibration": {"inclination_rms_deg": {}, "tubes": []},
    }  # fmt: skip
    lines = printed(show_result, result, Path("out/run-1"))
    assert [line.rstrip() for line in lines[lines.index("azimuth_rms_deg        0.1235") :]] == [
        "azimuth_rms_deg        0.1235",
        "nees_by_hop            1.0000 - 2.5000",
        *printed(show_column, result),
        "alarm  queue           tube 3: 2 dropped",
        "calibration, inclination_rms_deg:",
        "0 stations, 17 measurements, 5 processes, 123 s of rig time in 5.7 s",
        "digest d1",
        "files  out/run-1",
    ]
    assert any("0 measurements" not in line and "one process" in line for line in
               printed(show_result, result | {"processes": 1}, Path("f")))  # fmt: skip


def setup_row(item: str, **more: Any) -> dict[str, Any]:
    usual = {
        "item": item, "kind": item, "told": False, "missing": False, "toe_cm": 1.0, "unit": "deg", "way": "across",
        "sigma": 0.5, "detail": "by design", "check": "",
    }  # fmt: skip
    return usual | more


def test_a_check_names_what_is_missing_unchecked_wrong_and_assumed() -> None:
    items = [
        setup_row("north", check="not checked: a second bearing is"),
        setup_row("joint.4-3", missing=True, toe_cm=50.0),
        setup_row("mount.1", kind="mount", toe_cm=3.0, unit="1"),
        setup_row("mount.2", kind="mount", toe_cm=4.0, unit="1"),
        setup_row("length.2", kind="length", toe_cm=2.34, unit="m", way="along", sigma=0.0012345),
        setup_row("stick_up", told=True, toe_cm=9.0),
        setup_row("gravity", toe_cm=0.049),
    ]
    found = setup_check.SetupCheck(False, ["joint.4-3"], ["north"], ["depth stands"], "tell joint", "nothing", items)
    assert check_command.check_text(found).split("\n") == [
        "NOT READY TO DRILL",
        "missing  joint.4-3",
        "check    north, not checked: a second bearing is",
        "wrong    depth stands",
        "assumed  north ± 0.5 deg, by design: 1.0 cm at the toe",
        "assumed  mount of 2 tubes ± 0.5, by design: 5.0 cm at the toe",
        "assumed  length.2 ± 0.0012345 m, by design: 2.3 cm at the toe along the hole",
        "next     tell joint",
        "no sigma nothing",
    ]


@pytest.mark.parametrize(("is_ready", "status"), [(True, 0), (False, 1)])
@pytest.mark.parametrize("form", [[], ["--json"]])
def test_the_status_of_a_check_says_whether_a_rig_is_ready(
    monkeypatch: pytest.MonkeyPatch, is_ready: bool, status: int, form: list[str]
) -> None:
    found = setup_check.SetupCheck(is_ready, [], [], [], "", "", [])
    monkeypatch.setattr(setup_check, "check_scenario", lambda file, seed: found)
    assert ran(check_command.check, "wellbore-1", *form).exit_code == status


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
    done = ran(record_command.record, str(tmp_path / "shift.mcap"))
    assert done.stderr.splitlines() == told


def test_a_merge_says_what_each_has_had_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    twice = tuple((tube, 100 + tube) for tube in range(1, 8))
    done = DatabaseMerge(shared=11, first_alone=22, second_alone=33, stands=44, damaged=5, twice=twice)
    monkeypatch.setattr("groundstation.service.disk.merged_database.merge_databases", lambda *_given: done)
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
    first, second, into = (str(tmp_path / name) for name in ("a", "b", "c"))
    told = ran(merge_command.merge, first, second, "--into", into)
    named = ", ".join(f"number {100 + tube} of tube {tube}" for tube in range(1, 6))
    text = " ".join(told.output.split())
    assert f"{into}: 11 messages of both, 22 of {first} alone, 33 of {second} alone; 44 stands of the bit more" in text
    assert "5 messages are damaged and were left out" in text
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


def reply(key: str, payload: bytes = b"", error: str | None = None) -> QueryReply:
    return QueryReply(key=key, payload=payload, error=error)


A, B = reply("borechain/a/ground/status", b'{"x": 1}'), reply("borechain/b/ground/status", b'{"x": 2}')
WRONG, LATE = reply("", error="no such path"), reply("", error="Timeout")


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
    done = ran(query, "borechain/*/ground/status", "--json")
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


# files that land


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
    with pytest.raises(EnvironmentFault, match="draft: No space left on device; nothing was written"):
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


@pytest.mark.parametrize("has_temperature", [True, False])
def test_a_record_for_a_node_has_times_rates_forces_and_temperature_in_this_order(has_temperature: bool) -> None:
    record = SimpleNamespace(
        times=lambda: np.array([0.5, 0.6]),
        triad=lambda name: np.full((2, 3), {"gyroscope": 1.0, "accelerometer": 2.0}[name]) + np.arange(3) / 10.0,
        temperature=np.array([30.0, 31.0]) if has_temperature else None,
    )
    found = np.load(io.BytesIO(node_array(record)))  # type: ignore[arg-type]
    assert found[1].tolist() == [0.6, 1.0, 1.1, 1.2, 2.0, 2.1, 2.2] + ([31.0] if has_temperature else [])


def test_a_study_keeps_a_file_a_table_and_shows_an_interval_in_a_cell(tmp_path: Path) -> None:
    columns = (("low", "low"), ("hop", "hop"))
    tables = (
        ResultTable("first of {experiment}", columns, (("hop", "hop"), ("interval", "95 %")), "cases"),
        ResultTable("second", columns, (), "others", "-more"),
        ResultTable("third", (), (("hop", "hop"),), "others"),
    )
    result = {
        "experiment": "x",
        "cases": [{"hop": 1, "low": 0.91234, "high": 1.2345}, {"hop": 2, "low": 0.5, "high": 12.5}],
        "others": [{"hop": 7, "low": 3.0, "high": 4.0}],
    }
    study: Any = SimpleNamespace(tables=tables, drawn=False, verdicts=lambda _result: ["it holds"])
    write_study(study, result, tmp_path)
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "x.csv": "low,hop\n0.9123,1\n0.5,2\n", "x-more.csv": "low,hop\n3,7\n",
    }  # fmt: skip
    lines = printed(show_study, study, {}, result)
    assert [cells(line) for line in lines if "│" in line] == [["1", "0.912-1.23"], ["2", "0.5-12.5"], ["7"]]
    assert [line.strip() for line in lines if line.strip() in ("first of x", "second", "third")] == [
        "first of x", "third",
    ]  # fmt: skip
    assert lines[-1] == "it holds"


# options, and what is reckoned of many


@pytest.mark.parametrize(
    ("text", "speed"),
    [("max", float("inf")), ("0.5", 0.5), ("1000", 1000.0), ("0", None), ("1000.1", None), ("x", None)],
)  # fmt: skip
def test_a_speed_is_above_nothing_and_up_to_a_thousand(text: str, speed: float | None) -> None:
    with contextlib.nullcontext() if speed is not None else pytest.raises(Exception, match="expected max or"):
        assert parse_speed(None, None, text) == speed  # type: ignore[arg-type]


@pytest.mark.parametrize(("seed", "numbers"), [(None, [5, 6, 7]), (0, [0]), (9, [9])])
def test_seeds_are_as_many_as_asked_for_from_the_first_on(seed: int | None, numbers: list[int]) -> None:
    assert GauntletRequest(3, 5, seed, None, None, "minute", None, False, False).numbers == numbers


def test_a_gauntlet_tells_how_many_a_minute_of_one_core() -> None:
    said = "30 seeds, 2 failed, 20 a minute of one core"
    assert printed(lambda: _show_figures(30, 2, 90.0, None, as_json=False)) == [said]
    assert printed(lambda: _show_figures(30, 2, 90.0, 7, as_json=False)) == [f"{said}, 7 pairs of facts"]
    figures = {"seeds": 30, "failed": 2, "cpu_s": 91.23, "runs_per_cpu_minute": 19.7}
    (line,) = printed(lambda: _show_figures(30, 2, 91.234, None, as_json=True))
    assert json.loads(line) == figures
    (line,) = printed(lambda: _show_figures(30, 2, 91.234, 7, as_json=True))
    assert json.loads(line) == figures | {"pairs": 7}


@pytest.mark.parametrize(
    ("view", "inline", "quiet", "on_terminal", "has_textual", "found"),
    [
        (None, False, True, True, True, ""), ("bar", False, True, True, True, ""),
        ("log", True, False, True, True, "log"), (None, False, False, False, True, "log"),
        (None, True, False, False, True, "log"),
        (None, True, False, True, True, "bar"), (None, False, False, True, True, "crew"),
        (None, False, False, True, False, "bar"), ("crew", False, False, False, True, "crew"),
        ("crew", True, False, True, True, None),
    ],
)  # fmt: skip
def test_what_is_shown_while_a_rig_drills(
    monkeypatch: pytest.MonkeyPatch,
    view: str | None,
    inline: bool,
    quiet: bool,
    on_terminal: bool,
    has_textual: bool,
    found: str | None,
) -> None:
    monkeypatch.setattr("borechain.cli.rig.rig_command.find_spec", lambda _name: object() if has_textual else None)
    asked = partial(chosen_view, view, inline=inline, quiet=quiet, on_terminal=on_terminal)
    if found is None:
        with pytest.raises(InputFault, match="--view crew"):
            asked()
    else:
        assert asked() == found


def test_a_ratio_is_that_of_ours_to_the_peers_and_slower_above_one() -> None:
    row = compare_rounds([3.0, 6.0, 9.0], [1.0, 2.0, 3.0])
    assert (row["ours"], row["peer"], row["slower"], row["ratio"]) == (6.0, 2.0, 3.0, pytest.approx(1.0 / 3.0))
    assert row["slower_interval"] == [3.0, 3.0]


def test_latencies_are_told_in_milliseconds_the_median_first() -> None:
    found = latency_quantiles([0.001 * k for k in range(1, 102)])
    assert found == {"count": 101, "p50": 51.0, "p99": 100.0, "max": 101.0}
    assert latency_quantiles([]) == {"count": 0, "p50": None, "p99": None, "max": None}


class Streaming:
    """A ground station whose rows a test makes; what is asked for is noted."""

    def __init__(self) -> None:
        self.rows: list[int] = []
        self.asked: list[str] = []
        self.call: Callable[[str, bytes], object] = lambda _key, _payload: None

    def view(self, numbers: list[int]) -> bytes:
        newest = self.rows[-1] if self.rows else 0
        return json.dumps({"newest": newest, "events": [{"seq": number} for number in numbers]}).encode()

    def get(self, selector: str, timeout: float) -> list[QueryReply]:
        del timeout
        self.asked.append(selector)
        since = int(re.search(r"since=(\d+)", selector)[1])  # type: ignore[index]
        return [reply(selector, self.view([number for number in self.rows if number > since]))]

    def subscribe(self, key: str, call: Callable[[str, bytes], object]) -> None:
        self.call = call
        del key

    def publish(self, *numbers: int) -> None:
        self.rows += [number for number in numbers if not self.rows or number > self.rows[-1]]
        self.call("borechain/rig-1/ground/events", self.view(list(numbers)))


def test_a_stream_gives_each_row_once_asks_for_what_it_missed_and_begins_anew_after_a_restart() -> None:
    bus = Streaming()
    bus.rows = [1, 2, 3]
    stream = Ground(bus, "rig-1").stream("events", since=1, timeout=0.01)  # type: ignore[arg-type]
    assert [next(stream)["seq"] for _ in range(2)] == [2, 3]
    bus.publish(4)
    bus.publish(4)  # said twice
    bus.rows += [5]  # never came
    bus.publish(6)
    assert [next(stream)["seq"] for _ in range(3)] == [4, 5, 6]
    assert len(bus.asked) == 2
    bus.rows = []
    bus.publish(1)
    bus.publish(2)
    assert [row["seq"] for row in stream] == [1, 2]
    assert bus.asked[0] == "borechain/rig-1/ground/events?since=1"
    ground = Ground(bus, "rig-1")  # type: ignore[arg-type]
    with contextlib.suppress(KeyError, TypeError):
        ground.ask("events", since=2, points=3)
    assert bus.asked[-1] == "borechain/rig-1/ground/events?since=2;points=3"
    assert threading.active_count() >= 1
