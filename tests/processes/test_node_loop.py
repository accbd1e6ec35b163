"""A node by its own clock on a real zenoh session: its start, its neighbour gone and back, its end; bad recordings."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import signal
import time
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

import numpy as np
import pytest
from rigs import PATIENCE, free_endpoint, run

from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.drivers.timed import TimedImu
from node.process.tube_process import TubeProcess
from telemetry.application.endpoint import Endpoint
from telemetry.media.media_table import open_medium
from telemetry.media.neighbours import neighbour_ports
from telemetry.media.zenoh_bus import open_router
from telemetry.messages import ENCODER, Side
from telemetry.runtime.hosting import OwnTime, Place, live_by_own_clock
from telemetry.runtime.own_clock import OwnClock, OwnClockLoop
from telemetry.runtime.process_interface import Process
from telemetry.runtime.timing import CycleTiming

RIG = "own-clock"


@pytest.fixture
def router() -> Iterator[str]:
    endpoint = free_endpoint()
    with open_router(endpoint):
        yield endpoint


class Above(Process):
    """The encoder's conversation with the tube below it."""

    def __init__(self, boots: int) -> None:
        self.endpoint = Endpoint(ENCODER, frozenset({Side.LOWER}), boot_count=boots, is_clock_root=True)


@contextlib.asynccontextmanager
async def encoder_above(endpoint: str, boots: int) -> AsyncIterator[None]:
    with open_medium(f"zenoh:{endpoint}") as medium:
        loop = OwnClockLoop(
            Above(boots), neighbour_ports(medium, RIG, ENCODER, {Side.LOWER: 1}), OwnClock(), CycleTiming(), PERIOD
        )
        running = asyncio.create_task(loop.run())
        yield
        loop.stop()
        await running


async def test_a_node_loses_and_regains_its_neighbour_and_ends_when_told(router: str, tmp_path: Path) -> None:
    times = time.monotonic() - 1.0 + 0.1 * np.arange(6000.0)
    np.save(tmp_path / "imu.npy", np.column_stack([times, np.tile([0.0, 0.0, 0.01, 0.0, 0.3, -9.8], (6000, 1))]))
    built: list[TubeProcess] = []

    def build(timing: CycleTiming) -> TubeProcess:
        built.append(TubeProcess(TubeSettings(1), tmp_path, imus=[TimedImu(tmp_path / "imu.npy")], timing=timing))
        return built[-1]

    async def hears(boots: int | None) -> None:
        async with asyncio.timeout(PATIENCE):
            while True:
                above = built[0].endpoint.place.neighbours[Side.UPPER] if built else None
                if (above.boot_count if above else None) == boots and built:
                    return
                await asyncio.sleep(0.02)

    place = Place(RIG, router, tmp_path)
    node = asyncio.create_task(live_by_own_clock("node 1", place, 1, OwnTime({Side.UPPER: ENCODER}), build, PERIOD))
    async with encoder_above(router, boots=1):
        await hears(1)
        assert built[0].endpoint.place.hops == 1
    await hears(None)
    async with encoder_above(router, boots=2):
        await hears(2)
        os.kill(os.getpid(), signal.SIGTERM)
        await asyncio.wait_for(node, PATIENCE)
    report = json.loads((tmp_path / "timing.json").read_text())
    assert report["cycles"] > 0
    assert report["inbox_dropped"] == 0
    assert report["ports"]["upper"]["is_up"]
    assert "dropped" not in report["ports"]["upper"]["not_sent"]


@pytest.mark.parametrize("clock", [("--clock", "own"), ()])
@pytest.mark.parametrize("which", [("node", "--tube", "1", "--imu"), ("encoder", "--counter")])
def test_a_damaged_recording_is_reported_before_any_router_is_asked(
    tmp_path: Path, clock: tuple[str, ...], which: tuple[str, ...]
) -> None:
    (tmp_path / "damaged.npy").write_bytes(b"\x93NUMPY nothing else")
    place = ("--folder", str(tmp_path / "state"), "--endpoint", "tcp/127.0.0.1:1")
    done = run(*which, f"timed:{tmp_path / 'damaged.npy'}", *clock, *place)
    assert done.returncode == 1
    (line,) = done.stderr.strip().splitlines()
    assert "damaged.npy" in line
    assert "router" not in line
