"""The joint that was made up above a node: solved from the yaw it kept, from the marks, or from both."""

import math

import pytest

from node.firmware.inputs import ImuReading, RigContext
from node.firmware.sensor_limits import SensorLimits
from node.firmware.tube import Tube
from node.firmware.tube_settings import JointRule, MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import DEG, PERIOD
from node.kernels.record.filter_record import default_config
from node.kernels.record.node_record import forget_session, new_node
from node.kernels.string.encoder_step import QUANTUM
from telemetry.frozen import replace
from telemetry.messages import Aiding, Event

OLD = 0.05 * DEG  # of the mark between the head and this tube while it was on top
R = QUANTUM**2 / 12.0
TOP = Aiding(
    1.0, R, 0.0, 0.0, 0.0, 1000.0, 5, 0
)  # from the head; below, through the new tube whose marks are 0.1 deg off
MARKS_VAR = 2.0 * OLD**2
BELOW = replace(TOP, offset=0.5 + 0.1 * DEG, systematic_var=MARKS_VAR, hops=1)
ANOTHER = replace(BELOW, yaw=3.0, offset=BELOW.offset - 2.0, sequence=9)  # the head has turned by 2 rad meanwhile


class Bench:
    """A tube that stands below a head; its upper joint may be open."""

    def __init__(self, rule: JointRule, **change: float) -> None:
        config = default_config()
        limits = SensorLimits(repeats_together=0, repeats_alone=0)
        self.settings = TubeSettings(3, MakeUpAngle(0.5, OLD), joints=rule, limits=limits, **change)  # type: ignore[arg-type]
        self.tube = Tube(self.settings, config, new_node(config), iter(range(1, 10**6)).__next__, restored=False)
        self.now = 1000.0
        self.events: dict[str, Event] = {}

    def cycles(self, count: int, aiding: Aiding | None, rate: float = 0.0) -> Aiding | None:
        onward = None
        for _ in range(count):
            self.now += PERIOD
            reading = ImuReading(self.now - PERIOD, self.now, (0.0, 0.0, rate), (0.0, 0.3, -9.8))
            around = RigContext(aiding is not None, 1, self.now, 1e-8, True)
            self.events |= {m.code: m for m in self.tube.on_cycle(reading, around) if isinstance(m, Event)}
            if aiding is not None:
                onward = self.tube.on_aiding(replace(aiding, valid_at=self.now), self.now)
        return onward

    def add_a_tube(self, aiding: Aiding = BELOW, slip: float = 0.0) -> Aiding | None:
        self.cycles(120, TOP)
        self.cycles(10, None)
        if slip:
            self.cycles(4, None, slip / (4.0 * PERIOD))
            self.cycles(20, None)
        return self.cycles(5, aiding)


def test_by_default_the_marks_are_followed() -> None:
    bench = Bench("marks")
    bench.add_a_tube()
    assert bench.tube.yaw == pytest.approx(1.5 + 0.1 * DEG, abs=0.01 * DEG)
    assert bench.tube.systematic_var == pytest.approx(MARKS_VAR)
    assert not {"joint_solved", "joint_not_solved"} & set(bench.events)


def test_a_head_that_stood_still_leaves_yaw_variance_and_filter_as_they_were() -> None:
    bench = Bench("solved")
    bench.cycles(120, TOP)
    before = bench.tube.yaw_var
    onward = bench.add_a_tube()
    assert bench.tube.yaw == pytest.approx(1.5, abs=1e-9)
    assert bench.tube.yaw_var == pytest.approx(before, rel=0.05)
    assert "reference_changed" not in bench.events
    assert onward is not None
    assert onward.offset == pytest.approx(0.5)
    assert onward.systematic_var == pytest.approx(OLD**2 + bench.settings.unseen_std**2)
    solved = bench.events["joint_solved"].arguments
    assert solved["angle_deg"] == pytest.approx(math.degrees(0.5))
    assert solved["marks_deg"] == pytest.approx(math.degrees(0.5) + 0.1)
    assert solved["sigma_deg"] == pytest.approx(math.sqrt(0.05**2 + 0.01**2))
    assert "joint_contradicts_marks" not in bench.events


def test_a_head_that_turned_adds_the_saved_yaw_and_the_aiding() -> None:
    """make-up = saved yaw - aiding; var = its systematic + P + R + what may turn unseen."""
    bench = Bench("solved")
    bench.cycles(130, TOP)
    saved = bench.tube.yaw_var
    bench.add_a_tube(ANOTHER)
    assert bench.tube.yaw == pytest.approx(1.5, abs=1e-6)
    expected = OLD**2 + saved + R + bench.settings.unseen_std**2
    assert bench.tube.systematic_var == pytest.approx(expected, rel=0.02)
    assert bench.events["joint_solved"].arguments["angle_deg"] == pytest.approx(math.degrees(1.5 - 3.0), abs=1e-3)


