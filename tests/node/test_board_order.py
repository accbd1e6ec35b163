"""A board that is checked by an order over the string: the node's own newest cycles, and each fault by its part."""

from __future__ import annotations

import datetime
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from emulated_board import EmulatedBoard, can_with

from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.process.board_watch import BoardPlaces, BoardWatch
from node.process.tube_process import TubeProcess
from telemetry.application.arguments import checked_values
from telemetry.application.commands import find_command
from telemetry.frozen import replace
from telemetry.messages import Command, Reply, Side
from telemetry.presentation.msgpack_codec import decode_message, encode_message
from telemetry.records.noise_file import GyroNoise

pytestmark = pytest.mark.slow
SPEC = find_command("check_board")
MEDIA = {Side.UPPER: "can:can0", Side.LOWER: "can:can1,profile=native"}


class RunningBoard(EmulatedBoard):
    """An emulated board whose node runs."""

    def __init__(self, folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
        super().__init__(folder, monkeypatch, datetime.datetime.now(datetime.UTC) - datetime.timedelta(hours=1))
        monkeypatch.setattr("node.process.board_watch.folder_in_use", lambda: self.kernels)
        monkeypatch.chdir(folder)  # the name of a key file is in what is said of it
        self.write_program()
        places = BoardPlaces(folder / "state", self.key_place.relative_to(folder), MEDIA, has_clock=True)
        self.process = TubeProcess(TubeSettings(7), folder / "state", imus=[self.driver], places=places)
        self.cycles(12)

    def cycles(self, count: int) -> None:
        for _ in range(count):
            self.sleep(PERIOD)
            self.process.on_cycle([self.now - PERIOD, 0.0, 0.0, 0.0, 0.0, 0.0, -9.8], self.now)
            self.process.take_frames(self.now)

    def answer(self) -> Reply:
        """The reply to the order as the ground station decodes it."""
        self.write_program()
        reply = decode_message(encode_message(self.process._commands.obey(Command(7, 3, "check_board"))))
        assert isinstance(reply, Reply)
        return reply


@pytest.fixture
def running(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> RunningBoard:
    return RunningBoard(tmp_path, monkeypatch)


def test_a_good_board_says_so_of_every_part_while_its_node_goes_on(running: RunningBoard) -> None:
    reply = running.answer()
    assert reply.done
    assert reply.detail == "all 14 parts are good"
    values = checked_values(SPEC, reply.values)
    assert values == reply.values  # nothing that the table does not promise
    assert [name for name in values if name not in ("good", "wrong")] == [q.name for q in SPEC.reply][2:]
    assert (values["good"], values["wrong"]) == (True, "")
    assert values["sensor"] == "mpu6500 at 0x68, 50.0 Hz"
    assert values["readings"] == "8 of the last 8 cycles"
    assert values["upper"] == "can0: FD, 500000 bit/s"
    assert values["lower"] == "can1: FD, 500000 bit/s"
    assert str(values["keys"]).startswith("rig rig-1, generation 1 of ")
    opened = running.chip.opened
    running.cycles(3)
    assert running.answer().values["readings"] == "8 of the last 8 cycles"
    assert running.chip.opened == opened


FAULTS: list[tuple[str, Callable[[RunningBoard], object], str, str]] = [
    (
        "unplugged",
        lambda one: setattr(one.chip, "absent", True),
        "readings",
        "2 of the last 8 cycles: mpu6500: register",
    ),
    ("bytes lost", lambda one: setattr(one.chip, "lose_in", (20, 6)), "readings", "of the last 8 cycles"),
    ("half the force", lambda one: setattr(one, "force", 0.5), "readings", "m/s^2"),
    ("readings that repeat", lambda one: setattr(one, "noise", 0.0), "noise", "repeats itself"),
    ("no thermometer", lambda one: setattr(one, "temperature", -300.0), "temperature", "expected -45..125"),
    ("no CAN interface", lambda one: one.can.clear(), "upper", "is its overlay loaded?"),
    ("bus off", can_with(state="BUS-OFF"), "lower", "can1: expected state ERROR-ACTIVE, got BUS-OFF"),
    ("another bit rate", can_with(bittiming={"bitrate": 250000}), "upper", "expected 500000 bit/s, got 250000"),
    ("keys of another tube", lambda one: shutil.copy(one.keys / "tube-8.keys", one.key_place), "keys", "of tube-8"),
    ("no compiled kernels", lambda one: one.index.unlink(), "kernels", "not compiled in"),
]


@pytest.mark.parametrize(("name", "break_it", "part", "says"), FAULTS, ids=[row[0] for row in FAULTS])
def test_each_fault_is_named_by_its_part(
    running: RunningBoard, name: str, break_it: Callable[[RunningBoard], object], part: str, says: str
) -> None:
    break_it(running)
    running.cycles(6 if name == "unplugged" else 10)
    reply = running.answer()
    assert reply.done, name  # it is the board that is not as it should be, not the order
    assert not reply.values["good"]
    wrong = str(reply.values["wrong"]).split(", ")
    assert part in wrong
    assert reply.detail == f"wrong: {reply.values['wrong']}"
    assert says in str(reply.values[part])


def cycle(rate: float, force: float = 9.81, temperature: float = 20.0) -> ImuReading:
    random = np.random.default_rng(round(1e6 * rate) % 2**32)
    noise = 1e-5 * random.standard_normal(6)
    wx, wy, wz, fx, fy, fz = (np.array([0.0, 0.0, rate, 0.0, 0.0, -force]) + noise).tolist()
    return ImuReading(0.0, PERIOD, (wx, wy, wz), (fx, fy, fz), temperature)


def watch_of(folder: Path, imus: int = 1) -> BoardWatch:
    return BoardWatch(TubeSettings(1, imus=(ImuSettings(),) * imus), (), BoardPlaces(folder))


def test_what_only_a_rest_shows_is_not_judged_of_a_string_that_turns(tmp_path: Path) -> None:
    watch = watch_of(tmp_path)
    for k in range(8):
        watch.look(cycle(0.6 + 0.01 * k), still=False)
    found = {line.part: line for line in watch.findings(datetime.datetime.now(datetime.UTC))}
    assert {"noise", "bias", "gravity"} == {part for part, line in found.items() if "the string turned" in line.text}
    assert found["noise"].good
    assert found["temperature"].text == "20.0 C"
    assert "clock" not in found
    assert "keys" not in found
    for k in range(8):
        watch.look(cycle(1e-3 + 1e-6 * k), still=True)
    found = {line.part: line for line in watch.findings(datetime.datetime.now(datetime.UTC))}
    assert "deg/s of a cycle at rest" in found["noise"].text


def test_of_a_cluster_the_imu_that_is_wrong_is_named(tmp_path: Path) -> None:
    watch = watch_of(tmp_path, 3)
    for k in range(8):
        first, second, third = (
            cycle(1e-3 + 1e-6 * k + j, force) for j, force in ((0.0, 9.81), (1e-4, 5.0), (2e-4, 9.8))
        )
        watch.look(replace(first, others=(second, third)), still=True)
    found = {line.part: line for line in watch.findings(datetime.datetime.now(datetime.UTC))}
    assert not found["gravity"].good
    assert found["gravity"].text.startswith("IMU 2: expected 9.81 within 15 %, got 5.0")
    assert found["bias"].good
    assert found["bias"].text.startswith("IMU 1: ")


def test_a_node_that_has_just_started_says_that_no_reading_came(tmp_path: Path) -> None:
    found = {line.part: line for line in watch_of(tmp_path).findings(datetime.datetime.now(datetime.UTC))}
    assert (found["readings"].good, found["readings"].text) == (False, "0 of the last 0 cycles")
    assert "noise" not in found


def test_noise_is_judged_beside_that_of_the_sensor_s_own_record(tmp_path: Path) -> None:
    """0.01 deg/s/sqrt(Hz) is 0.0138 deg/s of a cycle; four times that is told, though cheap parts have it."""
    white = np.radians([0.01, 0.008, 0.009])
    wx, wy, wz = white.tolist()
    known = GyroNoise((wx, wy, wz), (1e-6, 1e-6, 1e-6), (100.0, 100.0, 100.0))
    for times, good in ((1.0, True), (4.5, False)):
        watch = BoardWatch(TubeSettings(1, gyro_noise=known), (), BoardPlaces(tmp_path))
        random = np.random.default_rng(5)
        for _ in range(8):
            x, y, z = (times * white / np.sqrt(PERIOD) * random.standard_normal(3)).tolist()
            watch.look(ImuReading(0.0, PERIOD, (x, y, z), (x, y, z - 9.8)), still=True)
        found = {line.part: line for line in watch.findings(datetime.datetime.now(datetime.UTC))}
        assert found["noise"].good == good
        assert found["noise"].text.endswith(" deg/s of a cycle at rest, 0.0138 by its record")
        assert found["noise"].text.startswith("expected at most 0.041, got ") != good
