"""Two processes that give themselves one number: the crew is told which two, and settles it by one order."""

from __future__ import annotations

import json
import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from forked_commands import Command
from rigs import PATIENCE, first_answer, free_endpoint, started

from sim.can.can_hub import running_hub
from sim.world.recording import record_sensors, turning_once
from telemetry.media.can_timing import BitRates
from telemetry.media.zenoh_bus import ZenohBus, open_client, open_router

pytestmark = pytest.mark.process
RIG = "doubled"
NUMBERS = {3: 2, 2: 1, 1: 2}  # that the tubes of the world give themselves, from the top down


@pytest.fixture
def bus(tmp_path: Path) -> Iterator[ZenohBus]:
    """A client of a rig whose ground station, encoder and three tubes run, its joints on CAN."""
    endpoint, world = free_endpoint(), turning_once(3, time.monotonic(), 600.0, 10.0, 700.0, seed=4, clock_std=0.0)
    record_sensors(world, tmp_path)
    running: list[Command] = []

    def start(name: str, *words: str) -> None:
        folder = tmp_path / f"process-{len(running)}"
        place = ("--clock", "own", "--rig", RIG, "--endpoint", endpoint, "--folder", str(folder))
        running.append(started(name, *words, *place))

    with (
        open_router(endpoint),
        running_hub(BitRates(500_000.0, 2_000_000.0)) as hub,
        open_client(endpoint, PATIENCE) as bus,
    ):
        joints = [f"can:{hub.port}/joint-{n},interface=borechain_loopback,frames=fd" for n in range(len(NUMBERS))]
        try:
            start("ground")
            start("encoder", "--counter", f"timed:{tmp_path / 'encoder.npy'}", "--above", "base", "--lower", joints[0])
            for place, (tube, number) in enumerate(NUMBERS.items()):
                angle = f"--drive-joint-deg={math.degrees(world.tube_settings(tube).drive_joint.angle)}"
                below = ("--lower", joints[place + 1]) if place + 1 < len(joints) else ()
                imu = f"timed:{tmp_path / f'tube-{tube}.npy'}"
                start("node", "--tube", str(number), "--imu", imu, angle, "--upper", joints[place], *below)
            yield bus
        finally:
            for process in running:
                process.kill()
                process.communicate()


def alarm_of(answer: dict[str, Any]) -> str:
    return next((str(row["detail"]) for row in answer["rig"] if row["code"] == "same_number"), "")


def test_which_two_is_told_and_one_order_settles_it_and_one_undoes_that(bus: ZenohBus) -> None:
    told = alarm_of(first_answer(bus, RIG, "alarms", alarm_of))
    assert "tube 1 from the top, shown as tube 1002, and tube 3 from the top" in told
    string = first_answer(bus, RIG, "string", lambda answer: len(answer["tubes"]) == len(NUMBERS))
    assert [row["tube"] for row in string["tubes"]] == [1002, 1, 2]
    for order, settled in (("same_number?tube=2;which=upper", True), ("setup?action=undo", False)):
        (reply,) = bus.get(f"borechain/{RIG}/cmd/{order}", PATIENCE)
        assert reply.error is None
        assert json.loads(reply.payload)["done"] is True
        first_answer(bus, RIG, "alarms", lambda answer, settled=settled: (alarm_of(answer) == "") is settled)
