"""What commands of a ground station ask for, print and end with, by stubs of its bus."""

from __future__ import annotations

import contextlib
import json
import queue
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from called_instead import Given, instead, noted
from click.testing import CliRunner
from printed_output import printed, query_reply, run_command

from borechain.cli.faults import EnvironmentFault
from borechain.cli.ground import check_command, crew, query, record_command
from borechain.cli.ground.check_command import CheckRequest, check
from borechain.cli.ground.merge_command import merge
from borechain.cli.ground.record_command import print_replay, record, replay, tell_damage
from borechain.drilling.rig_host import guard_of, say_absent
from borechain.setup_check import SetupCheck, check_live_rig
from telemetry.errors import MediumError

# the ground station of a rig


def test_the_crew_opens_its_screen_under_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    told: Given = []
    monkeypatch.setattr("borechain.client.connect_to_ground", noted(told, "ground"))

    class Screen:
        def __init__(self, *given: Any) -> None:
            told.append(given)

        def run(self) -> None:
            told.append("ran")

    monkeypatch.setattr("borechain.crew.app.CrewApp", Screen)
    monkeypatch.setattr(crew.getpass, "getuser", lambda: "anna")
    words = ("--rig", "rig-2", "--endpoint", "tcp/127.0.0.1:9", "--role", "driller")
    assert run_command(crew.crew, *words).exit_code == 0
    begins = ("ground", "begins", "tcp/127.0.0.1:9", "rig-2", {"keys_place": None, "role": "driller"})
    assert told == [begins, ("ground", "rig-2", "anna"), "ran", ("ground", "ends")]
    run_command(crew.crew, *words, "--by", "bert")
    assert told[5] == ("ground", "rig-2", "bert")
    for error in (OSError, KeyError):

        def nameless(error: Any = error) -> str:
            raise error

        monkeypatch.setattr(crew.getpass, "getuser", nameless)
        assert crew.user_name() == "crew"


def setup_check(**change: Any) -> SetupCheck:
    plain: dict[str, Any] = {"ready": True, "missing": [], "unchecked": [], "wrong": [], "todo": "drill"}
    return SetupCheck(**plain | {"left_out": "none", "items": []} | change)


@pytest.mark.parametrize("ready", [True, False])
def test_a_check_asks_who_was_named_and_its_status_is_the_answer(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, ready: bool
) -> None:
    found, told = setup_check(ready=ready), list[Any]()
    of_scenario = instead(monkeypatch, "borechain.setup_check.check_scenario", found)
    of_settings = instead(monkeypatch, "borechain.setup_check.check_settings", found)
    of_rig = instead(monkeypatch, "borechain.setup_check.check_live_rig", found)
    monkeypatch.setattr("borechain.client.connect_to_ground", noted(told, "ground"))
    done = run_command(check, "wellbore-1", "--seed", "5")
    word = "READY TO DRILL" if ready else "NOT READY TO DRILL"
    assert (done.exit_code, done.output.splitlines()[0]) == (1 - ready, word)
    assert of_scenario == [(Path("wellbore-1"), 5)]
    file = tmp_path / "ground.toml"
    file.write_text('rig = "rig-7"\ntube-length-m = 2.5\n')
    monkeypatch.setattr(check_command, "settings_of_file", lambda one: f"settings of {one.name}")
    assert json.loads(run_command(check, "--ground-config", str(file), "--json").output)["ready"] is ready
    assert of_settings == [("settings of ground.toml",)]
    run_command(check, "--rig", "rig-2", "--endpoint", "tcp/127.0.0.1:9")
    assert of_rig == [("ground",)]
    assert told[0] == ("ground", "begins", "tcp/127.0.0.1:9", "rig-2", {"keys_place": None, "role": "operator"})
    request = CheckRequest(Path("a"), file, 3, "rig-1", "tcp/h:1", None, "operator")
    assert request.answer() is found
    assert of_scenario[-1] == (Path("a"), 3)  # a scenario goes first


def test_settings_of_a_file_are_those_that_the_ground_station_would_take(tmp_path: Path) -> None:
    file = tmp_path / "ground.toml"
    file.write_text('rig = "rig-7"\ntube-length-m = 2.5\n')
    settings = check_command.settings_of_file(file)
    assert settings["tube_length"] == 2.5


