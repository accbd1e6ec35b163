"""Sources of all positions at once, and what the looks tell, against dense matrices and functionals one by one."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from dense_hole import DenseHole
from drawn_strings import DrawnString, draw_string

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.budget import ErrorShare, ShareSource, error_budget
from groundstation.survey.adjustment.hypotheses import Hypothesis
from groundstation.survey.adjustment.position_shares import position_shares
from groundstation.survey.adjustment.taken_in import adjust_with

OF_LOOKS = (ShareSource.FORCE_NOISE, ShareSource.PLAY, ShareSource.YAW_NOISE)


@pytest.fixture(scope="module")
def drawn() -> DrawnString:
    return draw_string(12)


@pytest.fixture(scope="module")
def found(drawn: DrawnString) -> Adjusted:
    return adjust_hole(drawn.looks, drawn.string, drawn.path)


def weights_of(found: Adjusted, station: int) -> np.ndarray:
    """Functional (s + 1, 2, 3) of a position: half of every leg above it goes each of the two ways at its ends."""
    weights = np.zeros((len(found.path.md), 2, 3))
    for leg, length in enumerate(np.diff(found.path.md)[:station]):
        for end in (leg, leg + 1):
            weights[end] += 0.5 * length * found.bases[end]
    return weights


def by_name(shares: list[ErrorShare]) -> dict[tuple[ShareSource, int], np.ndarray]:
    return {(one.source, one.subject): one.variances for one in shares if one.source not in OF_LOOKS}


def check_every_position(drawn: DrawnString, found: Adjusted) -> None:
    told = by_name(position_shares(found, drawn.run.causes))
    for station in range(len(found.path.md)):
        one_by_one = by_name(error_budget(found, weights_of(found, station), drawn.run.causes))
        assert told.keys() == one_by_one.keys()
        for name, variances in one_by_one.items():
            size = float(sum(one_by_one.values()).max())
            np.testing.assert_allclose(told[name][station], variances, rtol=1e-7, atol=1e-11 * size, err_msg=str(name))


def test_they_are_those_of_each_position_by_itself(drawn: DrawnString, found: Adjusted) -> None:
    check_every_position(drawn, found)


def test_they_are_so_with_a_blunder_taken_in(drawn: DrawnString) -> None:
    step = Hypothesis(BlunderKind.BIAS_STEPPED, (1,), 6)
    check_every_position(drawn, adjust_with(drawn.looks, drawn.string, drawn.path, drawn.run, [step]).found)


def test_the_path_is_what_a_dense_prior_makes_of_it(drawn: DrawnString, found: Adjusted) -> None:
    """g^T P g with g the covariance of all unknowns with a position, and P of directions and curvatures alone."""
    dense, states = DenseHole(found), 4 * len(found.path.md)
    told = by_name(position_shares(found, drawn.run.causes))
    for station in (1, 4, 10):
        spread = (dense.cov @ dense.functional(weights_of(found, station)))[:states]
        whole = np.einsum("ir,ij,jr->r", spread, dense.prior[:states, :states], spread)
        ours = told[ShareSource.COLLAR, -1][station] + told[ShareSource.PATH, -1][station]
        np.testing.assert_allclose(ours, whole, rtol=1e-4, atol=1e-5 * whole.max())


@pytest.mark.parametrize("count", [10, 40])
def test_what_the_looks_tell_is_the_trace_look_by_look(count: int) -> None:
    """Of forty tubes what is in common is wide enough for the factor that takes the place of an inverse."""
    drawn = draw_string(4, count=count)
    looks = replace(drawn.looks, force=drawn.looks.force + np.eye(3)[drawn.looks.tube % 3] * 1e-3)
    found = adjust_hole(looks, drawn.string, drawn.path)
    free = found.free_parts(np.arange(len(looks)))
    parts = np.einsum("kab,kba->", free, np.linalg.inv(found.linear.weights))
    assert found.redundancy == pytest.approx(parts, rel=1e-9)


def test_a_wide_solution_is_that_of_a_general_inverse() -> None:
    drawn = draw_string(4, count=40)
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    inverse = np.linalg.inv(found.solution.in_common.information)
    scale = np.sqrt(np.outer(np.diag(inverse), np.diag(inverse)))
    np.testing.assert_allclose(found.common_cov / scale, inverse / scale, atol=1e-7)
    np.testing.assert_allclose(found.solution.common / np.sqrt(np.diag(inverse)), 0.0, atol=0.1)  # the last step
