"""Small doors that nothing else opens: how a board begins, lines that are flushed, what a frozen process gets."""

from __future__ import annotations

import io
import sys
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from bench_modules import FOLDER, Clock, bench

from borechain.cli.rig import rig_command
from borechain.gauntlet.gauntlet_rig import BIAS_AFTER, GauntletRig
from node import __main__ as board
from sim.gauntlet.faulty_stepper import FaultyStepper
from sim.studies.field.third_world import THIRD
from sim.studies.soil_link.delivery_time import STEP, LossyJoint, joint_delay, quantile
from telemetry.runtime.stepped import Due, DueEvent

# a board


@pytest.mark.parametrize(
    ("module", "told"),
    [("telemetry.runtime.command_line", True), ("node.process.command_group", False)],
)
def test_a_board_without_the_package_beside_it_says_so_and_hides_no_other_fault(
    monkeypatch: pytest.MonkeyPatch, module: str, told: bool
) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    for found, origin in (
        (None, "none"),
        (SimpleNamespace(origin="/elsewhere/telemetry.py"), "/elsewhere/telemetry.py"),
    ):
        monkeypatch.setattr(board, "find_spec", lambda name, found=found: found if name == "telemetry" else 1 / 0)
        ended: Any
        with pytest.raises(SystemExit if told else ModuleNotFoundError) as ended:
            board.main()
        if told:
            expected = f"python -m node: expected the package telemetry of borechain, got {origin}"
            assert ended.value.code == expected


def test_a_board_runs_its_commands_under_its_name_with_its_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    ran: list[Any] = []
    monkeypatch.setattr(
        "telemetry.runtime.command_line.run_command", lambda *given, **named: ran.append((given, named))
    )  # fmt: skip
    board.main()
    from node.process.command_group import commands

    assert ran == [((commands, "python -m node"), {"packages": ("node", "telemetry")})]


# lines


def test_each_line_is_flushed_once_it_is_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    class Noted(io.StringIO):
        done: list[str] = []  # noqa: RUF012

        def flush(self) -> None:
            self.done.append(self.getvalue())

    for line in ("first", "second"):
        out = Noted()
        out.done.clear()
        monkeypatch.setattr(sys, "stdout", out)
        monkeypatch.setattr("click.echo", lambda text: sys.stdout.write(f"{text}\n"))
        rig_command.print_line(line)
        assert out.done == [f"{line}\n"]


# a gauntlet


class Noted:
    """A process that notes its events."""

    def __init__(self) -> None:
        self.missed: list[tuple[int, float]] = []

    def on_overrun(self, missed: int, now: float) -> None:
        self.missed.append((missed, now))


def event(kind: Due, at: float) -> Any:
    return DueEvent(kind, at, None), f"{kind.name} {at}"


def test_a_frozen_process_gets_its_frames_when_it_thaws_and_is_told_its_cycles_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    stepped: list[Any] = []
    monkeypatch.setattr(
        "sim.gauntlet.faulty_stepper.step_process", lambda process, events: stepped.append([e[1] for e in events])
    )  # fmt: skip
    world, process = SimpleNamespace(depth_hidden=False), Noted()
    stepper = FaultyStepper({}, world, lambda _: None, lambda _: None)  # type: ignore[arg-type]
    stepper.processes[3] = process  # type: ignore[assignment]
    for begin in (10.0, 50.0):  # and a second time
        stepper.freeze(3)
        for step in range(3):
            at = begin + step
            stepper.round({3: [event(Due.CYCLE, at), event(Due.UPPER_FRAME, at)]})
        stepper.freeze(3)  # frozen already: what waits stays, what was missed is counted anew
        stepper.round({3: [event(Due.CYCLE, begin + 3)]})
        assert (stepped, stepper.is_frozen(3), stepper.is_frozen(4)) == ([], True, False)
        stepper.thaw(3)
        stepper.thaw(4)
        assert stepper.is_frozen(3)  # it has not moved since
        stepper.round({3: [event(Due.CYCLE, begin + 4)]})
        assert stepped == [[*(f"UPPER_FRAME {begin + k}" for k in range(3)), f"CYCLE {begin + 4}"]]
        assert process.missed == [(1, begin + 4)]
        assert not stepper.is_frozen(3)
        stepper.round({3: [event(Due.CYCLE, begin + 5)]})
        assert stepped.pop() == [f"CYCLE {begin + 5}"]
        stepped.clear()
        process.missed.clear()
    stepper.freeze(3)
    stepper.drop(3)
    assert not stepper.is_frozen(3)