def test_of_a_live_rig_what_surveys_mend_is_not_wrong() -> None:
    setup = {"ready": True, "missing": [], "unchecked": ["u"], "todo": "t", "left_out": "l", "items": [{"a": 1}]}
    verdict = {"doubts": ["no_survey", "alarm", "unchecked"], "why": ["a", "b", "c"]}
    ground: Any = SimpleNamespace(ask=lambda path: {"setup": setup, "verdict": verdict}[path])
    assert check_live_rig(ground) == SetupCheck(False, [], ["u"], ["b"], "t", "l", [{"a": 1}])
    verdict["doubts"] = ["setup", "uncertain", "unchecked"]
    assert check_live_rig(ground).ready
    setup["ready"] = False
    assert not check_live_rig(ground).ready


def test_two_databases_are_merged_and_what_is_odd_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    one, two, into = (tmp_path / name for name in ("one", "two", "into"))
    one.mkdir()
    two.mkdir()
    twice = [(tube, 10 + tube) for tube in range(1, 8)]
    done: dict[str, Any] = {"damaged": 3, "twice": twice, "shared": 4, "first_alone": 5, "second_alone": 6, "stands": 7}
    merged = instead(monkeypatch, "groundstation.service.disk.merged_database.merge_databases", SimpleNamespace(**done))
    result = CliRunner().invoke(merge, [str(one), str(two), "--into", str(into)])
    assert merged == [(one, two, into)]
    assert result.stdout == (
        f"{into}: 4 messages of both, 5 of {one} alone, 6 of {two} alone; 7 stands of the bit more\n"
    )
    damaged, doubled = result.stderr.splitlines()
    assert damaged == "3 rows are damaged and were left out; the tubes are asked for lost messages again"
    named = ", ".join(f"number {10 + tube} of tube {tube}" for tube in range(1, 6))
    assert doubled == (
        f"7 numbers have two contents, both are kept: {named}; are there two tubes of one number?"
    )  # fmt: skip
    instead(
        monkeypatch, "groundstation.service.disk.merged_database.merge_databases",
        SimpleNamespace(**done | {"damaged": 0, "twice": []}),
    )  # fmt: skip
    assert CliRunner().invoke(merge, [str(one), str(two), "--into", str(into)]).stderr == ""


class Bus:
    """A bus that answers what it was given."""

    def __init__(self, *replies: Any) -> None:
        self.replies, self.asked = list(replies), list[Any]()

    def get(self, *given: Any) -> list[Any]:
        self.asked.append(given)
        return self.replies

    def subscribe(self, _key: str, call: Any) -> None:
        for one in self.replies:
            call(one.key, one.payload)


@pytest.mark.parametrize(
    ("replies", "status", "said"),
    [
        ([query_reply("k", b"", "Timeout")], 1, "Error: k/a: no answer within {:g} s; a longer --timeout may help"),
        ([query_reply("k", b"", "Timeout"), query_reply("k", b"", "no such tube")], 2, "Error: no such tube"),
        ([query_reply("k", b"", "refused"), query_reply("k", b"[1]")], 0, "["),
    ],
)
def test_a_query_waits_as_long_as_its_kind_takes_and_tells_why_there_is_no_answer(
    monkeypatch: pytest.MonkeyPatch, replies: list[Any], status: int, said: str
) -> None:
    bus = Bus(*replies)
    opened = instead(monkeypatch, "telemetry.media.zenoh_bus.open_client", contextlib.nullcontext(bus))
    monkeypatch.setattr(query.keys, "is_order", lambda selector: selector.endswith("order"))
    done = run_command(query.query, "k/a", "--endpoint", "tcp/127.0.0.1:9")
    assert (done.exit_code, done.output.splitlines()[0]) == (status, said.format(query.PATIENCE))
    run_command(query.query, "k/order", "--endpoint", "tcp/127.0.0.1:9")
    run_command(query.query, "k/order", "--endpoint", "tcp/127.0.0.1:9", "--timeout", "3")
    assert bus.asked == [("k/a", query.PATIENCE), ("k/order", query.ORDER_PATIENCE), ("k/order", 3.0)]
    assert opened == [("tcp/127.0.0.1:9", wait, None) for wait in (query.PATIENCE, query.PATIENCE, 3.0)]


