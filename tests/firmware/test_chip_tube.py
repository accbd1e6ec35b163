"""A whole tube on an emulated chip between two tubes in Python, each on its own clock, over CAN: nothing lost or wrong.

The base is at the surface end of a real encoder's process; the tubes above and below the chip are real nodes. The world
is one of rests and a turn, in the time of this machine.
"""

from __future__ import annotations

import datetime
import math
import os
import signal
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from chip_board import PATIENCE, EmulatedTube, TubeFlash, build_tube, sizes_of
from chip_stack import stack_region, stack_used
from forked_commands import Command as Forked
from needed_programs import needs
from own_clock_surface import Surface, living
from rigs import free_endpoint, started

from borechain.pki.rig_keys import add_tube, init_rig
from node.firmware.tube_settings import TubeSettings
from node.process.counter import BootCounter
from node.process.key_page import write_key_page
from sim.can.can_hub import CanHub, running_hub
from sim.world.recording import fastest_at, record_sensors, yaw_error
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.application.seals import Keys, Seals
from telemetry.media.can_loopback import register_loopback
from telemetry.media.zenoh_bus import open_router
from telemetry.messages import (
    BASE,
    BlockStatus,
    Command,
    Event,
    NodeFlag,
    NodeState,
    Reply,
    Side,
    StaticRecord,
    SurveyMeasurement,
    UploadPhase,
)
from telemetry.parameters import ParameterBlock, SensorParameters
from telemetry.transport.key_ring import key_file
from telemetry.transport.upload import Upload, split_block

RIG, CHIP, ABOVE, BELOW = "chip-between", 2, 3, 1
RECEIPTS = (Event, SurveyMeasurement, StaticRecord)
UNFIT = NodeFlag.YAW_UNTRUSTED | NodeFlag.CLOCK_UNSYNCHRONISED
REST, STOP, TURNING = 10.0, 80.0, 20.0  # s, before the string turns, of a stop after it, of a turn
MINUTES = float(os.environ.get("BORECHAIN_CHIP_MINUTES", "2"))
RATE_DPS = 71.0
WORDS_UNTIL_CUT = 700  # of flash: within the content of a save
FLASH, MEMORY = 192 * 1024, 32 * 1024
STACK, LEAST_USED, SPARE = 3072, 1024, 256  # bytes; a step alone takes more than the least, and a guard stays unused
NOW = datetime.datetime.now(datetime.UTC)
BLOCK_KEY = bytes(range(32))
BLOCK = ParameterBlock(CHIP, 1, accelerometer=SensorParameters(bias=(1e-3, 0.0, -1e-3)))  # its bias stays known
pytestmark = [
    pytest.mark.statistical,
    pytest.mark.timeout(60.0 * MINUTES + 600.0),
    needs("arm-none-eabi-gcc", "gcc-arm-none-eabi libnewlib-arm-none-eabi"),
    needs("qemu-system-arm", "qemu-system-arm"),
]


def world_of(begin: float) -> World:
    """A string of three that rests, and turns and stops again and again, in the time of this machine's clock."""
    blocks = 3 + math.ceil(60.0 * MINUTES / (STOP + TURNING))  # longer than all that is waited for
    return World(
        scenario_of(
            {
                "rig": {"tubes": 3, "tubes_at_start": 3, "tube_length_m": 1.0},
                "path": {"straight": {"inclination_deg": 2.0}},
                "schedule": {"begin_s": begin, "add_s": REST, "stop_s": STOP, "blocks": blocks},
                "rotation": {"turns": TURNING * RATE_DPS / 360.0, "rate_dps": RATE_DPS},
                "clocks": {"offset_std_s": 0.0, "drift_std_ppm": 0.0},
            }
        ),
        seed=4,
    )


