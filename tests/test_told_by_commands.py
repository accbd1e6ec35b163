"""What commands print and write, read off their output: which number stands in which column, and what is left out."""

from __future__ import annotations

import contextlib
import io
import itertools
import math
import queue
import re
import threading
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import click
import numpy as np
import pytest
from printed_output import cells, printed, wall_result

from borechain import api, setup_check
from borechain.cli.bench.bench import duration_text
from borechain.cli.console_tables import cell_text
from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.ground.query import next_sample
from borechain.cli.pki.pki import read_line
from borechain.cli.rig.shown_result import show_result
from borechain.cli.survey.clearance_command import show_clearance
from borechain.cli.survey.survey import SOURCES_SHOWN, show_survey
from borechain.cli.survey.wall_command import SHOWN, show_wall
from borechain.cli.whole_files import check_suffix, write_whole
from borechain.load.crowd import DRILLING_S, ROUND_S
from borechain.load.day import ADVANCE, ADVANCES, TUBE_LENGTH, depth_of
from borechain.load.killed import KillOutcome, count_losses
from borechain.load.learning import Figure
from borechain.load.page import DRILLED_M, speed_of
from groundstation.service.alarms.verdict_words import VerdictDoubt
from groundstation.service.disk.ground_store import Store
from groundstation.survey.requests.survey_request import FrameRequest, SiteFigures, SurveyRequest
from groundstation.survey.well.methods import Method
from telemetry.messages import ENCODER, Event, NodeFlag, Severity

ROOT = Path(__file__).parents[1]
RECORD = ROOT / "scenarios" / "wellbore-1-path.csv"


@pytest.fixture(scope="module")
def surveyed() -> dict[str, Any]:
    request = SurveyRequest(file=RECORD, site=SiteFigures(), frame=FrameRequest())
    result: dict[str, Any] = api.answer_survey(request).result
    return result


def test_a_survey_prints_every_number_of_its_answer_in_its_column(surveyed: dict[str, Any]) -> None:
    lines = printed(show_survey, surveyed)
    row, last = surveyed["stations"][-1], max(k for k, line in enumerate(lines) if cells(line)[:1] == ["10"])
    u = row["uncertainty"]
    assert len({round(u[key], 9) for key in ("north_m", "east_m", "tvd_m")}) == 3
    assert cells(lines[last]) == [
        "10", f"{row['md_m']:.2f}", f"{row['inclination_deg']:.2f}", f"{row['azimuth_deg']:.2f}",
        f"{row['north_m']:.4f}", f"{row['east_m']:.4f}", f"{row['tvd_m']:.4f}",
        f"{row['dogleg_severity_deg_per_30m']:.2f}",
        f"{100 * u['north_m']:.3f}", f"{100 * u['east_m']:.3f}", f"{100 * u['tvd_m']:.3f}",
    ]  # fmt: skip
    assert math.hypot(row["north_m"], row["east_m"]) == pytest.approx(surveyed["closure_m"], rel=1e-9)
    towards = math.degrees(math.atan2(row["east_m"], row["north_m"])) % 360.0
    assert f"closure {surveyed['closure_m']:.4f} m towards {towards:.2f} deg" in lines


def test_a_survey_prints_the_largest_sources_and_every_warning(surveyed: dict[str, Any]) -> None:
    sources = [
        {"source": f"S{k:02}", "north_m": 1.0 / (k + 1), "east_m": 0.02, "tvd_m": 0.003}
        for k in range(SOURCES_SHOWN + 4)
    ]
    warnings = [{"kind": "range", "text": f"row {k} is odd"} for k in range(3)]
    lines = printed(show_survey, surveyed | {"sources": sources, "warnings": warnings})
    shown = [cells(line) for line in lines if cells(line) and re.fullmatch(r"S\d\d", cells(line)[0])]
    assert [row[0] for row in shown] == [f"S{k:02}" for k in range(SOURCES_SHOWN)]
    assert shown[1] == ["S01", "50.0000", "2.0000", "0.3000"]
    assert [line for line in lines if line.startswith("WARNING")] == [
        f"WARNING (range): row {k} is odd" for k in range(3)
    ]


def test_a_method_that_is_asked_for_is_used_and_the_site_is_that_of_the_command() -> None:
    """The two methods of a straight line between stations part by their curvature."""
    for method in (Method.MINIMUM_CURVATURE, Method.TANGENTIAL):
        assert api.survey(RECORD, method=method.value).method is method
    one, other = (api.survey(RECORD, method=m.value) for m in (Method.MINIMUM_CURVATURE, Method.TANGENTIAL))
    assert abs(one.positions[-1] - other.positions[-1]).max() > 1e-3
    request = SurveyRequest(file=RECORD, instrument="GYRO-NS-CT", site=SiteFigures(), frame=FrameRequest())
    command = api.answer_survey(request).found
    library = api.survey(RECORD, instrument="GYRO-NS-CT")
    depth = float(library.md[-1])
    np.testing.assert_allclose(library.covariance_at(depth), command.covariance_at(depth), rtol=1e-9)