@pytest.mark.parametrize(("after", "begins_anew"), [(BIAS_AFTER - 0.001, True), (BIAS_AFTER, False)])
def test_a_pause_begins_anew_what_a_tube_was_learning_when_it_began(after: float, begins_anew: bool) -> None:
    rig: Any = GauntletRig.__new__(GauntletRig)
    done: list[Any] = []
    rig.stepper = SimpleNamespace(freeze=lambda a: done.append(("freeze", a)), thaw=lambda a: done.append(("thaw", a)))
    rig._frozen_at, rig.forgot_at = {}, {3: 100.0}
    rig.scheduler = SimpleNamespace(now=100.0 + after)
    rig.freeze(3)
    rig.freeze(4)
    rig.scheduler.now = 500.0
    rig.thaw(3)
    rig.thaw(4)
    rig.thaw(5)
    assert done == [("freeze", 3), ("freeze", 4), ("thaw", 3), ("thaw", 4), ("thaw", 5)]
    assert rig.forgot_at == {3: 500.0 if begins_anew else 100.0}
    assert rig._frozen_at == {}


# a third world

FINE = {"late-0.5", "late-1", "stick-slip-cycle", "ripple-cycle", "whirl", "bad-day", "bad-day-rigid"}
FRAMES = {"late-0.5": 0.5, "late-1": 1.0}
MEANS = {"stick-slip-cycle", "ripple-cycle", "stamp-step"}
LEANING = {"creeps-30": 30.0, "unwinds-slowly": 30.0}


def test_each_row_of_a_third_world_has_its_rate_of_samples_its_sensor_and_its_lean() -> None:
    assert len({case.key for case in THIRD}) == len(THIRD) == 24
    assert {case.key for case in THIRD if case.setup["rough"]["samples_hz"] == 1000.0} == FINE
    assert {case.setup["rough"]["samples_hz"] for case in THIRD} == {250.0, 1000.0}
    sensors = {case.key: case.setup["rough"].get("sensor", {}) for case in THIRD}
    assert {key: found["delay_off_ms"] for key, found in sensors.items() if "delay_off_ms" in found} == FRAMES
    assert {key for key, found in sensors.items() if found.get("frames_hz") == 50.0} == set(FRAMES)
    assert {found["low_pass_hz"] for found in sensors.values() if "low_pass_hz" in found} == {20.0}
    assert {case.key for case in THIRD if not case.setup["gyroscope"]["increments"]} == MEANS
    leans = {case.key: case.setup["path"]["straight"]["inclination_deg"] for case in THIRD}
    assert {key: lean for key, lean in leans.items() if lean != 2.0} == LEANING
    stood = {
        case.key: case.setup["disturbance"]["counter-stands"]["stands_s"] for case in THIRD if "stands" in case.key
    }
    assert stood == {"stands-1": 1.2, "stands-3": 3.0, "stands-20": 20.0}
    assert {case.key for case in THIRD if case.has_state} == set(FRAMES)
    assert [case.key for case in THIRD if case.judges_ramps] == ["lost-cycle"]
    assert [case.key for case in THIRD if case.by_ground] == ["exchanged"]


# soil


