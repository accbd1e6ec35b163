"""Holes that are drawn: what each kind is, that it is smooth between stations, and that one number is one hole."""

import csv
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.world.borehole import Borehole
from sim.world.path_section import HOLE_KINDS
from sim.world.scenario import scenario_of

LENGTH = 30.0
RECORD = Path(__file__).parents[2] / "scenarios" / "wellbore-1-path.csv"


def hole(kind: str, seed: int = 1, **values: Any) -> Borehole:
    drawn = {"kind": kind, "seed": seed, **values}
    return scenario_of({"rig": {"tubes": 15, "tube_length_m": 2.0}, "path": {"drawn": drawn}}).hole


def axis_of(inclination_deg: float, azimuth_deg: float) -> np.ndarray:
    lean, azimuth = math.radians(inclination_deg), math.radians(azimuth_deg)
    return np.array([math.sin(lean) * math.cos(azimuth), math.sin(lean) * math.sin(azimuth), math.cos(lean)])


def lean_deg(one: Borehole, md: np.ndarray, axis: np.ndarray) -> np.ndarray:
    """Angle between a hole and an axis."""
    tangent = one.tangent(md)[0]
    return np.degrees(np.arctan2(np.linalg.norm(np.cross(tangent, axis), axis=1), tangent @ axis))


@given(
    kind=st.sampled_from(HOLE_KINDS),
    seed=st.integers(0, 2**40),
    inclination=st.floats(0.0, 100.0),
    azimuth=st.floats(-180.0, 180.0),
)
def test_a_drawn_hole_is_as_long_as_it_takes_and_smooth(
    kind: str, seed: int, inclination: float, azimuth: float
) -> None:
    one = hole(kind, seed, inclination_deg=inclination, azimuth_deg=azimuth)
    assert one.length == pytest.approx(LENGTH)
    md = np.linspace(0.0, LENGTH, 3001)
    tangent, curvature = one.tangent(md)
    np.testing.assert_allclose(np.linalg.norm(tangent, axis=1), 1.0, atol=1e-12)
    size = np.degrees(np.linalg.norm(curvature, axis=1))
    steps = np.degrees(np.linalg.norm(np.diff(curvature, axis=0), axis=1))
    assert size.max() < 3.0  # deg/m
    assert steps.max() < 0.2  # deg/m: no kink; a path of stations of 2 m would jump by as much as it bends
    moved = np.array([one.position(float(depth)) for depth in md[::100]])
    by_parts = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (tangent[1:] + tangent[:-1]) * 0.01, axis=0)])
    np.testing.assert_allclose(moved, by_parts[::100], atol=1e-5)


def test_one_number_is_one_hole_and_another_another() -> None:
    md = np.linspace(0.0, LENGTH, 50)
    for kind in HOLE_KINDS:
        np.testing.assert_array_equal(hole(kind, 4).tangent(md)[0], hole(kind, 4).tangent(md)[0])
        assert np.abs(hole(kind, 4).tangent(md)[0] - hole(kind, 5).tangent(md)[0]).max() > 1e-5


@pytest.mark.parametrize(("inclination", "azimuth"), [(0.0, 0.0), (15.0, 70.0), (95.0, -120.0)])
def test_a_straight_hole_keeps_the_lean_of_its_collar(inclination: float, azimuth: float) -> None:
    axis, md = axis_of(inclination, azimuth), np.linspace(0.0, LENGTH, 40)
    leans = [
        lean_deg(hole("straight", seed, inclination_deg=inclination, azimuth_deg=azimuth), md, axis)
        for seed in range(400)
    ]
    assert np.ptp(np.array(leans), axis=1).max() < 1e-6
    # two axes of 0.15 deg: Rayleigh, whose mean square is 2 sigma^2
    assert np.mean(np.square(leans)) == pytest.approx(2.0 * 0.15**2, rel=0.25)


