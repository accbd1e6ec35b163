"""What a driver proves of every cycle: each defect is named, costs its cycles alone, and turns no yaw."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from emulated_mpu import CHIPS, EmulatedMpu

from node.errors import SensorError
from node.firmware.imu_settings import ImuSettings
from node.firmware.inputs import ImuReading
from node.firmware.tube_settings import TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.process.drivers import mpu_chips
from node.process.drivers.gravity_witness import GravityWitness
from node.process.drivers.mpu_imu import MpuImu
from node.process.drivers.source import ImuSample, SafeImu
from node.process.temperature_watch import TemperatureWatch
from node.process.tube_process import TubeProcess
from telemetry.messages import Severity
from telemetry.parameters import ParameterBlock, SensorParameters

RATE, FORCE = (0.5 * DEG, -1.0 * DEG, 40.0 * DEG), (1.9, -0.7, -9.58)
NAMES = tuple(CHIPS)


class Used:
    """A driver in use over an emulated sensor, cycle by cycle, as a process uses it."""

    def __init__(self, chip: str = "mpu6500") -> None:
        self.chip = EmulatedMpu(chip=chip)
        self.driver = MpuImu(self.chip.connect, chip=mpu_chips.CHIPS[chip], sleep=lambda _: None)
        self.driver.start()
        self.said: list[tuple[str, str]] = []
        self.details: list[str] = []
        self.safe = SafeImu(self.driver, self._say)
        self.now = 100.0

    def _say(self, _severity: Severity, code: str, arguments: dict) -> None:
        self.said.append((code, str(arguments.get("cause", ""))))
        self.details.append(str(arguments.get("detail", "")))

    def cycle(self, rate: tuple = RATE, force: tuple = FORCE, seconds: float = PERIOD) -> ImuSample:
        self.chip.live(seconds, rate, force)
        self.now += PERIOD
        return self.safe.read(self.now - PERIOD, self.now)

    def is_right(self, sample: ImuSample) -> bool:
        """Whether a sample is that of the motion, to the steps of the sensor."""
        near_rate = np.allclose(sample.rate, RATE, rtol=0.0, atol=500.0 * DEG / 32768.0)
        return bool(near_rate and np.allclose(sample.force, FORCE, rtol=0.0, atol=8.0 * 9.80665 / 32768.0))

    def outcomes(self, count: int) -> str:
        """One letter a cycle: right, lost or wrong."""
        letters = []
        for _ in range(count):
            sample = self.cycle()
            letters.append("." if math.isnan(sample.rate[2]) else "r" if self.is_right(sample) else "W")
        return "".join(letters)


@pytest.mark.parametrize("chip", NAMES)
def test_every_chip_of_the_family_reads_the_same_motion(chip: str) -> None:
    used = Used(chip)
    assert used.outcomes(6) == "rrrrrr"
    assert used.said == []
    assert used.cycle().temperature == pytest.approx(25.0, abs=0.01)


@pytest.mark.parametrize("chip", NAMES)
@pytest.mark.parametrize("lost", range(1, 14))
def test_bytes_lost_from_the_fifo_cost_two_cycles_and_exchange_no_axes(chip: str, lost: int) -> None:
    used = Used(chip)
    used.outcomes(3)
    used.chip.lose(lost)
    assert used.outcomes(5) == "..rrr"
    assert used.said == [("sensor_failed", "lost_bytes"), ("sensor_back", "")]


@pytest.mark.parametrize("lost", range(1, 14))
@pytest.mark.parametrize("at", [0, 1, 5, 12])
def test_bytes_lost_while_the_fifo_is_read_are_seen_in_that_cycle(lost: int, at: int) -> None:
    used = Used()
    used.outcomes(3)
    used.chip.lose_in = (at, lost)
    assert used.outcomes(5) == "..rrr"
    assert used.said == [("sensor_failed", "lost_bytes"), ("sensor_back", "")]


@pytest.mark.parametrize("chip", NAMES)
def test_each_register_that_falls_back_alone_is_named_in_its_cycle(chip: str) -> None:
    settings = Used(chip).driver._settings
    others = [(place, value) for place, value in settings if CHIPS[chip].after_reset.get(place, 0) != value]
    assert len(others) >= 6
    for place, value in others:
        used = Used(chip)
        used.outcomes(3)
        used.chip.registers[place] = CHIPS[chip].after_reset.get(place, 0)
        assert used.outcomes(5) == "..rrr", hex(place)
        assert used.said == [("sensor_failed", "register"), ("sensor_back", "")], hex(place)
        assert f"register 0x{place:02x}: expected 0x{value:02x}" in used.details[0]


def test_a_register_that_falls_back_in_mid_cycle_costs_that_cycle() -> None:
    """Its first frames are of the range that was set, the others of another."""
    used = Used()
    used.outcomes(3)
    used.chip.live(0.5 * PERIOD, RATE, FORCE)
    used.chip.registers[0x1B] = 0
    used.now += PERIOD
    used.chip.live(0.5 * PERIOD, RATE, FORCE)
    assert math.isnan(used.safe.read(used.now - PERIOD, used.now).rate[2])
    assert used.outcomes(3) == ".rr"
    assert used.said[0] == ("sensor_failed", "register")


@pytest.mark.parametrize("chip", NAMES)
def test_a_sensor_that_was_reset_is_set_up_anew(chip: str) -> None:
    used = Used(chip)
    used.outcomes(3)
    used.chip.reset()
    assert used.outcomes(5) == "..rrr"
    assert used.said == [("sensor_failed", "register"), ("sensor_back", "")]


@pytest.mark.parametrize("identity", [0x00, 0xFF, 0x12])
def test_an_identity_that_is_gone_is_named_at_once_and_once(identity: int) -> None:
    used = Used()
    used.outcomes(3)
    used.chip.identity = identity
    assert used.outcomes(20) == "." * 20
    assert used.said == [("sensor_failed", "identity")]
    used.chip.identity = 0x70
    assert used.outcomes(3) == ".rr"


@pytest.mark.parametrize("chip", [name for name in NAMES if name != "mpu6500"])
def test_another_chip_of_the_family_is_named_with_its_own_name(chip: str) -> None:
    one = EmulatedMpu(identity=CHIPS[chip].identity)
    if CHIPS[chip].who_am_i != 0x75:
        return  # answers at another register
    with pytest.raises(SensorError, match=f"expected 0x70, got 0x{CHIPS[chip].identity:02x}, which is an {chip}"):
        MpuImu(one.connect, sleep=lambda _: None).start()


@pytest.mark.parametrize("at", [26 * 14, 14, 512, 0])
def test_a_count_that_stands_is_named_within_two_cycles(at: int) -> None:
    used = Used()
    used.outcomes(3)
    used.chip.stands_at = at
    assert "r" not in used.outcomes(10)[1:]
    assert used.said[0][0] == "sensor_failed"
    assert any(cause == ("counter" if at == 26 * 14 else cause) for _, cause in used.said)
    assert "W" not in used.outcomes(5)
    used.chip.stands_at = None
    assert used.outcomes(5)[2:] == "rrr"
    assert used.said[-1] == ("sensor_back", "")
    assert len(used.said) <= 3


def test_a_fifo_that_overruns_and_slips_at_once_is_told_as_both() -> None:
    used = Used()
    used.outcomes(3)
    used.chip.live(2.0, RATE, FORCE)
    del used.chip.fifo[:5]
    assert used.outcomes(5) == "..rrr"
    assert used.said == [("sensor_failed", "overflow"), ("sensor_back", "")]
    assert "overflown, 499 bytes and 9 of them are no whole frame" in used.details[0]


def test_causes_that_come_one_after_the_other_are_each_told_once() -> None:
    used = Used()
    used.outcomes(3)
    used.chip.lose(3)
    used.cycle()
    used.chip.identity = 0
    used.outcomes(6)
    used.chip.identity, used.chip.absent = 0x70, True
    used.outcomes(6)
    used.chip.absent = False
    assert used.outcomes(3) == ".rr"
    causes = [("sensor_failed", cause) for cause in ("lost_bytes", "identity", "bus")]
    assert used.said == [*causes, ("sensor_back", "")]


def test_a_sensor_that_took_half_a_cycle_to_start_gives_no_numbers_for_it() -> None:
    """The head may have turned faster in the half that was not measured."""
    used = Used()
    used.outcomes(3)
    used.chip.lose(1)
    used.outcomes(2)
    assert math.isnan(used.cycle(seconds=0.5 * PERIOD).rate[2])
    assert used.outcomes(2) == "rr"


def test_a_force_at_rest_that_is_not_gravity_is_told_by_its_size() -> None:
    used = Used()
    rest = (0.0, 0.0, 0.01 * DEG)
    for scale in (1.0, 1.1, 0.9):
        for _ in range(3):
            assert math.isfinite(used.cycle(rest, tuple(scale * f for f in FORCE)).rate[2])
    assert used.said == []
    half = tuple(0.5 * f for f in FORCE)
    assert [math.isfinite(used.cycle(rest, half).rate[2]) for _ in range(8)] == [True] + 7 * [False]
    assert used.said == [("sensor_failed", "gravity")]
    assert f"a force of {0.5 * math.hypot(*FORCE):.2f} m/s^2 at rest" in used.details[0]
    used.outcomes(2)
    assert used.outcomes(2) == "rr"


def test_a_head_that_turns_or_is_shaken_is_no_rest() -> None:
    witness = GravityWitness()
    for k in range(40):
        turned = 0.3 * k
        witness.look((0.0, 0.0, 0.6), (4.0 * math.cos(turned), 4.0 * math.sin(turned), -3.0))
    for k in range(40):
        witness.look((0.0, 0.0, 0.02 * k), (0.0, 0.0, -3.0))
    witness.look((math.nan,) * 3, (math.nan,) * 3)


class Events(TubeProcess):
    """Keeps the process's own events."""

    def _send_event(self, severity: Severity, code: str, arguments: dict) -> None:
        self.told = [*getattr(self, "told", []), (code, arguments)]
        super()._send_event(severity, code, arguments)


