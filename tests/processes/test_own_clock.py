"""Real processes on their own clocks over loopback: the yaw comes down, a killed node keeps it, the end is clean."""

from __future__ import annotations

import contextlib
import datetime
import json
import math
import re
import shutil
import signal
import socket
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from forked_commands import Command as Forked
from own_clock_surface import Surface, living
from rigs import PATIENCE, first_answer, free_endpoint, run, started, started_by

from borechain.pki.access import read_access
from borechain.pki.rig_keys import add_tube, init_rig
from groundstation.service.disk.ground_store import Store
from node.process.encoder_command import encoder
from node.process.tube_command import node
from node.process.tube_process import TubeProcess
from sim.can.can_hub import running_hub
from sim.world.recording import record_sensors, turning_once, yaw_error
from telemetry.application.seals import seals_of
from telemetry.media.can_timing import BitRates
from telemetry.media.credentials import credentials_of
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router
from telemetry.messages import BASE, EPOCH_UNKNOWN, Command, Event, NodeFlag, NodeState, Reply, Side

RIG = "own-clock"
UNFIT = NodeFlag.YAW_UNTRUSTED | NodeFlag.CLOCK_UNSYNCHRONISED


class String:
    """An encoder and a tube in processes of their own, and whatever else is started."""

    def __init__(self, folder: Path, endpoint: str) -> None:
        self.folder, self.endpoint = folder, endpoint
        self.world = turning_once(1, time.monotonic(), 600.0, 10.0, 700.0, seed=4, clock_std=0.0)
        record_sensors(self.world, folder)
        self.running: dict[str, Forked] = {}

    def start(self, name: str, *options: str) -> None:
        place = ("--endpoint", self.endpoint, "--folder", str(self.folder / name))
        self.running[name] = started(name, "--clock", "own", "--rig", RIG, *options, *place)

    def start_encoder(self) -> None:
        recording = f"timed:{self.folder / 'encoder.npy'}"
        self.start("encoder", "--counter", recording, "--above", "base", "--below", "1")

    def start_node(self) -> None:
        recording, joint = f"timed:{self.folder / 'tube-1.npy'}", self.world.tube_settings(1).drive_joint
        angle = f"--drive-joint-deg={math.degrees(joint.angle)}"
        self.start("node", "--tube", "1", "--imu", recording, "--above", "encoder", angle)

    def kill(self, name: str) -> None:
        self.running[name].kill()
        self.running.pop(name).communicate()

    def end(self) -> None:
        """Ask every process to end, and see that it does so in silence."""
        for process in self.running.values():
            process.send_signal(signal.SIGTERM)
        for process in self.running.values():
            assert process.communicate(timeout=PATIENCE) == ("", "")
            assert process.returncode == 0
        self.running.clear()


class StartedNode:
    """A node that is no child of a process with numba; it ends when it is asked to."""

    def __init__(self, *words: str) -> None:
        self._process = started_by((), *words)
        self.pid = self._process.pid
        self.said: tuple[str, str] = ("", "not ended")

    def close(self) -> None:
        self._process.send_signal(signal.SIGTERM)
        self.said = self._process.communicate(timeout=PATIENCE)


@pytest.fixture
def router() -> Iterator[tuple[str, ZenohBus]]:
    endpoint = free_endpoint()
    with open_router(endpoint) as bus:
        yield endpoint, bus


@pytest.fixture
def string(tmp_path: Path, router: tuple[str, ZenohBus]) -> Iterator[String]:
    string = String(tmp_path, router[0])
    yield string
    for name in list(string.running):
        string.kill(name)


@pytest.fixture
def surface(router: tuple[str, ZenohBus]) -> Iterator[Surface]:
    with living(Surface(), router[1], RIG) as surface:
        yield surface


