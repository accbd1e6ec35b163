"""docs/deploy.md followed word for word: the board of a tube, the board of the encoder and the surface, to a survey."""

from __future__ import annotations

import contextlib
import json
import math
import re
import shlex
import shutil
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from deployed_machines import Machine, commands_of, living_sensor, make_stand_ins, turned_by_hand
from emulated_encoders import EmulatedCounter
from rigs import PATIENCE, REPOSITORY, first_answer, free_endpoint

from borechain.__main__ import cli
from node.process import board_command
from sim.can.can_hub import running_hub
from telemetry.media.can_timing import BitRates
from telemetry.media.credentials import credentials_of
from telemetry.media.zenoh_bus import open_client

PAGE = (REPOSITORY / "docs" / "deploy.md").read_text()
FORCE = (0.3, -0.2, -9.79)  # m/s^2, of a tube that leans by 2.1 deg
TUBE = 7
CHECKS = 5  # of a board, at most
DEPTH_M = 1.6  # within the first tube, which is 2 m long
DEPTH = "sudo install -o borechain -m 0600 stick/depth.keys"
RIG = "rig-1"


def section(number: int) -> str:
    return PAGE.partition(f"\n## {number}. ")[2].partition("\n## ")[0]


class Followed:
    """What follows the page: a stick, three machines, and what the commands printed."""

    def __init__(self, folder: Path, sensor: str, counter: EmulatedCounter, hub: int, capture: Any) -> None:
        self.work, self._capture = folder / "work", capture
        self.work.mkdir()
        shutil.copytree(REPOSITORY / "deploy", self.work / "deploy")
        self.port = free_endpoint().rpartition(":")[2]
        segments = f"can:{hub}/joint,interface=borechain_loopback"
        self.below = f"can:{hub}/below,interface=borechain_loopback"

        def translate(text: str) -> str:
            for told, emulated in (
                ("mpu6500:1", f"vn100:{sensor}"),
                ("counter:/dev/counter0", f"counter:{counter.place / 'count'}"),
                ("can:can0", segments),
                ("can:can1", self.below),
                ("tls/surface:7447", f"tls/127.0.0.1:{self.port}"),
                ("tls/0.0.0.0:7447", f"tls/127.0.0.1:{self.port}"),
            ):
                text = text.replace(told, emulated)
            return text

        stand_ins = make_stand_ins(folder / "stand-ins")
        self.machines = {name: Machine(folder / name, stand_ins, translate) for name in ("tube", "encoder", "surface")}
        self.said: dict[str, str] = {}
        self.drilled, self.depth = threading.Event(), threading.Thread()

    def follow(self, number: int, name: str, begin: str = "", until: str = "") -> None:
        """Do what a section says, on a machine, from one command up to another."""
        machine, commands = self.machines[name], list(commands_of(section(number)))
        first, last = (
            next((k for k, (_, text) in enumerate(commands) if text.startswith(at)), None)
            for at in (begin, until or "?")
        )
        for kind, text in commands[first:last]:
            if kind == "python":
                self.depth = threading.Thread(target=exec, args=(machine.place(text), {"readings": self.readings}))
                self.depth.start()  # the page's program, as it stands
            elif kind != "shell":
                machine.configure(kind, text)
            elif borechain := re.fullmatch(r"(?:sudo (?:-[ug] \w+ )*)?borechain (.*)", text):
                words = shlex.split(borechain[1])
                own = ["--folder", "/var/lib/borechain"] if words[:2] == ["board", "check"] else []  # its default
                self.said[text] = self.checked(machine, [*words, *own])
            elif number != 2 or name == "tube" or "warm_up" not in text:
                machine.shell(text.replace("stick/", f"{self.work}/stick/"), self.work)
                machine.start_units()

    def readings(self) -> Iterator[tuple[float, float]]:
        """Depth of a bit that stands, every half second of the rig's time."""
        endpoint = f"tls/127.0.0.1:{self.port}"
        with open_client(endpoint, PATIENCE, credentials_of(self.work / "stick", "operator")) as bus:
            while not self.drilled.wait(0.5):
                for reply in bus.get(f"borechain/{RIG}/ground/status", 5.0):
                    if (now := json.loads(reply.payload)["rig_time_s"]) is not None:
                        yield now, DEPTH_M

    def command(self, machine: Machine, words: list[str]) -> str:
        """What a command of borechain prints."""
        with contextlib.chdir(self.work):
            try:
                cli.main([machine.place(word) for word in words], prog_name="borechain", standalone_mode=False)
            except SystemExit as ended:
                self.said["status"] = str(ended.code or 0)
        return self._capture.readouterr().out

    def checked(self, machine: Machine, words: list[str]) -> str:
        """What a command prints; a check again where this machine, which has more to do than a board, lost cycles."""
        for _ in range(CHECKS):
            said = self.command(machine, words)
            if "cycles lost" not in said:
                break
        return said

    def said_of(self, begin: str) -> str:
        return next(said for command, said in self.said.items() if begin in command)


