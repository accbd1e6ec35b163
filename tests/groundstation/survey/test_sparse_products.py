"""A wide hole whose tubes have hardly met is solved without its zeros: the same as by full matrices."""

import numpy as np
import pytest
from drawn_strings import draw_string
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.survey.adjustment import normal_equations
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.curvature_size import bends_seen
from groundstation.survey.adjustment.kernels.sparse_products import add_rooted, add_squares
from groundstation.survey.adjustment.play import told_by_all

TUBES = 26  # of which the unknowns are wide
ALWAYS, NEVER = 0, 10**9  # places for each number


@settings(max_examples=20, deadline=None)
@given(
    seed=st.integers(0, 10_000), stations=st.integers(1, 6), width=st.integers(1, 9), more=st.integers(0, 2),
    share=st.floats(0.0, 1.0), scale=st.floats(-3.0, 3.0),
)  # fmt: skip
def test_products_without_zeros_are_those_of_full_matrices(
    seed: int, stations: int, width: int, more: int, share: float, scale: float
) -> None:
    random = np.random.default_rng(seed)
    coupled = random.standard_normal((stations, 4, width + more))
    coupled *= random.random(coupled.shape) < share
    root, before = np.triu(random.standard_normal((width, width))), random.standard_normal((stations, 4, width))
    found = before.copy()
    add_rooted(coupled, root, scale, found)
    expected = before.copy()
    expected[:, :2] += scale * coupled[:, :2, :width] @ root
    np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)
    by_common, whole = random.standard_normal((stations, 4, width)), random.standard_normal((width + more,) * 2)
    squares = whole.copy()
    add_squares(coupled, by_common, squares)
    product = np.einsum("kaj,kam->jm", coupled[:, :2, :width], by_common[:, :2])
    whole[:width, :width] += np.triu(product)
    np.testing.assert_allclose(squares, whole, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("stops", [2, 4, 26])
def test_a_hole_without_its_zeros_is_that_with_them(stops: int, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn, found = draw_string(stops, count=TUBES), list[Adjusted]()
    looks = drawn.looks.part(np.flatnonzero(drawn.looks.stop < stops))
    for times in (ALWAYS, NEVER):
        monkeypatch.setattr(normal_equations, "SPARSE", times)
        found.append(adjust_hole(looks, drawn.string, drawn.path))
    without, whole = found
    assert without.solution.sparse is not None
    assert whole.solution.sparse is None
    information = without.solution.in_common.information  # of both triangles of which shares of positions are made
    np.testing.assert_array_equal(information, information.T)
    stds = np.sqrt(np.diagonal(whole.covs, axis1=1, axis2=2))
    apart = np.einsum("kai,ki->ka", whole.bases, without.now.tangents - whole.now.tangents)
    assert np.abs(apart / stds[:, :2]).max() < 1e-5
    assert without.now.play_var == pytest.approx(whole.now.play_var, rel=1e-5)
    np.testing.assert_allclose(without.now.leg_vars, whole.now.leg_vars, rtol=1e-5)
    np.testing.assert_allclose(without.columns @ np.swapaxes(without.columns, 1, 2), whole.covs - whole.own_covs,
                               rtol=1e-5, atol=1e-5 * float(np.abs(whole.covs).max()))  # fmt: skip
    np.testing.assert_allclose(np.sqrt(np.diagonal(without.covs, axis1=1, axis2=2)), stds, rtol=1e-6)
    np.testing.assert_allclose(without.direction_columns, without.columns[:, :2], rtol=0, atol=0)
    for mine, its in zip(bends_seen(without), bends_seen(whole), strict=True):
        np.testing.assert_allclose(mine, its, rtol=1e-4, atol=1e-9)
    assert without.redundancy == pytest.approx(whole.redundancy, abs=1e-5)
    # what looks tell, look by look, without the sums of either
    weights = whole.linear.weights
    told = np.trace(weights - whole.free_parts(np.arange(len(looks))), axis1=1, axis2=2).sum()
    for one in found:
        assert told_by_all(one, one.linear.weights @ one.linear.weights) == pytest.approx(float(told), rel=1e-5)


def test_holes_of_few_unknowns_and_those_with_few_zeros_go_by_full_matrices() -> None:
    few = draw_string(1, count=10)
    assert adjust_hole(few.looks, few.string, few.path).solution.sparse is None
    coupled = np.ones((3, 4, normal_equations.WIDE + 1))
    assert normal_equations.kept_sparse(coupled, normal_equations.WIDE) is None
    coupled[:, :, normal_equations.WIDE // normal_equations.SPARSE :] = 0.0
    kept = normal_equations.kept_sparse(coupled, normal_equations.WIDE)
    assert kept is not None
    np.testing.assert_array_equal(kept, coupled[:, :2, : normal_equations.WIDE])
    assert normal_equations.kept_sparse(coupled[:, :, :-1].copy(), normal_equations.WIDE - 1) is None
