"""What a tube says and hands on."""

import math

import numpy as np
import pytest

from node.errors import NodeConfigurationError
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube import Tube
from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Scheme, default_config
from node.kernels.record.node_record import new_node
from telemetry.frozen import replace
from telemetry.messages import Aiding, Event, NodeFlag, NodeMode, NodeState, SurveyMeasurement

DRIVE, LOWER = MakeUpAngle(0.5, 1e-3), MakeUpAngle(-0.2, 2e-3)
NOISELESS = SensorLimits(repeats_together=0, repeats_alone=0)
AIDING = Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, 1000.0, 5, 0)


def tube(scheme: Scheme = Scheme.FORWARD) -> Tube:
    config = default_config()
    settings = TubeSettings(3, DRIVE, LOWER, mount_std=3e-3, scheme=scheme, limits=NOISELESS)
    return Tube(settings, config, new_node(config), iter(range(1, 10**6)).__next__, restored=False)


class Life:
    """A tube on a bench that stands or turns."""

    def __init__(self, it: Tube) -> None:
        self.tube = it
        self.now = 1000.0
        self.angle = 1.0
        self.sequence = 5
        self.clock_var = 1e-8  # s^2
        self.hops = 1
        self.said: list[object] = []

    def cycles(self, count: int, rate: float = 0.0, *, aided: bool = True) -> list[object]:
        said: list[object] = []
        for _ in range(count):
            self.now += PERIOD
            self.angle += rate * PERIOD
            self.sequence += rate != 0.0
            around = RigContext(True, self.hops, self.now, self.clock_var, True)
            reading = ImuReading(self.now - PERIOD, self.now, (0.0, 0.0, rate), (0.0, 0.3, -9.8))
            said.extend(self.tube.on_cycle(reading, around))
            aiding = replace(
                AIDING, yaw=self.angle % (2 * math.pi), rate=rate, valid_at=self.now, sequence=self.sequence
            )
            if aided:
                self.tube.on_aiding(aiding, self.now)
        self.said.extend(said)
        return said


def test_forward_hands_the_measurement_on_unchanged_with_the_joints_added() -> None:
    onward = tube().on_aiding(AIDING, 1000.0)
    assert onward is not None
    for name in ("yaw", "yaw_var", "rate", "valid_at", "sequence"):
        assert getattr(onward, name) == getattr(AIDING, name)
    assert onward.offset == pytest.approx(DRIVE.angle + LOWER.angle)
    assert onward.systematic_var == pytest.approx(DRIVE.std**2 + LOWER.std**2)
    assert onward.hops == 1


def test_the_drive_joint_counts_at_the_top_alone() -> None:
    onward = tube().on_aiding(replace(AIDING, hops=2, offset=0.1, systematic_var=1e-6), 1000.0)
    assert onward is not None
    assert onward.offset == pytest.approx(0.1 + LOWER.angle)
    assert onward.systematic_var == pytest.approx(1e-6 + LOWER.std**2)


@pytest.mark.parametrize(("clock_std", "rate", "used"), [(0.04, 1.0, True), (0.1, 1.0, False), (0.1, 0.0, True)])
def test_an_aiding_that_a_poor_clock_cannot_place_in_a_turning_goes_on_unused(
    clock_std: float, rate: float, used: bool
) -> None:
    life = Life(tube())
    life.cycles(40)
    life.cycles(6, rate)
    before = int(life.tube.state["pending"])
    aiding = replace(AIDING, yaw=life.angle, rate=rate, valid_at=life.now, sequence=900)
    assert life.tube.on_aiding(aiding, life.now, clock_std**2) is not None
    assert int(life.tube.state["pending"]) == before + used


def test_estimate_says_its_own_yaw_and_variance_each_cycle() -> None:
    life = Life(tube(Scheme.ESTIMATE))
    assert life.tube.on_aiding(AIDING, 1000.0) is None
    said = [m for m in life.cycles(5) if isinstance(m, Aiding)]
    assert said[-1].yaw == pytest.approx(1.0 + DRIVE.angle, abs=1e-6)
    assert said[-1].yaw_var == life.tube.yaw_var
    assert said[-1].offset == pytest.approx(LOWER.angle)
    assert said[-1].sequence != said[-2].sequence