def test_a_watch_prints_so_many_lines_and_no_more(monkeypatch: pytest.MonkeyPatch) -> None:
    bus = Bus(*(query_reply(f"k/{k}", b"[%d]" % k) for k in range(4)))
    instead(monkeypatch, "telemetry.media.zenoh_bus.open_client", contextlib.nullcontext(bus))
    done = run_command(query.watch, "k/*", "--count", "3", "--endpoint", "tcp/127.0.0.1:9")
    assert [json.loads(line) for line in done.output.splitlines()] == [
        {"key": f"k/{k}", "value": [k]} for k in range(3)
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("course", "said"),
    [
        ((True, 1, 0, 0), []),
        ((False, 7, 0, 0), ["not whole: the recording begins at event 7; a replay knows what it has"]),
        ((False, 7, 2, 3), ["not whole: the recording begins at event 7, 2 events and 3 samples were lost; a replay "
                            "knows what it has"]),
        ((False, 0, 0, 3), ["not whole: the recording holds no event of the ground station; a replay knows what it "
                            "has"]),
    ],
)  # fmt: skip
def test_a_recording_says_what_it_has_and_what_was_lost(
    monkeypatch: pytest.MonkeyPatch, course: tuple[bool, int, int, int], said: list[str]
) -> None:
    whole, first, missing, dropped = course
    found = SimpleNamespace(samples=50, newest=9, is_whole=whole, first=first, missing=missing, dropped=dropped)
    asked = instead(monkeypatch, "borechain.cli.ground.record_command.record_rig", found)
    done = CliRunner().invoke(record, ["f.mcap", "--rig", "rig-2", "--endpoint", "tcp/127.0.0.1:9", "--wait", "4"])
    assert asked == [(Path("f.mcap"), "rig-2", "tcp/127.0.0.1:9", 4.0, None)]
    assert done.stderr.splitlines() == ["50 samples, 9 events taken in by the ground station", *said]
    assert done.stdout == ""


