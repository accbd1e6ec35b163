"""The experiment of the alignment: the published errors, a standard error that holds, and a table that is complete."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from borechain.cli.experiment.experiment import experiment
from sim.studies.alignment.run import BASE, PUBLISHED_DEG, Turn, base_rows, error_ratio, run_seed

pytestmark = pytest.mark.slow

SEEDS = 24


@pytest.fixture(scope="module")
def found() -> list:
    return [run_seed((BASE, seed)) for seed in range(1, SEEDS + 1)]


def test_the_published_errors_and_their_ratio_are_within_our_intervals(found: list) -> None:
    rows = {(row["case"], row["quantity"]): row for row in base_rows(found)}
    circle, extremes = (rows[name, "offset"] for name in ("circle", "(max + min) / 2"))
    for row, method in ((circle, "circle"), (extremes, "extremes")):
        assert row["low"] <= 1.05 * PUBLISHED_DEG[method]
        assert row["high"] >= 0.95 * PUBLISHED_DEG[method]
    many, low, high = error_ratio(found)
    assert low < 6.0 < high
    assert many > 4.0


def test_the_node_knows_how_good_its_offset_is(found: list) -> None:
    for method in PUBLISHED_DEG:
        nees = np.mean([np.square(o[method].error) / np.square(o[method].std) for o in found])
        assert 0.5 < nees < 1.7, method


def test_the_survey_after_is_as_good_as_the_offset(found: list) -> None:
    rms = {m: np.degrees(np.sqrt(np.mean([o[m].inclination_error ** 2 for o in found]))) for m in found[0]}
    assert rms["none"] > 0.2
    assert rms["extremes"] < 0.02
    assert rms["circle"] < 0.008
    assert all("aligned" in o["circle"].events for o in found)


def test_the_integer_kernel_finds_the_same_mount() -> None:
    floats, integers = (Turn(replace(BASE, kernel=kernel), 3).run("circle") for kernel in ("float64", "fixed"))
    assert integers.error == pytest.approx(floats.error, abs=1e-6)
    assert integers.inclination_error == pytest.approx(floats.inclination_error, abs=1e-6)


@pytest.mark.statistical
def test_the_command_keeps_its_table_and_figure_and_is_the_same_twice(tmp_path: Path) -> None:
    told = []
    for folder in (tmp_path / "one", tmp_path / "two"):
        result = CliRunner().invoke(experiment, ["alignment", "--seeds", "2", "--json", "--out", str(folder)])
        assert result.exit_code == 0, result.output
        told.append(result.stdout)
        assert (folder / "alignment.svg").stat().st_size > 1000
    assert told[0] == told[1]
    rows = json.loads(told[0])["cases"]
    assert [row["published"] for row in rows[:2]] == [0.0014, 0.0086]
    assert len((tmp_path / "one" / "alignment.csv").read_text().splitlines()) == len(rows) + 1
