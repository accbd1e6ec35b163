"""``borechain board check`` on an emulated board: every line good, then each fault named, one at a time."""

from __future__ import annotations

import json
import math
import os
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner
from emulated_board import NOW, EmulatedBoard, can_with
from emulated_encoders import EmulatedCounter

from node.firmware.encoder_node import EncoderSample
from node.process.board_command import board, is_turning
from node.process.board_sensors import check_encoder
from node.process.drivers.quadrature import QuadratureFile


@pytest.fixture
def emulated(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> EmulatedBoard:
    return EmulatedBoard(tmp_path, monkeypatch)


PARTS = {
    "sensor", "readings", "rate", "noise", "bias", "gravity", "ranges", "temperature",
    "encoder", "direction", "count", "can", "clock", "disk", "keys", "kernels",
}  # fmt: skip


def test_every_line_of_a_good_board_is_good(emulated: EmulatedBoard) -> None:
    found = emulated.findings()
    assert set(found) == PARTS
    assert {part: text for part, (good, text) in found.items() if not good} == {}
    assert found["sensor"][1] == "mpu6500 at 0x68, 50.0 Hz"
    assert found["can"][1] == "can0: FD, 500000 bit/s"


FAULTS: list[tuple[str, Callable[[EmulatedBoard], object], str, str]] = [
    ("no sensor", lambda one: setattr(one.chip, "absent", True), "sensor", "No such device"),
    ("another chip", lambda one: setattr(one.chip, "identity", 0x68), "sensor", "which is an mpu6050"),
    ("a deaf register", lambda one: one.chip.deaf.add(0x1C), "sensor", "register 0x1c: expected 0x10"),
    ("bytes lost", lambda one: setattr(one.chip, "lose_in", (20, 6)), "readings", "1 of 8 cycles lost"),
    ("a crystal 15 % off", lambda one: setattr(one, "quicker", 1.15), "rate", "set to 50.0"),
    ("a sensor that moves", lambda one: setattr(one, "noise", math.radians(5.0)), "noise", "expected at most 0.150"),
    ("readings that repeat", lambda one: setattr(one, "noise", 0.0), "noise", "repeats itself"),
    ("a large bias", lambda one: one.bias.__setitem__(1, math.radians(30.0)), "bias", "expected at most 20"),
    ("half the force", lambda one: setattr(one, "force", 0.5), "gravity", "expected 9.81 within 15 %"),
    ("a rate at its range", lambda one: one.bias.__setitem__(0, 9.0), "ranges", "gyroscope at its range"),
    ("no thermometer", lambda one: setattr(one, "temperature", -300.0), "temperature", "expected -45..125"),
    ("no encoder", lambda one: one.counter.unplug(), "encoder", "No such file"),
    ("lines exchanged", lambda one: setattr(one, "step", -1), "direction", "counts backwards"),
    ("another resolution", lambda one: setattr(one, "turn", 45.0), "count", "45.00 deg for a turn of 90"),
    ("a counter that stands", lambda one: setattr(one.counter, "stands", True), "count", "0.00 deg"),
    ("no CAN interface", lambda one: one.can.clear(), "can", "is its overlay loaded?"),
    ("CAN is down", lambda one: one.can["flags"].remove("UP"), "can", "it is down"),
    ("bus off", can_with(state="BUS-OFF"), "can", "expected state ERROR-ACTIVE, got BUS-OFF"),
    ("another bit rate", can_with(bittiming={"bitrate": 250000}), "can", "expected 500000 bit/s, got 250000"),
    ("a classic controller", can_with(ctrlmode=[]), "can", "expected CAN FD, got classic"),
    ("another data rate", can_with(data_bittiming={"bitrate": 1000000}), "can", "for data, got 1000000"),
    ("many errors", can_with(berr_counter={"tx": 120, "rx": 0}), "can", "expected at most 95 errors"),
    (
        "a clock of 1970",
        lambda one: setattr(one, "clock", NOW.replace(year=1971)),
        "clock",
        "expected a clock that was set",
    ),
    ("a disk that takes no file", lambda one: (one.folder / "state").write_text(""), "disk", "File exists"),
    ("keys of another tube", lambda one: shutil.copy(one.keys / "tube-8.keys", one.key_place), "keys", "of tube-8"),
    ("keys open to others", lambda one: one.key_place.chmod(0o644), "keys", "expected permissions 0600, got 0644"),
    ("no keys", lambda one: one.key_place.unlink(), "keys", "No such file"),
    ("no compiled kernels", lambda one: one.index.unlink(), "kernels", "not compiled in"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("name", "break_it", "part", "says"), FAULTS, ids=[row[0] for row in FAULTS])
def test_each_fault_is_named_in_the_line_of_its_part(
    emulated: EmulatedBoard, name: str, break_it: Callable[[EmulatedBoard], object], part: str, says: str
) -> None:
    break_it(emulated)
    found = emulated.findings()
    good, text = found[part]
    assert not good, name
    assert says in text
    wrong = {other for other, (fine, _) in found.items() if not fine}
    also = {
        "a clock of 1970": {"keys"},
        "a rate at its range": {"noise", "bias"},  # it repeats itself there
    }
    assert wrong - {part} <= also.get(name, set())


def test_keys_that_end_soon_are_named(emulated: EmulatedBoard) -> None:
    text = emulated.key_place.read_text()
    made = f"made_at = {NOW.isoformat()}"
    assert made in text
    emulated.key_place.write_text(text.replace(made, f"{made}\nretires_at = {NOW.replace(month=12).isoformat()}", 1))
    assert emulated.findings()["keys"][0]
    emulated.clock = NOW.replace(month=12, day=20)
    assert emulated.findings()["keys"] == (False, "generation 1 holds until 2026-12-27 07:00 UTC")


def test_the_command_prints_a_line_a_part_and_ends_by_what_it_found(tmp_path: Path) -> None:
    rows = np.column_stack([0.5 * np.arange(60), np.random.default_rng(1).normal(0.0, 1e-4, (60, 6))])
    rows[:, 6] -= 9.8
    np.save(tmp_path / "imu.npy", rows)
    words = ["check", "--imu", f"replay:{tmp_path / 'imu.npy'}", "--folder", str(tmp_path / "state")]
    done = CliRunner().invoke(board, [*words, "--json"])
    found = json.loads(done.stdout)
    assert {row["part"] for row in found["findings"]} >= {"sensor", "readings", "gravity", "clock", "disk", "kernels"}
    assert done.exit_code == (0 if found["good"] else 1)
    done = CliRunner().invoke(board, [*words, "--can", "no-such-interface"])
    assert done.exit_code == 1
    assert "WRONG  can no-such-interface" in done.stdout
    assert CliRunner().invoke(board, ["check", "--imu", "bmp280:1"]).exit_code == 2


def test_a_head_is_turned_until_enter_or_the_end_of_the_input(monkeypatch: pytest.MonkeyPatch) -> None:
    for said in (b"\n", b""):
        read, write = os.pipe()
        with os.fdopen(read) as told:
            monkeypatch.setattr("sys.stdin", told)
            assert is_turning()
            os.write(write, said)
            if not said:
                os.close(write)
            assert not is_turning()
            if said:
                os.close(write)


def test_a_head_that_turns_is_read_at_every_look(tmp_path: Path) -> None:
    """The kernel keeps the edges of one turn of GPIO lines, and not of more."""
    counter, counts, looks = EmulatedCounter(tmp_path), list[int](), iter(range(1, 6))

    class Watched(QuadratureFile):
        def read(self, now: float) -> EncoderSample:
            found = super().read(now)
            counts.append(found.count)
            return found

    def turn_on() -> bool:
        look = next(looks, None)
        if look is not None:
            counter.turn_to(1024 * look)
        return look is not None

    found = check_encoder(Watched(counter.place / "count"), 450.0, lambda: 0.0, turn_on)
    assert all(line.good for line in found)
    assert counts == [0, 1024, 2048, 3072, 4096, 5120, 5120]
