"""Probability of voids at every depth of a grid, against drawn ones."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from walls_by_sampling import uncovered

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.plane_errors import PlaneErrors
from groundstation.survey.wall.void_chance import void_chance, void_open
from groundstation.survey.wall.voids import power_centre, triples_of
from groundstation.survey.wall.wall_verdict import FindingKind, WallVerdict, judge_columns

RADIUS, SPACING = 0.6, 0.81
HEADS = np.array([[0.0, 0.0], [0.0, SPACING], [SPACING, 0.0], [SPACING, SPACING]])
TRIPLES = triples_of(HEADS, 1.75 * SPACING)
SQUARE = np.array([[0, 1], [0, 2], [1, 3], [2, 3]])


def four(stds: tuple[float, ...], cv: float = 0.0) -> Columns:
    """Columns on a square whose own errors have other standard deviations (m) at every depth."""
    planes = len(stds)
    own = np.broadcast_to(np.array(stds)[:, None, None] * np.eye(2), (4, planes, 2, 2)).copy()
    centres = np.repeat(HEADS[:, None, :], planes, axis=1)
    return Columns(
        ["A", "B", "C", "D"], np.linspace(0.0, 20.0, planes), centres, own @ own, HEADS, centres.copy(),
        np.full((4, planes), ColumnState.SURVEYED, np.int8), PlaneErrors.of_planes(own),
        PlaneErrors.of_planes(np.zeros((4, planes, 2, 0))),
        np.full((4, planes), RADIUS), np.full((4, planes), RADIUS * cv), 0.0,
    )  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("cv", [0.0, 0.02])
def test_at_every_depth_it_is_that_of_drawn_columns(cv: float) -> None:
    stds = (0.0, 0.022, 0.03)
    found = void_chance(four(stds, cv), TRIPLES)
    rng, n = np.random.default_rng(3), 200_000
    for z, std in enumerate(stds):
        centres = HEADS + rng.normal(0.0, std, (n, 4, 2))
        radii = RADIUS * (1.0 + cv * rng.normal(size=(n, 4)))
        # only where both diagonals are long against their radii may the middle be free: those are looked at closely
        apart = [np.linalg.norm(centres[:, a] - centres[:, b], axis=1) for a, b in ((0, 3), (1, 2))]
        slack = apart[0] - radii[:, 0] - radii[:, 3], apart[1] - radii[:, 1] - radii[:, 2]
        close = np.flatnonzero(np.minimum(*slack) > -0.01)
        drawn = np.count_nonzero(uncovered(centres[close], radii[close], 0.05)) / n
        if std == 0.0 and cv == 0.0:
            assert found.probability[z] == drawn == 0.0
        elif drawn > 2e-4:
            assert found.probability[z] == pytest.approx(drawn, rel=0.2)
            assert found.standard_error[z] < 0.1 * found.probability[z]
            assert found.places[z] == pytest.approx([SPACING / 2, SPACING / 2], abs=1e-6)
    assert found.probability[1] < found.probability[2]


def test_a_void_as_surveyed_is_certain_where_nothing_moves() -> None:
    wide = four((0.0, 0.0))
    wide = replace(wide, radii=np.stack([np.full(4, RADIUS), np.full(4, 0.5)], axis=1))
    np.testing.assert_array_equal(void_chance(wide, TRIPLES).probability, [0.0, 1.0])


def test_where_a_column_is_missing_the_plane_is_open() -> None:
    whole = four((0.01, 0.01))
    states, centres = whole.states.copy(), whole.centres.copy()
    states[3, 1], centres[3, 1] = ColumnState.MISSING, math.nan
    found = void_chance(replace(whole, states=states, centres=centres), TRIPLES)
    assert found.probability[0] < 1e-3
    assert found.probability[1] == 1.0


def test_a_void_that_is_only_likely_is_named_with_its_depth() -> None:
    found = judge_columns(four((0.005, 0.06)), SQUARE, 0.05, grid_spacing=SPACING)
    doubtful = [finding for finding in found.findings if "void" in finding.text]
    assert [(finding.kind, finding.top) for finding in doubtful] == [(FindingKind.DOUBTFUL, 20.0)]
    assert "at 20 m, most of all between" in doubtful[0].text
    assert found.verdict is WallVerdict.NOT_PROVEN
    assert found.void_chance is not None
    assert found.void_chance.probability[1] == doubtful[0].probability


@given(st.integers(0, 2**32 - 1))
def test_the_plane_is_open_where_no_disc_holds_the_point_of_equal_power(seed: int) -> None:
    rng = np.random.default_rng(seed)
    places, radii = rng.uniform(-1.0, 1.0, (5, 4, 3, 2)), rng.uniform(0.2, 0.9, (5, 4, 3))
    places[3][rng.random((4, 3)) < 0.3] = math.nan  # what is not there covers nothing
    found = void_open(places + np.array([5e5, 6e6]), radii, (0, 1, 2), (3, 4))
    for s, z in np.ndindex(4, 3):
        point = power_centre(places[None, :3, s, z], radii[None, :3, s, z])[0]
        powers = np.sum((places[:, s, z] - point) ** 2, axis=-1) - radii[:, s, z] ** 2
        (ax, ay), (bx, by), (cx, cy) = places[:3, s, z] - point
        turns = np.array([ax * by - ay * bx, bx * cy - by * cx, cx * ay - cy * ax])
        if np.nanmin(np.abs([*powers, *turns])) > 1e-6:  # what the digits of site coordinates tell apart
            among = np.all(turns > 0.0) or np.all(turns < 0.0)
            assert found[s, z] == (among and powers[0] > 0.0 and not np.any(powers[3:] < 0.0))


def test_a_wide_column_covers_a_void_from_afar() -> None:
    """Three columns too thin to meet; the middle between them lies in one of 2 m radius, 1.9 m away."""
    heads = np.array([*HEADS[:3], [-1.2, -1.2]])
    found = four((0.0, 0.0))
    centres, middle = np.repeat(heads[:, None], 2, axis=1), np.array([SPACING / 2, SPACING / 2])
    radii = np.repeat(
        np.array([0.45, 0.45, 0.45, 2.0 + float(np.linalg.norm(heads[3] - middle)) - 1.9])[:, None], 2, axis=1
    )
    moved = replace(found, centres=centres, planned=centres, designs=heads, radii=radii)
    assert float(np.linalg.norm(heads[3] - middle)) > 2.0
    np.testing.assert_array_equal(void_chance(moved, np.array([[0, 1, 2]])).probability, 0.0)
    radii[3] = float(np.linalg.norm(heads[3] - middle)) - 0.2  # and does not reach it
    np.testing.assert_array_equal(void_chance(moved, np.array([[0, 1, 2]])).probability, 1.0)