def test_a_node_finds_its_yaw_keeps_it_over_kills_of_both_and_ends_when_asked(
    string: String, surface: Surface, tmp_path: Path
) -> None:
    string.start_encoder()
    string.start_node()
    state = surface.first(NodeState, lambda s: not s.flags & UNFIT)
    assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02
    assert state.hops == 1
    surface.loop.call(lambda process, now: process.endpoint.mail.command(Command(1, 5, "timing"), now))
    reply = surface.first(Reply, lambda r: r.sequence == 5)
    assert reply.done
    assert reply.values["cycle_max"] > 0.0
    assert (
        reply.values["aiding_max"] >= 0.0
    )  # by two clocks, which know of each other to milliseconds on a busy machine

    string.kill("node")
    saved = tmp_path / "saved"
    shutil.copytree(tmp_path / "node", saved)
    kept = TubeProcess(string.world.tube_settings(1), saved)
    assert abs(yaw_error(string.world, 1, kept.tube.yaw, state.at)) < 0.02

    string.start_node()
    event = surface.first(Event, lambda e: e.code == "restored")
    assert event.tube == 1
    state = surface.first(NodeState, lambda s: s.flags & NodeFlag.RESTORED and not s.flags & UNFIT)
    assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02

    string.kill("encoder")
    string.start_encoder()
    again = surface.first(NodeState, lambda s: s.epoch not in (EPOCH_UNKNOWN, state.epoch) and not s.flags & UNFIT)
    assert abs(yaw_error(string.world, 1, again.yaw, again.at)) < 0.02

    string.running["node"].send_signal(signal.SIGUSR1)
    while not (tmp_path / "node" / "timing.json").exists():
        surface.first(NodeState, lambda s: s.tube == 1)

    string.end()
    for name in ("encoder", "node"):
        report = json.loads((tmp_path / name / "timing.json").read_text())
        assert report["cycles"] > 0
        assert report["stages_ms"]["cycle"]["count"] == report["cycles"]


def test_a_node_whose_step_is_the_c_library_has_no_compiler_in_its_process(string: String, surface: Surface) -> None:
    """Started as on a board; what it says is that of a node."""
    string.start_encoder()
    imu, joint = f"timed:{string.folder / 'tube-1.npy'}", string.world.tube_settings(1).drive_joint
    made = ("--kernel", "fixed", "--compiled-by", "c", f"--drive-joint-deg={math.degrees(joint.angle)}")
    place = ("--endpoint", string.endpoint, "--folder", str(string.folder / "node"), "--rig", RIG)
    own = ("node", "--tube", "1", "--clock", "own", "--above", "encoder", "--imu", imu)
    with contextlib.closing(StartedNode(*own, *made, *place)) as process:
        state = surface.first(NodeState, lambda s: not s.flags & UNFIT)
        assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02
        loaded = Path(f"/proc/{process.pid}/maps").read_text()
        assert "step-" in loaded
        assert not {"llvmlite", "numba", "scipy"} & set(re.findall(r"site-packages/([a-z]+)", loaded))
    assert process.said == ("", "")
    string.end()


@pytest.mark.parametrize("settings", ["frames=fd", "frames=classic,profile=native"])
def test_a_base_station_on_zenoh_hears_a_node_on_can_that_opens_no_session(
    string: String, surface: Surface, settings: str
) -> None:
    with running_hub(BitRates(500_000.0, 2_000_000.0)) as hub:
        joint = f"can:{hub.port}/joint,interface=borechain_loopback,{settings}"
        counter, imu = (f"timed:{string.folder / name}.npy" for name in ("encoder", "tube-1"))
        angle = f"--drive-joint-deg={math.degrees(string.world.tube_settings(1).drive_joint.angle)}"
        string.start("encoder", "--counter", counter, "--above", "base", "--lower", joint)
        nowhere = ("--endpoint", "tcp/127.0.0.1:1")
        string.start("node", "--tube", "1", "--imu", imu, angle, "--upper", joint, *nowhere)
        state = surface.first(NodeState, lambda s: not s.flags & UNFIT)
        assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02
        assert state.hops == 1
        string.end()
    report = json.loads((string.folder / "node" / "timing.json").read_text())
    assert list(report["ports"]) == ["upper"]
    assert report["ports"]["upper"]["not_sent"].get("dropped", 0) == 0


