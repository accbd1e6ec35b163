"""The demonstration and the crew's screen of a rig, by stubs of what drills."""

from __future__ import annotations

import contextlib
import io
import math
import signal
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from called_instead import Given, instead, noted
from printed_output import run_command

from borechain.cli.faults import EnvironmentFault, InputFault
from borechain.cli.rig import demo, on_screen
from borechain.drilling.rig_job import RigJob
from telemetry.errors import MediumError

JOB = RigJob(Path("rig-3"), 7, math.inf, endpoint="tcp/127.0.0.1:0")


# the demonstration and the screen


def test_a_demonstration_drills_a_hole_a_round_with_the_seed_of_the_round(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    told: Given = []
    settings = SimpleNamespace(url="http://h:1", name="page")
    door = SimpleNamespace(close=lambda: told.append("closed"))
    monkeypatch.setattr(demo, "page_settings", lambda request: settings if request.page == "h:1" else None)
    monkeypatch.setattr("groundstation.gateway.page.page_settings.open_page_socket", lambda _settings: door)
    monkeypatch.setattr("sim.rig.launcher.check_port_free", lambda one: told.append(("port", one)))
    monkeypatch.setattr(demo, "compile_for_rig", lambda *given: told.append(given))
    monkeypatch.setattr("borechain.drilling.drill_hole.page_with_password", lambda page, _say: page)
    monkeypatch.setattr("borechain.drilling.rig_host.opened_router", noted(told, "router"))
    monkeypatch.setattr("sim.world.shipped.find_scenario", lambda one: f"file of {one}")
    monkeypatch.setattr(demo, "drill_demo_hole", lambda *given: told.append(given[:3]))
    words = ("--page", "h:1", "--speed", "4", "--endpoint", "tcp/127.0.0.1:9")
    done = run_command(demo.demo, *words, "--rounds", "2")
    assert (done.exit_code, done.output) == (0, "open http://h:1 in a browser; Ctrl-C ends the demonstration\n")
    jobs = [RigJob("file of demo", seed, 4.0, endpoint="tcp/127.0.0.1:9") for seed in (1, 2)]  # type: ignore[arg-type]
    assert told == [
        "closed", ("port", "tcp/127.0.0.1:9"), (Path("demo"),), ("router", "begins", "tcp/127.0.0.1:9"),
        *((job, "router", settings) for job in jobs), ("router", "ends"),
    ]  # fmt: skip

    def interrupted(job: RigJob, *_: Any) -> None:
        if job.seed == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr(demo, "drill_demo_hole", interrupted)
    assert run_command(demo.demo, *words).output.splitlines()[-1] == "ended"
    assert run_command(demo.demo, "--page", "off").output == ""


def test_a_hole_of_the_demonstration_has_its_page_and_no_log(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("borechain.drilling.drill_hole.read_world", lambda job, _say: f"world of {job.seed}")
    drilled = instead(monkeypatch, "borechain.drilling.rig_processes.drill_in_processes", None)
    bus, page = "bus", "page"
    demo.drill_demo_hole(JOB, bus, page, Path("f"))  # type: ignore[arg-type]
    world, job, given, _, log, table = drilled[0]
    assert (world, job, given, log) == ("world of 7", JOB, "bus", None)
    assert table.args == ("world of 7", JOB, Path("f"), "page")


class Process:
    """A rig that runs until it is told otherwise."""

    def __init__(self, returncode: int | None = None) -> None:
        self.returncode, self.told = returncode, list[Any]()
        self.ends_with = 0

    def poll(self) -> int | None:
        return self.returncode

    def send_signal(self, number: int) -> None:
        self.told.append(number)
        self.returncode = self.ends_with

    def terminate(self) -> None:
        self.told.append("terminated")

    def wait(self, within: float) -> None:
        self.told.append(within)


@pytest.mark.parametrize(
    ("status", "fault"), [(0, None), (1, EnvironmentFault), (2, InputFault), (130, EnvironmentFault)]
)
def test_who_leaves_the_screen_ends_the_rig_and_sees_what_it_printed(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], status: int, fault: Any
) -> None:
    process = Process()
    process.ends_with = status

    @contextlib.contextmanager
    def started(arguments: Any, written: Any) -> Any:
        assert arguments == ["rig", "rig-3"]
        written.write("what it printed\n")
        yield process

    monkeypatch.setattr(on_screen, "rig_process", started)
    monkeypatch.setattr(on_screen, "join_ground", lambda *given: contextlib.nullcontext("ground"))
    shown = instead(monkeypatch, "borechain.cli.rig.on_screen.show_crew_screen", None)
    with pytest.raises(fault) if fault else contextlib.nullcontext() as ended:
        on_screen.drill_on_screen(["rig", "rig-3"], "rig-1", "tcp/h:1", None)
    assert shown == [("ground", "rig-1", process)]
    assert process.told == [signal.SIGINT, on_screen.ENDS_WITHIN]
    lines = capsys.readouterr().out.splitlines()
    assert lines == [
        "starting; the screen of the crew opens when tcp/h:1 can be joined, Ctrl-C ends it", "what it printed",
    ]  # fmt: skip
    if fault:
        assert ended.value.message == f"the rig ended with status {status}; its message stands above"


def test_a_rig_is_joined_once_it_answers_and_not_where_it_has_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    tried: Given = []

    @contextlib.contextmanager
    def connect(*given: Any, **named: Any) -> Any:
        tried.append((*given, named))
        if len(tried) < 3:
            raise MediumError("not yet")
        yield "ground"

    monkeypatch.setattr(on_screen, "connect_to_ground", connect)
    with on_screen.join_ground(Process(), "tcp/h:1", "rig-1", None) as ground:  # type: ignore[arg-type]
        assert ground == "ground"
    assert tried == [("tcp/h:1", "rig-1", 2.0, {"keys_place": None, "role": "driller"})] * 3
    with on_screen.join_ground(Process(1), "tcp/h:1", "rig-1", None) as ground:  # type: ignore[arg-type]
        assert ground is None
    assert len(tried) == 3


@pytest.mark.parametrize("code", [None, 0])
def test_a_rig_behind_the_screen_logs_and_ends_with_it(monkeypatch: pytest.MonkeyPatch, code: int | None) -> None:
    process, begun = Process(code), list[Any]()
    monkeypatch.setattr(on_screen.subprocess, "Popen", lambda words, **named: begun.append((words, named)) or process)
    written: Any = io.StringIO()
    with on_screen.rig_process(["rig", "rig-3"], written) as running:
        assert running is process
    (words, named), *_ = begun
    assert words[1:] == ["-m", "borechain", "rig", "rig-3", "--view", "log"]
    assert (named["stdout"], named["stderr"]) == (written, on_screen.subprocess.STDOUT)
    assert process.told == (["terminated", 30.0] if code is None else [])
