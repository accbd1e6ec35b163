"""What is printed of studies, gauntlets and measured figures, and rows that stream from a restarted ground station."""

from __future__ import annotations

import contextlib
import io
import json
import re
import threading
from collections.abc import Callable
from functools import partial
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from printed_output import cells, printed, query_reply

from borechain.cli.calibrate.record_reader import node_array
from borechain.cli.experiment.study_output import show_study, write_study
from borechain.cli.faults import InputFault
from borechain.cli.gauntlet.gauntlet import GauntletRequest, _show_figures
from borechain.cli.rig.rig_command import chosen_view
from borechain.cli.shared_options import parse_speed
from borechain.client import Ground
from borechain.load.page import latency_quantiles
from borechain.load.rounds import compare_rounds
from sim.studies.study import ResultTable
from telemetry.media.zenoh_bus import QueryReply


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
        return [query_reply(selector, self.view([number for number in self.rows if number > since]))]

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