def test_a_stop_is_surveyed_once_and_every_transition_is_an_event() -> None:
    life = Life(tube())
    life.cycles(110)
    life.cycles(60, rate=1.2)
    said = life.cycles(80)
    surveys = [m for m in said if isinstance(m, SurveyMeasurement)]
    assert len(surveys) == 1
    assert surveys[0].samples == 32
    assert surveys[0].settle_time > 16.0
    assert surveys[0].yaw == pytest.approx((life.angle + DRIVE.angle) % (2 * math.pi), abs=1e-3)
    assert surveys[0].systematic_var == pytest.approx(DRIVE.std**2 + 3e-3**2)
    codes = [m.code for m in life.said if isinstance(m, Event)]
    for code in ("bias_known", "started", "stopped"):
        assert code in codes
    sequences = [m.sequence for m in life.said if isinstance(m, Event | SurveyMeasurement)]
    assert sequences == sorted(set(sequences))


def test_a_survey_can_be_asked_for_again() -> None:
    life = Life(tube())
    life.cycles(110)
    life.cycles(10, rate=1.2)
    life.cycles(60)
    life.tube.take_survey()
    assert sum(isinstance(m, SurveyMeasurement) for m in life.cycles(3)) == 1


def test_state_says_what_the_node_does_not_trust() -> None:
    life = Life(tube())
    first = next(m for m in life.cycles(3) if isinstance(m, NodeState))
    assert NodeFlag.BIAS_UNKNOWN in first.flags
    assert first.mode == NodeMode.STATIC_BIAS
    life.cycles(110)
    last = [m for m in life.cycles(6) if isinstance(m, NodeState)][-1]
    assert last.flags == NodeFlag.NONE
    assert last.aiding_age < 2.0
    unaided = RigContext(True, 1, life.now + 60.0, 1e-8, False)
    reading = ImuReading(life.now + 60.0 - PERIOD, life.now + 60.0, (0.0, 0.0, 0.0), (0.0, 0.0, -9.8))
    flags = [m.flags for _ in range(3) for m in life.tube.on_cycle(reading, unaided) if isinstance(m, NodeState)][-1]
    assert NodeFlag.AIDING_OLD in flags
    assert NodeFlag.CLOCK_UNSYNCHRONISED in flags


@pytest.mark.parametrize(
    "change",
    [{"tube": 0}, {"tube": 251}, {"state_every": 0}, {"mount_std": -1.0}, {"lower_joint": MakeUpAngle(math.nan, 0.0)},
     {"drive_joint": MakeUpAngle(0.0, math.inf)}],
)  # fmt: skip
def test_settings_that_cannot_be_are_refused_by_name(change: dict) -> None:
    with pytest.raises(NodeConfigurationError, match=next(iter(change))):
        TubeSettings(**({"tube": 1} | change))


def test_a_sample_that_is_no_number_is_an_event() -> None:
    life = Life(tube())
    life.cycles(5)
    around = RigContext(True, 1, life.now, 1e-8, True)
    reading = ImuReading(life.now, life.now + PERIOD, (math.nan, 0.0, 0.0), (0.0, 0.0, 0.0))
    codes = [m.code for m in life.tube.on_cycle(reading, around) if isinstance(m, Event)]
    assert codes == ["bad_sample"]
    assert np.isfinite(life.tube.yaw)


def test_a_chain_made_up_anew_is_an_event() -> None:
    life = Life(tube())
    life.cycles(110)
    life.tube.on_aiding(replace(AIDING, hops=1, offset=DRIVE.angle, systematic_var=1e-6), life.now)
    around = RigContext(True, 2, life.now + PERIOD, 1e-8, True)
    reading = ImuReading(life.now, life.now + PERIOD, (0.0, 0.0, 0.0), (0.0, 0.0, -9.8))
    codes = [m.code for m in life.tube.on_cycle(reading, around) if isinstance(m, Event)]
    assert codes == ["reference_changed"]


def test_a_broken_covariance_is_an_event_and_the_filter_starts_over() -> None:
    life = Life(tube())
    life.cycles(110)
    bias = life.tube.state["static_bias"].copy()
    life.tube.state["P"][2, 2] = math.nan
    codes = [m.code for m in life.cycles(2) if isinstance(m, Event)]
    assert "filter_fault" in codes
    np.testing.assert_array_equal(life.tube.state["static_bias"], bias)
    life.cycles(20, rate=1.2)
    off = life.tube.yaw - (life.angle + DRIVE.angle)
    assert math.remainder(off, 2 * math.pi) == pytest.approx(0.0, abs=1e-3)