class String:
    """Encoder, a tube in Python, the chip, another tube in Python; each joint a segment of CAN."""

    def __init__(self, folder: Path, endpoint: str, hub: CanHub, program: Path, keys: Path | None) -> None:
        self.folder, self.endpoint, self._hub, self.program, self._keys = folder, endpoint, hub, program, keys
        self.world = world_of(time.monotonic())
        record_sensors(self.world, folder)
        told = self.world.tube_settings(CHIP)
        own = TubeSettings(CHIP, drive_joint=told.drive_joint, lower_joint=told.lower_joint)
        page = b"" if keys is None else write_key_page(keys, CHIP, folder).read_bytes()
        self.flash = TubeFlash(folder / "flash.bin", own, folder, BLOCK_KEY, page)
        self.running: dict[str, Forked] = {}
        self._chip: EmulatedTube | None = None
        self.stack_used: list[int] = []  # bytes, of every life of the chip

    def joint(self, upper: str, lower: str) -> str:
        return f"can:{self._hub.port}/{RIG}/{upper}-{lower},interface=borechain_loopback,frames=fd,profile=native"

    def start(self, name: str, *options: str) -> None:
        place = ("--endpoint", self.endpoint, "--folder", str(self.folder / name))
        under = () if self._keys is None else ("--keys", str(self._keys))
        self.running[name] = started(
            name.split("-", maxsplit=1)[0], "--clock", "own", "--rig", RIG, *options, *place, *under
        )

    def start_all(self) -> None:
        if self._keys is None:
            BootCounter(self.folder / "encoder")  # one that has started before: its epoch is one that a signal can say
        counter = f"timed:{self.folder / 'encoder.npy'}"
        self.start("encoder", "--counter", counter, "--above", "base", "--lower", self.joint("encoder", str(ABOVE)))
        for tube, joints in (
            (ABOVE, ("--upper", self.joint("encoder", str(ABOVE)), "--lower", self.joint(str(ABOVE), str(CHIP)))),
            (BELOW, ("--upper", self.joint(str(CHIP), str(BELOW)))),
        ):
            told = self.world.tube_settings(tube)
            angles = [
                f"--{name}-joint-deg={math.degrees(joint.angle)}"
                for name, joint in (("drive", told.drive_joint), ("lower", told.lower_joint))
            ]
            imu = f"timed:{self.folder / f'tube-{tube}.npy'}"
            self.start(f"node-{tube}", "--tube", str(tube), "--imu", imu, *angles, *joints)
        self.start_chip()

    def start_chip(self) -> None:
        segments = f"{RIG}/{ABOVE}-{CHIP}", f"{RIG}/{CHIP}-{BELOW}"
        self._chip = EmulatedTube(self.program, self.flash, self._hub, segments, self.folder / f"tube-{CHIP}.npy")

    def cut_chip(self) -> None:
        if self._chip is not None:
            self.stack_used.append(stack_used(self._chip.monitor, self.program))
            self._chip.kill()
            self._chip = None

    def end(self) -> None:
        self.cut_chip()
        for process in self.running.values():
            process.send_signal(signal.SIGTERM)
        for process in self.running.values():
            process.communicate(timeout=PATIENCE)


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build_tube(tmp_path_factory.mktemp("tube"))


@pytest.fixture(params=["open", "sealed"])
def surface_and_string(
    request: pytest.FixtureRequest, tmp_path: Path, program: Path
) -> Iterator[tuple[Surface, String]]:
    """Without keys and an epoch that signals can say, and under keys with an epoch that they cannot."""
    register_loopback()
    endpoint, keys, seals = free_endpoint(), None, None
    if request.param == "sealed":
        keys = tmp_path / "keys"
        init_rig(keys, RIG, NOW)
        for tube in (BELOW, CHIP, ABOVE):
            add_tube(keys, tube, NOW)
        seals = Seals(Keys(key_file(keys, BASE), BASE), BASE, {Side.LOWER})
    base = Surface(seals, RECEIPTS)
    with open_router(endpoint) as bus, running_hub() as hub, living(base, bus, RIG) as surface:
        string = String(tmp_path, endpoint, hub, program, keys)
        string.start_all()
        try:
            yield surface, string
        finally:
            string.end()


def test_step_and_link_fit_a_small_chip(program: Path) -> None:
    flash, memory = sizes_of(program)
    assert flash <= FLASH
    assert memory <= MEMORY


