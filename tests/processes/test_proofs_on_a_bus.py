"""A node's process over the driver of its chip: what goes wrong on the bus is told by name and turns no yaw."""

from __future__ import annotations

import math
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path

from rigs import PATIENCE
from test_own_clock import RIG, UNFIT, String, Surface, router, string, surface  # noqa: F401  (fixtures)

from sim.world.recording import yaw_error
from telemetry.messages import Event, NodeState

TESTS = Path(__file__).parents[1]


def start_on_bus(string: String, folder: Path) -> subprocess.Popen[str]:  # noqa: F811
    """Node 1 over an emulated bus in a folder."""
    folder.mkdir()
    shutil.copy(string.folder / "tube-1.npy", folder / "imu.npy")
    paths = [str(TESTS / "tools" / "emulated_bus"), str(TESTS / "node")]
    angle = math.degrees(string.world.tube_settings(1).drive_joint.angle)
    words = ["node", "--tube", "1", "--clock", "own", "--imu", "mpu6500:1", "--rig", RIG, "--above", "encoder"]
    more = [f"--drive-joint-deg={angle}", "--endpoint", string.endpoint, "--folder", str(string.folder / "node")]
    return subprocess.Popen(
        [sys.executable, "-m", "borechain", *words, *more],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(paths), "EMULATED_BUS": str(folder)},
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_a_node_names_what_fails_on_its_bus_and_its_yaw_stays(string: String, surface: Surface) -> None:  # noqa: F811
    bus = string.folder / "bus"
    string.start_encoder()
    with start_on_bus(string, bus) as node:
        try:
            surface.first(NodeState, lambda s: not s.flags & UNFIT)
            for fault, cause in (("lose 6", "lost_bytes"), ("register 27", "register"), ("register 28", "register")):
                (bus / "new").write_text(fault)
                (bus / "new").rename(bus / "fault")
                event = surface.first(Event, lambda e: e.code == "sensor_failed")
                assert event.arguments["cause"] == cause
                surface.first(Event, lambda e: e.code == "sensor_back")
            state = surface.first(NodeState, lambda s: not s.flags & UNFIT)
            assert abs(yaw_error(string.world, 1, state.yaw, state.at)) < 0.02
            (bus / "new").write_text("identity 0")
            (bus / "new").rename(bus / "fault")
            assert surface.first(Event, lambda e: e.code == "sensor_failed").arguments["cause"] == "identity"
            node.send_signal(signal.SIGTERM)
            assert node.communicate(timeout=PATIENCE) == ("", "")
        finally:
            node.kill()
    string.end()
