"""A clock that is put right while the string turns: the node follows the step it knows of, and owns up to the rest."""

import math
from collections import Counter
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pytest

from borechain.drilling.inline import InlineRig
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube import Tube
from node.firmware.tube_settings import Kernel, MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.filter.resets import open_yaw
from node.kernels.record.filter_record import Err, default_config
from node.kernels.record.node_record import new_node
from sim.rig.ground_settings import ground_settings
from sim.world.scenario import scenario_of
from sim.world.world import World
from telemetry.messages import Aiding, Event

SPIN = math.radians(71.0)  # rad/s
RAMP = 4  # cycles
CLOCK_STD = 2e-3  # s
STEP = 1.5e-3  # s, of the clock in the middle of a turning: 0.1 deg, seven sigmas of what is known by then


@dataclass
class Bench:
    """A perfect tube below a perfect encoder, whose clock dates late by ``error`` (s)."""

    tube: Tube
    error: float = 1e-3
    now: float = 1000.0
    yaw: float = 0.0
    rate: float = 0.0
    number: int = 0  # of the aiding, which repeats itself while the head stands

    def __post_init__(self) -> None:
        self.codes: list[str] = []

    def cycles(self, count: int, to: float | None = None, stepped: float = 0.0, drift_std: float = 0.0) -> None:
        """Cycles at the present rate, or of a ramp ``to`` another; in the first the clock has ``stepped``."""
        begin = self.rate
        for k in range(count):
            before = self.rate
            if to is not None:
                self.rate = begin + (to - begin) * (k + 1) / count
            mean = 0.5 * (before + self.rate)
            self.now += PERIOD
            self.yaw += mean * PERIOD
            reading = ImuReading(self.now - PERIOD, self.now, (0.0, 0.0, mean), (0.0, 0.3, -9.8))
            around = RigContext(True, 1, self.now, CLOCK_STD**2, True, stepped=stepped, drift_std=drift_std)
            self.codes += [said.code for said in self.tube.on_cycle(reading, around) if isinstance(said, Event)]
            self.number += mean != 0.0
            self.error, stepped = self.error + stepped if math.isfinite(stepped) else self.error, 0.0
            aiding = Aiding(self.yaw % math.tau, 1e-9, 0.0, 0.0, self.rate, self.now, self.number, 0)
            self.tube.on_aiding(aiding, self.now + self.error)

    def turns_on_in_peace(self) -> None:
        """Twenty cycles more, after which the clock's error is known and no aiding was rejected."""
        self.cycles(20)
        assert self.stamp == pytest.approx(-self.error, abs=3.0 * self.stamp_std)
        assert "aiding_rejected" not in self.codes

    @property
    def stamp(self) -> float:
        return float(self.tube.state["stamp"])

    @property
    def stamp_std(self) -> float:
        return math.sqrt(self.tube.state["P"][Err.STAMP, Err.STAMP])


def turning(kernel: Kernel) -> Bench:
    """A tube that has learnt its clock's error from a turning, and turns on."""
    config = default_config()
    limits = SensorLimits(repeats_together=0, repeats_alone=0)
    settings = TubeSettings(3, MakeUpAngle(0.0, 0.0), MakeUpAngle(0.0, 0.0), kernel=kernel, limits=limits)
    bench = Bench(Tube(settings, config, new_node(config), iter(range(1, 10**6)).__next__, restored=False))
    bench.cycles(120)
    bench.cycles(RAMP, to=SPIN)
    bench.cycles(20)
    assert bench.stamp == pytest.approx(-bench.error, abs=3.0 * bench.stamp_std)
    assert bench.stamp_std < 0.3e-3
    return bench


KERNELS = ("float64", "fixed")


@pytest.mark.parametrize("kernel", KERNELS)
@pytest.mark.parametrize("step", [STEP, -STEP])
def test_a_step_of_the_clock_that_is_told_is_no_surprise(kernel: Kernel, step: float) -> None:
    bench = turning(kernel)
    stamp, std = bench.stamp, bench.stamp_std
    bench.cycles(1, stepped=step)
    assert bench.stamp == pytest.approx(stamp - step, abs=std)
    bench.turns_on_in_peace()


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_step_of_the_clock_that_is_not_told_contradicts_the_gyroscope(kernel: Kernel) -> None:
    bench = turning(kernel)
    bench.error += STEP
    bench.cycles(20)
    assert "aiding_rejected" in bench.codes


@pytest.mark.parametrize("kernel", KERNELS)
def test_an_unknown_step_makes_void_what_was_learnt_of_the_clock(kernel: Kernel) -> None:
    bench = turning(kernel)
    bench.error += STEP
    bench.cycles(1, stepped=math.nan)
    bench.turns_on_in_peace()


@pytest.mark.parametrize("kernel", KERNELS)
def test_at_rest_an_unknown_step_costs_no_reference_that_repeats_itself(kernel: Kernel) -> None:
    """What waits is dropped, and a head that stands says the same again: it is the first of the new dates."""
    bench = turning(kernel)
    bench.cycles(RAMP, to=0.0)
    open_yaw(bench.tube.state, 1.0)
    bench.cycles(1, stepped=math.nan)
    bench.cycles(10)
    assert math.sqrt(bench.tube.state["now_P"][Err.YAW, Err.YAW]) < 1e-4


@pytest.mark.parametrize("kernel", KERNELS)
def test_what_a_rest_lets_a_clock_wander_is_in_the_variance_of_its_error(kernel: Kernel) -> None:
    """A rate that is off by 2e-5 for a rest of 47 s: 0.9 ms, and no more than the clock itself may be off."""
    bench = turning(kernel)
    bench.cycles(RAMP, to=0.0)
    known = bench.stamp_std
    bench.cycles(90, drift_std=2e-5)
    assert bench.stamp_std == pytest.approx(math.hypot(known, 2e-5 * 90 * PERIOD), rel=0.1)
    bench.cycles(200, drift_std=2e-5)
    assert bench.stamp_std > CLOCK_STD
    bench.cycles(1, stepped=1e-6, drift_std=2e-5)
    assert bench.stamp_std == pytest.approx(CLOCK_STD, rel=0.01)
    assert bench.stamp == pytest.approx(0.0, abs=1e-9)


@pytest.mark.slow
def test_a_long_string_turns_without_a_doubt_while_its_clocks_are_put_right(tmp_path: Path) -> None:
    """Fifty tubes whose clocks have just begun to be compared; before nodes knew of steps they rejected 24 aidings."""
    tables: dict[str, Any] = {
        "rig": {"tubes": 50, "tube_length_m": 2.0, "tubes_at_start": 50},
        "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
        "rotation": {"turns": 1.5, "advance_m": 0.1},
        "schedule": {"add_s": 64.0, "stop_s": 26.0, "finish_s": 5.0, "blocks": 2},
    }
    world = World(scenario_of(tables), 1)
    rig = InlineRig(world, ground_settings(world), "rig-1", tmp_path)
    rig.run()
    codes = Counter(event["code"] for event in rig.ask("events")["events"])
    surveyed = len(rig.ask("measurements")["measurements"])
    rig.close()
    assert (codes["aiding_rejected"], codes["aiding_doubted"], surveyed) == (0, 0, 100)
