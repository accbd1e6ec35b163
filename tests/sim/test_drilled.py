"""Surveys of strings that twist and grow: errors are what the nodes state, and without handling they are not.

Errors are squared and divided by the variance stated (NEES, 1 is honest) over fixed seeds.
"""

import math
from typing import Any

import numpy as np
import pytest

from node.firmware.tube_settings import JointRule
from node.kernels.arithmetic.formats import PERIOD
from sim.string.direct_string import DirectString
from sim.string.result import StringRun
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow

STEEL: dict[str, float] = {}  # the usual section: 60/50 mm, 500 N m, 1 % trapped
SMALL_DEG = 0.02


def string_of(
    seed: int,
    first: int,
    blocks: int,
    *,
    added: int = 0,
    torsion: dict[str, float] | None = None,
    node: dict[str, Any] | None = None,
    joints: dict[str, float] | None = None,
) -> DirectString:
    """A string of ``first`` tubes, of 3 m, that is turned in ``blocks``; one tube is ``added`` before each further."""
    tables: dict[str, Any] = {
        "rig": {"tubes": first + added, "tubes_at_start": first, "tube_length_m": 3.0},
        "path": {"straight": {"inclination_deg": 2.0}},
        "schedule": {"add_s": 58.0, "stop_s": 32.0, "finish_s": 5.0, "blocks": blocks},
        "rotation": {"turns": 5.0},
        "joints": {"unseen_std_deg": 0.01} | (joints or {}),
        "clocks": {"wander_std_ms": 0.0},
        "medium": {"link": "off"},
        "node": node or {},
    }
    if torsion is not None:
        tables["torsion"] = torsion
    return DirectString(World(scenario_of(tables), seed))


def nees(found: list[StringRun], tube: int) -> float:
    """Mean over all surveys of a tube of error squared over the variance stated."""
    values = [
        survey.error**2 / (survey.measurement.yaw_var + survey.measurement.systematic_var)
        for run in found
        for survey in run.surveys
        if survey.tube == tube
    ]
    return float(np.mean(values))


def twisted(seed: int, hops: int, rule: str) -> DirectString:
    exact = {"reading_std_deg": SMALL_DEG, "mount_std_deg": SMALL_DEG}
    return string_of(seed, hops, 3, torsion=STEEL, node={"torsion": rule}, joints=exact)


def twisted_runs(hops: int, rule: str, seeds: int) -> list[StringRun]:
    return [twisted(seed, hops, rule).drill() for seed in range(1, seeds + 1)]