def test_a_sealed_string_on_can_is_heard_over_tls(tmp_path: Path) -> None:
    """On the native profile a sealed frame goes by ISO-TP; a base without keys would hear no tube."""
    keys, endpoint = tmp_path / "stick", free_endpoint().replace("tcp/", "tls/")
    now = datetime.datetime.now(datetime.UTC)
    init_rig(keys, RIG, now)
    add_tube(keys, 1, now)
    string = String(tmp_path, endpoint)
    with (
        open_router(endpoint, credentials_of(keys, "router"), read_access(keys)),
        open_client(endpoint, PATIENCE, credentials_of(keys, "base")) as bus,
        living(Surface(seals_of(keys, BASE, [Side.LOWER])), bus, RIG) as surface,
        running_hub(BitRates(500_000.0, 2_000_000.0)) as hub,
        contextlib.ExitStack() as stack,
    ):
        stack.callback(lambda: [string.kill(name) for name in list(string.running)])
        joint = f"can:{hub.port}/joint,interface=borechain_loopback,frames=fd,profile=native"
        counter, imu = (f"timed:{string.folder / name}.npy" for name in ("encoder", "tube-1"))
        angle = f"--drive-joint-deg={math.degrees(string.world.tube_settings(1).drive_joint.angle)}"
        under = ("--keys", str(keys))
        string.start("encoder", "--counter", counter, "--above", "base", "--lower", joint, *under)
        string.start("node", "--tube", "1", "--imu", imu, angle, "--upper", joint, *under)
        state = surface.first(NodeState, lambda s: not s.flags & UNFIT)
        assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02
        surface.loop.call(lambda process, at: process.endpoint.mail.command(Command(1, 5, "timing"), at))
        assert surface.first(Reply, lambda r: r.sequence == 5).done
        assert surface.endpoint.seals is not None
        assert surface.endpoint.seals.failures() == {}
        string.end()


def test_an_order_to_a_silent_tube_holds_up_nobody(string: String, router: tuple[str, ZenohBus]) -> None:
    bus, ordered = router[1], f"borechain/{RIG}/cmd"
    (string.folder / "ground").mkdir()
    with contextlib.closing(Store(f"sqlite:///{string.folder / 'ground' / 'ground.sqlite'}")) as store:
        store.keep_tally([1, 2])  # tube 2 hangs below, and nothing is heard of it
    string.start("ground")
    string.start_encoder()
    string.start_node()
    silent = threading.Thread(target=bus.get, args=(f"{ordered}/take_survey?tube=2", PATIENCE))
    first_answer(bus, RIG, "nodes/1", lambda node: True)
    silent.start()
    first_answer(bus, RIG, "orders", lambda answer: bool(answer["orders"]))
    (reply,) = bus.get(f"{ordered}/timing?tube=1", PATIENCE)
    assert reply.error is None
    order = json.loads(reply.payload)
    assert (order["tube"], order["state"], order["done"]) == (1, "done", True)
    assert order["values"]["cycles"] > 0
    assert order["values"]["cycle_p99_s"] <= order["values"]["cycle_max_s"]
    (reply,) = bus.get(f"{ordered}/check_board?tube=1", PATIENCE)
    found = json.loads(reply.payload)["values"]
    assert found["sensor"] == "TimedImu"
    assert re.fullmatch(r"\d of the last \d cycles", found["readings"])
    assert {"clock", "disk", "kernels"} <= found.keys()
    assert found["good"] == (not found["wrong"])
    first, second, _ = first_answer(bus, RIG, "orders", lambda answer: len(answer["orders"]) == 3)["orders"]
    assert (first["command"], first["tube"], first["state"]) == ("take_survey", 2, "sent")
    assert order == order | second  # the reply says when it was made besides
    string.end()
    silent.join()


