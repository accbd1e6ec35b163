"""The twist of the string: known answers, smoothness, release, what the rig knows of it."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.world.marks import wrap_angle
from sim.world.motion import Motion, Trapezoid
from sim.world.scenario import load_scenario
from sim.world.scenario_file import TorsionSection
from sim.world.torsion import StringTorsion, polar_moment, smooth_step, torsional_stiffness
from sim.world.world import World

SCENARIO = load_scenario(Path(__file__).parents[2] / "scenarios" / "torsion-10.toml")
TURN = Trapezoid(10.0 * math.pi, 1.2, 0.6)


def motion(blocks: int = 2) -> Motion:
    return Motion(1000.0, 20.0, 5.0, 40.0, 5.0, TURN, blocks, 3.0, 0.3)


def string(section: TorsionSection, tubes: int, trapped: float = 0.0, blocks: int = 2) -> StringTorsion:
    return StringTorsion(section, motion(blocks), 3.0, np.full(blocks, float(tubes)), np.full(blocks, trapped))


def drilling(block: int = 0) -> float:
    """Rig time in the middle of a block's turning."""
    phase = [p for p in motion().phases if p.kind == "drill"][block]
    return 0.5 * (phase.start + phase.end)


def at_rest(block: int = 0) -> float:
    return next(p for p in motion().phases if p.kind == "stop" and p.tube == block + 1).end - 1.0


def test_the_printed_twist_of_one_tube_and_of_fifty() -> None:
    """60/50 mm tube of 3 m at 500 N m: 1.65 deg, and 82 deg in a string of 50."""
    assert polar_moment(0.060, 0.050) == pytest.approx(6.588e-7, rel=1e-4)
    assert math.degrees(500.0 / torsional_stiffness(TorsionSection(), 3.0)) == pytest.approx(1.65, abs=0.005)
    lag = string(TorsionSection(), 50)
    now = np.array([drilling()])
    assert math.degrees(lag.twist(50, now)[0][0]) == pytest.approx(1.65, abs=0.005)
    assert math.degrees(lag.twist(1, now)[0][0]) == pytest.approx(82.0, abs=0.5)
    assert lag.torque(now)[0] == pytest.approx(500.0)


@pytest.mark.parametrize("tube", [1, 25, 50])
def test_a_released_string_keeps_what_friction_trapped(tube: int) -> None:
    """One per cent of the torque: 0.8 deg at 50 tubes."""
    lag = string(TorsionSection(), 50, trapped=0.01)
    full, rest = (float(lag.twist(tube, np.array([t]))[0][0]) for t in (drilling(), at_rest()))
    assert rest == pytest.approx(0.01 * full)
    assert lag.torque(np.array([at_rest()]))[0] == 0.0
    if tube == 1:
        assert math.degrees(rest) == pytest.approx(0.82, abs=0.01)


def test_wall_friction_is_felt_by_what_is_above_it() -> None:
    """T(s) = T_bit + w min(s, d), by small steps against the closed form."""
    section = TorsionSection(bit_torque_nm=100.0, wall_friction_nm_per_m=40.0)
    lag, now = string(section, 4), np.array([drilling()])
    depth = float(motion().depth(now)[0][0])
    s = (np.arange(12_000) + 0.5) * 1e-3  # m above the bit
    torque = 100.0 + 40.0 * np.minimum(s, depth)
    for tube in (1, 2, 3, 4):
        expected = torque[s > (tube - 1) * 3.0].sum() * 1e-3 / (torsional_stiffness(section, 3.0) * 3.0)
        assert lag.twist(tube, now)[0][0] == pytest.approx(expected, rel=1e-6)
    assert lag.torque(now)[0] == pytest.approx(100.0 + 40.0 * depth)


def test_a_tube_that_is_not_there_yet_has_no_twist() -> None:
    lag = StringTorsion(TorsionSection(), motion(), 3.0, np.array([1.0, 2.0]), np.array([0.3, 0.1]))
    assert lag.twist(2, np.array([drilling(0)]))[0][0] == 0.0
    assert lag.twist(2, np.array([drilling(1)]))[0][0] > 0.0
    kept = lag.twist(1, np.array([at_rest(0), drilling(1) - 0.5 * TURN.duration - 1e-6]))[0]
    assert kept[0] == pytest.approx(kept[1])  # until the next tube is drilled


@given(st.floats(999.0, 1140.0), st.integers(1, 6), st.floats(0.0, 60.0), st.floats(0.0, 1.0))
def test_rates_and_accelerations_are_derivatives_at_any_time(
    t: float, tube: int, friction: float, swing: float
) -> None:
    section = TorsionSection(wall_friction_nm_per_m=friction, stick_slip=swing, release_after_s=2.0)
    lag, h = string(section, 6, trapped=0.02), 1e-4
    edges = motion().phases  # the drive's acceleration jumps at the ends of its ramps, and friction follows the bit
    ramps = [p.start + s for p in edges if p.kind == "drill" for s in (0.0, TURN.ramp, TURN.duration - TURN.ramp)]
    ramps += [p.end for p in edges if p.kind == "drill"]
    around = t + h * np.arange(-2.0, 3.0)
    if any(around[0] <= edge <= around[-1] for edge in ramps):
        return
    angle, rate, acceleration = lag.twist(tube, around)
    weights = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * h)
    assert weights @ angle == pytest.approx(rate[2], abs=1e-8)
    assert weights @ rate == pytest.approx(acceleration[2], abs=2e-5)


@given(st.floats(-1.0, 5.0), st.floats(0.5, 4.0))
def test_the_step_is_monotonic_and_stays_between_its_ends(t: float, duration: float) -> None:
    value, rate, _ = smooth_step(np.array([t, t + 1e-3]), duration)
    assert 0.0 <= value[0] <= value[1] <= 1.0 + 1e-12
    assert np.all(rate >= 0.0)


def test_the_marks_explain_the_yaw_of_a_twisted_string_but_for_the_systematic_error() -> None:
    world = World(SCENARIO, 3)
    assert world.torsion is not None
    for phase in world.phases:
        if phase.kind != "stop":
            continue
        t = phase.end - 1.0
        marks = {tube: world.tube_settings(tube) for tube in range(1, phase.tube + 1)}
        head = float(world.motion.drive(np.array([t]))[0][0])
        for tube in (1, phase.tube):
            known = head + marks[tube].drive_joint.angle  # joints are solved: the mark of when it was on top stands
            off = wrap_angle(known - world.yaw_truth(tube, t) - world.systematic_error(tube, t))
            assert off == pytest.approx(0.0, abs=1e-9)
        trapped = float(world.torsion.twist(1, np.array([t]))[0][0])
        assert 0.0 < trapped < math.radians(1.0)


def test_a_rig_that_ignores_torsion_has_no_torque_sensor() -> None:
    blind = SCENARIO.file.model_copy(update={"node": SCENARIO.file.node.model_copy(update={"torsion": "ignore"})})
    scenario = load_scenario(Path(__file__).parents[2] / "scenarios" / "torsion-10.toml")
    scenario.file = blind
    world = World(SCENARIO, 1)
    t = next(p.end for p in world.phases if p.kind == "drill") - 5.0
    assert World(scenario, 1).encoder_sample(t)[3] is None
    sample = world.encoder_sample(t)
    assert sample[3] == pytest.approx(500.0 + 5.0 * world.bit_depth(t), rel=0.1001)