def test_a_recorder_stops_at_both_signals(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    handlers: dict[int, Any] = {}
    monkeypatch.setattr(record_command.signal, "signal", handlers.__setitem__)
    monkeypatch.setattr(record_command, "patient_client", lambda *given: contextlib.nullcontext(given))
    stopped: Given = []

    class Recorder:
        def __init__(self, *given: Any) -> None:
            self.given = given

        def stop(self) -> None:
            stopped.append(self.given)

        def run(self) -> Any:
            return self.given

    monkeypatch.setattr("groundstation.recording.recorder.Recorder", Recorder)
    given: Any = record_command.record_rig(Path("f"), "rig-2", "tcp/h:1", 4.0)
    assert given == (("tcp/h:1", 4.0, None), "rig-2", Path("f"))
    assert capsys.readouterr().err == "recording rig-2 at tcp/h:1 into f, Ctrl-C ends it\n"
    assert set(handlers) == {signal.SIGINT, signal.SIGTERM}
    for call in handlers.values():
        call(15, None)
    assert len(stopped) == 2


@pytest.mark.parametrize(("wait", "each", "tries"), [(5.0, 2.0, 3), (0.0, 0.1, 1)])
def test_a_router_is_tried_until_the_wait_is_over(
    monkeypatch: pytest.MonkeyPatch, wait: float, each: float, tries: int
) -> None:
    now, tried = [100.0], list[float]()

    def open_client(_endpoint: str, timeout: float, _credentials: Any) -> Any:
        tried.append(timeout)
        now[0] += timeout
        raise MediumError("no router")

    monkeypatch.setattr(record_command, "time", SimpleNamespace(monotonic=lambda: now[0]))
    monkeypatch.setattr("telemetry.media.zenoh_bus.open_client", open_client)
    with pytest.raises(MediumError, match="no router"), record_command.patient_client("tcp/h:1", wait, None):
        pass
    assert tried == [each] * tries
    monkeypatch.setattr("telemetry.media.zenoh_bus.open_client", lambda *_: contextlib.nullcontext("bus"))
    with record_command.patient_client("tcp/h:1", wait, None) as bus:
        assert bus == "bus"


REPLAYED: dict[str, Any] = {
    "stations": [{"station": 2, "md_m": 4.004, "inclination_deg": 1.23456, "azimuth_deg": 89.996}],
    "verdict": {"line": "ON TARGET"}, "events": 9, "missing": 1, "damage": [], "whole": True, "digest": "abcd",
}  # fmt: skip


@pytest.mark.parametrize(
    ("change", "file"),
    [({}, "whole"), ({"whole": False}, "cut"), ({"whole": False, "damage": ["at 3"]}, "damaged")],
)
def test_a_replay_prints_what_it_knows_and_its_status_is_that_of_the_file(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, change: dict[str, Any], file: str
) -> None:
    result = REPLAYED | change
    made = instead(monkeypatch, "groundstation.recording.recording_file.Recording", "recording")
    replayed = instead(monkeypatch, "borechain.api.replay", result)
    done = CliRunner().invoke(replay, ["f.mcap", "--folder", str(tmp_path)])
    assert done.exit_code == (0 if result["whole"] else 1)
    assert done.stdout.splitlines() == [
        "station 2 at 4.00 m: 1.235 deg to 90.00 deg", "ON TARGET", f"9 events, 1 missing; {file} file", "digest abcd",
    ]  # fmt: skip
    assert done.stderr.splitlines() == result["damage"]
    assert (made, replayed) == ([(Path("f.mcap"),)], [("recording", tmp_path)])
    said = CliRunner().invoke(replay, ["f.mcap", "--json"])
    assert (said.exit_code, json.loads(said.stdout)) == (done.exit_code, result)
    assert replayed[1][1].name.startswith("borechain-")
    (tmp_path / "here").write_text("")
    used = CliRunner().invoke(replay, ["f.mcap", "--folder", str(tmp_path)])
    assert (used.exit_code, used.output) == (
        1, f"Error: folder {tmp_path}: expected a new or empty one, it holds something\n",
    )  # fmt: skip


def test_a_replay_on_the_page_names_its_file_and_tells_the_damage(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    recording = SimpleNamespace(damage=[SimpleNamespace(line="at 3"), SimpleNamespace(line="at 5")])
    instead(monkeypatch, "groundstation.recording.recording_file.Recording", recording)
    shown = instead(monkeypatch, "groundstation.recording.show.show_recording", None)
    words = ["a/f.mcap", "--page", "127.0.0.1:9", "--speed", "5", "--folder", str(tmp_path)]
    done = CliRunner().invoke(replay, words)
    assert (done.exit_code, done.stdout, done.stderr) == (0, "", "at 3\nat 5\n")
    found, folder, settings, speed = shown[0]
    assert (found, folder, settings.replay, speed) == (recording, tmp_path, "f.mcap", 5.0)


@pytest.mark.parametrize(("count", "more"), [(20, 0), (21, 1), (25, 5)])
def test_of_much_damage_twenty_lines_are_told(capsys: pytest.CaptureFixture[str], count: int, more: int) -> None:
    tell_damage([f"line {k}" for k in range(count)])
    lines = capsys.readouterr().err.splitlines()
    assert lines[:20] == [f"line {k}" for k in range(20)]
    assert lines[20:] == ([f"and {more} more damaged parts"] if more else [])
    assert printed(print_replay, REPLAYED)[-1] == "digest abcd"


# the medium's words


@pytest.mark.parametrize(("waited", "is_said"), [(0.0, False), (9.0, False), (10.0, True), (15.0, False), (20.0, True)])
def test_who_is_absent_is_told_every_ten_seconds(
    capsys: pytest.CaptureFixture[str], waited: float, is_said: bool
) -> None:
    say_absent("tube 3", waited)
    line = f"borechain medium: tube 3 has not joined for {waited:.0f} s, it is waited for\n"
    assert capsys.readouterr().err == (line if is_said else "")


def test_a_router_without_tls_guards_nothing() -> None:
    assert guard_of("tcp/127.0.0.1:1", None) == (None, None)


def test_a_sample_that_does_not_come_is_told_with_its_selector() -> None:
    arrived: queue.SimpleQueue[Any] = queue.SimpleQueue()
    arrived.put(("k", b"1"))
    assert query.next_sample(arrived, "k", None) == ("k", b"1")
    with pytest.raises(EnvironmentFault, match="k"):
        query.next_sample(arrived, "k", 0.01)