def test_a_wall_prints_the_most_doubtful_joints_first_and_the_newest_days() -> None:
    lines = printed(show_wall, wall_result())
    names = [cells(line)[0] for line in lines if cells(line) and re.fullmatch("[A-D]-[B-E]", cells(line)[0])]
    assert names == ["C-D", "B-C", "D-E", "A-B"]  # one without a thickness is worse than any that has one
    assert any(line.endswith("; 2 columns beyond their tolerance") for line in lines)
    days = [line.split(":")[0] for line in lines if line.startswith("2026-05-")]
    assert days == [f"2026-05-{k:02}" for k in range(4, SHOWN + 4)]


@pytest.mark.parametrize(("shared", "independent", "decides"), [(1.4, 0.8, "0.80"), (0.7, 1.9, "0.70")])
def test_the_smaller_of_two_factors_decides_over_a_clearance(shared: float, independent: float, decides: str) -> None:
    least = {"distance_m": 1.5, "md_m": 10.0, "offset_md_m": 11.0, "factor": shared, "independent_factor": independent}
    site = api.answer_survey(SurveyRequest(file=RECORD, site=SiteFigures(), frame=FrameRequest())).result["site"]
    result = {"stations": [], "warnings": [], "site": site, "clear": False, "least": least, "nearest": least}
    lines = printed(show_clearance, result, "a from b")
    assert f"TOO NEAR: least factor {decides}, 1.50 m apart at 10.00 m, 11.00 m of the other hole" in lines


def test_a_run_prints_its_stations_above_the_truth_in_centimetres_and_degrees() -> None:
    truth = {"inclination_deg": 1.111, "azimuth_deg": 222.22, "north_m": 0.1234, "east_m": -0.5678, "tvd_m": 9.8765}
    station = {key: value + 0.001 for key, value in truth.items()} | {
        "truth": truth, "station": 4, "md_m": 10.0, "measurements": 7, "sigma_north_m": 0.0123, "sigma_east_m": 0.0456,
    }  # fmt: skip
    column = {"worst": None, "projection": None, "ahead": None}
    result = {
        "stations": [station], "figures": {}, "column": column, "alarms": [], "rig_alarms": [], "processes": 1,
        "measurements": 7, "rig_s": 100.0, "wall_s": 1.0, "digest": "d",
    }  # fmt: skip
    rows = [cells(line) for line in printed(show_result, result, Path("f")) if "10.00" in line or "222.22" in line]
    assert rows[0] == ["4", "10.00", "7", "1.112", "222.22", "0.1244", "-0.5668", "9.8775", "1.230", "4.560"]
    assert rows[1] == ["1.111", "222.22", "0.1234", "-0.5678", "9.8765"]


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (3.14159265, "3.142"), (0.000123456, "0.0001235"), (12345678.0, "1.235e+07"), (12345678, "12345678"),
     ("x", "x"), (True, "True")],
)  # fmt: skip
def test_a_table_has_four_digits_of_a_number(value: Any, text: str) -> None:
    assert cell_text(value) == text


@pytest.mark.parametrize(
    ("value", "text"),
    [(None, ""), (9.994e-4, "999.4 us"), (1e-3, "1.00 ms"), (0.99994, "999.94 ms"), (1.0, "1.00 s"), (12.5, "12.50 s")],
)
def test_a_time_has_the_unit_of_its_size(value: float | None, text: str) -> None:
    assert duration_text(value) == text


def test_a_file_is_the_old_one_until_it_is_the_whole_new_one(tmp_path: Path) -> None:
    path = tmp_path / "deep" / "table.csv"
    write_whole(path, "old")
    reader = path.open()  # who reads it goes on with what was there
    before = path.stat().st_ino
    write_whole(path, b"new and longer")
    assert reader.read() == "old"
    reader.close()
    assert path.stat().st_ino != before
    assert path.read_bytes() == b"new and longer"
    assert [one.name for one in path.parent.iterdir()] == ["table.csv"]
    (tmp_path / "folder").mkdir()
    with pytest.raises(EnvironmentFault, match="choose a writable place"):
        write_whole(tmp_path / "folder", "text")
    assert sorted(one.name for one in tmp_path.iterdir()) == ["deep", "folder"]


@pytest.mark.parametrize(("name", "is_taken"), [("a.svg", True), ("a.SVG", True), ("a.Pdf", True), ("a.svgz", False)])
def test_a_suffix_may_be_written_in_capitals(name: str, is_taken: bool) -> None:
    with contextlib.nullcontext() if is_taken else pytest.raises(InputFault):
        check_suffix("--plot", Path(name), ".svg", ".pdf")