@pytest.mark.parametrize("frozen", [6.0, pytest.param(30.0, marks=pytest.mark.statistical)])
def test_the_crew_is_told_of_a_frozen_node_and_of_an_encoder_that_starts_again(
    string: String, router: tuple[str, ZenohBus], frozen: float
) -> None:
    bus = router[1]
    string.start("ground")
    string.start_encoder()
    string.start_node()
    first_answer(bus, RIG, "nodes/1", lambda node: not node["stale"])
    # before it is aided its place in the string is unknown
    first_answer(bus, RIG, "status", lambda rig: rig["tubes"] == 1)
    string.running["node"].send_signal(signal.SIGSTOP)
    silent = first_answer(bus, RIG, "nodes/1", lambda node: node["age_s"] > frozen)
    assert silent["stale"]
    first_answer(bus, RIG, "alarms", lambda answer: "tube_silent" in codes(answer))
    string.running["node"].send_signal(signal.SIGCONT)
    first_answer(bus, RIG, "alarms", lambda answer: "tube_silent" not in codes(answer))
    string.kill("encoder")
    string.start_encoder()
    first_answer(bus, RIG, "alarms", lambda answer: "epoch" in codes(answer))
    first_answer(bus, RIG, "nodes/1", lambda node: not node["stale"] and node["age_s"] >= 0.0)
    string.end()


def codes(alarms: dict[str, Any]) -> set[str]:
    return {row["code"] for row in alarms["rig"]}


def test_the_bench_measures_every_process(tmp_path: Path) -> None:
    done = run("bench", "realtime", "--nodes", "2", "--seconds", "4", "--endpoint", free_endpoint(),
               "--out", str(tmp_path), "--json")  # fmt: skip
    assert done.returncode == 0, done.stderr
    result = json.loads(done.stdout)
    assert [case["hop"] for case in result["cases"]] == [0, 1, 2]
    for case in result["cases"]:
        assert case["cycles"] > 0
        assert 0.0 < case["private_mb"] <= case["pss_mb"]
        assert case["cycle_median_ms"] <= case["cycle_p99_ms"] <= case["cycle_max_ms"]
    assert result["total"]["private_mb"] == pytest.approx(sum(case["private_mb"] for case in result["cases"]))
    assert len((tmp_path / "realtime.csv").read_text().splitlines()) == 4


@pytest.mark.parametrize(
    ("which", "words", "says"),
    [
        (node, ("--tube", "1", "--clock", "own"), "--clock own: expected --imu with it"),
        (encoder, ("--clock", "own"), "--clock own: expected --counter with it"),
        (node, ("--tube", "1", "--clock", "own", "--imu", "timed:none.npy"), "got none.npy, which is not a file"),
        (node, ("--tube", "1", "--clock", "sundial"), "'sundial' is not one of 'stepper', 'own'"),
        (node, ("--tube", "1", "--above", "2"), "expected --clock own with them"),
        (node, ("--tube", "1", "--upper", "can:can0"), "expected --clock own with them"),
        (node, ("--tube", "1", "--clock", "own", "--imu", "mpu6500:1", "--upper", "tin:1"), "expected one of can,"),
        (node, ("--tube", "1", "--clock", "own", "--imu", "mpu6500:1", "--lower", "zenoh:"), "expected --below with"),
        (encoder, ("--clock", "own", "--counter", "counter:x", "--lower", "can:"), "expected a channel"),
        (encoder, ("--clock", "own", "--counter", "counter:x", "--lower", "can:x,bitrate=0"), "expected bit/s, got 0"),
        (encoder, ("--clock", "own", "--counter", "counter:x", "--lower", "can:x,speed=1"), "got speed=1"),
        (node, ("--tube", "1", "--clock", "own", "--above", "sky"), "expected encoder, base or a tube 1..250, got sky"),
        (node, ("--tube", "1", "--clock", "own", "--imu", "mpu6500:1", "--above", "1"), "others than 1 itself, got 1"),
        (encoder, ("--clock", "own", "--counter", "counter:x", "--above", "3", "--below", "3"), "got 3, 3"),
    ],
)
def test_options_that_cannot_be_are_refused(which: Any, words: tuple[str, ...], says: str) -> None:
    done = CliRunner().invoke(which, words)
    assert done.exit_code == 2
    assert says in done.output
    assert len([line for line in done.output.splitlines() if line.startswith("Error")]) == 1


def test_a_busy_port_is_one_line() -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        endpoint = f"tcp/127.0.0.1:{taken.getsockname()[1]}"
        done = run("bench", "realtime", "--nodes", "1", "--endpoint", endpoint)
    assert done.returncode == 1
    assert done.stderr.strip().splitlines() == [
        f"Error: endpoint {endpoint}: Address already in use; choose another with --endpoint tcp/127.0.0.1:PORT"
    ]
