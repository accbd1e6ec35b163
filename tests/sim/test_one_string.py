"""The one string: with its link in this process, and without it for studies; settings that only one of them has."""

import math
from typing import Any

import numba
import numpy as np
import pytest
from node_by_node import drill_node_by_node
from numba.extending import typeof_impl

from node.kernels.arithmetic.formats import PERIOD
from node.kernels.record.filter_record import Scheme
from node.kernels.step.address import BY_ADDRESS
from sim.errors import ScenarioError
from sim.string.direct_string import DirectString
from sim.string.nodes import loop_of
from sim.string.result import StringRun
from sim.string.schedule import aiding_passes
from sim.studies.epochs import resting_string
from sim.world.scenario import scenario_of
from sim.world.scenario_file import AidingSection
from sim.world.world import World
from telemetry.parameters import ParameterBlock, SensorParameters

pytestmark = pytest.mark.slow

FAINT = 1e-6  # readings without any noise would look like those of a stuck sensor
IDEAL_GYRO = {
    "noise_dps_rthz": (FAINT, FAINT, FAINT),
    "bias_std_dps": (0.0, 0.0, 0.0),
    "constant_bias_dps": (0.0, 0.0, 0.0),
    "constant_bias_std_dps": 0.0,
    "scale_factor_std": 0.0,
    "resolution_dps": 0.0,
}
IDEAL_CLOCKS = {"joint_std_ms": 0.0, "wander_std_ms": 0.0}


def tables(**changed: dict[str, Any]) -> dict[str, Any]:
    """Two tubes that rest, turn five times and rest, twice; every table may be changed."""
    usual: dict[str, Any] = {
        "rig": {"tubes": 2, "tubes_at_start": 2, "tube_length_m": 1.0},
        "path": {"straight": {"inclination_deg": 2.0}},
        "schedule": {"add_s": 58.0, "stop_s": 32.0, "finish_s": 5.0, "blocks": 2},
        "rotation": {"turns": 5.0},
        "medium": {"link": "off"},
    }
    return {name: usual.get(name, {}) | changed.get(name, {}) for name in usual | changed}


def drilled(seed: int = 1, **changed: dict[str, Any]) -> StringRun:
    return DirectString(World(scenario_of(tables(**changed)), seed)).drill()


def test_ideal_sensors_and_clocks_leave_nothing_but_the_place_of_the_rest_within_a_count() -> None:
    run = drilled(
        gyroscope=IDEAL_GYRO,
        accelerometer={"noise_deg": FAINT, "bias_std_deg": 0.0, "vibration_mps2": 0.0},
        clocks=IDEAL_CLOCKS,
        encoder={"edge_std_deg": 0.0},
        joints={"reading_std_deg": 0.0, "mount_std_deg": 0.0},
    )
    settled = run.ends > 1100.0
    assert np.degrees(np.abs(run.error[settled])).max() < 0.02
    assert np.all(run.systematic_error[settled] == 0.0)


def test_a_string_states_its_errors_and_surveys_every_stop() -> None:
    runs = [drilled(seed) for seed in range(1, 9)]
    rest = ~runs[0].turning & (runs[0].ends > 1100.0)
    nees = np.mean([run.error[rest] ** 2 / run.var[rest] for run in runs])
    assert 0.3 < nees < 2.0
    for run in runs:
        assert sorted(s.tube for s in run.surveys) == [1, 1, 2, 2]
        for survey in run.surveys:
            assert survey.error == run.total_error[survey.cycle, survey.tube - 1]


def test_one_seed_gives_one_run() -> None:
    first, second, other = drilled(3), drilled(3), drilled(4)
    assert np.array_equal(first.total_error, second.total_error, equal_nan=True)
    assert not np.array_equal(first.total_error, other.total_error, equal_nan=True)


def test_a_block_taken_in_the_middle_of_a_study_is_in_use_from_the_next_cycle_on() -> None:
    string = DirectString(World(scenario_of(tables(gyroscope=IDEAL_GYRO)), 1))
    block = ParameterBlock(1, 1, SensorParameters(bias=(0.0, 0.0, 0.01)))
    for cycle in string.steps():
        taken = string.nodes["raw_rate"][:, 2] - string.nodes["rate"][:, 2]
        assert np.allclose(taken, [0.01 if cycle > 50 else 0.0, 0.0], atol=1e-12)
        if cycle == 50:
            string.tubes[1].use(block)
        elif cycle > 60:
            return


def test_a_string_that_grows_is_powered_tube_by_tube() -> None:
    run = drilled(rig={"tubes": 3, "tubes_at_start": 1}, schedule={"blocks": None})
    known = ~np.isnan(run.total_error)
    begins = [run.ends[known[:, tube]][0] for tube in range(3)]
    assert begins[0] < begins[1] < begins[2]
    assert sorted(s.tube for s in run.surveys) == [1, 1, 1, 2, 2, 3]