@pytest.mark.parametrize("temperature", [math.nan, math.inf, -1e9, 400.0])
@pytest.mark.parametrize("is_own", [True, False])
def test_an_impossible_temperature_is_told_and_the_readings_stay(
    tmp_path: Path, temperature: float, is_own: bool
) -> None:
    chip = EmulatedMpu()
    imus = [MpuImu(chip.connect, sleep=lambda _: None)] if is_own else []
    process = Events(TubeSettings(3), tmp_path, imus=imus)
    random, now, kept = np.random.default_rng(1), 1000.0, 30.0
    for k in range(120):
        now += PERIOD
        warmth = temperature if 60 <= k < 80 else kept
        noise = random.normal(0.0, 0.05 * DEG, 3)
        force = np.array(FORCE) + random.normal(0.0, 0.01, 3)
        if is_own:
            chip.live(PERIOD, tuple(noise), tuple(force), -273.0 if warmth != kept else kept)  # its counts end at -77 C
        process.on_cycle([now - PERIOD, *noise, *force, warmth], now)
        process.take_frames(now)
        assert np.all(np.isfinite(process.state[0]["P"]))
        assert process.tube.node["temperature"] == pytest.approx(kept, abs=0.01)
    told = [code for code, _ in process.told if code.startswith("temp")]
    assert told == ["temperature_lost", "temperature_back"]


