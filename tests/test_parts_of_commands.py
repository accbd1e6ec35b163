"""Parts of commands from plain arguments: requests of a siege, weights of an hour, what a fault let be seen."""

from __future__ import annotations

import contextlib
import json
import math
import socket
import sqlite3
import tempfile
import threading
import tomllib
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from click.testing import CliRunner
from hypothesis import given, settings
from messages_of_schema import messages
from printed_output import cells, printed

from borechain.cli.bench.hour_command import show_process_weights, write_hour_files
from borechain.cli.calibrate.apply_command import _rows_of, _show, _table_of
from borechain.cli.calibrate.apply_command import apply as apply_command
from borechain.cli.calibrate.linear import attitudes, turntable
from borechain.cli.campaign.campaign import campaign
from borechain.cli.faults import InputFault
from borechain.cli.link.chip_command import show_counts
from borechain.cli.survey.survey_options import SurveyFiles, list_tools, parse_constants
from borechain.gauntlet.fault_observability import FaultObservability
from borechain.load import doors
from borechain.load.hour import Scales, Weight, scenario_text
from borechain.load.hour_figure import hour_figure
from groundstation.calibration.applied_series import AppliedSeries
from groundstation.gateway.page.page_settings import PageSettings
from sim.world.scenario import scenario_of
from telemetry.frozen import replace
from telemetry.messages import BASE, ENCODER, SurveyMeasurement
from telemetry.presentation.msgpack_codec import encode_message


def test_what_a_chip_carried_is_told_by_name() -> None:
    assert show_counts({}) == "carried: nothing"
    assert show_counts({"sent": 3, "errors": 0, "heard": 12}) == "carried: errors 0, heard 12, sent 3"


@pytest.mark.parametrize("word", ["x", "x=", "=1", "x=nan", "x=inf", "1x=2", "a b=1", "x=1=2"])
def test_a_constant_is_a_name_and_a_number(word: str) -> None:
    assert parse_constants(None, None, ("a=1.5", " b =-2")) == {"a": 1.5, "b": -2.0}  # type: ignore[arg-type]
    with pytest.raises(InputFault, match="--parameter: expected NAME=VALUE with a number"):
        parse_constants(None, None, ("a=1", word))  # type: ignore[arg-type]


def test_every_error_model_is_listed_with_its_title() -> None:
    command = click.Command(
        "t", params=[click.Option(["--tools"], is_flag=True, callback=list_tools, expose_value=False)]
    )
    lines = CliRunner().invoke(command, ["--tools"]).output.splitlines()
    told = {line[:28].strip(): line[29:] for line in lines}
    assert len(told) == len(lines) > 30
    assert all(told.values())
    assert any(title.startswith("OWSG: ") for title in told.values())
    assert not told["relay"].startswith("OWSG")


@pytest.mark.parametrize(
    ("name", "wrong", "right"),
    [
        ("out", "a.txt", "a.csv"),
        ("by_source", "a.json", "a.csv"),
        ("plot", "a.csv", "a.svg"),
        ("export_tool", "a.toml", "a.json"),
        ("report", "a.svg", "a.pdf"),
    ],
)
def test_a_file_of_a_survey_has_its_suffix(name: str, wrong: str, right: str) -> None:
    none = dict.fromkeys(("out", "by_source", "plot", "export_tool", "report"))
    request: Any = SimpleNamespace(programme=None)
    SurveyFiles(**none | {name: Path(right)}).check(request)
    with pytest.raises(InputFault, match=f"--{name.replace('_', '-')} {wrong}: expected a name that ends in"):
        SurveyFiles(**none | {name: Path(wrong)}).check(request)
    if name == "export_tool":
        with pytest.raises(InputFault, match="programme"):
            SurveyFiles(**none | {name: Path(right)}).check(SimpleNamespace(programme=Path("p")))  # type: ignore[arg-type]


