"""Published experiments of the node's filter: what is asked is reached, and a filter that is wrong is told so."""

import math

import numpy as np
import pytest

from node.kernels.arithmetic.formats import PERIOD
from sim.string.direct_string import DirectString
from sim.string.schedule import aiding_passes
from sim.studies import epochs
from sim.studies.delay import run as delay
from sim.studies.lab import ENDS, LAB, REST, ROTATING, STOP, LabRun, run_seed
from sim.studies.modes import run as modes
from sim.studies.outage import run as outage
from sim.studies.scenarios import Tables, change_sections, on_off
from sim.studies.trials import bootstrap_interval, rms_deg
from sim.studies.tuning import run as tuning
from sim.world.scenario import scenario_of
from sim.world.scenario_file import AidingSection
from sim.world.world import World

pytestmark = pytest.mark.slow

SEEDS = 16
SLACK = 1.5  # of the figure to reach, for few seeds


def runs(setup: Tables, seeds: int = SEEDS) -> list[LabRun]:
    return [run_seed((setup, seed)) for seed in range(1, seeds + 1)]


def judged(case: modes.ModeCase, found: list[LabRun]) -> dict[str, dict]:
    return {row["quantity"]: row for row in modes.mode_rows(case, found)}


def cost(case: modes.ModeCase) -> list[pytest.MarkDecorator]:
    """The modes between those of `make test` run in `make study`."""
    ends = ("continuous 1.9 Hz", "20 s on / 30 s off", "20 s on / 60 s off", "single, 1 Hz", "single, 0.0167 Hz")
    return [] if case.name in ends else [pytest.mark.statistical]


@pytest.mark.parametrize(
    "case",
    [
        pytest.param(c, id=c.name, marks=cost(c))
        for name in ("update-modes", "single-updates")
        for c in modes.CASES[name]
    ],
)
def test_every_update_mode_is_within_reach(case: modes.ModeCase) -> None:
    rows = judged(case, runs(case.setup))
    for quantity in ("yaw", "azimuth"):
        assert rows[quantity]["ours"] < SLACK * rows[quantity]["to_reach"], rows[quantity]
        assert rows[quantity]["low"] < rows[quantity]["ours"] < rows[quantity]["high"]


def test_without_the_scale_factor_state_the_reach_is_missed() -> None:
    case = next(c for c in modes.CASES["update-modes"] if c.name == "20 s on / 30 s off")
    row = judged(case, runs(change_sections(case.setup, node={"tuning": {"scale_std": 0.0}})))["yaw"]
    assert row["reached"] is False
    assert row["ours"] > 2.0 * row["to_reach"]


def test_the_second_node_is_as_good_as_the_first() -> None:
    found = runs(modes.TWO)
    for case in modes.CASES["two-nodes"]:
        row = judged(case, found)["yaw"]
        assert row["ours"] < SLACK * row["to_reach"]


def test_one_seed_gives_one_run_whatever_else_runs() -> None:
    first, second, other = (run_seed((change_sections(LAB, aiding=on_off(20.0, 10.0)), seed)) for seed in (3, 3, 4))
    assert np.array_equal(first.error, second.error)
    assert np.array_equal(first.azimuth_error, second.azimuth_error)
    assert not np.array_equal(first.error, other.error)
    job = (change_sections(epochs.resting_string(outage.HOPS, blocks=1), aiding=on_off(20.0, 20.0)), 7)
    assert np.array_equal(epochs.run_seed(job).error, epochs.run_seed(job).error)


def test_an_experiment_over_a_pool_is_that_of_its_seeds() -> None:
    stepped: list[None] = []
    result = modes.run_study("two-nodes", 2, lambda: stepped.append(None))
    assert len(stepped) == modes.count_steps("two-nodes", 2)
    alone = runs(modes.TWO, 2)
    assert result["cases"][0]["ours"] == rms_deg([r.error[REST, 0] for r in alone])[0]
    for row in result["cases"]:
        assert {"case", "published", "ours", "unit", "to_reach", "reached"} <= row.keys()


def test_a_larger_bias_factor_finds_the_bias_sooner() -> None:
    times = {}
    for factor in (1.0, 5.0):
        found = runs(tuning.setup_of("bias_factor", factor))
        times[factor] = tuning.convergence_time(tuning.mean_error_dps(found))
    assert times[1.0] is not None
    assert times[5.0] is not None
    assert times[5.0] <= tuning.SLOWEST
    assert times[5.0] < times[1.0]


def test_a_bias_that_stays_never_converges() -> None:
    assert tuning.convergence_time(np.full(len(ENDS), 0.02)) is None
    decay = 0.02 * np.exp(-np.maximum(ENDS - STOP, 0.0) / 10.0)
    time = tuning.convergence_time(decay)
    assert time == pytest.approx(10.0 * math.log(10.0), abs=PERIOD)


def test_a_delay_costs_nothing_when_compensated_and_its_angle_when_not() -> None:
    late = {form: change_sections(setup, medium={"delay_ms": 100.0}) for form, setup in delay.FORMS.items()}
    late[delay.FOUND] = change_sections(late[delay.FOUND], clocks={"stated_std_ms": 100.0})
    errors = {form: rms_deg([r.error[ROTATING, 0] for r in runs(late[form], 4)])[0] for form in late}
    assert errors["compensated"] < delay.TO_REACH_DEG
    assert errors["dated by arrival"] == pytest.approx(0.1 * 71.0, rel=0.03)
    assert errors[delay.FOUND] < delay.TO_REACH_DEG


def test_the_interval_holds_the_mean() -> None:
    values = np.random.default_rng(1).exponential(size=400)
    low, high = bootstrap_interval(values)
    assert low < values.mean() < high
    assert high - low == pytest.approx(2 * 1.96 * values.std() / 20.0, rel=0.15)


def test_aiding_passes_as_its_scenario_says() -> None:
    t = ENDS
    assert aiding_passes(AidingSection(), t, 1).all()
    assert aiding_passes(AidingSection(on_s=20.0, off_s=60.0), t, 1).mean() == pytest.approx(0.25, abs=0.03)
    for every in (1.0, 5.0, 60.0):
        passed = aiding_passes(AidingSection(every_s=every), t, 1)
        assert abs(int(passed.sum()) - t[-1] / every) <= 1.0
        assert np.all(np.diff(t[passed]) > every - PERIOD - 1e-9)


def test_outages_reach_the_whole_string() -> None:
    tables = change_sections(epochs.resting_string(2, blocks=1, loss=0.0), aiding=on_off(20.0, 60.0))
    string = DirectString(World(scenario_of(dict(tables)), 1))
    passes = string.schedule.is_sent
    assert passes.mean() == pytest.approx(0.25, abs=0.1)
    run = string.drill()
    silent = np.flatnonzero(~passes & run.turning)
    assert (run.var[silent[-1]] > run.var[silent[0]]).all()  # both nodes dead-reckon, nothing is lost but the encoder