@pytest.mark.parametrize("aiding", [BELOW, ANOTHER])
def test_both_are_weighed_by_their_inverse_variances(aiding: Aiding) -> None:
    solved, both = Bench("solved"), Bench("both")
    solved.add_a_tube(aiding)
    both.add_a_tube(aiding)
    var = solved.tube.systematic_var
    share = MARKS_VAR / (MARKS_VAR + var)
    assert both.tube.systematic_var == pytest.approx(share * var, rel=1e-6)
    assert both.tube.yaw == pytest.approx(1.5 + (1.0 - share) * 0.1 * DEG, abs=0.008 * DEG)


def test_what_the_gyroscope_saw_turn_is_in_the_solution() -> None:
    bench = Bench("solved")
    bench.add_a_tube(slip=3.0 * DEG)
    assert bench.tube.yaw == pytest.approx(1.5 + 3.0 * DEG, abs=0.1 * DEG)
    solved = bench.events["joint_solved"].arguments
    assert solved["turned"] is True
    assert solved["angle_deg"] == pytest.approx(math.degrees(0.5) + 3.0, abs=0.1)
    assert bench.tube.systematic_var > OLD**2 + R


@pytest.mark.parametrize(("off_deg", "contradicts"), [(0.2, False), (2.0, True), (-2.0, True)])
def test_marks_that_say_otherwise_are_a_warning(off_deg: float, contradicts: bool) -> None:
    bench = Bench("both")
    bench.add_a_tube(replace(BELOW, offset=0.5 + off_deg * DEG))
    assert ("joint_contradicts_marks" in bench.events) == contradicts
    if contradicts:  # an error of that size is no error of reading, and is not averaged in
        assert bench.tube.yaw == pytest.approx(1.5, abs=1e-6)


def test_a_yaw_that_is_not_known_solves_nothing() -> None:
    bench = Bench("solved")
    bench.cycles(120, TOP)
    bench.cycles(10, None)
    bench.tube.state["yaw_known"] = 0
    bench.cycles(5, BELOW)
    assert bench.events["joint_not_solved"].arguments["reason"] == "the saved yaw is not known"
    assert bench.tube.yaw == pytest.approx(1.5 + 0.1 * DEG, abs=1e-5)
    assert bench.tube.systematic_var == pytest.approx(MARKS_VAR)


@pytest.mark.parametrize("change", [{"rate": 1.0}, {"under_torque": True, "torque": 500.0}])
def test_a_string_that_does_not_stand_solves_nothing(change: dict) -> None:
    bench = Bench("solved")
    bench.add_a_tube(replace(BELOW, **change))
    assert bench.events["joint_not_solved"].arguments["reason"] == "the string does not stand still"


def restarted(bench: Bench) -> Tube:
    forget_session(bench.tube.nodes)
    return Tube(bench.settings, default_config(), bench.tube.nodes, iter(range(9)).__next__, restored=True)


def test_the_solution_is_kept_over_a_restart_and_for_later_measurements() -> None:
    bench = Bench("solved")
    bench.add_a_tube(ANOTHER)
    offset, var = float(bench.tube.state["reference_offset"]), bench.tube.systematic_var
    bench.tube = restarted(bench)
    bench.events.clear()
    onward = bench.cycles(5, replace(ANOTHER, sequence=10))
    assert onward is not None
    assert onward.offset == pytest.approx(offset, abs=1e-12)
    assert onward.systematic_var == pytest.approx(var)
    assert not bench.events


def test_a_restart_does_not_count_the_trapped_twist_twice() -> None:
    bench = Bench("solved", stiffness=17_413.0)
    bench.add_a_tube(replace(ANOTHER, torque=50.0, torsion_var=1e-6))
    var = bench.tube.systematic_var
    for sequence in (10, 11, 12):
        bench.tube = restarted(bench)
        bench.cycles(5, replace(ANOTHER, torque=50.0, torsion_var=1e-6, sequence=sequence))
        assert bench.tube.systematic_var == pytest.approx(var)


def test_a_node_that_was_off_while_the_joint_was_made_up_takes_the_marks() -> None:
    bench = Bench("solved")
    bench.cycles(120, TOP)
    bench.tube = restarted(bench)
    bench.cycles(5, BELOW)
    assert bench.events["joint_not_solved"].arguments["reason"] == "the node was started anew meanwhile"
    assert bench.tube.systematic_var == pytest.approx(MARKS_VAR)


def test_farther_down_the_yaw_goes_on_too_and_the_joint_is_told_once() -> None:
    """A node that was at hop 2 and is at hop 3 now: its own joint is no new one."""
    bench = Bench("both")
    bench.cycles(120, replace(BELOW, offset=0.5, systematic_var=OLD**2))
    bench.cycles(10, None)
    bench.cycles(5, replace(BELOW, offset=0.5 + 0.1 * DEG, hops=2))
    assert bench.tube.yaw == pytest.approx(1.5, abs=1e-6)
    assert bench.tube.systematic_var == pytest.approx(OLD**2 + bench.settings.unseen_std**2)
    assert "joint_solved" not in bench.events
