"""Tubes that have looked once are left out of the equations on the way: the hole is the same, and so is each step."""

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from drawn_strings import DrawnString, draw_string

from groundstation.survey.adjustment import lone_looks
from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.curvature_size import learnt_curvature
from groundstation.survey.adjustment.equations import path_equations, string_departure, string_information
from groundstation.survey.adjustment.looks import FurtherEffects
from groundstation.survey.adjustment.normal_equations import WIDE, linearise_all, solve_equations
from groundstation.survey.adjustment.play import learnt_play
from groundstation.survey.adjustment.sphere import carried_bases
from groundstation.survey.adjustment.starting_point import first_start

Array = npt.NDArray[np.float64]
TUBES = 26


def first_looks(seed: int, whole: float) -> DrawnString:
    """A drawn string of which most tubes have one look, at any of its stops, and a share of them all."""
    drawn, random = draw_string(seed, count=TUBES), np.random.default_rng([seed, 5])
    tube = drawn.looks.tube
    is_kept = (random.random(TUBES) < whole)[tube]
    for one in range(TUBES):
        is_kept[random.choice(np.flatnonzero(tube == one))] = True
    return replace(drawn, looks=drawn.looks.part(np.flatnonzero(is_kept)))


def stds_of(found: Adjusted) -> tuple[Array, Array]:
    """Standard deviations of directions (s + 1, 2), and of what stations have in common (p,)."""
    return np.sqrt(np.diagonal(found.covs, axis1=1, axis2=2)[:, :2]), np.sqrt(found.common_vars)


@pytest.mark.parametrize(("seed", "whole", "extras"), [(1, 0.0, 0), (2, 0.3, 2), (3, 0.4, 1)])
def test_a_step_and_what_is_learnt_of_it_are_those_of_the_whole_equations(seed: int, whole: float, extras: int) -> None:
    drawn, random = first_looks(seed, whole), np.random.default_rng([seed, 6])
    looks, string, path = drawn.looks, drawn.string, drawn.path
    extra = FurtherEffects(random.standard_normal((len(looks), 3, extras)), np.ones(extras))
    now = replace(first_start(looks, string, path), extra=0.01 * np.ones(extras))
    now.tubes[:, :5] += 1e-3 * random.standard_normal((TUBES, 5))
    linear, known = linearise_all(looks, now, carried_bases(now.tangents), extra), string_information(string, extra)
    departure = string_departure(string, now)
    one = solve_equations(looks, linear, path_equations(path, now, linear.bases), known, departure, extra)
    expected = Adjusted(looks, string, path, extra, now, linear, one, known)

    alone = lone_looks.lone_looks(looks, string, known)
    assert alone is not None
    assert len(alone.kept) == len(known) - 5 * len(alone.rows)
    made, gains = alone.put_into_weights(linear, now.tubes)
    kept = known[np.ix_(alone.kept, alone.kept)]
    other = solve_equations(looks, made, path_equations(path, now, linear.bases), kept, departure[alone.kept], extra)
    found = Adjusted(looks, string, path, extra, now, made, other, kept)

    directions, common = stds_of(expected)
    step = alone.whole_step(other.common, gains, found.left, now.tubes)
    assert np.abs((step - one.common) / common).max() < 1e-7
    assert np.abs((other.states - one.states)[:, :2] / directions).max() < 1e-7
    np.testing.assert_allclose(found.covs, expected.covs, rtol=1e-7, atol=1e-9 * np.abs(expected.covs).max())
    assert learnt_play(found, string.play_std**2, 4.0) == pytest.approx(
        learnt_play(expected, string.play_std**2, 4.0), rel=1e-7
    )
    assert learnt_curvature(found)[0] == pytest.approx(learnt_curvature(expected)[0], rel=1e-7)
    np.testing.assert_allclose(learnt_curvature(found)[1], learnt_curvature(expected)[1], rtol=1e-7)


@pytest.mark.parametrize(("seed", "whole"), [(4, 0.0), (5, 0.35)])
@pytest.mark.parametrize("is_learnt", [False, True])
def test_a_hole_comes_to_the_same_with_them_left_out(seed: int, whole: float, is_learnt: bool) -> None:
    drawn, found = first_looks(seed, whole), list[Adjusted]()
    start = first_start(drawn.looks, drawn.string, drawn.path)
    for share in (lone_looks.SHARE, 2.0):  # and never
        with pytest.MonkeyPatch.context() as patched:
            patched.setattr(lone_looks, "SHARE", share)
            begin = replace(start, is_learnt=is_learnt)
            found.append(adjust_hole(drawn.looks, drawn.string, drawn.path, start=begin))
    one, other = found
    assert len(one.known) == len(other.known) == drawn.string.width >= WIDE
    directions, common = stds_of(other)
    apart = np.einsum("kai,ki->ka", other.bases, one.now.tangents - other.now.tangents)
    assert np.abs(apart / directions).max() < 1e-3
    assert np.abs((one.now.tubes - other.now.tubes).ravel() / common[: one.now.tubes.size]).max() < 1e-3
    np.testing.assert_allclose(stds_of(one)[0], directions, rtol=1e-3)
    np.testing.assert_allclose(one.now.play_var, other.now.play_var, rtol=1e-3)
    assert one.squares == pytest.approx(other.squares, rel=1e-3)
    assert one.solution.step < 0.03 or is_learnt
