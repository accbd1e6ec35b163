"""Hops of a string without a link, against closed forms: errors of rig time add up, losses are as said."""

import numpy as np
import pytest

from sim.string.hops import draw_hops, hop_noise_of, record_hops
from sim.world.scenario import scenario_of
from sim.world.world import World

TUBES, SEEDS = 6, 200


def world_of(seed: int, joint_ms: float, wander_ms: float, loss: float = 0.1) -> World:
    tables = {
        "rig": {"tubes": TUBES, "tubes_at_start": TUBES, "tube_length_m": 1.0},
        "path": {"straight": {}},
        "schedule": {"blocks": 1, "stop_s": 24.0},
        "rotation": {"turns": 2.0},
        "clocks": {"joint_std_ms": joint_ms, "wander_std_ms": wander_ms},
        "medium": {"link": "off", "loss": loss},
    }
    return World(scenario_of(tables), seed)


@pytest.mark.parametrize(("joint_ms", "wander_ms"), [(2.0, 0.0), (0.0, 3.0), (2.0, 3.0)])
def test_errors_of_rig_time_add_up_as_the_scenario_says(joint_ms: float, wander_ms: float) -> None:
    """The mean square below n joints is n (joint^2 + wander^2), from both sides, within 4 sigma of its chi-square."""
    last = np.array([record_hops(world_of(seed, joint_ms, wander_ms))[0][0] for seed in range(SEEDS)])
    expected = 1e-6 * (joint_ms**2 + wander_ms**2) * np.arange(1, TUBES + 1)
    ratio = (last**2).mean(axis=0) / expected
    assert np.all(np.abs(ratio - 1.0) < 4.0 * np.sqrt(2.0 / SEEDS)), ratio


def test_a_campaign_has_the_constant_errors_of_the_rig_of_its_seed() -> None:
    world = world_of(5, 2.0, 0.0)
    assert np.array_equal(np.cumsum(draw_hops(world)["clock"]), record_hops(world)[0][0])


def test_a_campaign_draws_what_wanders_as_wide_as_the_scenario_says() -> None:
    (noise,) = hop_noise_of(world_of(5, 2.0, 3.0).scenario.file)
    assert noise["clock"] == pytest.approx(3e-3)
    assert noise["clock_phi"] ** 2 + noise["clock_fresh"] ** 2 == pytest.approx(1.0)
    assert noise["loss"] == 0.1


def test_aidings_are_lost_as_often_as_the_scenario_says() -> None:
    lost = record_hops(world_of(5, 2.0, 3.0))[1]
    assert abs(lost.mean() - 0.1) < 4.0 * np.sqrt(0.09 / lost.size)
