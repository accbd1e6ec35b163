"""Who runs a rig, by hand: ticks, cues, the watchdog, folders and endpoints, the table of processes, the operator."""

from __future__ import annotations

import re
import socket
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from borechain.drilling import drill_hole, rig_host
from borechain.drilling.rig_job import RigJob
from sim.errors import RigError
from sim.rig import launcher, processes
from sim.rig.launcher import Launcher, Tick, Watchdog
from sim.rig.processes import ProcessTable, Spec
from sim.rig.rack_operator import BusGroundClient
from sim.rig.rig_progress import RigProgress, give_up
from sim.rig.stepper import Acted
from telemetry.messages import BASE, ENCODER

PROGRESS = RigProgress("drill tube 2", 31.5, 1.0, 99.0, [BASE, ENCODER, 3], [2], cue="solve")


# a launcher and its watchdog


def tick(**change: Any) -> Tick:
    fields = {"phase": "p", "rig_time": 5.0, "begin": 1.0, "end": 9.0, "wanted": ("1",), "kill": (), "finished": False}
    return Tick(**(fields | {"cue": ""} | change))


def test_progress_is_said_and_heard_field_by_field() -> None:
    heard = Tick.parse(rig_host.pack_progress(PROGRESS))
    assert heard == Tick("drill tube 2", 31.5, 1.0, 99.0, ("base", "encoder", "3"), ("2",), False, "solve")
    assert Tick.parse(rig_host.pack_progress(RigProgress("x", 1.0, 2.0, 3.0, finished=True))).finished
    with pytest.raises(TypeError, match="expected Progress, got str"):
        rig_host.pack_progress("x")


class Table:
    """A table of processes that notes what is asked of it."""

    def __init__(self) -> None:
        self.said: list[Any] = []
        self.running: dict[str, Any] = {}
        self.failures: list[str] = []

    def start(self, name: str) -> None:
        self.said.append(("start", name))
        self.running[name] = SimpleNamespace(exitcode=None)

    def reconcile(self, wanted: list[str], kill: list[str]) -> None:
        self.said.append((tuple(wanted), tuple(kill)))

    def stop(self) -> None:
        self.said.append("stop")


class Bus:
    """A bus of which the medium's ticks come as soon as they are subscribed to."""

    def __init__(self, *ticks: RigProgress) -> None:
        self.ticks, self.put, self.asked = ticks, list[Any](), list[Any]()
        self.replies: list[Any] = []

    def subscribe(self, key: str, call: Any) -> None:
        self.asked.append(key)
        for one in self.ticks:
            call(key, rig_host.pack_progress(one))

    def publisher(self, key: str) -> Any:
        return SimpleNamespace(put=lambda payload: self.put.append((key, payload)))

    def get(self, selector: str, patience: float) -> list[Any]:
        self.asked.append((selector, patience))
        return self.replies


def at(time: float, cue: str = "", **change: Any) -> RigProgress:
    return RigProgress("p", time, 0.0, 9.0, cue=cue, **change)


def test_a_launcher_keeps_what_is_wanted_answers_each_cue_once_and_asks_at_the_end() -> None:
    bus = Bus(
        at(1.0, wanted=[BASE]), at(2.0, "begin", wanted=[BASE, 1], kill=[2]), at(2.0, "begin"), at(2.0, "begin"),
        at(3.0), at(4.0, "begin"), at(5.0, "solve"), at(9.0, finished=True),
    )  # fmt: skip
    table, shown, acts = Table(), list[float](), [Acted.NO_ANSWER, Acted.DONE, Acted.LATER, Acted.DONE]
    cues: list[str] = []

    def act(_bus: Any, cue: str) -> Acted:
        cues.append(cue)
        return acts.pop(0)

    run = Launcher(table, bus, "r", lambda one: shown.append(one.rig_time), act)  # type: ignore[arg-type]
    assert run.run(lambda asked: {"asked": asked is bus}) == {"asked": True}
    assert shown == [1.0, 2.0, 2.0, 2.0, 3.0, 4.0, 5.0, 9.0]
    assert cues == ["begin", "begin", "begin", "solve"]  # asked again until it is answered, and anew after a while
    assert bus.asked == ["borechain/r/stepper/wanted"]
    assert bus.put == [("borechain/r/stepper/cue", said) for said in (b"done begin", b"later begin", b"done solve")]
    assert table.said[:3] == [("start", "medium"), (("base",), ()), (("base", "1"), ("2",))]
    assert table.said[-1] == "stop"


