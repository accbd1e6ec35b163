"""The consistency test of relay schemes: it accepts the truth and rejects the negative controls."""

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.experiment.experiment import experiment
from node.kernels.record.filter_record import Scheme
from sim.string.direct_string import DirectString
from sim.studies.consistency.run import EVERY, epoch_rows, judge_cells, run_study, setup_of
from sim.studies.epochs import run_seed, sample_epochs
from sim.studies.scenarios import Tables, change_sections
from sim.world.scenario import scenario_of
from sim.world.world import World

pytestmark = pytest.mark.slow

FEW, SEEDS = 24, 40  # strings of two hops in `make test`; in `make study` two and five hops


def shorter(setup: Tables) -> Tables:
    return change_sections(setup, schedule={"blocks": 1})


@pytest.fixture(
    scope="module",
    params=[(2, FEW), *(pytest.param((hops, SEEDS), marks=pytest.mark.statistical) for hops in (2, 5))],
    ids=lambda asked: f"{asked[0]} hops, {asked[1]} seeds",
)
def result(request: pytest.FixtureRequest) -> dict:
    hops, seeds = request.param
    stepped: list[None] = []
    found = run_study(seeds, seeds, lambda: stepped.append(None), hops=hops)
    assert len(stepped) == 3 * seeds
    return found


def cells(result: dict, scheme: str, state: str, name: str = "nees") -> np.ndarray:
    return np.array([r[name] for r in result["cases"] if (r["scheme"], r["state"]) == (scheme, state)])


def test_forward_tells_the_truth(result: dict) -> None:
    for state in ("turning", "at rest"):
        for name in ("nees", "nees_total"):
            found = cells(result, "forward", state, name)
            assert found.mean() == pytest.approx(1.0, abs=0.25)
            assert np.all((found > 0.45) & (found < 1.8))  # 3.5 standard errors of 40 seeds


def test_estimate_is_rejected_at_every_hop_but_the_first(result: dict) -> None:
    assert not result["schemes"]["estimate"]["consistent"]
    assert result["schemes"]["estimate"]["worst"] > 10.0 * EVERY[1]
    hops = np.array([r["hop"] for r in result["cases"] if (r["scheme"], r["state"]) == ("estimate", "at rest")])
    assert np.all(cells(result, "estimate", "at rest")[hops > 1] > 2.0)


def test_intersection_is_too_wide(result: dict) -> None:
    assert not result["schemes"]["intersection"]["consistent"]
    assert np.all(cells(result, "intersection", "at rest") < 0.8)


def test_the_verdict_is_that_of_its_bounds() -> None:
    assert judge_cells([1.0] * 19 + [1.2])["consistent"]
    assert not judge_cells([1.0] * 9 + [1.2])["consistent"]  # a tenth outside
    assert not judge_cells([1.0] * 99 + [1.3])["consistent"]
    assert judge_cells([1.0, 0.5, 1.3])["worst"] == 0.5


def test_clock_errors_are_felt() -> None:
    """A node that is told of better clocks than it has must look dishonest."""
    setup = shorter(setup_of(Scheme.FORWARD, 1))

    def nees(factor: float) -> float:
        found = []
        told = change_sections(setup, clocks={"stated_std_ms": 5.0 / factor})
        for seed in range(1, 9):
            run = sample_epochs(DirectString(World(scenario_of(dict(told)), seed)))
            found.append(float((run.error**2 / run.var)[run.turning].mean()))
        return float(np.mean(found))

    assert nees(1.0) < 3.0
    assert nees(20.0) > 10.0


def test_a_table_has_a_row_an_epoch_and_hop() -> None:
    setup = shorter(setup_of(Scheme.FORWARD, 2))
    rows = epoch_rows(Scheme.FORWARD, [run_seed((setup, 1)), run_seed((setup, 2))])
    assert [(r["state"], r["hop"]) for r in rows] == [("turning", 1), ("turning", 2), ("at rest", 1), ("at rest", 2)]


def test_the_command_refuses_no_seeds() -> None:
    done = CliRunner().invoke(experiment, ["consistency", "--seeds", "0"])
    assert done.exit_code == 2
    assert "--seeds" in done.output


def test_of_the_integer_kernel_forward_alone_is_judged_beside_the_reference() -> None:
    fixed = run_study(2, 2, lambda: None, hops=2, kernel="fixed")
    assert (fixed["experiment"], fixed["schemes"].keys()) == ("consistency-fixed", {"forward"})
    reference = [r["nees"] for r in run_study(2, 2, lambda: None, hops=2)["cases"] if r["scheme"] == "forward"]
    found = [r["nees"] for r in fixed["cases"]]
    assert found == pytest.approx(reference, rel=1e-2)
    assert found != reference  # it is another kernel