def test_a_siege_is_what_it_says_and_is_not_read() -> None:
    heard: list[bytes] = []
    with socket.create_server(("127.0.0.1", 0)) as door:
        door.settimeout(5.0)
        page = PageSettings("127.0.0.1", door.getsockname()[1])
        with doors.standing_in_the_door(doors.Siege(half_open=2, streams=1, wrong=1, asks=0), page):
            taken = [door.accept()[0] for _ in range(4)]
        for one in taken:
            with one:
                heard.append(b"".join(iter(lambda one=one: one.recv(4096), b"")))
    body = b'{"role": "driller", "name": "anna", "password": "not the password"}'
    assert sorted(heard) == sorted(
        [
            b"GET /api/status HTTP/1.1\r\nHost: ",
            b"GET /api/status HTTP/1.1\r\nHost: ",
            b"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n",
            b"POST /api/session HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\n"
            b"Content-Length: %d\r\n\r\n%s" % (len(body), body),
        ]
    )


def test_who_is_signed_in_asks_each_in_turn_and_a_refusal_counts_as_the_longest_wait(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked: list[tuple[str, str | None]] = []

    class Page(BaseHTTPRequestHandler):
        def do_GET(self) -> None:
            asked.append((self.path, self.headers["cookie"]))
            self.send_response(503 if len(asked) == 2 else 200)
            self.end_headers()

        def do_POST(self) -> None:
            given = json.loads(self.rfile.read(int(self.headers["content-length"])))
            self.send_response(200 if given == {"role": "driller", "name": "anna", "password": "p"} else 401)
            self.send_header("set-cookie", "s=1; Path=/")
            self.end_headers()

        def log_message(self, *words: object) -> None:
            del words

    monkeypatch.setattr(doors, "ASK_EVERY_S", 0.0)
    with HTTPServer(("127.0.0.1", 0), Page) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        page = PageSettings("127.0.0.1", server.server_port)
        assert doors.sign_in(page, "p") == "s=1"
        assert doors.sign_in(page, "q") is None
        times = doors.answer_times(page, "s=1", 3)
        server.shutdown()
    assert asked == [("/api/session", "s=1"), ("/api/status", "s=1"), ("/api/session", "s=1")]
    assert [took == doors.ANSWER_S for took in times] == [False, True, False]
    assert doors.sign_in(PageSettings("127.0.0.1", page.port), "p") is None  # nothing is served there any more


WEIGHTS = [
    Weight(0.0, "a", 1.0, 2, 0.0, 0), Weight(0.0, "base", 3.0, 4, 5.0, 0), Weight(1.0, "a", 6.0, 7, 0.0, 0),
    Weight(1.0, "base", 8.0, 9, 10.0, 11), Weight(6.1, "a", 12.0, 13, 0.0, 0), Weight(6.1, "base", 14.0, 15, 16.0, 17),
]  # fmt: skip


def test_an_hour_is_shown_after_a_sixth_and_at_its_end_and_kept_whole(tmp_path: Path) -> None:
    rows = [cells(line) for line in printed(show_process_weights, WEIGHTS)]
    shown = [row for row in rows if len(row) == 6 and row[0] != "hours"]
    assert shown == [
        ["1", "a", "6", "7", "0", "0"], ["1", "base", "8", "9", "10", "11"],
        ["6.1", "a", "12", "13", "0", "0"], ["6.1", "base", "14", "15", "16", "17"],
    ]  # fmt: skip
    write_hour_files(WEIGHTS, tmp_path / "made")
    lines = (tmp_path / "made" / "hour.csv").read_text().splitlines()
    assert lines[0] == "hours,process,private_mb,handles,database_kb,surveys"
    assert lines[4] == "1,base,8,9,10,11"
    assert (tmp_path / "made" / "hour.svg").read_bytes().startswith(b"<?xml")
    memory, handles, database = hour_figure(WEIGHTS).axes
    for axes, key in ((memory, "private_mb"), (handles, "handles")):
        for line, name in zip(axes.lines, ("a", "base"), strict=True):
            assert line.get_xdata().tolist() == [0.0, 1.0, 6.1]
            assert line.get_ydata().tolist() == [getattr(one, key) for one in WEIGHTS if one.process == name]
    (line,) = database.lines
    assert (line.get_xdata().tolist(), line.get_ydata().tolist()) == ([0, 11, 17], [5.0, 10.0, 16.0])


@pytest.mark.parametrize(("rig_s", "stops"), [(10.0, 1), (89.9, 1), (90.0, 1), (180.0, 2), (3600.0, 40)])
def test_an_hour_has_a_stop_every_ninety_seconds(rig_s: float, stops: int) -> None:
    tables = tomllib.loads(scenario_text(3, rig_s))
    file = scenario_of(tables).file
    assert (file.blocks, file.rig.tubes, file.rig.tubes_at_start) == (stops, 3, 3)
    assert file.rotation.advance_m == pytest.approx(0.8 / stops)
    assert file.schedule.add_s + file.schedule.stop_s == 90.0


@settings(max_examples=3)
@given(survey=messages(SurveyMeasurement))
def test_a_database_is_weighed_with_its_log_and_each_survey_counts_once(survey: SurveyMeasurement) -> None:
    with tempfile.TemporaryDirectory() as folder:
        weigh_database(Path(folder), survey)


def weigh_database(folder: Path, survey: SurveyMeasurement) -> None:
    path = folder / "ground.sqlite"
    scales = Scales(SimpleNamespace(running={}), path, 10.0)  # type: ignore[arg-type]
    assert scales.kept() == (0.0, 0)
    with contextlib.closing(sqlite3.connect(path)) as database:
        database.execute("create table other (a)")
        database.commit()
        assert scales.kept() == (path.stat().st_size / 1e3, 0)
        database.execute("create table messages (kind text, payload blob)")
        again = replace(survey, sequence=survey.sequence + 1)
        later = replace(survey, sequence=survey.sequence + 2, station_at=survey.station_at / 2.0 + 1.0)
        for one in (survey, again, later):
            database.execute("insert into messages values ('SurveyMeasurement', ?)", (encode_message(one),))
        database.commit()
    (folder / "ground.sqlite-wal").write_bytes(b"")
    (folder / "other").write_bytes(b"1" * 5000)
    assert scales.kept() == (path.stat().st_size / 1e3, 2)


class SeenRig:
    """A rig as its observer looks at it."""

    def __init__(self) -> None:
        self.now = 100.0
        self.world = SimpleNamespace(slipped=0, stuck_at=None, spoilers={}, depth_error=0.0)
        self.stepper = SimpleNamespace(processes={ENCODER: object()}, is_frozen=lambda address: address in self.frozen)
        self.frozen: set[int] = set()
        self.off: dict[int, float] = {}
        self.ground: object | None = object()
        self.handled = 0
        self.after_step: list[Any] = []
        self.before_cut: list[Any] = []

    def disk(self, address: int) -> Any:
        assert address == BASE
        return SimpleNamespace(handled=self.handled)

    def at(self, now: float) -> None:
        self.now = now
        for note in self.after_step:
            note()


def test_an_encoder_that_never_went_wrong_was_seen_and_one_that_slipped_unwatched_was_not() -> None:
    rig: Any = SeenRig()
    sight = FaultObservability(rig)
    rig.at(110.0)
    assert sight.has_seen
    rig.world.slipped = 5
    rig.at(120.0)
    rig.at(140.0)
    assert not sight.has_seen  # there is no tube
    assert not sight.nobody_could_know


def test_a_depth_is_believed_wrong_where_the_database_came_from_outside_meanwhile() -> None:
    for handled, error, believed in ((1, 0.5, True), (0, 0.5, False), (1, 0.0, False)):
        rig: Any = SeenRig()
        sight = FaultObservability(rig)
        rig.ground = None
        rig.at(110.0)
        rig.handled, rig.world.depth_error = handled, error
        rig.at(120.0)
        assert not sight.has_believed_a_wrong_depth  # there is no ground station yet
        rig.ground = object()
        rig.at(130.0)
        assert sight.has_believed_a_wrong_depth is believed
        rig.world.depth_error = 0.5
        rig.at(140.0)
        assert sight.has_believed_a_wrong_depth is believed  # what was handled is handled once


def test_of_a_string_that_was_turned_in_the_dark_nothing_is_known() -> None:
    for off, known in (({ENCODER: 0.0, 1: 0.0, 2: 0.0}, False), ({ENCODER: 0.0, 1: 0.0}, True)):
        rig: Any = SeenRig()
        sight = FaultObservability(rig)
        rig.off = off
        rig.world.stuck_at = 3.0
        rig.at(110.0)
        assert sight.nobody_could_know is not known


BEFORE = np.array([[3.0, 4.0, 0.0], [0.0, 0.0, 7.0], [math.nan, 0.0, 0.0]])
AFTER = np.array([[0.0, 0.0, 10.0], [6.0, 0.0, 8.0], [0.0, 10.0, 0.0]])


def test_a_series_says_mean_scatter_and_how_far_it_is_off(tmp_path: Path) -> None:
    accelerometer = AppliedSeries("accelerometer", np.array([0.0, 0.5, 1.0]), BEFORE, AFTER)
    gyroscope = AppliedSeries("gyroscope", accelerometer.times, AFTER, BEFORE)
    before, after = _rows_of(accelerometer, 9.0)
    assert (before["when"], after["when"], before["unit"]) == ("before", "after", "m/s2")
    assert before["mean"] == [1.5, 2.0, 3.5]
    assert before["std"] == [1.5, 2.0, 3.5]
    assert before["off"] == pytest.approx(math.sqrt((4.0**2 + 2.0**2) / 2.0))
    assert after["off"] == pytest.approx(1.0)
    turned = _rows_of(gyroscope, 9.0)
    assert turned[0]["off"] == pytest.approx(10.0)
    assert turned[1]["unit"] == "rad/s"
    field = AppliedSeries("magnetometer", accelerometer.times, AFTER, AFTER)
    assert [row["off"] for row in _rows_of(field, 9.0)] == [None, None]
    lines = _table_of([accelerometer, gyroscope]).decode().splitlines()
    assert lines[:2] == ["time_s,ax_mps2,ay_mps2,az_mps2,gx_rads,gy_rads,gz_rads", "0,0,0,10,3,4,0"]
    assert lines[2] == "0.5,6,0,8,0,0,7"
    told = printed(_show, [before, _rows_of(field, 9.0)[0]], [tmp_path / "a.csv"])
    rows = [cells(line) for line in told]
    assert ["accelerometer", "before", "1.5", "2", "3.5", "1.5", "2", "3.5", "3.162", "m/s2"] in rows
    assert told[-1] == f"wrote {tmp_path / 'a.csv'}"


def test_files_of_an_applied_calibration_are_all_different(tmp_path: Path) -> None:
    record, block = tmp_path / "r.csv", tmp_path / "b.json"
    for words, refusal in (
        ((record, "--calibration", block, "--out", record), "expected different files"),
        ((record, "--calibration", record), "expected different files"),
        ((record, "--calibration", block, "--calibration", block), "expected different files"),
        ((record, "--calibration", block, "--out", tmp_path / "o.txt"), "--out"),
        ((record, "--calibration", block, "--plot", tmp_path / "o.csv"), "--plot"),
    ):
        result = CliRunner().invoke(apply_command, [str(word) for word in words])
        assert result.exit_code == 2
        assert refusal in result.output
        assert "No such file" not in result.output


@pytest.mark.parametrize(
    ("words", "refusal"),
    [
        (("--scheduler", "tcp://a:1"), "--scheduler: expected with --engine dask alone"),
        (("--first", "99999999", "--runs", "2"), "expected a last run of at most 99999999"),
    ],
)
def test_runs_of_a_campaign_that_cannot_be_are_refused(words: tuple[str, ...], refusal: str) -> None:
    runs = () if "--runs" in words else ("--runs", "1")
    result = CliRunner().invoke(campaign, ["rig-3", *runs, *words])
    assert result.exit_code == 2
    assert refusal in result.output


@pytest.mark.parametrize("command", [turntable, attitudes])
def test_a_jig_has_two_standard_deviations(command: click.Command) -> None:
    option = next(one for one in command.params if one.name == "jig_deg")
    assert (option.nargs, option.required) == (2, False)
