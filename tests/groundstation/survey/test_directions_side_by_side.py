"""Stations put side by side are those that are put one by one, bit for bit, and stay so when one comes between."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.errors import SurveyError
from groundstation.survey.fusion.direction_run import DirectionRun
from groundstation.survey.fusion.packed import Packed
from groundstation.survey.fusion.resolve import Direction, known_direction
from groundstation.survey.fusion.sphere_direction import SphereDirection
from groundstation.survey.well.depth_errors import StationDepth
from groundstation.survey.well.trajectory import Trajectory
from groundstation.survey.well.trajectory_stations import BLOCK

WIDTH = 9  # columns in all


def drawn_run(seed: int, count: int) -> DirectionRun:
    """Directions that lean a little, each with an error of its own, and some that all share."""
    rng = np.random.default_rng(seed)
    tangents = np.array([0.0, 0.0, 1.0]) + 0.1 * rng.standard_normal((count, 3))
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    roots = 1e-3 * rng.standard_normal((count, 3, 3))
    places = np.sort(rng.choice(WIDTH, 4, replace=False))
    return DirectionRun(
        tangents, roots @ roots.swapaxes(1, 2), 1e-3 * rng.standard_normal((3, count, 4)), places, WIDTH
    )


def one_by_one(run: DirectionRun) -> list[SphereDirection]:
    """The same directions, each with columns of its own."""
    found = []
    for k in range(len(run.tangents)):
        columns = np.zeros((3, WIDTH))
        columns[:, run.places] = run.columns[:, k]
        found.append(SphereDirection(run.tangents[k], run.owns[k], Packed(columns, run.places)))
    return found


def drawn_depths(seed: int, mds: list[float]) -> dict[float, StationDepth]:
    """Depths that share more columns than the directions have; every third station is exact."""
    rng = np.random.default_rng(seed)
    return {
        md: StationDepth(Packed(1e-2 * rng.standard_normal((1, WIDTH + 2))), 1e-6 * float(rng.random()))
        for k, md in enumerate(mds)
        if k % 3
    }


def assert_alike(one: Trajectory, other: Trajectory) -> None:
    assert len(one) == len(other)
    for name in ("md", "tangents", "positions", "covs", "tangent_covs", "path_covs", "depth_covs", "shared_depth_vars"):
        np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    for mine, its in zip(one.columns(), other.columns(), strict=True):
        np.testing.assert_array_equal(mine, its)
    middles = 0.5 * (one.md[1:] + one.md[:-1])
    for md in middles[:: max(1, len(middles) // 5)].tolist():
        np.testing.assert_array_equal(one.at(md).cov, other.at(md).cov)
        np.testing.assert_array_equal(one.at(md).shared, other.at(md).shared)


@settings(max_examples=25, deadline=None)
@given(
    seed=st.integers(0, 1000),
    count=st.sampled_from([1, 2, 5, BLOCK - 1, BLOCK, BLOCK + 1, 2 * BLOCK + 3]),
    above=st.integers(0, 3),
    keeps=st.booleans(),
    with_depths=st.booleans(),
)
def test_stations_side_by_side_are_those_put_one_by_one(
    seed: int, count: int, above: int, keeps: bool, with_depths: bool
) -> None:
    mds = np.cumsum(np.random.default_rng(seed).uniform(0.2, 3.0, above + count)).tolist()
    collar, first, run = known_direction(0.02, 1.0), drawn_run(seed, above), drawn_run(seed + 1, count)
    depths = drawn_depths(seed, mds) if with_depths else {}
    beside, single = (Trajectory(collar=collar, keeps_columns=keeps) for _ in range(2))
    for drawn in (beside, single):
        drawn.put(zip(mds, one_by_one(first), strict=False), depths)
    beside.put_below(mds[above:], run, depths)
    single.put([*zip(mds[above:], one_by_one(run), strict=True)], depths)
    assert_alike(beside, single)
    # one that comes between takes them apart, and one below goes on from them
    more: list[tuple[float, Direction]] = [
        (0.5 * (mds[-1] + ([0.0, *mds][-2])), known_direction(0.1, 2.0)),
        (mds[-1] + 1.0, known_direction(0.2, -1.0)),
    ]
    for drawn in (beside, single):
        drawn.put(more)
    assert_alike(beside, single)


def test_a_run_is_a_sequence_of_its_directions() -> None:
    run = drawn_run(3, 6)
    assert len(run[2:]) == 4
    assert len([*run]) == len(run) == 6
    for one, single in zip(run[2:], one_by_one(run)[2:], strict=True):
        np.testing.assert_array_equal(one.tangent, single.tangent)
        np.testing.assert_array_equal(one.tangent_cov, single.tangent_cov)
        np.testing.assert_array_equal(one.shared, single.shared)
        assert one.width == single.width == WIDTH


@pytest.mark.parametrize("mds", [[0.0, 1.0], [2.0, 2.0], [2.0, 1.0], [1.0, float("inf")], [float("nan"), 2.0]])
def test_depths_that_do_not_grow_are_refused_and_nothing_is_put(mds: list[float]) -> None:
    trajectory = Trajectory()
    with pytest.raises(SurveyError, match="expected a depth beyond"):
        trajectory.put_below(mds, drawn_run(1, 2))
    assert len(trajectory) == 1