def test_a_constant_curvature_leans_in_proportion_to_the_depth() -> None:
    md = np.linspace(0.0, LENGTH, 60)
    for kind in ("build", "walk"):
        leans = [lean_deg(hole(kind, seed, collar_std_deg=0.0), md, axis_of(0.0, 0.0)) for seed in range(1, 30)]
        for lean in leans:
            np.testing.assert_allclose(lean, lean[-1] * md / LENGTH, atol=1e-6)


def test_a_hole_that_walks_goes_to_the_right_of_its_axis() -> None:
    inclination, azimuth = math.radians(20.0), math.radians(30.0)
    right = np.array([-math.sin(azimuth), math.cos(azimuth), 0.0])
    up = np.array(
        [math.cos(inclination) * math.cos(azimuth), math.cos(inclination) * math.sin(azimuth), -math.sin(inclination)]
    )
    ends = []
    for seed in range(200):
        one = hole("walk", seed, inclination_deg=20.0, azimuth_deg=30.0, collar_std_deg=0.0)
        end = one.position(LENGTH)
        assert end @ right >= 0.0
        ends.append((end @ right, end @ up))
    aside, along = np.sqrt(np.mean(np.square(ends), axis=0))
    assert aside / along == pytest.approx(0.1 / 0.02, rel=0.35)


def test_a_soft_layer_bends_from_a_depth_on_and_not_above() -> None:
    md, depths = np.linspace(0.0, LENGTH, 601), []
    for seed in range(60):
        one = hole("soft", seed, collar_std_deg=0.0)
        lean = lean_deg(one, md, axis_of(0.0, 0.0))
        begin = md[np.flatnonzero(lean > 1e-5)[0]]
        depths.append(begin)
        below = md > begin + 2.3
        slope = np.diff(lean[below]) / np.diff(md[below])
        assert np.ptp(slope) < 1e-4 * slope.max() + 1e-6  # constant in the layer
    assert min(depths) > 0.19 * LENGTH
    assert max(depths) < 0.85 * LENGTH
    assert np.std(depths) == pytest.approx(0.6 * LENGTH / math.sqrt(12.0), rel=0.3)


def test_the_shape_of_the_field_record_is_scaled_and_turned() -> None:
    with RECORD.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))
    lateral = np.array([[float(row["a_cm"]), float(row["b_cm"])] for row in rows]) / 100.0
    recorded = np.arcsin(np.hypot(*lateral.T) / 2.0)
    depth = np.array([float(row["md_m"]) for row in rows]) * LENGTH / 20.0
    for seed in range(10):
        lean = lean_deg(hole("wellbore", seed, collar_std_deg=0.0), depth, axis_of(0.0, 0.0))
        scale = lean[-1] / math.degrees(recorded[-1])
        assert 0.4 <= scale <= 1.2
        np.testing.assert_allclose(lean, np.degrees(scale * recorded), atol=2e-3)


def test_a_curvature_that_wanders_has_its_size_and_its_length() -> None:
    md = np.linspace(0.05, LENGTH - 0.05, 300)  # in the middle of the arcs
    found = np.array(
        [hole("random", seed, collar_std_deg=0.0).tangent(md)[1][:, :2] for seed in range(250)]
    )  # north and east of a hole that hardly leans
    found = np.degrees(found)
    assert found.std() == pytest.approx(0.12, rel=0.05)
    lag = 120  # of 0.1 m
    follows = np.mean(found[:, lag:] * found[:, :-lag]) / found.var()
    assert follows == pytest.approx(math.exp(-1.0), abs=0.07)
    assert abs(np.mean(found[..., 0] * found[..., 1])) / found.var() < 0.1


def test_bending_scales_what_is_drawn_and_nothing_else() -> None:
    md, axis = np.linspace(0.0, LENGTH, 31), axis_of(0.0, 0.0)  # where its directions are drawn
    one, twice = (hole("random", 3, collar_std_deg=0.0, bending=size) for size in (1.0, 2.0))
    np.testing.assert_allclose(lean_deg(twice, md, axis), 2.0 * lean_deg(one, md, axis), rtol=1e-9, atol=1e-9)