def test_the_phase_of_the_cycles_is_a_setting_of_the_world() -> None:
    locked, random = (World(scenario_of(tables(encoder={"phase": phase})), 1) for phase in ("locked", "random"))
    assert [locked.phase(tube) for tube in (1, 2)] == [0.0, 0.0]
    assert 0.0 < random.phase(1) < PERIOD
    assert random.phase(1) != random.phase(2)
    run = DirectString(random).drill()
    rest = ~run.turning & (run.ends > 1100.0)
    assert np.degrees(np.sqrt(np.mean(run.error[rest] ** 2))) < 0.05


@pytest.mark.parametrize(("settings", "share"), [({}, 1.0), ({"off_s": 20.0}, 0.5), ({"every_s": 10 * PERIOD}, 0.1)])
def test_aiding_passes_for_its_share_of_the_time(settings: dict[str, float], share: float) -> None:
    t = PERIOD * np.arange(1.0, 10_000.0)
    assert np.mean(aiding_passes(AidingSection(**settings), t, 1)) == pytest.approx(share, abs=0.01)


def test_a_mark_that_lags_a_free_head_is_the_worlds_own_error() -> None:
    """The marks explain the yaw but for the systematic error, also where the head turned free and tubes slipped."""
    world = World(
        scenario_of(
            tables(
                rig={"tubes": 4, "tubes_at_start": 2},
                schedule={"blocks": 3},
                joints={"unseen_std_deg": 1.0, "head_turn_deg": 30.0},
            )
        ),
        5,
    )
    last = world.end - 6.0
    quantum = math.tau / world.scenario.file.encoder.counts_per_turn
    head = world.encoder_sample(last)[0] * quantum
    settings = {tube: world.tube_settings(tube) for tube in range(1, 5)}
    for tube in range(1, 5):
        above = sum(settings[k].lower_joint.angle for k in range(tube + 1, 5))
        known = head + settings[4].drive_joint.angle + above
        off = math.remainder(known - world.yaw_truth(tube, last) - world.systematic_error(tube, last), math.tau)
        assert abs(off) < 1.5 * quantum


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"medium": {"link": "on", "delay_ms": 5.0}}, "medium.delay_ms"),
        ({"medium": {"link": "on"}, "aiding": {"off_s": 5.0}}, "aiding"),
        ({"medium": {"link": "on"}, "node": {"tuning": {"scale_std": 0.0}}}, "node.tuning"),
        ({"medium": {"link": "on"}, "encoder": {"edge_times": False}}, "encoder.edge_times"),
        ({"rig": {"tubes": 2, "tubes_at_start": 3}}, "rig.tubes_at_start"),
        ({"rig": {"tubes": 4, "tubes_at_start": 2, "depth_at_start_m": 2.5}}, "rig.depth_at_start_m"),
        ({"rig": {"tubes": 4, "tubes_at_start": 1}, "schedule": {"blocks": 2}}, "schedule.blocks"),
        ({"path": {"straight": None}}, "exactly one of"),
    ],
)
def test_settings_that_would_do_nothing_are_refused(changed: dict[str, Any], named: str) -> None:
    with pytest.raises(ScenarioError, match=named):
        scenario_of(tables(**changed))


def test_a_string_without_frames_needs_a_link_that_is_off_and_fields_that_exist() -> None:
    with pytest.raises(ScenarioError, match="off"):
        DirectString(World(scenario_of(tables(medium={"link": "on"})), 1))
    with pytest.raises(ScenarioError, match=r"node\.tuning\.colour"):
        DirectString(World(scenario_of(tables(node={"tuning": {"colour": 1.0}})), 1))


@pytest.mark.parametrize("scheme", ["forward", "estimate"])
@pytest.mark.parametrize("kernel", BY_ADDRESS)
def test_a_string_in_one_call_is_the_string_node_by_node(scheme: str, kernel: str) -> None:
    """As the processes of nodes call it: on readings and aidings that are messages."""
    wanted = dict(resting_string(3, Scheme[scheme.upper()], blocks=2, loss=0.2, kernel=kernel))
    together = DirectString(World(scenario_of(wanted), 3)).drill()
    apart = drill_node_by_node(DirectString(World(scenario_of(wanted), 3)))
    for name in ("yaw", "total_error", "var", "systematic_var", "gyro_bias"):
        np.testing.assert_array_equal(getattr(together, name), getattr(apart, name))
    assert together.events == apart.events
    assert together.surveys == apart.surveys
    assert len(together.surveys) == 6


@pytest.mark.parametrize("tubes", [1, 3])
def test_the_type_of_a_loop_in_integers_is_what_numba_would_make(tubes: int) -> None:
    loop = loop_of("fixed", tubes).integers
    assert numba.typeof(loop) == typeof_impl.dispatch(tuple)(loop, None)