@pytest.fixture
def followed(tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> Iterator[Followed]:
    counter = EmulatedCounter(tmp_path / "counters")
    monkeypatch.setattr(board_command, "is_turning", turned_by_hand(counter))
    with contextlib.ExitStack() as stack:
        sensor = stack.enter_context(living_sensor(FORCE))
        hub = stack.enter_context(running_hub(BitRates(500_000.0, 2_000_000.0)))
        page = Followed(tmp_path, str(sensor.line.path), counter, hub.port, capfd)
        monkeypatch.setenv("PATH", str(tmp_path / "stand-ins"), prepend=":")
        for machine in page.machines.values():
            stack.callback(machine.end)
        yield page
        page.drilled.set()
        if page.depth.ident is not None:
            page.depth.join()


def test_two_boards_come_to_a_survey_by_the_commands_of_the_page(followed: Followed) -> None:
    followed.follow(1, "surface")
    followed.command(followed.machines["surface"], ["pki", "tube", str(TUBE), "--folder", "stick"])  # and so on
    for name in followed.machines:
        followed.follow(2, name)
    followed.follow(3, "tube")
    board = followed.said_of("board check --tube 7")
    assert re.findall(r"^WRONG.*", board, re.MULTILINE) == []
    for part in ("sensor", "readings", "noise", "bias", "gravity", "can can0", "can can1", "disk", "keys", "kernels"):
        assert re.search(rf"^good +{part} ", board, re.MULTILINE), (part, board)
    followed.follow(4, "encoder")
    assert re.findall(r"^(good|WRONG) +(direction|count|keys)", followed.said_of("--turn-deg 90"), re.MULTILINE) == [
        ("good", "direction"), ("good", "count"), ("good", "keys"),
    ]  # fmt: skip
    followed.follow(5, "surface", until=DEPTH)
    assert "north" in followed.said_of("--ground-config")
    endpoint, stick = f"tls/127.0.0.1:{followed.port}", followed.work / "stick"
    with open_client(endpoint, PATIENCE, credentials_of(stick, "operator")) as bus:
        first_answer(bus, RIG, f"nodes/{TUBE}", lambda node: not node["stale"] and "yaw_untrusted" not in node["flags"])
        followed.follow(5, "surface", begin=DEPTH)
        assert "as it is mounted" in followed.said_of("check --endpoint")
        assert json.loads(followed.said_of("ground/status"))["tubes"] == 1
        assert json.loads(followed.said_of("take_survey"))["state"] == "done"
        (station,) = first_answer(bus, RIG, "stations", lambda answer: bool(answer["stations"]))["stations"]
    assert station["inclination_deg"] == pytest.approx(
        math.degrees(math.atan2(math.hypot(*FORCE[:2]), -FORCE[2])), abs=0.05
    )
    azimuth = 12.5 + math.degrees(math.atan2(FORCE[1], FORCE[0]))  # the head stands at its zero, the joint at 12.5 deg
    assert math.remainder(station["azimuth_deg"] - azimuth, 360.0) == pytest.approx(0.0, abs=0.5)
    for machine in followed.machines.values():
        for process in machine.running.values():
            assert process.poll() is None