def test_a_chip_between_two_tubes_loses_nothing_and_says_nothing_wrong(
    surface_and_string: tuple[Surface, String],
) -> None:
    surface, string = surface_and_string
    for tube in (CHIP, BELOW):
        state = surface.first(NodeState, lambda s, tube=tube: s.tube == tube and not s.flags & UNFIT)
        assert abs(yaw_error(string.world, tube, state.yaw, state.at)) < 0.02, tube
        assert state.hops == ABOVE + 1 - tube

    survey = surface.first(SurveyMeasurement, lambda s: s.tube == CHIP, patience=STOP + 60.0)
    assert abs(yaw_error(string.world, CHIP, survey.yaw, survey.station_at)) < 0.02
    begun, number = time.monotonic(), 10
    while number == 10 or time.monotonic() - begun < 60.0 * (MINUTES - 2.0):
        if number == 10:
            upload_block(surface)
        survey = order_a_survey_and_cut_the_power(surface, string, number, survey)
        number += 2
    state = surface.first(NodeState, lambda s: s.tube == CHIP)
    assert (state.parameters_version, state.parameters_hash) == (1, BLOCK.sha256()[:8])  # over every cut
    string.cut_chip()
    room = stack_region(string.program)[1]
    assert room >= STACK
    assert LEAST_USED < max(string.stack_used) < room - SPARE, string.stack_used
    judge_all(surface, string)


def upload_block(surface: Surface) -> None:
    """Upload a block to the chip until it says that it is in use, which takes a stop."""
    upload, is_ended = (
        Upload(split_block(BLOCK.canonical(), CHIP, 1, BLOCK.version, BLOCK_KEY), time.monotonic()),
        False,
    )
    deadline = time.monotonic() + STOP + TURNING + PATIENCE
    while not is_ended:
        assert time.monotonic() < deadline
        for segment in upload.due_segments(time.monotonic()):
            surface.loop.call(lambda process, now, part=segment: process.endpoint.mail.send_segment(part))
        heard = surface.first(BlockStatus | NodeState, lambda m: m.tube == CHIP)  # type: ignore[arg-type]
        is_ended = isinstance(heard, BlockStatus) and upload.on_status(heard)
    assert heard.phase is UploadPhase.APPLIED
    assert heard.in_use == BLOCK.sha256()


def order_a_survey_and_cut_the_power(
    surface: Surface, string: String, number: int, before: SurveyMeasurement
) -> SurveyMeasurement:
    """Order a survey, have the power fail while the next order's answer is saved; the newest survey after it."""
    reply = surface.order(CHIP, number, "take_survey")
    assert (reply.done, reply.detail) == (True, "at the next settled cycle")
    again = surface.first(SurveyMeasurement, lambda s: s.tube == CHIP and s.station_at > before.station_at, STOP + 60.0)

    string.flash.power_fails_after(WORDS_UNTIL_CUT)
    command = Command(CHIP, number + 1, "take_survey", {})
    surface.loop.call(lambda process, now: process.endpoint.mail.command(command, now))
    deadline = time.monotonic() + PATIENCE
    while not string.flash.has_failed and time.monotonic() < deadline:
        surface.first(NodeState, lambda s: s.tube == ABOVE)
    assert string.flash.has_failed
    string.cut_chip()
    string.start_chip()
    restored = surface.first(Event, lambda e: e.tube == CHIP and e.code == "restored")
    assert restored.sequence > again.sequence
    replies = [m for m in surface.kept if isinstance(m, Reply) and m.sequence == number + 1]
    assert (replies or [surface.first(Reply, lambda r: r.sequence == number + 1)])[0].done
    last: SurveyMeasurement = surface.first(
        SurveyMeasurement, lambda s: s.tube == CHIP and s.station_at > again.station_at, STOP + 60.0
    )
    assert abs(yaw_error(string.world, CHIP, last.yaw, last.station_at)) < 0.02
    return last


def judge_all(surface: Surface, string: String) -> None:
    """Every number once and none missing; every yaw that is trusted within its own doubt of the truth."""
    kept = [m for m in surface.kept if isinstance(m, Event | SurveyMeasurement) and m.tube == CHIP]
    by_number = {m.sequence: m for m in kept}
    assert all(by_number[m.sequence] == m for m in kept)  # what was sent again is the same
    assert sorted(by_number) == list(range(1, max(by_number) + 1))
    for state in surface.kept:
        if isinstance(state, NodeState) and state.tube in (CHIP, BELOW) and not state.flags & UNFIT:
            rate = fastest_at(string.world, state.at)  # by which a wrong clock errs, as in the real-time run
            doubt = math.sqrt(state.yaw_var + state.systematic_var + rate * rate * state.clock_var)
            assert abs(yaw_error(string.world, state.tube, state.yaw, state.at)) < 5.0 * doubt + 0.002, state
