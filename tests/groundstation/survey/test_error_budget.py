"""Budget, reliability and the angle of the next stop, against dense matrices, sampling and a linear sketch."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from dense_hole import DenseHole
from drawn_strings import DEG, MG, DrawnString, draw_string
from scipy.stats import chi2, ncx2

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunders import chance_of_one
from groundstation.survey.adjustment.budget import ShareSource, error_budget, toe_budget
from groundstation.survey.adjustment.hypotheses import Hypothesis, all_hypotheses
from groundstation.survey.adjustment.looks import Looks
from groundstation.survey.adjustment.next_stop import plan_stop
from groundstation.survey.adjustment.reliability import Reliability, least_noncentrality, measure_reliability
from groundstation.survey.adjustment.scores import score_hypotheses
from groundstation.survey.adjustment.taken_in import adjust_with
from groundstation.survey.adjustment.toe_weights import leg_weights, toe_weights

Array = npt.NDArray[np.float64]
K = BlunderKind


@pytest.fixture(scope="module")
def drawn() -> DrawnString:
    return draw_string(11)


@pytest.fixture(scope="module")
def found(drawn: DrawnString) -> Adjusted:
    return adjust_hole(drawn.looks, drawn.string, drawn.path)


@pytest.fixture(scope="module")
def dense(found: Adjusted) -> DenseHole:
    return DenseHole(found)


@pytest.fixture(scope="module")
def toe(found: Adjusted, dense: DenseHole) -> Array:
    """Functional (p, 3) of the toe from the lengths of legs, each half above and half below."""
    weights = np.zeros_like(toe_weights(found))
    for leg, length in enumerate(np.diff(found.path.md)):
        for end in (leg, leg + 1):
            weights[end] += 0.5 * length * found.linear.bases[end]
    return dense.functional(weights)


def test_shares_add_up_to_the_variance(drawn: DrawnString, found: Adjusted) -> None:
    weights = np.random.default_rng(1).normal(size=(11, 2, 4))
    states, _ = found.cofactor(weights, np.zeros((len(found.common_cov), 4)))
    whole = np.einsum("kar,kar->r", states[:, :2], weights)
    shares = error_budget(found, weights, drawn.run.causes)
    np.testing.assert_allclose(sum(one.variances for one in shares), whole, rtol=1e-10)
    assert all(np.all(one.variances >= -1e-12 * whole) for one in shares)


def test_shares_add_up_with_a_blunder_taken_in_and_looks_that_count_less(drawn: DrawnString) -> None:
    force = drawn.looks.force.copy()
    force[20] += 0.5
    force[(drawn.looks.tube == 1) & (drawn.looks.stop > 5)] += 0.05
    looks = replace(drawn.looks, force=force)
    step = Hypothesis(K.BIAS_STEPPED, (1,), 6)
    found = adjust_with(looks, drawn.string, drawn.path, drawn.run, [step]).found
    assert np.max(found.linear.squares) > 16.27
    states, _ = found.cofactor(toe_weights(found), np.zeros((len(found.common_cov), 3)))
    whole = np.einsum("kar,kar->r", states[:, :2], toe_weights(found))
    shares = toe_budget(found, drawn.run.causes)
    np.testing.assert_allclose(sum(one.variances for one in shares), whole, rtol=1e-10)
    assert sum(one.source is ShareSource.BLUNDER for one in shares) == 3


def test_shares_are_those_of_the_dense_estimator(
    drawn: DrawnString, found: Adjusted, dense: DenseHole, toe: Array
) -> None:
    gain = dense.cov @ dense.A.T @ dense.W
    by_prior = dense.cov @ dense.prior
    states = dense.states
    expected: dict[tuple[str, int], Array] = {
        ("force_noise", -1): variances(toe.T @ gain, dense.by_source["force"]),
        ("play", -1): variances(toe.T @ gain, dense.by_source["play"]),
        ("yaw_noise", -1): variances(toe.T @ gain, dense.by_source["yaw"]),
        ("gravity", -1): variances((toe.T @ by_prior)[:, [dense.gravity_at]], np.eye(1) * found.string.gravity_std**2),
    }
    for tube in range(10):
        at = states + 6 * tube
        rows = toe.T @ by_prior
        expected["bias", tube] = variances(rows[:, at : at + 3], np.eye(3) * found.string.bias_std[tube] ** 2)
        expected["tilt", tube] = variances(rows[:, at + 3 : at + 5], np.eye(2) * found.string.tilt_std[tube] ** 2)
    turned = toe.T @ by_prior[:, dense.turns]
    for place, (kind, subject) in enumerate(drawn.run.causes.names):
        # what a cause does to tubes and make-ups, told anew
        tubes, tops = np.arange(10), np.arange(10)
        if kind == "joint":
            column = np.concatenate([np.where(tubes > subject, -1.0, 0.0), np.where(tops > subject, 1.0, 0.0)])
        else:
            column = np.concatenate([np.where((tubes == subject) | (kind == "north"), 1.0, 0.0), np.zeros(10)])
        std = {"joint": 0.1, "mount": 0.02, "north": 0.1}[kind] * DEG
        expected["turn", place] = (turned @ column * std) ** 2
    collar = np.linalg.inv(dense.prior[:2, :2] - walk_information(dense))
    expected["collar", -1] = variances(toe.T @ dense.cov[:, :2] @ np.linalg.inv(collar), collar)
    shares = {(one.source.value, one.subject): one.variances for one in toe_budget(found, drawn.run.causes)}
    whole = variances(toe.T, dense.cov)
    for name, value in expected.items():
        np.testing.assert_allclose(shares[name], value, rtol=0.01, atol=1e-4 * whole.max(), err_msg=str(name))


def variances(rows: Array, cov: Array) -> Array:
    return np.asarray(np.einsum("ra,ab,rb->r", rows, cov, rows))


def walk_information(dense: DenseHole) -> Array:
    """What the first step of the path says (2, 2) of the direction at the collar, were all below known."""
    known = dense.found.path.collar_cov
    basis = dense.found.linear.bases[0]
    return np.asarray(dense.prior[:2, :2] - np.linalg.inv(basis @ known @ basis.T + 1e-16 * np.eye(2)))


def test_leg_weights_add_up_to_the_length_of_the_hole() -> None:
    assert leg_weights(np.array([0.0, 2.0, 5.0, 5.5])) == pytest.approx([1.0, 2.5, 1.75, 0.25])


@pytest.mark.parametrize("width", [1, 2, 3])
@pytest.mark.parametrize(("chance", "power"), [(1e-3, 0.8), (1e-8, 0.8), (0.05, 0.5)])
def test_noncentrality_gives_the_power(width: int, chance: float, power: float) -> None:
    needed = least_noncentrality(width, chance, power)
    assert ncx2.sf(chi2.isf(chance, width), width, needed) == pytest.approx(power, abs=1e-6)
    assert width > 1 or chance < 1e-3 or chance > 1e-2 or needed == pytest.approx(17.07, abs=0.01)


def test_reliability_is_that_of_dense_matrices(
    drawn: DrawnString, found: Adjusted, dense: DenseHole, toe: Array
) -> None:
    for tube, stop in ((0, 4), (3, 8), (5, 7), (8, 9)):
        one = Hypothesis(K.BIAS_STEPPED, (tube,), stop)
        (told,) = measure_reliability(found, drawn.run, [one], toe_weights(found), {})
        columns = (
            np.tile(np.eye(3), (55, 1, 1)) * ((drawn.looks.tube == tube) & (drawn.looks.stop >= stop))[:, None, None]
        )
        flat = columns.reshape(165, 3)
        free = flat.T @ dense.free @ flat
        least = np.linalg.eigvalsh(free)[0]
        assert told.smallest == pytest.approx(np.sqrt(21.545 / least), rel=2e-3)
        effect = toe.T @ dense.cov @ dense.A.T @ dense.W @ flat
        worst = np.sqrt(21.545 * np.einsum("ra,ab,rb->r", effect, np.linalg.inv(free), effect))
        np.testing.assert_allclose(told.at_toe, worst, rtol=0.01, atol=1e-6)


def test_a_step_of_the_least_size_is_found_with_the_stated_power(drawn: DrawnString, found: Adjusted) -> None:
    """The test statistic of one hypothesis over draws of noise in the linear equations."""
    one = Hypothesis(K.JOINT_SLIPPED, (3,), 7)
    (told,) = measure_reliability(found, drawn.run, [one], toe_weights(found), {})
    score = score_hypotheses(found, drawn.run, [one])[0]
    information = float(score.free[0, 0, 0])
    draws = np.random.default_rng(2).normal(size=20_000) + told.smallest * np.sqrt(information)
    assert np.mean(draws**2 > 10.828) == pytest.approx(0.8, abs=0.015)


def test_where_nothing_can_tell_it_says_so() -> None:
    """One tube that never meets another: no step of its bias can be told but by the path."""
    drawn = draw_string(12)
    alone = drawn.looks.tube == 0
    looks = replace(drawn.looks, **{n: getattr(drawn.looks, n)[alone] for n in Looks.__dataclass_fields__})
    path = replace(drawn.path, curvature_std=1.0)
    found = adjust_hole(looks, drawn.string, path)
    one = Hypothesis(K.LOOK_WRONG, (0,), 9)
    weights = toe_weights(found)
    (told,) = measure_reliability(found, drawn.run, [one], weights, {K.LOOK_WRONG: 5.0 * MG})
    assert told.smallest > 20.0 * measured_with_ten(drawn, one).smallest
    dense = DenseHole(found)
    effect = dense.functional(weights).T @ dense.cov @ dense.A.T @ dense.W[:, -3:]
    np.testing.assert_allclose(told.by_size, 5.0 * MG * np.linalg.norm(effect, axis=1), rtol=0.02)
    assert np.all(told.unfound <= told.by_size)


def measured_with_ten(drawn: DrawnString, one: Hypothesis) -> Reliability:
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    middle = replace(one, subject=(3,), stop=7)
    return measure_reliability(found, drawn.run, [middle], toe_weights(found), {})[0]


def test_a_turn_of_all_tubes_at_one_stop_is_infinite() -> None:
    """At the first stop nothing stands against a slip of the depth."""
    drawn = draw_string(13)
    first = drawn.looks.stop == 0
    looks = replace(drawn.looks, **{n: getattr(drawn.looks, n)[first] for n in Looks.__dataclass_fields__})
    path = replace(drawn.path, md=drawn.path.md[:2])
    found = adjust_hole(looks, drawn.string, path)
    run = replace(drawn.run, station_md=path.md)
    vast = Hypothesis(K.TUBES_EXCHANGED, (0, 1))
    (told,) = measure_reliability(found, run, [vast], toe_weights(found), {})
    assert told.smallest == np.inf
    assert np.all(told.at_toe == np.inf)


def test_free_faces_find_a_step_far_below_the_same_faces() -> None:
    """The sketch of the issue: a step of one accelerometer is told from some tenths of a milli-g on."""
    steps = []
    for same in (False, True):
        drawn = draw_string(14, same_faces=same, play_deg=0.001, tilt_deg=0.001)
        found = adjust_hole(drawn.looks, drawn.string, drawn.path)
        some = [one for one in all_hypotheses(drawn.looks, drawn.run) if one.kind is K.BIAS_STEPPED]
        told = measure_reliability(found, drawn.run, some, toe_weights(found), {})
        steps.append(np.median([one.smallest for one in told]) / MG)
    assert 0.1 < steps[0] < 0.3
    assert steps[0] <= steps[1]


def test_the_level_of_one_is_a_share_of_a_whole_hole(drawn: DrawnString) -> None:
    count = len(list(all_hypotheses(drawn.looks, drawn.run))) + 1  # of the collar
    assert chance_of_one(drawn.looks, drawn.run) == pytest.approx(1e-3 / (10 * 11 * count))


@pytest.mark.parametrize("same", [True, False])
def test_the_next_stop_is_that_of_dense_matrices(same: bool) -> None:
    drawn = draw_string(15, tilt_deg=0.5, same_faces=same)
    found = adjust_hole(drawn.looks, drawn.string, drawn.path)
    planned = plan_stop(found, 2.0, 12)
    md = np.append(drawn.path.md, drawn.path.md[-1] + 2.0)
    for place in (0, 2, 6, 9):
        dense = DenseHole(found, looks_after(drawn.looks, float(planned.angles[place])), md)
        weights = np.zeros((12, 2, 3))
        bases = np.concatenate([found.linear.bases, found.linear.bases[-1:]])
        weights[:] = leg_weights(md)[:, None, None] * bases
        weighed = dense.functional(weights)
        toe_var = float(np.trace(weighed.T @ dense.cov @ weighed))
        assert planned.toe_stds[place] == pytest.approx(np.sqrt(toe_var), rel=2e-3)


def looks_after(looks: Looks, angle: float) -> Looks:
    """The looks, and those of a stop one station deeper with all faces turned."""
    last = np.flatnonzero(looks.stop == looks.stop.max())
    more = {n: getattr(looks, n)[last] for n in Looks.__dataclass_fields__}
    more |= {"station": more["station"] + 1, "stop": more["stop"] + 1, "yaw": more["yaw"] + angle}
    return Looks(**{n: np.concatenate([getattr(looks, n), more[n]]) for n in Looks.__dataclass_fields__})


def test_a_crew_that_never_turns_is_told_to_turn() -> None:
    drawn = draw_string(16, tilt_deg=0.5, same_faces=True)
    planned = plan_stop(adjust_hole(drawn.looks, drawn.string, drawn.path), 2.0)
    assert 90.0 <= planned.best / DEG <= 270.0
    assert planned.worth > 0.02
    assert planned.worth == pytest.approx(planned.toe_stds[0] - planned.toe_stds.min())
