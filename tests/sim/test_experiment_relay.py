"""Consistency of the filter down the string: the default must be honest, the published scheme must be caught lying."""

import math

import numpy as np
import pytest

from node.kernels.layout import Scheme
from sim.studies.chain import Chain, ChainSetup
from sim.studies.relay.run import run, table

SEEDS = 24


@pytest.fixture(scope="module")
def result() -> dict:
    return run(4, SEEDS, lambda: None)


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
    setup = ChainSetup(2, Scheme.FORWARD, blocks=1)
    first, second, other = Chain(setup, 1).run(), Chain(setup, 1).run(), Chain(setup, 2).run()
    assert np.array_equal(first.error, second.error)
    assert not np.array_equal(first.error, other.error)


def test_a_lossy_string_stays_honest() -> None:
    setup = ChainSetup(3, Scheme.FORWARD, loss=0.3)
    judged = table(Scheme.FORWARD, [Chain(setup, seed).run() for seed in range(1, 13)])
    for row in judged:
        assert row["yaw_rms_rest_deg"] < 0.05
        assert row["nees_rest"] < 2.5
        assert math.isfinite(row["nees_turning"])


def test_innovations_are_white_enough_to_be_believed() -> None:
    """NIS: r^2 / S averaged over many updates, near 1 for a filter that knows its own size."""
    chain = Chain(ChainSetup(1, Scheme.FORWARD), 5)
    tube = chain._tubes[0]
    ratios = []
    plain = tube.on_cycle

    def watched(reading, around):
        before = tube.state["last_aided"]
        said = list(plain(reading, around))
        if tube.state["last_aided"] != before and abs(tube.state["now_rate"]) > 0.5:
            ratios.append(float(tube.state["innovation"] ** 2 / tube.state["innovation_var"]))
        return iter(said)

    tube.on_cycle = watched  # type: ignore[method-assign]
    chain.run()
    assert len(ratios) > 400
    assert 0.5 < float(np.mean(ratios)) < 1.5
