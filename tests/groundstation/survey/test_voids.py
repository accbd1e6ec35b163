"""Voids between discs: number, area and place, against grids whose geometry is known and against fine rasters."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.survey.wall.voids import find_voids, power_centre


def square_grid(count: int, spacing: float) -> np.ndarray:
    return np.array([[a, b] for a in range(count) for b in range(count)], float) * spacing


def square_void(spacing: float, radius: float) -> float:
    """Area between four circles: the square less four quarter circles, plus the halves of four lenses in it."""
    half = math.acos(0.5 * spacing / radius)
    lens = 2.0 * radius**2 * half - spacing * math.sqrt(radius**2 - 0.25 * spacing**2)
    return spacing**2 - math.pi * radius**2 + 2.0 * lens


def test_a_square_grid_has_a_void_in_the_middle_of_every_cell() -> None:
    centres = square_grid(4, 0.9)
    found = find_voids(centres, np.full(16, 0.6))
    assert len(found) == 9
    for void in found:
        assert len(void.columns) == 4
        assert void.radius == pytest.approx(0.9 / math.sqrt(2.0) - 0.6, abs=1e-9)  # 3.6 cm
        assert void.area == pytest.approx(square_void(0.9, 0.6), rel=1e-9)
        assert void.place == pytest.approx(tuple(centres[list(void.columns)].mean(axis=0)), abs=1e-9)


def test_a_grid_that_is_near_enough_has_none() -> None:
    assert find_voids(square_grid(4, 0.84), np.full(16, 0.6)) == []


def test_a_triangular_cell_opens_only_beyond_its_circumradius() -> None:
    def cell(spacing: float) -> np.ndarray:
        return np.array([[0.0, 0.0], [0.0, spacing], [spacing * math.sqrt(0.75), 0.5 * spacing]])

    edge = 0.6 * math.sqrt(3.0)
    assert find_voids(cell(edge - 1e-4), np.full(3, 0.6)) == []
    (void,) = find_voids(cell(edge + 0.01), np.full(3, 0.6))
    assert void.columns == (0, 1, 2)
    assert void.radius == pytest.approx(0.01 / math.sqrt(3.0), rel=1e-6)


def test_a_ring_of_columns_encloses_its_inside_and_a_missing_one_opens_it() -> None:
    angle = np.linspace(0.0, math.tau, 30, endpoint=False)
    ring = 3.0 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
    (void,) = find_voids(ring, np.full(30, 0.4))
    assert len(void.columns) == 30
    assert void.area > math.pi * 2.6**2
    ring[7] = np.nan
    assert find_voids(ring, np.full(30, 0.4)) == []


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_areas_are_those_of_a_fine_raster(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centres = square_grid(4, 0.9) + rng.normal(0.0, 0.05, (16, 2))
    edge = np.array([a in (0, 3) or b in (0, 3) for a in range(4) for b in range(4)])
    radii = np.where(edge, 0.68, rng.uniform(0.45, 0.6, 16))  # closed all around: no opening that a raster may miss
    step = 0.01
    x, y = np.meshgrid(np.arange(0.0, 2.7, step), np.arange(0.0, 2.7, step), indexing="ij")
    free = np.ones(x.shape, bool)
    for (cx, cy), r in zip(centres, radii, strict=True):
        free &= (x - cx) ** 2 + (y - cy) ** 2 >= r**2
    area = sum(void.area for void in find_voids(centres, radii))
    assert area > 0.0
    assert area == pytest.approx(np.count_nonzero(free) * step**2, rel=0.03, abs=0.004)


@settings(max_examples=25)
@given(st.integers(0, 10_000))
def test_turning_and_shifting_change_no_area(seed: int) -> None:
    rng = np.random.default_rng(seed)
    centres, radii = square_grid(3, 0.9) + rng.normal(0.0, 0.05, (9, 2)), rng.uniform(0.5, 0.66, 9)
    angle = rng.uniform(0.0, math.tau)
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    before = sorted(void.area for void in find_voids(centres, radii))
    after = sorted(void.area for void in find_voids(centres @ turn.T + rng.uniform(-50.0, 50.0, 2), radii))
    np.testing.assert_allclose(after, before, rtol=1e-6, atol=2e-9)


def test_the_power_centre_of_equal_discs_is_the_circumcentre() -> None:
    three = np.array([[[0.0, 0.0], [2.0, 0.0], [0.0, 1.0]]])
    np.testing.assert_allclose(power_centre(three, np.full((1, 3), 0.7)), [[1.0, 0.5]])