@pytest.mark.parametrize(
    ("share", "cell"), [(0.05, 0), (0.1, 0), (0.11, 1), (0.299, 1), (0.31, 2), (0.59, 2), (0.61, 4), (1.0, 4)]
)
def test_a_quantile_is_the_first_time_by_which_the_share_has_come(share: float, cell: int) -> None:
    for whole in (1.0, 3.0):  # also of what does not add up to one
        found = quantile(whole * np.array([0.1, 0.2, 0.3, 0.0, 0.4]), share)
        assert found == pytest.approx(cell * 1e-3)
    assert STEP == 1e-3


@pytest.mark.parametrize("attempts", [1, 3])
def test_all_messages_over_a_joint_come_at_their_times_and_the_rest_at_the_end(attempts: int) -> None:
    """A frame is sent at 0, 0.06, 0.18, 0.42 s and so on up to 2 s apart; each of its attempts fails by itself."""
    failing, at, gap, sent = 0.7, 0.0, 0.06, 0
    expected: dict[int, float] = {}
    while at < 40.0:
        for attempt in range(attempts):
            place = round((at + 0.01 + attempt * 0.004) / 1e-3)
            if place < 40_000:
                expected[place] = failing ** (sent * attempts + attempt) * (1.0 - failing)
        at, gap, sent = at + gap, min(2.0 * gap, 2.0), sent + 1
    found = joint_delay(LossyJoint((failing, failing), attempts, 0.004, 0.01, 0.0))
    assert found.sum() == pytest.approx(1.0, abs=1e-12)
    places = np.flatnonzero(found[:-1])
    assert {int(k): float(found[k]) for k in places} == pytest.approx(expected, abs=1e-15)


# benchmarks


def noting(noted: list[Any], answer: Any) -> Any:
    """What notes the one argument that it is given."""

    def note(given: Any) -> Any:
        noted.append(given)
        return answer

    return note


def test_a_call_is_timed_by_the_time_of_this_thread_over_all_its_arguments() -> None:
    node = bench("node")
    clock = Clock("thread_time")
    node.time = clock.time
    assert node.call_time(clock.taking(1.0, 2.0, 6.0), [(1,), (2,), (3,)]) == 3.0
    assert clock.calls == 3
    stretch = SimpleNamespace(
        inputs=[], state=np.zeros(1), begin=np.array([7.0]), config=np.array([2.0])
    )  # fmt: skip
    ours = node.OurCalls(stretch)
    done: list[Any] = []
    node.offer_aiding = lambda *given: done.append(("offer", *given))

    def run_cycle(*given: Any) -> None:
        done.append(("cycle", *given))
        clock.now += 4.0

    node.run_cycle = run_cycle
    ours.arguments = [(("heard",), ("read", 1)), (None, ("read", 2))]
    assert ours.seconds() == 4.0
    assert done == [("offer", 7.0, 2.0, "heard"), ("cycle", 7.0, 2.0, "read", 1), ("cycle", 7.0, 2.0, "read", 2)]
    assert stretch.state[0] == 7.0


def test_a_campaign_is_that_of_wellbore_one_and_each_ratio_has_its_own_two_figures() -> None:
    campaign = bench("campaign")
    assert FOLDER.parent == campaign.ROOT
    loaded: list[Any] = []
    campaign.load_scenario = noting(loaded, "scenario")
    campaign.OneRun = lambda scenario: scenario
    campaign.node_cycles = lambda one: {"drawn": 3.0, "bare": 2.0, "whole": 5.0, "columns": 1e-6}
    campaign.pool_time = lambda scenario, processes: {1: 11.0, 2: 7.0}[processes]
    campaign.long_string = lambda: (0.5, 1300.0)
    campaign.command_time = lambda runs: (runs / 10.0, 90.0 + runs / 1000.0)
    found = campaign.run()
    assert loaded == [FOLDER.parent / "scenarios" / "wellbore-1.toml"]
    assert loaded[0].is_file()
    rows = [(row["ours"], row["peer"], row.get("at_most"), row.get("at_least")) for row in found["ratios"].values()]
    assert rows == [
        (3.0, 2.0, 1.6, None), (5.0, 2.0, 3.0, None), (1e-6, 2.5e-6, None, 1.0), (7.0, 11.0, None, 1.8),
        (0.5, 1300.0, None, 2000.0), (100.0, 60.0, None, 1.0),
    ]  # fmt: skip
    for row in found["ratios"].values():
        assert row["ratio"] == pytest.approx(row["peer"] / row["ours"])
        assert row["ours_to_peer"] == pytest.approx(row["ours"] / row["peer"])
    few = 2 * campaign.RUNS
    assert found["memory_mb"] == {str(few): 90.0 + few / 1000.0, "1000": 91.0}


