"""What the committed tables of whole rigs say holds: regions, sharpness, and what becomes of blunders."""

import csv
import re
from pathlib import Path

import pytest
from scipy.stats import binom, chi2

RESULTS = Path(__file__).parents[2] / "docs" / "results"
BY_CHANCE = 1e-3  # of a table whose regions hold what they are to hold, at either end of one column
BEYOND_BY_CHANCE = 10 * (chi2.sf(18.0, 2) + chi2.sf(27.0, 3))  # of ten directions and positions, 3 sigma each


def committed(name: str) -> list[dict[str, str]]:
    with (RESULTS / f"{name}.csv").open(newline="") as file:
        return list(csv.DictReader(file))


def rigs_of(study: str, option: str) -> int:
    """Size with which a study's table was made, by its caption."""
    found = re.search(rf"`{study} [^`]*--{option} (\d+)", (RESULTS / "README.md").read_text())
    assert found
    return int(found[1])


@pytest.mark.parametrize("column", ["north", "east", "vertical", "direction", "ellipsoid"])
def test_regions_hold_93_to_97_percent_within_the_scatter_of_so_many_rigs(column: str) -> None:
    rigs, rows = rigs_of("set-up", "seeds"), committed("set-up")
    least, most = binom.ppf([BY_CHANCE / len(rows), 1.0 - BY_CHANCE / len(rows)], rigs, [0.93, 0.97]) / rigs
    assert len(rows) == 10
    for row in rows:
        assert 100.0 * least <= float(row[column]) <= 100.0 * most


def test_directions_are_as_sharp_as_they_can_be() -> None:
    assert all(float(row["ratio"]) <= 1.2 for row in committed("set-up"))


def test_no_honest_rig_is_blamed() -> None:
    (honest,) = (row for row in committed("blunders") if row["case"] == "honest")
    assert int(honest["rigs"]) == rigs_of("blunders", "honest")
    assert honest["named"] == "0"


def test_honest_rigs_are_beyond_three_sigma_by_chance_alone() -> None:
    (honest,) = (row for row in committed("blunders") if row["case"] == "honest")
    rigs = int(honest["rigs"])
    assert int(honest["missed"]) <= binom.isf(BY_CHANCE, rigs, BEYOND_BY_CHANCE)
    assert int(honest["beyond_on_target"]) <= int(honest["missed"])


def test_blunders_are_beyond_three_sigma_without_a_word_or_on_target_by_chance_alone() -> None:
    """As many as of honest rigs, of all together and of any one row: a blunder adds none."""
    rows = [row for row in committed("blunders") if row["case"] != "honest"]
    assert len({row["case"] for row in rows}) >= 25
    for column, judged in (("missed", rows), ("beyond_on_target", [row for row in rows if not row["seen_by"]])):
        rigs, beyond = (sum(int(row[name]) for row in judged) for name in ("rigs", column))
        assert beyond <= binom.isf(BY_CHANCE, rigs, BEYOND_BY_CHANCE)
        for row in judged:
            assert int(row[column]) <= binom.isf(BY_CHANCE / len(rows), int(row["rigs"]), BEYOND_BY_CHANCE), row["case"]


def test_a_hole_that_moved_by_a_tenth_of_a_degree_is_named() -> None:
    rows = [row for row in committed("blunders") if row["case"] == "hole moves at two stations"]
    assert [row["size"] for row in rows] == ["0.02 deg", "0.1 deg", "1 deg"]
    assert all(int(row["named"]) >= 0.95 * int(row["rigs"]) for row in rows[1:])
