"""How a rig is checked, compiled and drilled, in order, by stubs of what runs."""

from __future__ import annotations

import contextlib
import json
import math
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from called_instead import Given, instead, noted
from printed_output import printed, run_command

from borechain.cli.faults import InputFault
from borechain.cli.rig import compiling_bar, drilling_bar, rig_command
from borechain.cli.rig.rig_command import chosen_view, rig
from borechain.drilling import compile_ahead, drill_hole, kernel_parts, rig_processes
from borechain.drilling.rig_job import DrilledRig, RigJob, RigRun, RigWatcher
from groundstation.page_options import PageRequest
from sim.errors import RigError, ScenarioError

JOB = RigJob(Path("rig-3"), 7, math.inf, endpoint="tcp/127.0.0.1:0")


# drilling


def test_a_rig_is_checked_compiled_drilled_and_shown_and_what_is_missing_is_its_status(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: Given = []
    result = {"missing": [[1, 2]], "measurements": 55}
    monkeypatch.setattr(rig_command, "checked_job", lambda job, page: told.append((job.seed, page)) or job)
    monkeypatch.setattr(rig_command, "compile_for_rig", lambda *given: told.append(given))
    monkeypatch.setattr(
        "borechain.api.drill_rig",
        lambda job, watcher: told.append(watcher.log is not None) or DrilledRig(result, Path("f")),
    )  # fmt: skip
    monkeypatch.setattr(rig_command, "show_result", lambda *given: told.append(given))
    monkeypatch.setattr("sim.rig.rig_result.missing_surveys_line", lambda *given: f"line of {given}")
    done = run_command(rig, "rig-3", "--seed", "4", "--chip", "2", "--page", "h:1")
    assert (done.exit_code, done.output) == (1, "Error: line of ([[1, 2]], 55, PosixPath('f'))\n")
    assert told == [(4, PageRequest("h:1")), (Path("rig-3"), "2"), True, (result, Path("f"))]
    result["missing"] = []
    done = run_command(rig, "rig-3", "--json")
    assert (done.exit_code, json.loads(done.output)) == (0, result)
    assert told[4:] == [(1, PageRequest(None)), (Path("rig-3"), ""), False]


def test_the_screen_of_the_crew_has_the_rig_as_it_was_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(rig_command, "checked_job", lambda job, _page: job)
    monkeypatch.setattr(rig_command, "compile_for_rig", lambda *_: None)
    monkeypatch.setattr(rig_command.sys, "argv", ["borechain", "rig", "rig-3"])
    drilled = instead(monkeypatch, "borechain.cli.rig.on_screen.drill_on_screen", None)
    assert run_command(rig, "rig-3", "--view", "crew", "--rig", "rig-9").exit_code == 0
    assert drilled == [(["rig", "rig-3"], "rig-9", "tcp/127.0.0.1:7447", None)]


@pytest.mark.parametrize(
    ("view", "given", "shown"),
    [
        ("crew", {"quiet": True, "inline": True}, ""), (None, {"quiet": True}, ""), ("bar", {}, "bar"),
        (None, {"on_terminal": False, "inline": True}, "log"), (None, {"inline": True}, "bar"), (None, {}, "crew"),
    ],
)  # fmt: skip
def test_what_is_shown_is_asked_for_or_by_where_it_is(view: str | None, given: dict[str, bool], shown: str) -> None:
    plain = {"inline": False, "quiet": False, "on_terminal": True}
    assert chosen_view(view, **plain | given) == shown
    with pytest.raises(InputFault, match="--view crew: expected a rig of processes"):
        chosen_view("crew", **plain | {"inline": True})


@pytest.mark.parametrize("inline", [True, False])
def test_a_job_is_checked_before_anything_is_compiled(monkeypatch: pytest.MonkeyPatch, inline: bool) -> None:
    told: Given = []
    monkeypatch.setattr("sim.world.shipped.find_scenario", lambda one: told.append(("scenario", one)))
    monkeypatch.setattr("sim.rig.launcher.refuse_used_folder", lambda one: told.append(("folder", one)))
    monkeypatch.setattr("sim.rig.launcher.check_port_free", lambda one: told.append(("port", one)))
    door = SimpleNamespace(close=lambda: told.append("closed"))
    monkeypatch.setattr(
        "groundstation.gateway.page.page_settings.open_page_socket", lambda one: told.append(("page", one)) or door
    )  # fmt: skip
    job = replace(JOB, inline=inline, out=Path("o"))
    checked = rig_command.checked_job(job, PageRequest(None))
    port = [] if inline else [("port", JOB.endpoint)]
    assert told == [("scenario", Path("rig-3")), ("folder", Path("o")), *port]
    assert checked == job
    wrong = "zenoh" if inline else "can-native"
    with pytest.raises(InputFault, match=f"--transport {wrong}: expected"):
        rig_command.checked_job(replace(job, transport=wrong), PageRequest(None))
    right = "can-native" if inline else "mixed"
    assert rig_command.checked_job(replace(job, transport=right), PageRequest(None)).transport == right
    told.clear()
    monkeypatch.setattr(rig_command, "page_settings", lambda _request: "served")
    if inline:
        with pytest.raises(InputFault, match="--page: expected a rig of processes"):
            rig_command.checked_job(job, PageRequest("h:1"))
    else:
        assert rig_command.checked_job(job, PageRequest("h:1")).served == "served"
        assert told[2:] == [("page", "served"), "closed", *port]


def world_of(**medium: Any) -> Any:
    scenario = SimpleNamespace(tubes=3, medium=SimpleNamespace(**{"link": "on", "transports": "t"} | medium))
    return SimpleNamespace(scenario=scenario, on_chips=None, rack=None)


@pytest.mark.parametrize("bus", [None, "bus"])
def test_a_hole_is_drilled_in_its_folder_and_its_result_has_what_ran(monkeypatch: pytest.MonkeyPatch, bus: Any) -> None:
    told: Given = []
    world = world_of()
    monkeypatch.setattr(drill_hole, "read_world", lambda *_: world)
    monkeypatch.setattr(drill_hole, "run_folder", lambda _job: Path("f"))
    monkeypatch.setattr(drill_hole, "page_with_password", lambda page, _say: f"{page} with a password")
    monkeypatch.setattr(drill_hole, "Ground", lambda *given: given)
    run = RigRun({"a": 1}, 9, 2)
    monkeypatch.setattr(drill_hole, "drill_inline", lambda *given: told.append(("inline", *given)) or run)
    monkeypatch.setattr(drill_hole, "drill_in_processes", lambda *given: told.append(("processes", *given)) or run)
    monkeypatch.setattr(drill_hole, "rig_result", lambda answers, of: {"answers": answers, "of": of})
    monkeypatch.setattr(drill_hole, "processor_in_use", lambda: "this one")
    monkeypatch.setattr(drill_hole, "write_files", lambda *given: told.append(("written", *given)))
    moments = iter((10.0, 12.34567))
    monkeypatch.setattr(drill_hole, "time", SimpleNamespace(monotonic=lambda: next(moments)))
    log: Any = SimpleNamespace(join=lambda *given: told.append(("log", *given)))
    job = replace(JOB, served="page")  # type: ignore[arg-type]
    drilled = drill_hole.drill_hole(job, bus, RigWatcher(progress=noted(told, "show"), log=log))
    expected = {"answers": {"a": 1}, "of": world, "processes": 9, "wall_s": 2.346, "restarts": 2, "kernels": "this one"}
    assert (drilled.result, drilled.folder) == (expected, Path("f"))
    if bus is None:
        ran: Any = ("inline", world, job, Path("f"), "show", log)
        assert told == [("show", "begins", world), ran, ("show", "ends"), ("written", Path("f"), expected)]
        return
    *ran, table = told[2]
    assert ran == ["processes", world, job, "bus", "show", log]
    assert table.args == (world, job, Path("f"), "page with a password")
    assert told[0] == ("log", JOB.endpoint, "rig-1", ("bus", "rig-1"))
    assert told[-1] == ("written", Path("f"), expected)


def test_an_interrupted_rig_names_where_what_was_stored_is(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(drill_hole, "read_world", lambda *_: world_of())
    monkeypatch.setattr(drill_hole, "run_folder", lambda _job: Path("f"))

    def interrupted(*_: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(drill_hole, "drill_inline", interrupted)
    with pytest.raises(RigError, match=r"^interrupted; every process was ended, what was stored is in f$"):
        drill_hole.drill_hole(JOB, None, RigWatcher())


def test_a_rig_has_a_link_and_tubes_on_chips_are_of_the_string(monkeypatch: pytest.MonkeyPatch) -> None:
    made: Given = []
    monkeypatch.setattr("node.translation.chip_program.chip_program", lambda: made.append("a program"))
    for said, chosen in (("", set()), ("all", {1, 2, 3}), ("1,3", {1, 3}), (" 2 ", {2})):
        assert drill_hole.tubes_on_chips(said, 3) == chosen
    assert made == ["a program"] * 3
    for said in ("0", "4", "1,4", "1,1", "1,x", ",", "1,,2"):
        with pytest.raises(
            RigError, match=f"^--chip {said}: expected all, or numbers of tubes from 1 to 3 with commas$"
        ):
            drill_hole.tubes_on_chips(said, 3)
    monkeypatch.setattr(drill_hole, "load_scenario", lambda *_: None)
    monkeypatch.setattr(drill_hole, "World", lambda *_: world_of(link="off"))
    with pytest.raises(ScenarioError, match=r'^rig-3: medium\.link: expected "on" for a rig'):
        drill_hole.read_world(JOB)
    monkeypatch.setattr(drill_hole, "World", lambda *given: made.append(given) or world_of())
    assert drill_hole.read_world(replace(JOB, chips="2")).on_chips == {2}
    assert made[-2] == (None, 7)
    holes: Any = SimpleNamespace(drilling=lambda hole: f"hole {hole}")
    monkeypatch.setattr(drill_hole, "load_scenario", lambda *_: holes)
    drill_hole.read_world(replace(JOB, hole="B"))
    assert made[-1] == ("hole B", 7)


def test_processes_are_followed_asked_at_the_end_and_counted(monkeypatch: pytest.MonkeyPatch) -> None:
    told: Given = []
    monkeypatch.setattr(rig_processes, "open_transports", noted(told, "transports"))
    table: Any = SimpleNamespace(specs={"a": 1, "b": 2, "c": 3}, restarts={"a": 2, "c": 3})
    monkeypatch.setattr(rig_processes, "operator_of", lambda world, name: ("operator", name))
    monkeypatch.setattr(rig_processes, "ask_surveys", lambda bus, name: {"asked": (bus, name)})
    monkeypatch.setattr(rig_processes, "get_json", lambda bus, selector: told.append((bus, selector)))

    class Launcher:
        def __init__(self, *given: Any) -> None:
            *rest, self.follow, operator = given
            assert (*rest, operator) == (table, "bus", "rig-1", ("operator", "rig-1"))

        def run(self, finish: Any) -> Any:
            self.follow("tick")
            return finish("the bus")

    monkeypatch.setattr(rig_processes, "Launcher", Launcher)
    log: Any = SimpleNamespace(
        on_tick=lambda *given: told.append(("log", *given)),
        poll=lambda ask, since: told.append(("poll", since)) or ask("verdict", {"a": "1"}),
    )
    bus: Any = "bus"
    places: Given = []

    def table_of(transports: Any, steps: Path) -> Any:
        places.append((transports, steps.name))
        return table

    run = rig_processes.drill_in_processes(
        world_of(), JOB, bus, lambda tick: told.append(("show", tick)), log, table_of
    )  # fmt: skip
    assert run == RigRun({"asked": ("the bus", "rig-1")}, 3, 5)
    assert places == [("transports", "steps")]
    assert told[1:-1] == [
        ("show", "tick"), ("log", "tick", {"a": 2, "c": 3}), ("poll", 0),
        ("the bus", "borechain/rig-1/ground/verdict?a=1"),
    ]  # fmt: skip


# compiling


def test_what_is_lacking_alone_is_compiled(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    marks = {part: tmp_path / part for part in ("step", "surveys", "adjustment", "integers")}
    monkeypatch.setattr(compile_ahead, "mark_of", lambda part: marks[part])
    compiled: Given = []

    def compile_parts(parts: Any, tell: Any) -> None:
        compiled.append(list(parts))
        tell(12)

    monkeypatch.setattr(compile_ahead, "compile_parts", compile_parts)
    shown: Given = []

    @contextlib.contextmanager
    def show(count: int) -> Any:
        shown.append(count)
        yield shown.append

    marks["adjustment"].touch()
    compile_ahead.compile_ahead("float64", show)
    assert (compiled, shown) == ([["step", "surveys"]], [305 + 270, 12])
    marks["step"].touch()
    assert not compile_ahead.are_compiled("float64")
    compile_ahead.compile_ahead("fixed", show)
    assert (compiled[1], shown[2:]) == (["surveys", "integers"], [270 + 500, 12])
    for part in ("surveys", "integers"):
        marks[part].touch()
    compile_ahead.compile_ahead("fixed", show)
    assert len(compiled) == 2
    assert compile_ahead.are_compiled("float64")
    assert compile_ahead.are_compiled("chip")


def test_parts_are_compiled_by_one_process_and_each_line_is_one_function(monkeypatch: pytest.MonkeyPatch) -> None:
    done: Given = []

    class Running:
        def __init__(self, command: list[str], stdout: int) -> None:
            assert command[1:] == ["-m", "borechain.drilling.kernel_parts", "step", "integers"]
            self.stdout = [b".\n"] * 3

        def __enter__(self) -> Running:
            return self

        def __exit__(self, *_: object) -> None:
            done.append("waited for")

        def terminate(self) -> None:
            done.append("ended")

    monkeypatch.setattr(compile_ahead.subprocess, "Popen", Running)
    counts: Given = []
    compile_ahead.compile_parts(["step", "integers"], counts.append)
    assert (counts, done) == ([1, 2, 3], ["waited for"])

    def interrupt(count: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        compile_ahead.compile_parts(["step", "integers"], interrupt)
    assert done[1:] == ["ended", "waited for"]


def test_a_part_that_failed_is_not_marked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(kernel_parts, "mark_of", lambda part: tmp_path / part)
    monkeypatch.setattr(kernel_parts, "load_compiler", lambda: None)
    begun: Given = []

    class Process:
        def __init__(self, target: Any, args: tuple[str]) -> None:
            assert target is kernel_parts.compile_part
            self.part = args[0]
            self.exitcode = {"step": 0, "surveys": 1}.get(self.part, -9)

        def start(self) -> None:
            begun.append(f"{self.part} starts")

        def join(self) -> None:
            begun.append(f"{self.part} ends")

        def kill(self) -> None:
            begun.append(f"{self.part} is ended")

    monkeypatch.setattr(kernel_parts.multiprocessing, "get_context", lambda way: SimpleNamespace(Process=Process))
    kernel_parts.compile_beside(["surveys", "step", "integers"])
    assert [one.name for one in tmp_path.iterdir()] == ["step"]
    parts = ("surveys", "step", "integers")
    assert begun == [f"{part} {what}" for what in ("starts", "ends", "is ended") for part in parts]


def test_a_part_is_compiled_by_its_name_and_a_line_is_said_for_each(monkeypatch: pytest.MonkeyPatch) -> None:
    assert (
        set(kernel_parts.PARTS) == set(compile_ahead.ABOUT) == {p for ps in compile_ahead.PARTS_OF.values() for p in ps}
    )
    lines = printed(kernel_parts.say_one)
    assert lines == ["."]
    warmed: Given = []
    for place in ("warm_up", "warm_encoder", "warm_end"):
        monkeypatch.setattr(f"node.kernels.step.precompile.{place}", lambda place=place: warmed.append(place))
    monkeypatch.setattr(kernel_parts, "warm_surveys", lambda: warmed.append("surveys"))
    monkeypatch.setattr(
        "groundstation.survey.adjustment.warm_adjustment.warm_adjustment", lambda: warmed.append("adjustment")
    )  # fmt: skip
    monkeypatch.setattr("node.kernels.step.precompile.warm_step", lambda *given: warmed.append(given))
    monkeypatch.setattr(
        "node.firmware.kernel_choice.kernel_of", lambda name: SimpleNamespace(step=f"{name} step", aiding="aiding")
    )  # fmt: skip
    for part in kernel_parts.PARTS.values():
        part()
    assert warmed == ["warm_up", "warm_end", "warm_encoder", "surveys", "adjustment", ("fixed step", "aiding")]


@pytest.mark.parametrize(("chips", "kernel"), [("", "float64"), ("2", "fixed")])
def test_a_rig_on_chips_has_its_integers_compiled(monkeypatch: pytest.MonkeyPatch, chips: str, kernel: str) -> None:
    asked = instead(monkeypatch, "borechain.drilling.compile_ahead.compile_ahead", None)
    for is_terminal, shown in ((False, compiling_bar.compiling_line), (True, compiling_bar.compiling_bar)):
        monkeypatch.setattr(
            compiling_bar, "sys", SimpleNamespace(stderr=SimpleNamespace(isatty=lambda is_one=is_terminal: is_one))
        )  # fmt: skip
        compiling_bar.compile_for_rig(Path("rig-3"), chips)
        assert asked.pop() == (kernel, shown)


class Bar:
    """A bar that notes what it is told."""

    made: Given = []  # noqa: RUF012

    def __init__(self, *shown: Any, **named: Any) -> None:
        Bar.made.append(("bar", named["console"].stderr))

    def __enter__(self) -> Bar:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def start(self) -> None:
        Bar.made.append("starts")

    def stop(self) -> None:
        Bar.made.append("stops")

    def add_task(self, words: str, total: float) -> int:
        Bar.made.append((words, total))
        return 5

    def update(self, *given: Any, **named: Any) -> None:
        Bar.made.append((*given, named))


def test_bars_show_how_much_is_compiled_and_how_far_the_rig_is(monkeypatch: pytest.MonkeyPatch) -> None:
    Bar.made = []
    monkeypatch.setattr("rich.progress.Progress", Bar)
    with compiling_bar.compiling_bar(10) as tell:
        tell(3)
        tell(10)
    assert Bar.made == [
        ("bar", True), ("", 10), (5, {"completed": 3, "total": 10}), (5, {"completed": 10, "total": 11}), "stops",
    ]  # fmt: skip
    Bar.made = []
    world: Any = SimpleNamespace(begin=100.0, end=340.0)
    with drilling_bar.DrillingBar(world) as show:
        show(SimpleNamespace(rig_time=150.0, begin=120.0, phase="turn"))  # type: ignore[arg-type]
    assert Bar.made == [
        ("bar", True), ("starting", 240.0), "starts", (5, {"completed": 30.0, "description": "turn"}), "stops",
    ]  # fmt: skip


def test_a_line_says_how_many_functions_were_compiled(capsys: pytest.CaptureFixture[str]) -> None:
    with compiling_bar.compiling_line(10) as tell:
        tell(3)
        tell(8)
    assert capsys.readouterr().err.splitlines() == [
        f"compiling about 10 functions for this machine: {compiling_bar.HOW_LONG}", "8 functions are compiled",
    ]  # fmt: skip
