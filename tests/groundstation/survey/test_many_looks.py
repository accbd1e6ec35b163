"""A hole of many looks is solved without what is zero and by equations of before: the same as all of it anew."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from drawn_strings import DrawnString, draw_string
from hypothesis import given, settings
from hypothesis import strategies as st

from groundstation.survey.adjustment import normal_equations
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.equations import (
    path_equations,
    string_departure,
    string_information,
)
from groundstation.survey.adjustment.linear_solution import InCommon
from groundstation.survey.adjustment.looks import OF_TUBE, FurtherEffects, StartingPoint
from groundstation.survey.adjustment.normal_equations import linearise_all, solve_again, solve_equations
from groundstation.survey.adjustment.sphere import carried_bases
from groundstation.survey.adjustment.starting_point import first_start

Array = npt.NDArray[np.float64]
NEVER = 10**9  # looks
TUBES = 26  # of which the unknowns are wide


def some_looks(seed: int, share: float, *, shuffled: bool) -> DrawnString:
    """A drawn string of which a share of the looks is there, its tubes by their places from the bit or in any order."""
    drawn, random = draw_string(seed, count=TUBES), np.random.default_rng([seed, 7])
    looks = drawn.looks.part(np.flatnonzero(random.random(len(drawn.looks)) < share))
    if shuffled:
        looks = replace(looks, tube=random.permutation(TUBES)[looks.tube])
    return replace(drawn, looks=looks)


def dense_solution(drawn: DrawnString, now: StartingPoint, extra: FurtherEffects) -> tuple[Array, Array]:
    """Step of all unknowns, directions first, and their covariance: one matrix, look by look."""
    looks, bases = drawn.looks, carried_bases(now.tangents)
    linear = linearise_all(looks, now, bases, extra)
    diagonal, tied, right = path_equations(drawn.path, now, bases)
    known = string_information(drawn.string, extra)
    stations, count = 4 * len(diagonal), 4 * len(diagonal) + len(known)
    whole, side = np.zeros((count, count)), np.zeros(count)
    for k, block in enumerate(diagonal):
        here = slice(4 * k, 4 * k + 4)
        whole[here, here] += block
        side[here] += right[k]
        if k:
            above = slice(4 * k - 4, 4 * k)
            whole[here, above] += tied[k]
            whole[above, here] += tied[k].T
    whole[stations:, stations:] += known
    side[stations:] -= known @ string_departure(drawn.string, now)
    gravity = stations + OF_TUBE * drawn.string.count
    for k, (station, tube, make_up) in enumerate(zip(looks.station, looks.tube, looks.make_up, strict=True)):
        row, j = np.zeros((3, count)), linear.jacobians[k]
        row[:, 4 * station : 4 * station + 2] = j[:, :2]
        row[:, stations + OF_TUBE * tube : stations + OF_TUBE * (tube + 1)] = j[:, 2:8]
        row[:, gravity], row[:, gravity + 1 + make_up] = j[:, 8], j[:, 7]
        row[:, count - len(extra.std) :] = extra.columns[k]
        whole += row.T @ linear.weights[k] @ row
        side += row.T @ linear.weights[k] @ linear.residuals[k]
    step, cov = np.linalg.solve(whole, side), np.linalg.inv(whole)
    return np.asarray(step, np.float64), np.asarray(cov, np.float64)


@settings(max_examples=8, deadline=None)
@given(
    seed=st.integers(0, 10_000), share=st.floats(0.2, 1.0), shuffled=st.booleans(), extras=st.integers(0, 2),
    sparse=st.sampled_from([0, NEVER]),
)  # fmt: skip
def test_a_step_of_many_looks_is_that_of_one_matrix_of_all_unknowns(
    seed: int, share: float, shuffled: bool, extras: int, sparse: int
) -> None:
    drawn = some_looks(seed, share, shuffled=shuffled)
    looks, random = drawn.looks, np.random.default_rng([seed, 8])
    extra = FurtherEffects(random.standard_normal((len(looks), 3, extras)), np.ones(extras))
    now = replace(first_start(looks, drawn.string, drawn.path), extra=0.01 * np.ones(extras))
    bases = carried_bases(now.tangents)
    linear, known = linearise_all(looks, now, bases, extra), string_information(drawn.string, extra)
    of_path, departure = path_equations(drawn.path, now, bases), string_departure(drawn.string, now)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(normal_equations, "MANY", 1)
        patched.setattr(normal_equations, "TOGETHER", 5)
        patched.setattr(normal_equations, "SPARSE", sparse)
        found = solve_equations(looks, linear, of_path, known, departure, extra)
    again = solve_again(found, looks, linear, path_equations(drawn.path, now, bases)[2], -known @ departure, extra)
    step, cov = dense_solution(drawn, now, extra)
    stds, states = np.sqrt(np.diag(cov)), found.states.size
    for one in (found, again):  # the latter by its right sides alone
        assert np.abs((one.states.ravel() - step[:states]) / stds[:states]).max() < 1e-6
        assert np.abs((one.common - step[states:]) / stds[states:]).max() < 1e-6
        assert one.decrement == pytest.approx(found.decrement, rel=1e-9)
    np.testing.assert_allclose(np.sqrt(np.diag(found.cov)), stds[states:], rtol=1e-6)
    adjusted = Adjusted(looks, drawn.string, drawn.path, extra, now, linear, found, known)
    own = [np.sqrt(np.diag(one)) for one in adjusted.covs]
    np.testing.assert_allclose(np.ravel(own), stds[:states], rtol=1e-6)
    np.testing.assert_allclose(np.sqrt(adjusted.common_vars), stds[states:], rtol=1e-6)


def moved_start(drawn: DrawnString, seed: int, far: float) -> StartingPoint:
    """Where an adjustment of half of the looks ended, or a little beside it."""
    half = drawn.looks.part(np.flatnonzero(drawn.looks.stop < TUBES - 2))
    now = adjust_hole(half, drawn.string, drawn.path).now
    random = np.random.default_rng([seed, 9])
    off = now.tangents + far * 1e-3 * random.standard_normal(now.tangents.shape)
    off /= np.linalg.norm(off, axis=1, keepdims=True)
    return replace(now, tangents=off, gravity=now.gravity + far * 1e-3, is_learnt=True)


@settings(max_examples=4, deadline=None)
@given(seed=st.integers(0, 10_000), far=st.floats(0.0, 3.0))
def test_steps_by_equations_of_before_lead_where_whole_ones_do(seed: int, far: float) -> None:
    drawn = draw_string(seed, count=TUBES)
    start, found = moved_start(drawn, seed, far), list[Adjusted]()
    for many in (1, NEVER):
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(normal_equations, "MANY", many)
            found.append(adjust_hole(drawn.looks, drawn.string, drawn.path, start=start))
    one, other = found
    stds = np.sqrt(np.diagonal(other.covs, axis1=1, axis2=2))
    apart = np.einsum("kai,ki->ka", other.bases, one.now.tangents - other.now.tangents)
    assert np.abs(apart / stds[:, :2]).max() < 0.01
    of_tubes = np.sqrt(np.diag(other.common_cov))[: one.now.tubes.size]
    assert np.abs((one.now.tubes - other.now.tubes).ravel() / of_tubes).max() < 0.01
    np.testing.assert_allclose(np.sqrt(np.diagonal(one.covs, axis1=1, axis2=2)), stds, rtol=0.01)
    assert one.squares == pytest.approx(other.squares, rel=1e-3)
    assert one.redundancy == pytest.approx(other.redundancy, rel=1e-3)


@pytest.mark.parametrize("count", [1, 12, 71, 170])
def test_roots_and_products_are_those_of_the_inverse(count: int) -> None:
    random = np.random.default_rng(count)
    columns = random.standard_normal((count, count + 5))
    information, right = columns @ columns.T + np.eye(count), random.standard_normal(count)
    found, inverse = InCommon(information, right), np.linalg.inv(information)
    scale = np.abs(inverse).max()
    some = random.standard_normal((count, 3))
    assert np.abs(found.root @ found.root.T - inverse).max() < 1e-10 * scale
    assert np.abs(found.times_cov(some) - inverse @ some).max() < 1e-9 * scale
    assert np.abs(found.times_root(some.T) - some.T @ found.root).max() < 1e-10 * np.sqrt(scale)
    again = found.with_right(2.0 * right)
    assert again.root is found.root
    assert np.abs(again.step - 2.0 * (inverse @ right)).max() < 1e-9 * np.abs(inverse @ right).max()
