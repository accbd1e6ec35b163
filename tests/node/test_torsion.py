"""What a node does about the twist of the string above it: handed on, gated or stated, waited for."""

import math

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from node.errors import NodeConfigurationError
from node.firmware.inputs import ImuReading, RigContext
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube import Tube
from node.firmware.tube_settings import Kernel, MakeUpAngle, TorsionRule, TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Err, Scheme, default_config
from node.kernels.record.node_record import new_node
from telemetry.frozen import replace
from telemetry.messages import Aiding, Event, SurveyMeasurement

STIFFNESS = 17_413.0  # N m/rad, 60/50 mm, 3 m
FREE = Aiding(1.0, 1e-8, 0.0, 0.0, 0.0, 1000.0, 5, 0, torque=5.0)
HELD = replace(FREE, torque=500.0, under_torque=True)


def tube(rule: TorsionRule = "gate", kernel: Kernel = "float64", scheme: Scheme = Scheme.FORWARD) -> Tube:
    config = default_config()
    settings = TubeSettings(
        3,
        MakeUpAngle(0.5, 1e-3),
        MakeUpAngle(-0.2, 2e-3),
        scheme=scheme,
        kernel=kernel,
        limits=SensorLimits(repeats_together=0, repeats_alone=0),
        stiffness=STIFFNESS,
        torsion=rule,
    )
    return Tube(settings, config, new_node(config), iter(range(1, 10**6)).__next__, restored=False)


class Bench:
    """A tube below a head that stands; ``aiding`` is said every cycle."""

    def __init__(self, it: Tube) -> None:
        self.tube, self.now = it, 1000.0
        self.said: list[object] = []

    def cycles(self, count: int, aiding: Aiding | None, rate: float = 0.0) -> None:
        for _ in range(count):
            self.now += PERIOD
            reading = ImuReading(self.now - PERIOD, self.now, (0.0, 0.0, rate), (0.0, 0.3, -9.8))
            self.said += self.tube.on_cycle(reading, RigContext(True, 1, self.now, 1e-8, True))
            if aiding is not None:
                self.tube.on_aiding(replace(aiding, valid_at=self.now), self.now)

    def codes(self) -> list[str]:
        return [m.code for m in self.said if isinstance(m, Event)]

    def surveys(self) -> int:
        return sum(isinstance(m, SurveyMeasurement) for m in self.said)


@settings(max_examples=20)
@given(st.integers(1, 60), st.floats(0.0, 2000.0))
def test_the_twist_of_a_string_adds_up_as_angles_and_not_as_variances(hops: int, torque: float) -> None:
    """One and the same torque: sigma = |T| hops L / (G J), as far as a turn can be known at all."""
    aiding: Aiding | None = replace(HELD, torque=torque)
    for _ in range(hops):
        assert aiding is not None
        aiding = replace(aiding, systematic_var=0.0)
        aiding = tube().on_aiding(aiding, 1000.0)
    assert aiding is not None
    assert aiding.torsion_var == pytest.approx(min((hops * torque / STIFFNESS) ** 2, 10.0), rel=1e-9, abs=1e-15)
    assert (aiding.torque, aiding.under_torque) == (torque, True)


def test_fifty_tubes_at_500_newton_metres_are_82_degrees() -> None:
    aiding: Aiding | None = HELD
    for _ in range(50):
        assert aiding is not None
        aiding = tube().on_aiding(aiding, 1000.0)
    assert aiding is not None
    assert math.degrees(math.sqrt(aiding.torsion_var)) == pytest.approx(82.0, abs=0.5)


def test_a_gated_aiding_changes_nothing_of_the_filter_and_goes_on_down() -> None:
    bench = Bench(tube("gate"))
    bench.cycles(120, FREE)
    before = bench.tube.state.copy()
    onward = bench.tube.on_aiding(replace(HELD, yaw=2.0, sequence=6), bench.now)
    assert bench.tube.state == before
    assert onward is not None
    assert onward.yaw == 2.0


