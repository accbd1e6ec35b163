"""The seams of the product that the gauntlet opens: each is one, none stays open, and what is shown stays true."""

import ast
import importlib
import inspect

import pytest
from hypothesis import given
from hypothesis import strategies as st

from borechain.gauntlet.gauntlet_run import SeedJob, judge_seed, run_seed
from borechain.gauntlet.seams import SEAMS, Seam, drawn_seams, opened_seams

BY_KEY = {seam.key: seam for seam in SEAMS}


def value_of(seam: Seam) -> object:
    return getattr(importlib.import_module(seam.module), seam.name)


def read_when_called(seam: Seam) -> bool:
    """Whether some function of the module looks the number up each time it is called."""
    tree = ast.parse(inspect.getsource(importlib.import_module(seam.module)))
    bodies = [line for made in ast.walk(tree) if isinstance(made, ast.FunctionDef) for line in made.body]
    return any(isinstance(one, ast.Name) and one.id == seam.name for line in bodies for one in ast.walk(line))


@pytest.mark.parametrize("seam", SEAMS, ids=lambda seam: seam.key)
def test_a_seam_is_a_number_that_is_looked_up_where_it_is_used(seam: Seam) -> None:
    usual = value_of(seam)
    assert isinstance(usual, int | float)
    assert usual not in seam.values
    assert read_when_called(seam)


@given(st.integers(0, 10**8))
def test_seams_are_opened_for_a_while_alone(seed: int) -> None:
    usual = {seam.key: value_of(seam) for seam in SEAMS}
    drawn = drawn_seams(seed)
    assert drawn
    with opened_seams(drawn):
        for key, value in drawn.items():
            assert value in BY_KEY[key].values
            assert value_of(BY_KEY[key]) == value
            assert type(value_of(BY_KEY[key])) is type(usual[key])
        assert {key for key in usual if value_of(BY_KEY[key]) != usual[key]} == set(drawn)
    assert {seam.key: value_of(seam) for seam in SEAMS} == usual


def test_every_seam_is_opened_with_every_value() -> None:
    drawn = [drawn_seams(seed) for seed in range(400)]
    opened = {(key, value) for one in drawn for key, value in one.items()}
    assert opened == {(seam.key, float(value)) for seam in SEAMS for value in seam.values}


@pytest.mark.slow
def test_a_seed_with_seams_repeats_and_is_another_than_without() -> None:
    kinds = ("loss", "node-cut")
    first, second = (run_seed(9_200_000, kinds=kinds, has_seams=True, covers=True) for _ in range(2))
    assert first.violations == []
    assert first == second
    assert first.seams
    assert first.pairs
    seeds = range(9_200_001, 9_200_003)
    with_and_without = [[run_seed(seed, kinds=kinds, has_seams=has).told for seed in seeds] for has in (True, False)]
    assert with_and_without[0] != with_and_without[1]


@pytest.mark.parametrize(
    ("first", "count"),
    [pytest.param(9_210_000, 3, marks=pytest.mark.slow), pytest.param(9_210_003, 400, marks=pytest.mark.statistical)],
)
def test_seeds_with_seams_hold(first: int, count: int) -> None:
    jobs = [
        SeedJob(seed, plan=plan, has_seams=True)
        for seed in range(first, first + count)
        for plan in ("minute", "calmed")
    ]
    failed = [one for job in jobs[::2] + jobs[1::4] if (one := judge_seed(job)).violations]
    assert [(one.seed, one.plan, one.kinds, one.violations) for one in failed] == []
