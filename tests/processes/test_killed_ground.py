"""The ground station killed at random moments: what was receipted is kept, once, over SQLite and over PostgreSQL."""

from pathlib import Path

import pytest
from postgres import running_postgres
from rigs import free_endpoint

from borechain.load.killed import kill_again_and_again

pytestmark = pytest.mark.process


@pytest.mark.parametrize("times", [10, pytest.param(200, marks=pytest.mark.statistical)])
def test_over_sqlite_nothing_receipted_is_lost_or_doubled(tmp_path: Path, times: int) -> None:
    outcome = kill_again_and_again(times, free_endpoint(), tmp_path, seed=times)
    assert (outcome.lost, outcome.doubled, len(outcome.back_s)) == (0, 0, times + 1)
    assert outcome.handed > 8 * times


@pytest.mark.parametrize("times", [5, pytest.param(50, marks=pytest.mark.statistical)])
def test_over_postgresql_nothing_receipted_is_lost_or_doubled(tmp_path: Path, times: int) -> None:
    with running_postgres() as url:
        outcome = kill_again_and_again(times, free_endpoint(), tmp_path, url, seed=times)
        assert (outcome.lost, outcome.doubled, len(outcome.back_s)) == (0, 0, times + 1)
        assert outcome.handed > 8 * times
    assert not (tmp_path / "ground.sqlite").exists()
