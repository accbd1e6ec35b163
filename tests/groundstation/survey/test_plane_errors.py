"""Errors of columns in planes, kept at the stations: what is read is what was said, and memory grows with stations."""

import math
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from groundstation.survey.tools.instruments import PropagationMode, load_tool
from groundstation.survey.wall.as_built import intersect_planes
from groundstation.survey.wall.column_deviation import ColumnDesign
from groundstation.survey.wall.column_errors import reduce_error_columns, shared_name
from groundstation.survey.wall.column_plans import Assumptions, ColumnPlan, ColumnSurvey
from groundstation.survey.wall.judged_wall import judge_wall
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.wall_columns import build_wall
from groundstation.survey.wall.wall_errors import COLUMNS, PLACES, batch_groups
from groundstation.survey.wall.wall_file import read_wall
from groundstation.survey.well.error_columns import ErrorColumns


@given(st.integers(0, 10_000), st.integers(2, 8), st.integers(0, 40))
def test_the_fewest_numbers_say_the_same(seed: int, stations: int, numbers: int) -> None:
    errors = np.random.default_rng(seed).normal(0.0, 0.01, (stations, 2, numbers))
    errors[0] = 0.0
    found = reduce_error_columns(errors)
    assert found.shape[-1] <= min(2 * (stations - 1), numbers)
    flat, before = found.reshape(2 * stations, -1), errors.reshape(2 * stations, -1)
    np.testing.assert_allclose(flat @ flat.T, before @ before.T, rtol=1e-9, atol=1e-15)


def test_errors_between_two_stations_are_theirs_blended_and_those_of_the_site_come_after_them() -> None:
    effects = [np.arange(12.0).reshape(3, 2, 2), np.zeros((1, 2, 0))]
    upper, share = np.array([[0, 1], [0, 0]]), np.array([[0.25, 1.0], [0.0, 0.0]])
    alike = np.zeros((2, 2, 2))
    alike[0, :, 1] = 0.5, 0.7
    errors = PlaneErrors.of_stations(effects, upper, share, alike)
    first, second = errors.at([0, 1])
    assert errors.width == 4
    np.testing.assert_allclose(first[0, :, :2], 0.75 * effects[0][0] + 0.25 * effects[0][1])
    np.testing.assert_allclose(first[1, :, :2], effects[0][2])
    np.testing.assert_allclose(first[:, :, 2:], [0.5 * np.eye(2), 0.7 * np.eye(2)])
    assert not second.any()
    np.testing.assert_array_equal(errors.subset(np.array([1, 0])).at([1])[0], first)