def test_a_command_is_timed_with_the_memory_of_its_largest_process(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, clock, ran = bench("campaign"), Clock("perf_counter"), list[Any]()
    campaign.time = clock.time

    def run(words: list[str], **named: Any) -> Any:
        ran.append((words, named))
        clock.now += 12.5
        return SimpleNamespace(stdout="204800\n")

    monkeypatch.setattr(campaign, "subprocess", SimpleNamespace(run=run, DEVNULL=None))
    assert campaign.command_time(30) == (12.5, 200.0)
    ((words, named),) = ran
    assert words[:2] == [sys.executable, "-c"]
    assert words[3:9] == [sys.executable, "-m", "borechain", "campaign", "wellbore-1", "--runs"]
    assert (words[9], words[10], words[11]) == ("30", "--json", "--out")
    assert words[12].endswith("/runs")
    assert named == {"capture_output": True, "text": True, "check": True}


def test_positions_of_a_survey_and_those_of_its_peer_are_of_the_same_well(monkeypatch: pytest.MonkeyPatch) -> None:
    survey = bench("survey")
    asked: list[Any] = []

    def deviation(*given: Any) -> Any:
        return SimpleNamespace(minimum_curvature=lambda: asked.append(given))

    header = SimpleNamespace(survey=SimpleNamespace(SurveyHeader=lambda **named: None))
    monkeypatch.setitem(sys.modules, "welleng", header)
    monkeypatch.setitem(sys.modules, "wellpathpy", SimpleNamespace(deviation=deviation))
    pairs: list[Any] = []

    def compare(ours: Any, peer: Any) -> dict[str, float]:
        pairs.append((ours, peer))
        return {"ours": float(len(pairs))}

    monkeypatch.setattr(survey, "compare", compare)
    monkeypatch.setattr(survey, "alternating", lambda ours, peer: {"ours": 30.0})
    monkeypatch.setattr(survey, "batch", lambda tool, site: {"ours": 40.0})
    monkeypatch.setattr(survey, "append_time", lambda: 50.0)
    monkeypatch.setattr(survey, "preload_models", lambda names: None)
    imports = {"groundstation": 6.0, "welleng": 9.0}
    monkeypatch.setattr(survey, "import_time", lambda module: imports[module.split(".")[0]])
    ratios = list(survey.run()["ratios"].values())
    assert [row["ours"] for row in ratios] == [2.0, 30.0, 3.0, 4.0, 1.0, 5.0, 40.0, 50.0, 6.0]
    assert (ratios[-1]["peer"], ratios[-1]["ratio"]) == (9.0, 1.5)
    path, peer_path = pairs[-1]
    peer_path()
    md, inclination_deg, azimuth_deg = asked[0]
    lean, turn = np.radians(inclination_deg), np.radians(azimuth_deg)
    tangents = np.stack([np.sin(lean) * np.cos(turn), np.sin(lean) * np.sin(turn), np.cos(lean)], axis=1)
    bends = np.arccos(np.clip(np.sum(tangents[1:] * tangents[:-1], axis=1), -1.0, 1.0))
    legs = 0.5 * np.diff(md) * np.tan(bends / 2.0) / (bends / 2.0)
    ends = np.cumsum(legs[:, None] * (tangents[1:] + tangents[:-1]), axis=0)
    assert np.asarray(path())[1:] == pytest.approx(ends, abs=1e-6)


def test_of_two_that_alternate_the_ratio_is_that_of_pairs_with_its_quartiles() -> None:
    node = bench("node")
    node.BLOCKS = 5
    ours, peer = iter([99.0, 1.0, 2.0, 4.0, 1.0, 2.0]), iter([99.0, 3.0, 2.0, 20.0, 7.0, 18.0])
    row = node.alternating(lambda: next(ours), lambda: next(peer), 1.5)  # ratios 3, 1, 5, 7, 9
    assert (row["ours"], row["peer"], row["ratio"], row["ratio_quartiles"]) == (2.0, 7.0, 5.0, [3.0, 7.0])
    assert (row["ours_to_peer"], row["at_most"]) == (0.2, 1.5)
    assert row["ours_to_peer_quartiles"] == pytest.approx([1.0 / 7.0, 1.0 / 3.0])


def test_a_bare_kernel_has_every_cycle_of_every_tube_and_what_a_tape_has_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    campaign, done = bench("campaign"), list[Any]()
    schedule: Any = SimpleNamespace(
        ends=np.array([1.0, 2.0, 3.0]), begins=np.array([0.0, 1.0, 2.0]), powered=np.array([1, 2, 2]),
        joined=np.array([[1.0, 0.0], [0.5, 0.0], [0.0, 1.0]]), is_sent=np.array([True, False, True]),
        measured=np.arange(3 * 12, dtype=float).reshape(3, 12),
    )  # fmt: skip
    hops = [SimpleNamespace(error=0.0, loses=0) for _ in range(2)]
    drawn: Any = SimpleNamespace(readings=np.zeros((2, 1, 6)))

    def draw(_drawn: Any, _nothing: Any, _schedule: Any, _hops: Any, cycle: int) -> None:
        for k in range(2):
            drawn.readings[k, 0] = 10.0 * cycle + k + np.arange(6) / 10.0
            hops[k].error, hops[k].loses = cycle + 0.25 * k, int(cycle == 2 and k == 1)

    monkeypatch.setattr(campaign, "draw_readings", draw)
    tape = campaign.Tape(np.zeros((3, 2, 6)), np.zeros((3, 2)), np.zeros((3, 2), int))
    campaign.record.py_func(schedule, drawn, hops, tape)
    assert tape.readings[:, :, 0].tolist() == [[0.0, 0.0], [10.0, 11.0], [20.0, 21.0]]
    assert (tape.errors.tolist(), tape.loses.tolist()) == (
        [[0.0, 0.0], [1.0, 1.25], [2.0, 2.25]],
        [[0, 0], [0, 0], [0, 1]],
    )
    nodes = [SimpleNamespace(filter=f"filter {k}", config=f"config {k}") for k in range(2)]
    told = [SimpleNamespace(drive_angle=0.1 + k, drive_var=0.2, lower_angle=0.3, lower_var=0.4) for k in range(2)]
    monkeypatch.setattr(campaign, "run_cycle", lambda *given: done.append((given[0], *given[4:])))
    monkeypatch.setattr(campaign, "offer_aiding", lambda *given: done.append(("offer", given[0], *given[4:6])))
    for is_drawn in (True, False):  # drawn anew, or from the tape
        done.clear()
        campaign.kernels.py_func(is_drawn, nodes, told, schedule, drawn, hops, tape)
        systematic = [float(schedule.measured[k][campaign.A_SYSTEMATIC]) for k in (0, 2)]
        assert done == [
            ("filter 0", 0.0, 1.0, 1), ("offer", "filter 0", pytest.approx(systematic[0] + 0.2), pytest.approx(0.1)),
            ("filter 0", 1.0, 2.0, 1), ("filter 1", 1.0, 2.0, 0), ("filter 0", 2.0, 3.0, 0), ("filter 1", 2.0, 3.0, 1),
            ("offer", "filter 1", pytest.approx(systematic[1] + 0.2), pytest.approx(1.1)),
        ]  # fmt: skip