@pytest.mark.parametrize("kernel", ["float64", "fixed"])
def test_under_torque_the_variance_of_the_twist_is_stated_and_never_averaged(kernel: Kernel) -> None:
    bench = Bench(tube("variance", kernel))
    bench.cycles(120, FREE)
    free = bench.tube.systematic_var
    for k in range(200):
        bench.cycles(1, replace(HELD, sequence=6 + k))
    assert bench.tube.yaw_var < math.radians(0.05) ** 2
    assert bench.tube.systematic_var - free == pytest.approx((500.0 / STIFFNESS) ** 2 - (5.0 / STIFFNESS) ** 2)
    bench.cycles(3, replace(FREE, sequence=400))
    assert bench.tube.systematic_var == pytest.approx(free)
    assert bench.codes()[-2:] == ["string_under_torque", "string_released"]


@pytest.mark.parametrize("rule", ["gate", "variance"])
def test_a_change_of_torque_opens_the_yaw_by_both_twists_and_keeps_the_cross_terms(rule: TorsionRule) -> None:
    bench = Bench(tube(rule))
    bench.cycles(120, FREE)
    bench.tube.on_aiding(replace(HELD, sequence=6), bench.now)
    P = bench.tube.state["P"].copy()
    bench.tube.on_aiding(replace(FREE, sequence=7), bench.now)
    std, released = 500.0 / STIFFNESS if rule == "variance" else 5.0 / STIFFNESS, 5.0 / STIFFNESS
    opened = bench.tube.state["P"] - P
    assert opened[Err.YAW, Err.YAW] == pytest.approx(std**2 + released**2)
    opened[Err.YAW, Err.YAW] = 0.0
    assert not opened.any()


def test_the_survey_waits_for_the_release_of_a_string_that_stands_under_torque() -> None:
    bench = Bench(tube())
    bench.cycles(110, FREE)
    bench.cycles(20, replace(HELD, sequence=6), rate=1.2)
    bench.cycles(90, replace(HELD, sequence=7))
    assert bench.surveys() == 0
    bench.cycles(3, replace(FREE, sequence=8))
    assert bench.surveys() == 1
    bench.cycles(90, replace(FREE, sequence=8))
    assert bench.surveys() == 1


def test_a_torque_of_which_nothing_more_is_heard_is_not_waited_for() -> None:
    bench = Bench(tube())
    bench.cycles(110, FREE)
    bench.cycles(20, replace(HELD, sequence=6), rate=1.2)
    bench.cycles(60, None)
    assert bench.surveys() == 1


def test_a_station_that_was_surveyed_is_not_surveyed_again_by_a_grip() -> None:
    bench = Bench(tube())
    bench.cycles(110, FREE)
    bench.cycles(20, replace(FREE, sequence=6), rate=1.2)
    bench.cycles(60, replace(FREE, sequence=7))
    assert bench.surveys() == 1
    bench.cycles(20, replace(HELD, sequence=8))
    bench.cycles(60, replace(FREE, sequence=9))
    assert bench.surveys() == 1


def test_the_published_scheme_says_the_twist_too() -> None:
    bench = Bench(tube("variance", scheme=Scheme.ESTIMATE))
    bench.cycles(120, FREE)
    said = [m for m in bench.said if isinstance(m, Aiding)][-1]
    assert said.torsion_var == pytest.approx((5.0 / STIFFNESS) ** 2)
    assert said.systematic_var == pytest.approx(1e-6 + 4e-6)
    assert (said.torque, said.under_torque) == (5.0, False)


def test_a_rigid_string_tells_of_no_twist() -> None:
    bench = Bench(tube())
    bench.cycles(120, replace(FREE, torque=0.0))
    bench.cycles(20, replace(FREE, torque=0.0, sequence=6), rate=1.2)
    assert not {"string_released", "string_under_torque"} & set(bench.codes())
    assert bench.tube.systematic_var == pytest.approx(1e-6)


@pytest.mark.parametrize(
    "change",
    [{"stiffness": 0.0}, {"stiffness": math.nan}, {"torsion": "guess"}, {"joints": "guess"}, {"unseen_std": -1.0},
     {"joints": "solved", "scheme": Scheme.ESTIMATE}],
)  # fmt: skip
def test_settings_that_cannot_be_are_refused_by_name(change: dict) -> None:
    with pytest.raises(NodeConfigurationError, match=next(iter(change))):
        TubeSettings(**({"tube": 1} | change))