@given(st.lists(st.lists(st.integers(0, 500), min_size=2, max_size=9), max_size=60), st.integers(1, 600))
def test_parts_hold_every_group_once_and_its_columns(groups: list[list[int]], samples: int) -> None:
    parts = list(batch_groups(groups, samples, 60))
    assert [k for some, _ in parts for k in some] == list(range(len(groups)))
    for some, which in parts:
        assert set(which.tolist()) == {column for k in some for column in groups[k]}
        assert len(some) == 1 or len(which) <= min(COLUMNS, PLACES // (60 * samples))


def test_columns_of_one_instrument_and_of_none_share_what_they_share() -> None:
    """Two of one serial number err alike, a third by itself; what each errs in all stays the same."""
    tool, md = load_tool("relay"), np.arange(0.0, 11.0, 2.0)
    hole = ColumnSurvey(md, np.full(6, math.radians(2.0)), np.full(6, 1.0))
    plans = [
        ColumnPlan(ColumnDesign(f"C{k}", (0.0, 0.8 * k, 0.0), length=10.0), tool, serial)
        for k, serial in enumerate(("S1", "S1", ""))
    ]
    built = build_wall(plans, [hole] * 3, Assumptions())
    covs = built.columns.covs
    np.testing.assert_allclose(covs[0], covs[2], rtol=1e-9, atol=1e-15)
    shared = built.columns.shared.at(range(3))
    np.testing.assert_array_equal(shared[0], shared[1])
    assert shared[0].any()
    assert not shared[2].any()


def made_wall(folder: Path, count: int) -> Path:
    """A wall of so many columns that all lean a little, none of whose joints is sure to be good."""
    random = np.random.default_rng(count)
    heads, stations = ["column,north_m,east_m"], ["column,md_m,inclination_deg,azimuth_deg"]
    for k in range(count):
        heads.append(f"K{k},0,{0.75 * k:.2f}")
        towards = random.uniform(0.0, 360.0)
        stations += [f"K{k},{md},{random.uniform(0.02, 0.05):.3f},{towards:.1f}" for md in range(0, 31, 2)]
    (folder / "heads.csv").write_text("\n".join(heads) + "\n")
    (folder / "stations.csv").write_text("\n".join(stations) + "\n")
    wall = folder / "wall.toml"
    wall.write_text(
        'radius_m = 0.6\nthickness_m = 0.8\nspacing_m = 0.75\nhead_sigma_m = 0.02\nheads = "heads.csv"\n'
        'stations = "stations.csv"\n'
    )
    return wall


@pytest.mark.slow
def test_a_wall_of_four_times_as_many_columns_needs_not_four_times_the_memory(tmp_path: Path) -> None:
    """What is drawn and judged together is bounded; only what is known of each column grows with their number."""
    peaks = []
    judge_wall(read_wall(made_wall(tmp_path, 10)))  # what is loaded on first use
    for count in (100, 400):
        wall = made_wall(tmp_path, count)
        tracemalloc.start()
        judgement = judge_wall(read_wall(wall))
        peaks.append(tracemalloc.get_traced_memory()[1])
        tracemalloc.stop()
        assert 0.0 < judgement.system.probability < 1.0
    assert peaks[1] < 3.0 * peaks[0]


@pytest.mark.parametrize(
    ("mode", "shared_as"),
    [
        (PropagationMode.RANDOM, None),
        (PropagationMode.SECTION, None),  # of one run of a gyro, which surveys one column
        (PropagationMode.SYSTEMATIC, "7/A"),
        (PropagationMode.WELL, "7/A"),
        (PropagationMode.GLOBAL, "A"),
    ],
)
def test_columns_share_what_one_instrument_errs_in_all_of_them(mode: PropagationMode, shared_as: str | None) -> None:
    source = ErrorColumns("A", mode, np.zeros((1, 2, 3, 1)))
    assert shared_name(source, ColumnPlan(ColumnDesign(), load_tool("relay"), serial="7")) == shared_as
    alone = shared_name(source, ColumnPlan(ColumnDesign(), load_tool("relay")))
    assert alone == (shared_as if mode is PropagationMode.GLOBAL else None)


@given(st.integers(0, 10_000))
def test_what_a_hole_errs_moves_the_point_in_which_a_plane_cuts_it(seed: int) -> None:
    """A straight hole that leans across the planes is moved as a whole, and cut again: depth counts by its slope."""
    rng = np.random.default_rng(seed)
    slope = rng.uniform(-1.5, 1.5, 2)
    tangent = np.array([*slope, 1.0]) / math.sqrt(1.0 + float(slope @ slope))
    positions = np.linspace(0.0, 20.0, 6)[:, None] * tangent + rng.normal(size=3)
    error = rng.normal(0.0, 0.02, 3)
    tangents, depths = np.tile(tangent, (1, 6, 1)), positions[0, 2] + np.array([0.5, 3.0, 7.5])
    before, after = (intersect_planes(one[None], tangents, depths) for one in (positions, positions + error))
    claimed = before.in_plane(np.tile(error[:, None], (1, 6, 1, 1)))[0, :, :, 0]
    np.testing.assert_allclose(claimed, np.tile(after.centres[0, 0] - before.centres[0, 0], (6, 1)), atol=1e-12)
    np.testing.assert_allclose(after.centres - before.centres, claimed[None, :3], atol=1e-12)
