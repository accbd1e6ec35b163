"""Arcs of a surveyed hole: the nearest point in closed form against points set all along them."""

import math

import numpy as np
from hypothesis import example, given
from hypothesis import strategies as st

from groundstation.survey.well.hole_arcs import HoleArcs

LENGTH = 30.0


def one_arc(bend: float, rng: np.random.Generator) -> HoleArcs:
    """An arc of 30 m that bends by ``bend`` (rad), anyhow in space."""
    first, other = rng.standard_normal((2, 3))
    first /= np.linalg.norm(first)
    across = other - (other @ first) * first
    across /= np.linalg.norm(across)
    last = math.cos(bend) * first + math.sin(bend) * across
    begin = rng.uniform(-50.0, 50.0, (1, 3))
    md = np.array([7.0, 7.0 + LENGTH])
    return HoleArcs.of_stations(md, np.concatenate([begin, begin]), np.stack([first, last]))


def turned_evenly(arcs: HoleArcs, count: int) -> np.ndarray:
    """Points of the one arc by adding up directions that turn evenly; each step is a chord."""
    angles = (np.arange(count) + 0.5) * float(arcs.bend[0]) / count
    steps = np.cos(angles)[:, None] * arcs.tangent[0] + np.sin(angles)[:, None] * arcs.normal[0]
    small = 0.5 * float(arcs.bend[0]) / count
    chord = LENGTH / count * (math.sin(small) / small if small > 0.0 else 1.0)
    return np.concatenate([arcs.begin, arcs.begin + np.cumsum(chord * steps, axis=0)])


@given(st.floats(0.0, 3.1), st.integers(0, 1000), st.floats(0.0, 100.0))
@example(0.0, 1, 5.0)
@example(1e-14, 1, 5.0)
@example(1e-9, 2, 5.0)
@example(3.1, 3, 0.0)
def test_the_nearest_point_of_an_arc_is_the_nearest_of_all(bend: float, seed: int, reach: float) -> None:
    rng = np.random.default_rng(seed)
    arcs = one_arc(bend, rng)
    along = turned_evenly(arcs, 3000)
    places = along[rng.integers(0, 3000, 20)] + reach * rng.standard_normal((20, 3))
    arc, fraction, distance = arcs.nearest(places)
    brute = np.linalg.norm(places[:, None] - along, axis=-1).min(axis=1)
    assert np.all(distance <= brute + 1e-9)
    assert np.all(brute <= distance + LENGTH / 3000)
    np.testing.assert_allclose(np.linalg.norm(arcs.places(arc, fraction) - places, axis=-1), distance, atol=1e-9)


@given(st.floats(0.0, 3.1), st.integers(0, 1000), st.floats(0.0, 1.0))
def test_a_point_of_an_arc_is_nearest_to_itself_and_its_direction_is_the_arcs(bend: float, seed: int, f: float) -> None:
    arcs = one_arc(bend, np.random.default_rng(seed))
    zero, here = np.zeros(1, np.intp), np.array([f])
    place = arcs.places(zero, here)
    np.testing.assert_allclose(arcs.nearest(place)[1], f, atol=1e-7)
    h = 1e-6
    ahead, behind = (arcs.places(zero, here + d) for d in (h, -h))
    np.testing.assert_allclose((ahead - behind) / (2 * h * LENGTH), arcs.tangents(zero, here), atol=1e-6)
    np.testing.assert_allclose(np.linalg.norm(arcs.tangents(zero, here), axis=-1), 1.0, atol=1e-12)


def test_many_points_are_compared_a_part_at_a_time() -> None:
    rng = np.random.default_rng(0)
    md = np.arange(0.0, 400.0)
    inclination = np.linspace(0.0, 1.5, 400)
    tangents = np.stack([np.sin(inclination), np.zeros(400), np.cos(inclination)], axis=-1)
    positions = np.concatenate([np.zeros((1, 3)), np.cumsum(0.5 * (tangents[1:] + tangents[:-1]), axis=0)])
    arcs = HoleArcs.of_stations(md, positions, tangents)
    places = positions[rng.integers(0, 400, 9000)] + rng.standard_normal((9000, 3))
    whole = arcs.nearest(places)
    for k in (0, 2499, 2501, 8999):
        alone = arcs.nearest(places[k : k + 1])
        assert (whole[0][k], whole[2][k]) == (alone[0][0], alone[2][0])
