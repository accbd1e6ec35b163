"""Every service of docker-compose.yml, run locally by its own command line."""

import contextlib
import json
import math
import queue
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml
from forked_commands import Command
from rigs import PATIENCE, REPOSITORY, free_endpoint, run, started

from sim.world.scenario import load_scenario
from sim.world.world import World
from telemetry.media.credentials import credentials_of
from telemetry.media.zenoh_bus import ZenohBus, open_client

WAITED_FOR = re.compile(r"borechain medium: \w+ has not joined for \d+ s, it is waited for")
SERVICES: dict[str, dict[str, Any]] = yaml.safe_load((REPOSITORY / "docker-compose.yml").read_text())["services"]


def local(words: list[str], endpoint: str, folder: Path, keys: Path) -> list[str]:
    """A service's command line with this machine's address and folders, at forty times real time."""
    address = endpoint.removeprefix("tls/")
    swapped = [w.replace("router:7447", address).replace("0.0.0.0:7447", address) for w in words]
    swapped = [{"/state": str(folder), "/keys": str(keys)}.get(w, w) for w in swapped]
    if "--speed" in swapped:
        swapped[swapped.index("--speed") + 1] = "40"
    return swapped


@contextlib.contextmanager
def services(folder: Path) -> Iterator[tuple[dict[str, Command], str]]:
    endpoint = free_endpoint().replace("tcp/", "tls/")
    running: dict[str, Command] = {}
    try:
        for name, service in SERVICES.items():
            words = local([str(word) for word in service["command"]], endpoint, folder / name, folder / "keys")
            if name == "keys":  # the others wait until it has ended well
                assert run(*words).returncode == 0
                continue
            running[name] = started(*words)
        yield running, endpoint
    finally:
        for process in running.values():
            process.kill()
            process.communicate()


def operator(endpoint: str, keys: Path) -> contextlib.AbstractContextManager[ZenohBus]:
    """Session with the right to read."""
    return open_client(endpoint, PATIENCE, credentials_of(keys, "operator"))


def ask(bus: ZenohBus, path: str) -> Any:
    replies = [r for r in bus.get(f"borechain/*/ground/{path}", 10.0) if r.error is None]
    return json.loads(replies[0].payload) if replies else {}


def test_the_services_drill_two_tubes_together_and_end_when_asked(tmp_path: Path) -> None:
    with services(tmp_path) as (running, endpoint), operator(endpoint, tmp_path / "keys") as bus:
        told: queue.SimpleQueue[None] = queue.SimpleQueue()
        bus.subscribe("borechain/*/ground/status", lambda _key, _payload: told.put(None))
        while ask(bus, "status").get("measurements") != 3:
            ended = {name: p.communicate()[1] for name, p in running.items() if p.poll() is not None}
            assert not ended
            with contextlib.suppress(queue.Empty):  # asking without a pause keeps all others from a core
                told.get(timeout=1.0)
        stations = ask(bus, "stations")["stations"]
        assert [s["measurements"] for s in stations] == [2, 1]
        world = World(load_scenario(REPOSITORY / "scenarios" / "compose-2.toml"), 1)
        for station in stations:
            truth = world.truth_station(station["md_m"])
            assert station["inclination_deg"] == pytest.approx(truth["inclination_deg"], abs=0.03)
        for name, process in reversed(running.items()):
            process.terminate()
            _, errors = process.communicate(timeout=30.0)
            assert process.returncode == 0, (name, errors)
            # on a busy machine a process may join late, which the medium has to say
            assert [line for line in errors.splitlines() if not WAITED_FOR.fullmatch(line)] == []


def test_the_joint_readings_are_those_of_the_scenario() -> None:
    world = World(load_scenario(REPOSITORY / "scenarios" / "compose-2.toml"), 1)
    for tube in (1, 2):
        words = [str(word) for word in SERVICES[f"node-{tube}"]["command"]]
        settings = world.tube_settings(tube)
        readings = {"--drive-joint-deg": settings.drive_joint.angle}
        if tube > 1:
            readings["--lower-joint-deg"] = settings.lower_joint.angle
        for option, angle in readings.items():
            given = next(word for word in words if word.startswith(option)).partition("=")[2]
            assert float(given) == pytest.approx(math.degrees(angle), abs=1e-3)


def test_the_compose_file_has_keys_a_router_encoder_medium_two_nodes_and_ground() -> None:
    assert {name.split("-")[0] for name in SERVICES} == {"keys", "router", "encoder", "medium", "node", "ground"}
    assert len(SERVICES) == 7


def test_a_medium_waits_for_whoever_has_not_joined_and_says_so(tmp_path: Path) -> None:
    """Services of a cold start compile for minutes where the machine is busy."""
    place = ("--endpoint", free_endpoint(), "--rig", "alone", "--folder", str(tmp_path))
    with started("medium", "compose-2", "--router", *place) as alone:
        try:
            said = alone.stderr.readline()
            assert said == "borechain medium: encoder has not joined for 10 s, it is waited for\n"
            alone.terminate()
            assert alone.wait(30.0) == 0
        finally:
            alone.kill()
