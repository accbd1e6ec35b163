"""What the program for notebooks, the client and the table of commands ask for and hand on."""

from __future__ import annotations

import contextlib
import math
from datetime import UTC, date, datetime
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from called_instead import Given, instead, noted
from click.testing import CliRunner
from printed_output import query_reply

from borechain import __main__ as program
from borechain import api, rig_search
from borechain import client as client_room
from borechain.client import Ground, NoAnswerError, RefusedError, shape_answer, shape_value
from groundstation.service.answers.shapes.answer_fields import fields_of_answer
from telemetry import keys
from telemetry.errors import MediumError

# the program for notebooks


def test_a_scenario_is_drilled_in_a_folder_that_is_kept_or_goes(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    run = SimpleNamespace(answers="answers")
    drilled = instead(monkeypatch, "borechain.drilling.drill_hole.drill_inline", run)
    monkeypatch.setattr("sim.world.world.World", lambda scenario, seed: (scenario, seed))
    monkeypatch.setattr("sim.rig.rig_result.rig_result", lambda answers, world: {"of": (answers, world)})
    scenario: Any = "scenario"
    assert api.drill(scenario, 5, tmp_path / "kept") == {"of": ("answers", ("scenario", 5))}
    world, job, folder, _ = drilled[0]
    assert (world, job.seed, job.speed, job.inline, folder) == (("scenario", 5), 5, math.inf, True, tmp_path / "kept")
    assert folder.exists()
    api.drill(scenario)
    assert (drilled[1][1].seed, drilled[1][2].exists()) == (1, False)


def test_each_function_hands_on_what_it_is_given(monkeypatch: pytest.MonkeyPatch) -> None:
    loaded = instead(monkeypatch, "sim.world.scenario.load_scenario", "scenario")
    assert api.load("rig-3", ("kill-node:1@5",)) == "scenario"
    assert loaded == [(Path("rig-3"), ("kill-node:1@5",))]
    calibrated = instead(monkeypatch, "groundstation.report.calibrations.calibration_answer.answer_calibration", "made")
    request: Any = "request"
    assert api.calibrate(request, date(2026, 5, 4)) == "made"
    before = datetime.now(UTC).date().isoformat()
    api.calibrate(request)
    assert calibrated[0] == ("request", "2026-05-04")
    assert before <= calibrated[1][1] <= datetime.now(UTC).date().isoformat()
    known = {"stations": [1, 2], "events": 3}
    instead(monkeypatch, "groundstation.recording.ground_replay.replay_summary", known)
    monkeypatch.setattr("sim.rig.report.station_digest", lambda stations: f"digest of {stations}")
    recording: Any = "recording"
    assert api.replay(recording, Path("f")) == known | {"digest": "digest of [1, 2]"}
    rigs = instead(monkeypatch, "borechain.drilling.drill_rig.drill_rig", "drilled")
    job, watcher = SimpleNamespace(), SimpleNamespace()
    assert api.drill_rig(job, watcher) == "drilled"  # type: ignore[arg-type]
    assert rigs == [(job, watcher)]


class Bus:
    """A bus that answers what it was given; the keys and times of its questions are noted."""

    def __init__(self, *replies: Any) -> None:
        self.replies, self.asked, self.calls = list(replies), list[Any](), list[Any]()

    def get(self, *given: Any) -> list[Any]:
        self.asked.append(given)
        return self.replies

    def subscribe(self, key: str, call: Any) -> None:
        self.calls.append((key, call))

    def tokens(self, *given: Any) -> list[str]:
        self.asked.append(given)
        return ["borechain/rig-2/a", "borechain/rig-1/b", "borechain/rig-2/c"]


def test_a_question_of_the_notebook_has_its_answers_by_key_or_says_why(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Bus(query_reply("a", b"[1]"), query_reply("b", b"", "refused"), query_reply("c", b"2"))
    opened = instead(monkeypatch, "telemetry.media.zenoh_bus.open_client", contextlib.nullcontext(bus))
    assert api.query("k", "tcp/h:1", 3.0) == {"a": [1], "c": 2}
    assert (opened, bus.asked) == ([("tcp/h:1", 3.0)], [("k", 3.0)])
    bus.replies = [query_reply("b", b"", "refused")]
    with pytest.raises(MediumError, match=r"^k: refused$"):
        api.query("k")
    bus.replies = []
    with pytest.raises(MediumError, match=r"^k: no answer from tcp/127\.0\.0\.1:7447$"):
        api.query("k")


def test_rigs_that_live_are_named_once_in_order() -> None:
    bus: Any = Bus()
    assert rig_search.live_rigs(bus, 2.5) == ["rig-1", "rig-2"]
    assert bus.asked == [(keys.LEASE.format(rig="*", holder="*"), 2.5)]
    assert rig_search.who_is_there(bus) == "rigs with a ground station: rig-1, rig-2"
    bus.tokens = lambda *_: []
    assert rig_search.who_is_there(bus) == "no rig has a ground station here"


def test_a_client_asks_its_rig_orders_with_patience_and_tells_a_refusal_from_silence() -> None:
    bus: Any = Bus(query_reply("k", b"", "Timeout"), query_reply("k", b'{"a": 1}'))
    ground = Ground(bus, "rig-7", 2.5)
    assert ground.ask("stations", md="4..12", x=1) == {"a": 1}
    assert ground.ask("verdict") == {"a": 1}
    with pytest.raises(client_room.AnswerError, match="Order: the answer lacks"):
        ground.order("north", "anna", action="tell")
    assert bus.asked == [
        ("borechain/rig-7/ground/stations?md=4..12;x=1", 2.5), ("borechain/rig-7/ground/verdict", 2.5),
        ("borechain/rig-7/cmd/north?action=tell;by=anna", 40.0),
    ]  # fmt: skip
    bus.replies = [query_reply("k", b"", "Timeout"), query_reply("k", b"", "borechain/rig-7/ground/x: no such path")]
    with pytest.raises(RefusedError, match=r"^no such path$"):
        ground.ask("x")
    bus.replies = [query_reply("k", b"", "Timeout")]
    with pytest.raises(NoAnswerError, match=r"^borechain/rig-7/ground/x: no answer within 2\.5 s; rigs with a ground"):
        ground.ask("x")
    heard: Given = []
    ground.follow("**", lambda *given: heard.append(given))
    ((key, call),) = bus.calls
    call("borechain/rig-7/ground/nodes/3", b'{"tube": 3}')
    assert (key, heard) == ("borechain/rig-7/ground/**", [("nodes/3", {"tube": 3})])


def test_a_stream_gives_each_row_once_asks_for_what_it_missed_and_begins_anew_with_the_station() -> None:
    bus: Any = Bus()
    ground = Ground(bus, "rig-7")
    rows = [{"seq": k} for k in range(1, 10)]
    published = [
        {"newest": 3, "events": rows[2:3]}, {"newest": 3, "events": rows[2:3]},  # the same again
        {"newest": 6, "events": rows[5:6]},  # four and five did not come
        {"newest": 6, "events": []}, {"newest": 2, "events": rows[1:2]},  # started again
    ]  # fmt: skip
    asked: Given = []

    def ask(path: str, since: int) -> Any:
        asked.append((path, since))
        newest = 2 if len(asked) in (1, 4) else 6
        return {"newest": newest, "events": [row for row in rows[:newest] if row["seq"] > since]}

    ground.ask = ask  # type: ignore[assignment, method-assign]
    ground.follow = lambda path, call: [call(path, view) for view in published]  # type: ignore[assignment, method-assign]
    seen = [row["seq"] for row in ground.stream("events", timeout=0.01)]
    assert seen == [1, 2, 3, 4, 5, 6, 1, 2]
    assert asked == [("events", 0), ("events", 3), ("events", 6), ("events", 0)]
    with pytest.raises(RefusedError, match=r"^status: no stream; expected one of"):
        next(ground.stream("status"))


def test_an_answer_takes_its_shape_and_parts_of_it_theirs() -> None:
    steer = {field.name: 1 for field in fields_of_answer(client_room.Steer)}
    made = shape_answer(client_room.Steer, steer | {"of a later version": 2})
    assert made.azimuth_deg == 1
    field: Any = SimpleNamespace(shape=client_room.Steer, kind="", rank=0)
    assert shape_value(field, steer) == made
    assert shape_value(field, None) is None
    field.rank = 1
    assert shape_value(field, [steer, steer]) == [made, made]
    field.kind = "map"
    assert shape_value(field, {"a": steer}) == {"a": made}
    field.shape = None
    assert shape_value(field, {"a": steer}) == {"a": steer}


def test_a_client_connects_with_its_certificate_to_its_rig(monkeypatch: pytest.MonkeyPatch) -> None:
    told: Given = []
    monkeypatch.setattr(client_room, "open_client", noted(told, "bus"))
    monkeypatch.setattr(client_room, "credentials_for", lambda *given: given)
    with client_room.connect_to_ground("tls/h:1", "rig-7", 3.0, keys_place=Path("k"), role="driller") as ground:
        assert (ground._bus, ground._rig) == ("bus", "rig-7")
    assert told == [("bus", "begins", "tls/h:1", 3.0, ("tls/h:1", Path("k"), "driller")), ("bus", "ends")]


# the table of commands


def test_commands_are_listed_in_the_order_of_their_table_and_none_is_loaded_for_it() -> None:
    lines = CliRunner().invoke(program.cli, ["--help"]).output.splitlines()
    begin = next(k for k, line in enumerate(lines) if line.startswith("Commands"))
    named = [line.split()[0] for line in lines[begin + 1 :] if line.startswith("  ") and line[2] != " "]
    assert named == list(program.COMMANDS)
    group: Any = program.cli
    assert group.list_commands(None) == list(program.COMMANDS)
    assert group.get_command(None, "none") is None
    assert group.get_command(None, "merge").name == "merge"


def test_the_program_runs_under_its_name_with_what_it_was_given(monkeypatch: pytest.MonkeyPatch) -> None:
    ran = instead(monkeypatch, "telemetry.runtime.command_line.run_command", None)
    program.main(["a", "b"])
    assert ran == [(program.cli, "borechain", ["a", "b"])]