@pytest.mark.parametrize(
    ("hops", "rule", "seeds"),
    [(10, "gate", 10), (10, "variance", 10), pytest.param(50, "gate", 5, marks=pytest.mark.statistical)],
)
def test_surveys_of_a_string_with_trapped_torque_are_honest(hops: int, rule: str, seeds: int) -> None:
    found = twisted_runs(hops, rule, seeds)
    for run in found:
        assert len(run.surveys) == 3 * hops  # every node, every stop
        codes = {event.code for _, event in run.events}
        assert not {"gyro_step", "gyro_scale", "aiding_rejected"} & codes
    low, high = (0.5, 1.7)
    assert low < nees(found, 1) < high
    assert low < nees(found, hops // 2) < high
    last = [survey.error for run in found for survey in run.surveys if survey.tube == 1]
    trapped = 0.01 * hops * 1.645  # deg, 1 sigma
    assert math.degrees(float(np.sqrt(np.mean(np.square(last))))) == pytest.approx(trapped, rel=0.4)


@pytest.mark.parametrize(("hops", "seeds"), [(10, 6), pytest.param(50, 2, marks=pytest.mark.statistical)])
def test_a_rig_that_ignores_torsion_says_that_it_cannot_explain_what_it_sees(hops: int, seeds: int) -> None:
    """The string winds up and unwinds, the node is not told the torque: it flags that, and its variance has it."""
    found = twisted_runs(hops, "ignore", seeds)
    assert nees(found, 1) < 1.7
    for run in found:
        told = {event.code for _, event in run.events if event.tube == 1}
        assert told & {"gyro_step", "aiding_rejected"}
        assert "yaw_reset" in told
    ignored = max(math.sqrt(float(survey.measurement.systematic_var)) for run in found for survey in run.surveys)
    gated = max(math.sqrt(float(s.measurement.systematic_var)) for s in twisted(1, hops, "gate").drill().surveys)
    assert ignored > 4.0 * gated


def test_a_gated_node_dead_reckons_the_twist_and_a_varied_one_states_it() -> None:
    """While drilling: the one follows its gyroscope, which sees the string wind up, the other the drive."""
    for rule, most in (("gate", 1.0), ("variance", 1.7 * 16.45)):
        string = twisted(3, 10, rule)
        run = string.drill()
        turning = string.world.motion.drive(run.ends)[1] > 1.0
        late = turning & (run.ends > string.world.begin + 200.0)  # the scale factor is known from the first rests
        error = np.degrees(run.total_error[late, 0])
        assert np.abs(error).max() < most
        if rule == "variance":
            assert np.abs(error).mean() == pytest.approx(16.45, abs=1.0)


def test_the_integer_kernel_copes_as_well() -> None:
    fixed, floats = (
        string_of(2, 3, 2, added=1, torsion=STEEL, node={"joints": "solved", "kernel": kernel}).drill()
        for kernel in ("fixed", "float64")
    )
    assert len(fixed.surveys) == len(floats.surveys) == 7
    told = [
        np.array([(s.cycle, s.tube, s.error, s.measurement.yaw_var, s.measurement.systematic_var) for s in run.surveys])
        for run in (fixed, floats)
    ]
    np.testing.assert_allclose(told[0], told[1], rtol=0.01, atol=2e-6)
    assert [e.code for _, e in fixed.events] == [e.code for _, e in floats.events]


def growing(seed: int, joints: JointRule, head_turn_deg: float = 0.0) -> DirectString:
    return string_of(seed, 2, 4, added=3, node={"joints": joints}, joints={"head_turn_deg": head_turn_deg})


def steps_deg(string: DirectString) -> list[float]:
    """Change of the estimated yaw of the two lowest tubes over each make-up, beyond what they truly turned."""
    found: list[float] = []
    world, error = string.world, string.run.total_error
    for add in [phase for phase in world.phases if phase.kind == "add"]:
        before, after = (int((t - world.begin) / PERIOD) for t in (add.start - 2.0, add.end - 5.0))
        slipped = [float(np.diff(world.marks.unseen(tube, np.array([add.start, add.end])))[0]) for tube in (1, 2)]
        found += np.degrees(error[after, :2] - error[before, :2] + slipped).tolist()
    return found


@pytest.mark.parametrize(
    ("joints", "head_turn", "seeds"),
    [
        pytest.param("solved", 0.0, 20, marks=pytest.mark.statistical),
        pytest.param("solved", 172.0, 20, marks=pytest.mark.statistical),
        ("solved", 172.0, 8),
        ("both", 0.0, 20),
        ("marks", 0.0, 20),
    ],
)
def test_a_string_that_grows_stays_honest(joints: JointRule, head_turn: float, seeds: int) -> None:
    strings = [growing(seed, joints, head_turn) for seed in range(1, seeds + 1)]
    found = [string.drill() for string in strings]
    for tube in range(1, 6):
        assert 0.4 < nees(found, tube) < 1.6
    steps = np.array([step for string in strings for step in steps_deg(string)])
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
        run = growing(1, joints).drill()  # type: ignore[arg-type]
        newest = [survey.measurement for survey in run.surveys if survey.tube == 1][-1]
        last[joints] = newest.yaw_var + newest.systematic_var
    assert last["solved"] < 0.7 * last["marks"]
    assert last["both"] <= last["solved"]


def test_a_string_that_slipped_far_contradicts_its_marks() -> None:
    slipping = {"unseen_std_deg": 5.0}
    strings = [string_of(seed, 2, 2, added=1, node={"joints": "solved"}, joints=slipping) for seed in (1, 2, 3)]
    events = [event for string in strings for _, event in string.drill().events]
    warned = [event for event in events if event.code == "joint_contradicts_marks"]
    assert warned
    for event in warned:
        off = math.remainder(float(event.arguments["angle_deg"]) - float(event.arguments["marks_deg"]), 360.0)  # type: ignore[arg-type]
        assert abs(off) > 0.3


def test_one_seed_gives_one_run() -> None:
    first, second, other = (string_of(seed, 2, 2, added=1, torsion=STEEL).drill() for seed in (1, 1, 2))
    assert first.surveys == second.surveys
    assert first.surveys != other.surveys