@pytest.mark.parametrize(("line", "password"), [(" a b \n", " a b "), ("x\t\r\n", "x\t"), ("", ""), ("y", "y")])
def test_a_password_is_all_of_its_line(monkeypatch: pytest.MonkeyPatch, line: str, password: str) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO(line))
    assert read_line() == password


def test_what_is_published_late_comes_within_the_time_that_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    """A minute of patience, of which the first silence is a part; a clock that a test moves."""
    waits: list[float | None] = []
    now = [0.0]

    class Silent(queue.SimpleQueue):  # type: ignore[type-arg]
        def get(self, block: bool = True, timeout: float | None = None) -> Any:
            waits.append(timeout)
            now[0] += timeout or 0.0
            raise queue.Empty

    monkeypatch.setattr("borechain.cli.ground.query.time.monotonic", lambda: now[0])
    with pytest.raises(EnvironmentFault, match="nothing was published within 60 s"):
        next_sample(Silent(), "borechain/**", 60.0)
    assert sum(wait or 0.0 for wait in waits) == pytest.approx(60.0)
    assert threading.active_count() >= 1


# before a rig starts


@pytest.mark.parametrize(("is_ready", "wrong", "found"), [(True, [], True), (True, ["x"], False), (False, [], False)])
def test_a_rig_is_ready_where_nothing_is_missing_and_nothing_wrong(
    is_ready: bool, wrong: list[str], found: bool
) -> None:
    setup = {"ready": is_ready, "missing": ["north"], "unchecked": ["u"], "todo": "t", "left_out": "l", "items": [{}]}
    answer = setup_check.check_of(setup, wrong)
    assert (answer.ready, answer.wrong, answer.missing, answer.unchecked) == (found, wrong, ["north"], ["u"])


def test_of_a_live_rig_what_surveys_mend_is_not_wrong_and_the_rest_is() -> None:
    doubts = [VerdictDoubt.NO_SURVEY, *(one for one in VerdictDoubt if one not in setup_check.LATER)]
    views = {
        "setup": {"ready": True, "missing": [], "unchecked": [], "todo": "", "left_out": "", "items": []},
        "verdict": {"doubts": doubts, "why": [f"because {k}" for k in range(len(doubts))]},
    }
    answer = setup_check.check_live_rig(SimpleNamespace(ask=views.__getitem__))  # type: ignore[arg-type]
    assert answer.wrong == [f"because {k}" for k in range(1, len(doubts))]
    assert not answer.ready
    assert NodeFlag.LOWER_UNTOLD != NodeFlag.DRIVE_UNTOLD


# what a load is told by


def test_the_bit_of_a_day_goes_down_until_the_last_tube_has() -> None:
    for tubes in (5, 50):
        depths = [depth_of(tubes, k) for k in range(ADVANCES + 1)]
        assert all(later - before == pytest.approx(ADVANCE) for before, later in itertools.pairwise(depths))
        assert depths[0] >= TUBE_LENGTH
    assert depth_of(50, ADVANCES) == pytest.approx(50 * TUBE_LENGTH)


@pytest.mark.parametrize("seconds", [100.0, 150.0, 3600.0])
def test_every_round_drills_a_whole_part_of_a_tube_and_all_no_more_than_there_is_room(seconds: float) -> None:
    drilled, rounds = speed_of(seconds) * DRILLING_S, math.ceil(seconds / ROUND_S)
    assert TUBE_LENGTH / drilled == pytest.approx(round(TUBE_LENGTH / drilled))
    assert drilled * rounds <= DRILLED_M + 1e-9


def test_events_that_are_lost_or_kept_twice_are_counted(tmp_path: Path) -> None:
    url = f"sqlite:///{tmp_path / 'rig.db'}"
    with contextlib.closing(Store(url)) as store:
        for number in (1, 2, 3, 3, 5):
            count = len(list(store.messages()))
            store.add_message(Event(ENCODER, number, float(count), Severity.INFO, "stopped"), None)
        store.add_message(Event(7, 4, 1.0, Severity.INFO, "stopped"), None)
    outcome = KillOutcome(handed=6)
    count_losses(outcome, url)
    assert (outcome.lost, outcome.doubled, outcome.is_whole) == (2, 1, False)  # 4 and 6


@pytest.mark.parametrize(("p99", "holds"), [(0.99, True), (1.0, True), (1.01, False)])
def test_a_figure_holds_by_its_99th_percentile(p99: float, holds: bool) -> None:
    assert Figure("x", "ms", 0.5 * p99, p99, 3.0 * p99, 10, 1.0).row["holds"] == holds
    assert click.unstyle("x") == "x"