@pytest.mark.parametrize(
    ("exitcode", "failures", "told"),
    [
        (1, [], "the medium process ended before the schedule did; its message stands above"),
        (0, [], "the medium process ended before the schedule did; its message stands above"),
        (None, ["first", "second"], "first"),
    ],
)
def test_a_launcher_ends_all_where_the_medium_or_a_process_fails(
    exitcode: int | None, failures: list[str], told: str
) -> None:
    table = Table()
    table.failures = failures
    table.start = lambda name: table.running.update({name: SimpleNamespace(exitcode=exitcode)})  # type: ignore[method-assign]
    with pytest.raises(RigError, match=f"^{told}$"):
        Launcher(table, Bus(at(1.0)), "r", lambda _t: None).run(lambda _b: {})  # type: ignore[arg-type]
    assert table.said[-1] == "stop"
    table = Table()
    with pytest.raises(KeyboardInterrupt):
        Launcher(table, Bus(at(1.0)), "r", interrupt).run(lambda _b: {})  # type: ignore[arg-type]
    assert table.said[-1] == "stop"


def interrupt(_tick: Tick) -> None:
    import signal

    signal.raise_signal(signal.SIGTERM)


def test_a_watchdog_bites_once_nothing_moves_for_its_limit(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(launcher, "time", SimpleNamespace(monotonic=lambda: clock.now))

    def bites(dog: Watchdog, running: tuple[str, ...] = ()) -> str:
        try:
            dog.check(running)
        except RigError as error:
            return str(error)
        return ""

    dog = Watchdog(10.0)
    clock.now = 109.9
    assert bites(dog) == ""
    clock.now = 110.0
    assert bites(dog) == "the medium has said nothing for 10 s"
    for moved in (
        tick(),
        tick(rig_time=6.0),
        tick(rig_time=6.0, cue="c"),
        tick(rig_time=6.0, cue="c", wanted=("1", "2")),
    ):
        clock.now += 9.0
        dog.on_tick(moved)
        assert bites(dog) == ""
    clock.now += 5.0
    dog.on_tick(tick(rig_time=6.0, cue="c", wanted=("1", "2"), phase="q"))  # of which nothing moved
    clock.now += 5.0
    assert bites(dog) == "rig time stands at 6.0 s (q) for 10 s; it waits for cue c"
    dog.on_tick(tick(rig_time=7.0, wanted=("1", "2", "3")))
    clock.now += 10.0
    assert bites(dog, ("1",)) == "rig time stands at 7.0 s (p) for 10 s; it waits for processes 2, 3"
    assert bites(dog, ("1", "2", "3")).endswith("it waits for processes 1, 2, 3")
    for waited, ends in ((89.9, False), (90.0, True)):
        if ends:
            with pytest.raises(RigError, match=r"^process 7 did not attach within 90 s$"):
                give_up("7", waited)
        else:
            give_up("7", waited)


def test_an_endpoint_is_one_that_is_free(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        with pytest.raises(RigError, match=f"^endpoint {endpoint}: .* in use; choose another with --endpoint tcp/"):
            launcher.check_port_free(endpoint)
    launcher.check_port_free(endpoint)
    launcher.check_port_free(endpoint.replace("tcp", "tls"))
    for wrong in ("udp/127.0.0.1:9", "tcp/127.0.0.1:x", "tcp/127.0.0.1", ""):
        with pytest.raises(RigError, match=f"^endpoint: expected tcp/HOST:PORT or tls/HOST:PORT, got {wrong}$"):
            launcher.check_port_free(wrong)
    assert launcher.next_run_folder(tmp_path) == tmp_path / "run-0001"
    for name in ("run-0007", "run-12", "run-2x", "other-0099"):
        (tmp_path / name).mkdir()
    assert launcher.next_run_folder(tmp_path) == tmp_path / "run-0013"
    assert launcher.private_folder(tmp_path, "tube-3") == tmp_path / "state" / "tube-3"


def test_a_folder_of_a_run_is_new_or_empty_and_can_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    place = tmp_path / "a" / "b"
    for _ in range(2):
        launcher.prepare_folder(place)
        assert list(place.iterdir()) == []
    (place / "x").touch()
    told = f"output folder {place}: expected a new or empty folder, it holds an earlier run; choose another --out"
    with pytest.raises(RigError, match=f"^{re.escape(told)}$"):
        launcher.prepare_folder(place)
    with pytest.raises(RigError, match=r": Not a directory; choose a writable folder with --out$"):
        launcher.prepare_folder(place / "x" / "y")
    monkeypatch.chdir(tmp_path)
    for k in (1, 2):
        found = drill_hole.run_folder(RigJob(Path("s/deep.toml"), 1, 1.0))
        assert found == Path("out/deep") / f"run-{k:04d}"
        assert found.is_dir()
    assert drill_hole.run_folder(RigJob(Path("s/deep.toml"), 1, 1.0, out=Path("own"))) == Path("own")


# a table of processes


class Fork:
    """A process that is there until it is ended."""

    def __init__(self, target: Any, args: tuple[Any, ...] = (), name: str = "") -> None:
        self.said: list[Any] = [(target, args, name)]
        self.exitcode: int | None = None
        self.pid = 4000

    def start(self) -> None:
        self.said.append("start")

    def kill(self) -> None:
        self.said.append("kill")

    def join(self, timeout: float | None = None) -> None:
        self.said.append(("join", timeout))


def test_what_runs_is_what_is_wanted_and_who_dies_too_often_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = SimpleNamespace(now=100.0)
    monkeypatch.setattr(processes, "time", SimpleNamespace(monotonic=lambda: clock.now))
    table = ProcessTable({name: Spec(print, (name,)) for name in "abc"}, [])
    table._context = SimpleNamespace(Process=Fork)
    table.reconcile(["a", "b"], [])
    first: Any = dict(table.running)
    assert {name: one.said for name, one in first.items()} == {
        name: [(print, (name,), f"borechain {name}"), "start"] for name in "ab"
    }
    table.reconcile(["a", "b"], [])
    assert table.running == first  # nothing is started twice
    table.reconcile(["a"], ["b"])  # the power is cut: no death
    assert list(table.running) == ["a"]
    assert first["b"].said[2:] == ["kill", ("join", None)]
    table.reconcile(["a"], ["a", "c"])  # one that is wanted all the same did not answer
    assert table.restarts == {"a": 1}
    assert table.running["a"] is not first["a"]
    for k in range(2, 7):
        clock.now += 100.0
        table.running["a"].exitcode = -9  # type: ignore[misc]
        assert table.failures == []
        table.reconcile(["a"], [])
        assert table.restarts == {"a": k}
    assert table.failures == ["process a was started again 5 times within 600 s; last it ended with status -9"]
    clock.now += 600.0  # all but one of those are forgotten
    table.running["a"].exitcode = 1  # type: ignore[misc]
    table.reconcile([], [])
    assert (table.restarts, len(table.failures), table.running) == ({"a": 7}, 1, {})


def test_all_are_asked_to_end_and_then_made_to(monkeypatch: pytest.MonkeyPatch) -> None:
    clock, sent = SimpleNamespace(now=100.0), list[Any]()
    monkeypatch.setattr(processes, "time", SimpleNamespace(monotonic=lambda: clock.now))
    monkeypatch.setattr(processes, "os", SimpleNamespace(kill=lambda *given: sent.append(given)))
    table = ProcessTable({}, [])
    one, other = Fork(print), Fork(print)
    other.pid, other.exitcode = 5000, 0
    one.join = lambda timeout=None: (setattr(clock, "now", clock.now + 3.0), one.said.append(timeout))  # type: ignore[method-assign,assignment]
    table.running = {"a": one, "b": other}  # type: ignore[dict-item]
    table.stop()
    assert sent == [(4000, 15), (4000, 9)]
    assert one.said[1:] == [5.0, 5.0]
    assert other.said[1:] == [("join", 2.0), ("join", 2.0)]
    assert table.running == {}


def test_an_operator_asks_over_the_bus_and_a_refusal_is_told() -> None:
    bus = Bus()
    client = BusGroundClient(bus, "r")  # type: ignore[arg-type]
    assert client.ask("setup") is None
    bus.replies = [SimpleNamespace(error=None, payload=b'{"a": 1}')]
    assert client.ask("setup") == {"a": 1}
    assert client.command("recalibrate", {"action": "solve", "x": "2"}) == {"a": 1}
    assert [selector for selector, _ in bus.asked] == [
        "borechain/r/ground/setup", "borechain/r/ground/setup", "borechain/r/cmd/recalibrate?action=solve;x=2",
    ]  # fmt: skip
    assert {patience for _, patience in bus.asked} == {10.0}
    bus.replies = [SimpleNamespace(error="no", payload=b"")]
    with pytest.raises(RigError, match=r"^borechain/r/ground/setup: no$"):
        client.ask("setup")
