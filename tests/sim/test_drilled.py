"""Surveys of strings that twist and grow: errors are what the nodes state, and without handling they are not.

Errors are squared and divided by the variance stated (NEES, 1 is honest) over fixed seeds.
"""

import math

import numpy as np
import pytest

from node.firmware.settings import JointRule
from node.kernels.layout import PERIOD
from sim.studies.drilled import BEGIN, DrilledRun, DrilledSetup, DrilledString
from sim.world.scenario import TorsionSection

pytestmark = pytest.mark.slow

STEEL = TorsionSection()  # 60/50 mm, 500 N m, 1 % trapped
SMALL = math.radians(0.02)


def runs(setup: DrilledSetup, seeds: int) -> list[DrilledRun]:
    return [DrilledString(setup, seed).run() for seed in range(1, seeds + 1)]


def nees(found: list[DrilledRun], tube: int) -> float:
    return float(np.mean([value for run in found for value in run.nees(tube)]))


def twisted(hops: int, rule: str) -> DrilledSetup:
    return DrilledSetup(hops, 3, torsion=STEEL, rule=rule, joint_std=SMALL, mount_std=SMALL)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("hops", "rule", "seeds"),
    [(10, "gate", 10), (10, "variance", 10), pytest.param(50, "gate", 5, marks=pytest.mark.statistical)],
)
def test_surveys_of_a_string_with_trapped_torque_are_honest(hops: int, rule: str, seeds: int) -> None:
    found = runs(twisted(hops, rule), seeds)
    for run in found:
        assert len(run.surveys) == 3 * hops  # every node, every stop
        codes = {event.code for _, event in run.events}
        assert not {"gyro_step", "gyro_scale", "aiding_rejected"} & codes
    low, high = (0.5, 1.7)
    assert low < nees(found, 1) < high
    assert low < nees(found, hops // 2) < high
    last = [error for run in found for _, tube, error, _ in run.surveys if tube == 1]
    trapped = 0.01 * hops * 1.645  # deg, 1 sigma
    assert math.degrees(float(np.sqrt(np.mean(np.square(last))))) == pytest.approx(trapped, rel=0.4)


@pytest.mark.parametrize(("hops", "seeds"), [(10, 6), pytest.param(50, 2, marks=pytest.mark.statistical)])
def test_a_rig_that_ignores_torsion_is_caught_overconfident(hops: int, seeds: int) -> None:
    """The negative control: the unwinding string is taken for a faulty gyroscope, and what is trapped is not stated."""
    found = runs(twisted(hops, "ignore"), seeds)
    assert nees(found, 1) > 4.0
    assert any(event.code in ("gyro_step", "aiding_rejected") for _, event in found[0].events)


def test_a_gated_node_dead_reckons_the_twist_and_a_varied_one_states_it() -> None:
    """While drilling: the one follows its gyroscope, which sees the string wind up, the other the drive."""
    for rule, most in (("gate", 1.0), ("variance", 1.7 * 16.45)):
        string = DrilledString(twisted(10, rule), 3)
        run = string.run()
        turning = string.motion.drive(run.ends)[1] > 1.0
        late = turning & (run.ends > BEGIN + 200.0)  # the scale factor is known from the first rests
        error = np.degrees(run.error[late, 0])
        assert np.abs(error).max() < most
        if rule == "variance":
            assert np.abs(error).mean() == pytest.approx(16.45, abs=1.0)


def test_the_integer_kernel_copes_as_well() -> None:
    setup = DrilledSetup(3, 2, torsion=STEEL, joints="solved", added=1)
    fixed = DrilledString(DrilledSetup(3, 2, torsion=STEEL, joints="solved", added=1, kernel="fixed"), 2).run()
    floats = DrilledString(setup, 2).run()
    assert len(fixed.surveys) == len(floats.surveys) == 7
    np.testing.assert_allclose(np.array(fixed.surveys), np.array(floats.surveys), rtol=0.01, atol=2e-6)
    assert [e.code for _, e in fixed.events] == [e.code for _, e in floats.events]


def growing(joints: JointRule, head_turn: float = 0.0) -> DrilledSetup:
    return DrilledSetup(2, 4, added=3, joints=joints, head_turn=head_turn)


def steps_deg(string: DrilledString, run: DrilledRun) -> list[float]:
    """Change of the estimated yaw of the two lowest tubes over each make-up, beyond what they truly turned."""
    found: list[float] = []
    for add in [phase for phase in string.motion.phases if phase.kind == "add"][1:]:
        before, after = (int((t - BEGIN) / PERIOD) for t in (add.start - 2.0, add.end - 5.0))
        slipped = [string.unseen(tube, add.end) - string.unseen(tube, add.start) for tube in (1, 2)]
        found += np.degrees(run.error[after, :2] - run.error[before, :2] + slipped).tolist()
    return found


@pytest.mark.parametrize(("joints", "head_turn"), [("solved", 0.0), ("solved", 3.0), ("both", 0.0), ("marks", 0.0)])
def test_a_string_that_grows_stays_honest(joints: JointRule, head_turn: float) -> None:
    strings = [DrilledString(growing(joints, head_turn), seed) for seed in range(1, 21)]
    found = [string.run() for string in strings]
    for tube in range(1, 6):
        assert 0.4 < nees(found, tube) < 1.6
    steps = np.array([step for string, run in zip(strings, found, strict=True) for step in steps_deg(string, run)])
    if joints == "solved":
        assert np.abs(steps).max() < 1e-3  # the yaw below goes on
    else:
        assert np.sqrt(np.mean(steps**2)) > 0.005
    solved = [event for run in found for _, event in run.events if event.code == "joint_solved"]
    assert len(solved) == (0 if joints == "marks" else 3 * len(found))
    assert not any(event.code == "joint_contradicts_marks" for run in found for _, event in run.events)


def test_solved_joints_do_not_add_up_as_marks_do() -> None:
    """At the lowest of five tubes: four marks and the head's against one mark and what slipped unseen."""
    last: dict[str, float] = {}
    for joints in ("marks", "solved", "both"):
        run = DrilledString(growing(joints), 1).run()  # type: ignore[arg-type]
        last[joints] = max(var for block, tube, _, var in run.surveys if (block, tube) == (3, 1))
    assert last["solved"] < 0.7 * last["marks"]
    assert last["both"] <= last["solved"]


def test_a_string_that_slipped_far_contradicts_its_marks() -> None:
    setup = DrilledSetup(2, 2, added=1, joints="solved", unseen_std=math.radians(5.0))
    events = [event for run in runs(setup, 3) for _, event in run.events]
    warned = [event for event in events if event.code == "joint_contradicts_marks"]
    assert warned
    for event in warned:
        off = math.remainder(float(event.arguments["angle_deg"]) - float(event.arguments["marks_deg"]), 360.0)  # type: ignore[arg-type]
        assert abs(off) > 0.3


def test_one_seed_gives_one_run() -> None:
    setup = DrilledSetup(2, 2, added=1, torsion=STEEL)
    first, second, other = (DrilledString(setup, seed).run() for seed in (1, 1, 2))
    assert first.surveys == second.surveys
    assert first.surveys != other.surveys
