"""The study of both worlds: what its rough one is made of, and that its assumed one is the other studies'."""

from collections.abc import Callable

import numpy as np
import pytest

from node.kernels.record.filter_record import Scheme
from sim.studies.bridging.run import mean_of
from sim.studies.consistency.run import epoch_rows, setup_of
from sim.studies.epochs import run_campaign_seed, run_seed
from sim.studies.lab import LAB, run_seed_of_each
from sim.studies.lab import run_seed as lab_seed
from sim.studies.limits.bound import Model
from sim.studies.scenarios import Tables, change_sections, on_off
from sim.studies.worlds.run import count_steps, jobs_of, rough_world, run_study, shipped_rough_world
from sim.world.parsing import read_toml
from sim.world.shipped import shipped_folder

SEEDS = 2
FIRST, SECOND = change_sections(LAB, aiding=on_off(20.0, 10.0)), change_sections(LAB, aiding={"every_s": 5.0})
UNLIKE = change_sections(LAB, path={"straight": {"inclination_deg": 3.0}})


def test_the_rough_world_is_the_one_that_is_shipped_but_for_its_untold_twist() -> None:
    shipped = read_toml(shipped_folder() / "rough.toml")
    assert shipped_rough_world(LAB) == {**LAB, "rough": shipped["rough"], "encoder": shipped["encoder"]}
    string = dict(shipped["rough"]["string"])
    assert string.pop("twist_deg") > 0.0
    assert rough_world(LAB)["rough"] == {**shipped["rough"], "string": string}


@pytest.mark.parametrize("part", ["all", "update-modes", "single-updates", "two-nodes", "fifty-nodes", "consistency"])
def test_every_part_runs_as_often_as_it_says(part: str) -> None:
    """The strings that have as many seeds run seed by seed, in either world."""
    jobs = jobs_of(part, 5, 3, 9, 7)
    assert count_steps(part, 5, 3, 9, 7) == sum(2 * seeds for seeds in {job.seeds for job in jobs})
    assert {job.seeds for job in jobs} <= {3, 5, 9}
    assert all(case.hop < job.worlds["rough"]["rig"]["tubes"] <= 7 for job in jobs for case in job.cases)


@pytest.mark.slow
def test_its_assumed_world_is_that_of_the_consistency_study() -> None:
    done: list[None] = []
    found = run_study("consistency", SEEDS, SEEDS, SEEDS, 2, lambda: done.append(None))
    assert len(done) == count_steps("consistency", SEEDS, SEEDS, SEEDS, 2)
    runs = [run_campaign_seed((setup_of(Scheme.FORWARD, 2), seed)) for seed in range(1, SEEDS + 1)]
    expected = [row["nees_total"] for row in epoch_rows(Scheme.FORWARD, runs)]
    assert [row["assumed_nees"] for row in found["consistency"]] == pytest.approx(expected)
    assert all(row["rough_nees"] > 0.0 and row["rough_deg"] != row["assumed_deg"] for row in found["consistency"])


@pytest.mark.slow
def test_a_string_by_a_campaign_has_the_joints_and_the_epochs_of_the_string_of_its_seed() -> None:
    job = (setup_of(Scheme.FORWARD, 3), 4)
    one, other = run_seed(job), run_campaign_seed(job)
    assert other.turning.tolist() == one.turning.tolist()
    assert other.error.shape == one.error.shape
    assert np.allclose(other.total_error - other.error, one.total_error - one.error, rtol=0.0, atol=1e-12)
    assert np.allclose(other.total_var - other.var, one.total_var - one.var, rtol=1e-6)
    assert np.allclose(other.var, one.var, rtol=0.5)


@pytest.mark.slow
@pytest.mark.parametrize("of", [lambda setup: setup, rough_world], ids=["assumed", "rough"])
def test_aidings_that_share_a_world_are_those_that_have_one_each(of: Callable[[Tables], Tables]) -> None:
    setups = [of(change_sections(setup, schedule={"blocks": 1})) for setup in (LAB, FIRST, SECOND, UNLIKE)]
    shared = run_seed_of_each((setups, 4))
    for one, setup in zip(shared, setups, strict=True):
        alone = lab_seed((setup, 4))
        for name in ("error", "var", "total_var", "bias_error", "azimuth_error", "survey_error"):
            np.testing.assert_array_equal(getattr(one, name), getattr(alone, name))
    assert len({one.error.tobytes() for one in shared}) == len(setups)


def test_the_mean_of_gyroscopes_shares_the_errors_of_the_aiding() -> None:
    one = Model(1e-4, 2e-5, 16.0, 1e-3, 5e-3, 1e-4)
    ten = mean_of(one, 4)
    assert (ten.noise, ten.bias_std, ten.scale_std) == (0.5e-4, 1e-5, 0.5e-3)
    assert (ten.bias_tau, ten.stamp_std, ten.stamp_walk) == (one.bias_tau, one.stamp_std, one.stamp_walk)
