"""Consistency of the filter down the string: the default must be honest, the published scheme must be caught lying."""

import math

import numpy as np
import pytest

from node.kernels.record.filter_record import Scheme
from sim.string.direct_string import DirectString
from sim.studies.epochs import resting_string, run_seed
from sim.studies.relay.run import hop_rows, run_study
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow

SEEDS = 24


@pytest.fixture(scope="module", params=[pytest.param(hops, marks=pytest.mark.statistical) for hops in (2, 4)])
def result(request: pytest.FixtureRequest) -> dict:
    return run_study(request.param, SEEDS, lambda: None)


def rows(result: dict, scheme: str) -> list[dict]:
    return [row for row in result["cases"] if row["scheme"] == scheme]


def test_forward_is_honest_at_every_hop(result: dict) -> None:
    assert result["consistent"]["forward"]
    for row in rows(result, "forward"):
        assert row["yaw_rms_rest_deg"] < 0.05
        assert row["yaw_rms_turning_deg"] < 0.05


def test_estimate_is_caught_overconfident_beyond_the_first_hop(result: dict) -> None:
    assert not result["consistent"]["estimate"]
    for row in rows(result, "estimate")[1:]:
        assert row["nees_rest"] > 10.0
        assert row["yaw_rms_rest_deg"] < 0.05  # its error looks fine, only its variance lies


def test_one_seed_gives_one_result() -> None:
    first, second, other = (run_seed((resting_string(2, blocks=1), seed)) for seed in (1, 1, 2))
    assert np.array_equal(first.error, second.error)
    assert not np.array_equal(first.error, other.error)


def test_a_lossy_string_stays_honest() -> None:
    judged = hop_rows(Scheme.FORWARD, [run_seed((resting_string(3, loss=0.3), seed)) for seed in range(1, 13)])
    for row in judged:
        assert row["yaw_rms_rest_deg"] < 0.05
        assert row["nees_rest"] < 2.5
        assert math.isfinite(row["nees_turning"])


def test_innovations_are_white_enough_to_be_believed() -> None:
    """NIS: r^2 / S averaged over many updates, near 1 for a filter that knows its own size."""
    string = DirectString(World(scenario_of(dict(resting_string(1))), 5))
    state, ratios = string.tubes[1].state, []
    before = float(state["last_aided"])
    for _ in string.steps():
        if state["last_aided"] != before and abs(state["now_rate"]) > 0.5:
            ratios.append(float(state["innovation"] ** 2 / state["innovation_var"]))
        before = float(state["last_aided"])
    assert len(ratios) > 400
    assert 0.5 < float(np.mean(ratios)) < 1.5