def test_a_reading_that_is_corrected_by_its_temperature_is_lost_without_it() -> None:
    said: list[tuple[str, object]] = []
    slopes = ((0.0, 0.0, 1e-5), (0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    blocks = [ParameterBlock(3, 1, gyroscope=SensorParameters(bias_slopes=slopes)), ParameterBlock(3, 2)]
    for block in blocks:
        watch = TemperatureWatch(
            lambda _, code, arguments: said.append((code, arguments.get("readings_used"))),
            (ImuSettings(),),
            lambda block=block: block,
        )
        readings = [ImuReading(0.0, PERIOD, RATE, FORCE, warmth) for warmth in (31.0, math.nan, math.nan, 32.0)]
        looked = [watch.look(reading) for reading in readings]
        assert [one.temperature for one in looked] == [31.0, 31.0, 31.0, 32.0]
        assert [math.isfinite(one.rate[2]) for one in looked] == [True, block is blocks[1], block is blocks[1], True]
    assert said == [
        ("temperature_lost", False),
        ("temperature_back", None),
        ("temperature_lost", True),
        ("temperature_back", None),
    ]


@pytest.mark.parametrize("first", range(1, 14))
def test_bytes_lost_twice_that_make_up_a_frame_are_seen_by_its_temperatures(first: int) -> None:
    """What is between the two has its words exchanged, and the count is whole."""
    used = Used()
    used.outcomes(3)
    used.chip.live(PERIOD, RATE, FORCE)
    del used.chip.fifo[200 : 200 + 14 - first]
    del used.chip.fifo[100 : 100 + first]
    used.now += PERIOD
    assert math.isnan(used.safe.read(used.now - PERIOD, used.now).rate[2])
    assert used.said == [("sensor_failed", "lost_bytes")]
    assert used.outcomes(3) == ".rr"
