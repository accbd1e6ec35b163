"""What the benchmarks of a ground station and a string ask for, print and end with, line by line."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner, Result
from printed_output import cells, printed

from borechain.cli.bench import bench as bench_room
from borechain.cli.bench import load, realtime
from borechain.cli.bench.bench import bench, bench_names, show_ratios
from borechain.load.hour import Weight
from borechain.load.killed import KillOutcome

FREE = ("--endpoint", "tcp/127.0.0.1:0")
LATE = {"count": 7, "p50": 1.25, "p99": 30.04, "max": 41.06}
NONE = {"count": 0, "p50": None, "p99": None, "max": None}
Given = list[Any]


def run(*words: str) -> Result:
    return CliRunner().invoke(bench, list(words))


@pytest.fixture
def measured(monkeypatch: pytest.MonkeyPatch) -> Callable[[str, Any], Given]:
    """Has a measurement answer at once; returns what it was asked."""

    def have(place: str, found: Any) -> Given:
        given: Given = []

        def measure(*words: Any) -> Any:
            given.append([word for word in words if not isinstance(word, Path)])
            return found

        monkeypatch.setattr(place, measure)
        return given

    return have


def test_a_page_under_load_is_told_with_its_memory_at_three_times(measured: Any, monkeypatch: Any) -> None:
    result = {
        "memory_s_mb": [(0.0, 50.04), (30.0, 60.06), (60.0, 70.0), (75.5, 80.26)], "cpu_percent": 12.34,
        "browser_late_ms": LATE, "terminal_late_ms": NONE, "unanswered": 3, "answer_ms": LATE | {"p50": 2.0},
        "bare_ms": LATE | {"p50": 3.0}, "stations": 11, "surveys": 22,
    }  # fmt: skip
    given = measured("borechain.load.page.measure_load", result)
    monkeypatch.setattr(load, "free_page", lambda address, endpoint: (address, endpoint))
    words = ("page", "--tubes", "4", "--browsers", "2", "--terminals", "1", "--seconds", "9", "--page", "h:1", *FREE)
    late = "median {} ms, 99 % within 30.0 ms, all within 41.1 ms, of 7"
    assert run(*words).output.splitlines() == [
        "ground station: 12.3 % of a core, 50.0 MB at first, 70.0 MB after 60 s, 80.3 MB at the end",
        f"news on the page, browser: {late.format(1.2)}",
        "news on the keys, terminal: none",
        f"answers to questions, 3 without one: {late.format('2.0')}",
        f"answers of a process that does nothing else: {late.format('3.0')}",
        "11 stations of 22 surveys",
    ]
    asked, endpoint, served = given[0]
    assert (asked.tubes, asked.browsers, asked.terminals, asked.seconds) == (4, 2, 1, 9.0)
    assert (endpoint, served) == (FREE[1], ("h:1", FREE[1]))
    said = json.loads(run(*words, "--json").output)
    assert said == json.loads(json.dumps({"bench": "page", "tubes": 4, "seconds": 9.0} | result))


def test_a_day_is_told_by_its_start_and_its_page(measured: Any, monkeypatch: Any) -> None:
    result = {
        "started_s": 2.34, "started_cpu_s": 1.26, "surveys": 900, "stations": 30, "picture_ms": 70.6,
        "history_ms": 8.4, "moment_ms": LATE, "private_mb": 123.6,
    }  # fmt: skip
    given = measured("borechain.load.day.measure_day", result)
    monkeypatch.setattr(load, "free_page", lambda address, _endpoint: address)
    words = ("day", "--hours", "3", "--tubes", "5", "--page", "h:1", *FREE)
    assert run(*words).output.splitlines() == [
        "900 surveys at 30 stations: answers 2.3 s after its start, 1.3 s of CPU",
        "page opened: 71 ms until the history has come; asked again 8 ms",
        "an earlier moment: median 1.2 ms, 99 % within 30.0 ms, all within 41.1 ms, of 7",
        "memory: 124 MB",
    ]
    assert given == [[3.0, 5, FREE[1], "h:1"]]
    assert json.loads(run(*words, "--json").output) == {"bench": "day", "hours": 3.0, "tubes": 5} | result


def test_doors_are_told_free_and_beset(measured: Any, monkeypatch: Any) -> None:
    given = measured("borechain.load.doors.measure_doors", {"free_ms": LATE, "answer_ms": NONE})
    monkeypatch.setattr(load, "free_page", lambda address, _endpoint: address)
    words = ("doors", "--half-open", "9", "--streams", "8", "--wrong", "7", "--asks", "6", *FREE)
    assert run(*words).output.splitlines() == [
        "answers while the door is free: median 1.2 ms, 99 % within 30.0 ms, all within 41.1 ms, of 7",
        "answers while it is beset: none",
    ]
    siege = given[0][0]
    assert (siege.half_open, siege.streams, siege.wrong, siege.asks) == (9, 8, 7, 6)
    assert json.loads(run(*words, "--json").output) == {"bench": "doors", "free_ms": LATE, "answer_ms": NONE}


def test_who_was_shut_out_is_told_by_the_slowest(measured: Any) -> None:
    result = {"out_s": [1.0, 3.26, 2.0], "goes_on_s": [4.0, 2.0, 5.14], "handed": 9, "lost": 1, "doubled": 2}
    given = measured("borechain.load.shut_out.measure_shut_out", result)
    assert run("shut_out", "--times", "3", "--endpoint", "tls/h:1").output.splitlines() == [
        "3 persons revoked: out within 3.3 s, the string receipted again within 5.1 s",
        "9 handed over, 1 lost, 2 kept twice",
    ]
    assert given == [[3, "tls/h:1"]]


@pytest.mark.parametrize(("lost", "doubled", "status"), [(0, 0, 0), (1, 0, 1), (0, 2, 1)])
def test_who_was_killed_has_lost_nothing_or_it_is_an_error(measured: Any, lost: int, doubled: int, status: int) -> None:
    given = measured("borechain.load.killed.kill_again_and_again", KillOutcome(50, lost, doubled, [9.0, 0.5, 0.5, 1.0]))
    result = run("killed", "--times", "3", "--seed", "4", "--database", "d", *FREE)
    told = [
        f"50 events, {lost} lost, {doubled} doubled",
        "killed until the next receipt: median 500.0 ms, 99 % within 990.0 ms, all within 1000.0 ms, of 3",
    ]
    if status:
        told.append(f"Error: {lost} receipted events were lost, {doubled} are kept twice")
    assert (result.exit_code, result.output.splitlines()) == (status, told)
    assert given == [[3, FREE[1], "d", 4]]
    said = json.loads(run("killed", "--times", "3", "--json", *FREE).stdout.splitlines()[0])
    assert said == {
        "bench": "killed", "times": 3, "handed": 50, "lost": lost, "doubled": doubled,
        "back_ms": {"count": 3, "p50": 500.0, "p99": 990.0, "max": 1000.0},
    }  # fmt: skip


@pytest.mark.parametrize(("missing", "restarts", "status"), [([], 0, 0), ([1], 0, 1), ([], 2, 1)])
def test_an_hour_without_a_loss_ends_well(
    measured: Any, tmp_path: Path, missing: list[int], restarts: int, status: int
) -> None:
    weights = [Weight(0.1, "base", 3.0, 4, 5.0, 6), Weight(0.5, "base", 7.0, 8, 9.0, 10)]
    found = weights, {"bench": "hour", "missing": len(missing), "restarts": restarts}
    given = measured("borechain.load.weighed_rig.weigh_rig", found)
    words = ("hour", "--tubes", "2", "--seconds", "30", "--speed", "4", "--out", str(tmp_path), *FREE)
    result = run(*words, "--json")
    assert result.exit_code == status
    assert given == [[2, 30.0, 4.0, FREE[1]]]
    said = json.loads(result.stdout.splitlines()[0])
    assert said["weights"][1] == {
        "hours": 0.5, "process": "base", "private_mb": 7.0, "handles": 8, "database_kb": 9.0, "surveys": 10,
    }  # fmt: skip
    assert sorted(path.name for path in tmp_path.iterdir()) == ["hour.csv", "hour.svg"]
    if status:
        told = f"Error: {len(missing)} surveys are missing, {restarts} processes started again"
        assert result.output.splitlines()[-1] == told
    shown = [cells(line) for line in run(*words).output.splitlines()]
    assert ["0.1", "base", "3", "4", "5", "6"] in shown
    assert ["0.5", "base", "7", "8", "9", "10"] in shown


def test_a_string_in_real_time_is_told_by_its_worst_and_its_sums(measured: Any, tmp_path: Path) -> None:
    case = {key: k for k, (key, _) in enumerate(realtime.COLUMNS)}
    found = {
        "cases": [case], "worst": {"overruns": 3, "cycle_p99_ms": 4.5, "yaw_rest_deg": 0.125},
        "total": {"overruns": 7, "private_mb": 55.0}, "router_and_base_cpu_percent": 6.26,
    }  # fmt: skip
    given = measured("borechain.load.realtime_string.measure_realtime_string", found)
    words = ("realtime", "--nodes", "2", "--seconds", "5", "--seed", "8", "--out", str(tmp_path / "o"), *FREE)
    result = run(*words)
    assert result.exit_code == 0, result.output
    lines = result.output.splitlines()
    rows = [cells(line) for line in lines]
    assert [row for row in rows if row and row[0].replace(" ", "_") in found["worst"]] == [
        ["overruns", "3", "7"], ["cycle p99 ms", "4.5"], ["yaw rest deg", "0.125"],
    ]  # fmt: skip
    assert lines[-1] == "router and base station: 6.3 % of a core"
    assert given == [[2, 5.0, FREE[1], 8]]
    assert (tmp_path / "o" / "realtime.csv").read_text().splitlines() == [
        ",".join(case), ",".join(str(k) for k in range(len(case))),
    ]  # fmt: skip
    assert json.loads(run(*words, "--json").output) == {"bench": "realtime", "nodes": 2, "seconds": 5.0} | found


def test_learning_is_told_figure_by_figure_with_the_calls_of_one_place(measured: Any, monkeypatch: Any) -> None:
    figure = {"what": "w", "unit": "ms", "p50": 1.0, "p99": 2.0, "max": 3.0, "count": 4, "bound": 5.0, "holds": True}
    found = {"surveys": 600, "stations": 20, "figures": [figure], "store_bytes_of_a_survey": {"of all": 812.4}}
    given = measured("borechain.load.learning.measure_learning", found)
    monkeypatch.setattr("groundstation.ground_host.load_kernels", lambda: None)
    from borechain.load import placing_calls

    bounds = dict(placing_calls.CALLS_AT_MOST)
    (one, other), told = bounds, "Python calls of the ground station to place one"
    counts = {one: [7, bounds[one]], other: [bounds[other] + 1, 3]}
    monkeypatch.setattr(placing_calls, "count_placing_calls", lambda _folder, weighting: counts[weighting])
    words = ("learn", "--surveys", "600", "--tubes", "5", "--stops", "4")
    lines = run(*words).output.splitlines()
    assert ["w", "ms", "1", "2", "3", "4", "5", "True"] in [cells(line) for line in lines]
    assert lines[-3:] == [
        "database, for each survey: 812 bytes of all",
        f"{told}, {one}: {bounds[one]} at most, the bound is {bounds[one]}",
        f"{told}, {other}: {bounds[other] + 1} at most, the bound is {bounds[other]}",
    ]
    assert given == [[600, 5, 4]]
    said = json.loads(run(*words, "--json").output)
    assert said["calls_to_place_one"] == [
        {"weighting": one.value, "max": bounds[one], "bound": bounds[one], "holds": True},
        {"weighting": other.value, "max": bounds[other] + 1, "bound": bounds[other], "holds": False},
    ]
    assert {key: said[key] for key in ("bench", "tubes", "surveys")} == {"bench": "learn", "tubes": 5, "surveys": 600}


def test_ratios_are_a_table_with_units_and_none_where_there_is_no_peer() -> None:
    rows = {"a": {"ours": 2e-6, "peer": 0.25, "ratio": 12.3456}, "b": {"ours": 3.0, "peer": None, "ratio": None}}
    lines = [cells(line) for line in printed(show_ratios, {"bench": "x", "ratios": rows})]
    assert [line for line in lines if line and line[0] in ("a", "b")] == [
        ["a", "2.0 us", "250.00 ms", "12.3"], ["b", "3.00 s"],
    ]  # fmt: skip


def test_benchmarks_are_those_of_the_repository_and_the_package(monkeypatch: Any, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(
        '"""What mine measures.\n\nMore."""\ndef run():\n    return {"bench": "mine", "ratios": {}}\n'
    )
    (tmp_path / "lacks.py").write_text("import nowhere_at_all\n")
    monkeypatch.setattr(bench_room, "FOLDER", tmp_path)
    assert bench_names() == sorted(["mine", "lacks", *bench_room.OWN])
    assert run().output.splitlines() == bench_names()
    assert json.loads(run("mine", "--json").output) == {"bench": "mine", "ratios": {}}
    assert "What mine measures" in run("mine", "--help").output
    told = "bench lacks needs nowhere_at_all; install the development dependencies: pip install 'borechain[dev]'"
    assert run("lacks").output == f"Error: {told}\n"
    assert f"expected one of {', '.join(bench_names())}, got 'x'" in str(run("x").output)
    monkeypatch.setattr(bench_room, "FOLDER", tmp_path / "none")
    assert "the benchmarks beside other libraries are in the repository" in run("mine").output
    assert run().output.splitlines()[:-1] == bench_names()
