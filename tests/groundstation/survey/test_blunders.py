"""What is wrong with a hole: scores against dense matrices, drawn blunders named, honest holes left in peace."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
import numpy.typing as npt
import pytest
from blame_table import examined, examined_as_it_grows, toe_departure, verdict
from dense_hole import DenseHole, walk
from drawn_strings import DEG, MG, SIZES, DrawnString, draw_string
from scipy.stats import f as f_distribution

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.blunder_words import SENTENCES, say_blunder
from groundstation.survey.adjustment.blunders import examine_hole, find_blunder, is_plausible
from groundstation.survey.adjustment.hypotheses import (
    OF_FORCE,
    Hypothesis,
    all_hypotheses,
    effect_amplitudes,
    thinned_stops,
)
from groundstation.survey.adjustment.play import told_by_all
from groundstation.survey.adjustment.scores import log_tail, score_hypotheses
from groundstation.survey.adjustment.screen import is_suspicious
from groundstation.survey.adjustment.taken_in import TakenIn, adjust_with, deviance_of

Array = npt.NDArray[np.float64]
K = BlunderKind
IN_LOOKS = [kind for kind in K if kind is not K.COLLAR_WRONG]
NAMES = [str(tube + 1) for tube in range(10)]


@pytest.fixture(scope="module")
def honest() -> DrawnString:
    return draw_string(7)


@pytest.mark.parametrize(
    "kind", [k for k in IN_LOOKS if k not in (K.TUBES_EXCHANGED, K.DEPTH_WRONG_ONCE, K.DEPTH_WRONG_FROM)]
)
def test_a_score_is_that_of_dense_matrices(honest: DrawnString, kind: BlunderKind) -> None:
    looks = honest.looks
    found = adjust_hole(looks, honest.string, honest.path)
    dense = DenseHole(found)
    of_kind = [one for one in all_hypotheses(looks, honest.run) if one.kind is kind]
    pulled = dense.W @ found.left.ravel()
    scores = score_hypotheses(found, honest.run, of_kind)[0]
    for place in range(0, len(of_kind), max(1, len(of_kind) // 5)):
        one = scores.hypotheses[place]
        columns = dense_effect(one, dense, honest)
        free = columns.T @ dense.free @ columns
        np.testing.assert_allclose(scores.free[place], free, rtol=2e-3, atol=2e-3 * np.max(np.abs(free)))
        t = columns.T @ pulled
        assert scores.squares[place] == pytest.approx(t @ np.linalg.solve(free, t), rel=0.02, abs=0.02)


def test_what_all_looks_tell_is_that_of_dense_matrices(honest: DrawnString) -> None:
    """The trace of any weights times J Q J^T, look by look, as the play is learnt with."""
    found = adjust_hole(honest.looks, honest.string, honest.path)
    dense, lot = DenseHole(found), np.random.default_rng(3)
    roots = lot.normal(size=(len(honest.looks), 3, 3))
    weights = roots @ np.swapaxes(roots, 1, 2)
    told = dense.A @ dense.cov @ dense.A.T
    by_look = [told[3 * k : 3 * k + 3, 3 * k : 3 * k + 3] for k in range(len(honest.looks))]
    expected = sum(float(np.trace(weight @ part)) for weight, part in zip(weights, by_look, strict=True))
    assert told_by_all(found, weights) == pytest.approx(expected, rel=2e-3)


def dense_effect(one: Hypothesis, dense: DenseHole, drawn: DrawnString) -> Array:
    """Columns (3 n, q) of a hypothesis from the design matrix, and of turns by who is below the joint."""
    looks, rows = drawn.looks, dense.A.reshape(len(drawn.looks), 3, -1)
    touched = looks.stop >= one.stop
    tube = one.subject[0] if one.subject else -1
    if one.kind is K.HOLE_MOVED:
        touched = ~touched & (looks.station >= one.subject[0]) & (looks.station <= one.subject[1])
        columns = np.stack([rows[k, :, 4 * s : 4 * s + 2] for k, s in enumerate(looks.station)])
    elif one.kind in (K.JOINT_SLIPPED, K.JOINT_MISREAD):
        touched &= (looks.tube <= tube) & (looks.stop > tube)
        columns = rows[:, :, dense.gravity_at + 1 :].sum(axis=2, keepdims=True)
    elif one.kind is K.ENCODER_DRIFTS:
        columns = rows[:, :, dense.gravity_at + 1 :].sum(axis=2, keepdims=True) * looks.stop[:, None, None]
    elif one.kind is K.ENCODER_SLIPPED:
        columns = rows[:, :, dense.gravity_at + 1 :].sum(axis=2, keepdims=True)
    else:
        touched &= looks.tube == tube
        if one.kind is K.LOOK_WRONG:
            touched &= looks.stop == one.stop
        at = dense.states + 6 * tube
        if one.kind in (K.TILT_SLIPPED, K.TILT_WRONG):
            columns = rows[:, :, at + 3 : at + 5]
        elif one.kind in (K.MOUNT_TURNED, K.MOUNT_MISREAD):
            columns = rows[:, :, at + 5 : at + 6]
        elif one.kind is K.AXES_EXCHANGED:
            columns = (looks.force @ (np.eye(3) - np.eye(3)[[1, 0, 2]]))[:, :, None]
        else:
            columns = np.tile(np.eye(3), (len(looks), 1, 1))
    hours = 3600.0 * (looks.stop - one.stop) if one.kind is K.BIAS_CREEPS else np.ones(len(looks))
    return np.asarray((columns * (touched * hours)[:, None, None]).reshape(3 * len(looks), -1))


def test_the_likelihood_is_that_of_dense_matrices(honest: DrawnString) -> None:
    found = adjust_hole(honest.looks, honest.string, honest.path)
    dense, now = DenseHole(found), found.now
    sizes = [np.linalg.slogdet(one)[1] for one in (np.linalg.inv(dense.cov), dense.prior, dense.W)]
    # how far the unknowns stand off what was known of them; the path by the bends between its stations
    off = np.zeros(dense.width)
    off[dense.states :] = np.concatenate([now.tubes.ravel(), [now.gravity - 9.81], now.make_ups])
    squares = found.left.ravel() @ dense.W @ found.left.ravel()
    squares += off[dense.states :] @ dense.prior[dense.states :, dense.states :] @ off[dense.states :]
    across = found.linear.bases
    collar = across[0] @ (now.tangents[0] - honest.path.collar)
    squares += collar @ collar / (0.5 * DEG) ** 2 + np.sum(now.curvatures[0] ** 2) / now.curvature_var
    for k in range(10):
        go, spread = walk(2.0, 20.0, now.leg_vars[k] ** 0.5)
        bend = across[k] @ (now.tangents[k + 1] - now.tangents[k])
        step = np.stack([bend, now.curvatures[k + 1]]) - go @ np.stack([np.zeros(2), now.curvatures[k]])
        squares += np.trace(step.T @ np.linalg.solve(spread, step))
    play = 4.0 * (np.log(now.play_var) + (0.01 * DEG) ** 2 / now.play_var)
    hole, legs = now.curvature_var, now.leg_vars
    bends = 4.0 * np.sum(np.log(legs / hole) + hole / legs - 1.0) + 6.0 * (np.log(hole) + (0.15 * DEG) ** 2 / hole)
    assert deviance_of(found) == pytest.approx(squares + sizes[0] - sizes[1] - sizes[2] + play + bends, abs=0.1)


def test_scores_of_honest_holes_are_chi_square() -> None:
    squares: dict[BlunderKind, list[float]] = {}
    for seed in range(12):
        drawn = draw_string(100 + seed)
        found = adjust_hole(drawn.looks, drawn.string, drawn.path)
        for score in score_hypotheses(found, drawn.run, all_hypotheses(drawn.looks, drawn.run)):
            for one, square, told in zip(score.hypotheses, score.squares, score.told, strict=True):
                squares.setdefault(one.kind, []).append(square / max(told, 1))
    assert set(squares) == set(IN_LOOKS)
    for kind, found_squares in squares.items():
        assert 0.4 < np.mean(found_squares) < 1.8, kind


@pytest.mark.slow
@pytest.mark.parametrize("kind", SIZES)
def test_a_blunder_is_named_or_told_as_a_doubt(kind: str) -> None:
    size = SIZES[kind][min(1, len(SIZES[kind]) - 1)]
    found = [(verdict(examined(drawn), kind, drawn), drawn) for drawn in (draw_string(s, kind, size) for s in range(3))]
    assert {one for one, _ in found} <= {"named", "doubt"}


@pytest.mark.slow
@pytest.mark.parametrize("kind", ["bias_stepped", "joint_misread", "axes_exchanged", "hole_moved", "look_wrong"])
def test_the_toe_is_honest_once_a_gross_blunder_is_taken_in(kind: str) -> None:
    drawn = [draw_string(seed, kind, SIZES[kind][-1]) for seed in range(4)]
    squares = [toe_departure(examined(one), one) for one in drawn]
    assert sum(squares) < 26.12  # one in a thousand of chi-square with 8 degrees of freedom


def test_a_step_is_told_with_its_size_and_from_which_stop_on() -> None:
    drawn = draw_string(3, "bias_stepped", 17.0)
    found = examined(drawn)
    (one,) = found.blunders
    assert one.best.hypothesis == Hypothesis(K.BIAS_STEPPED, (drawn.tube,), drawn.onset)
    size = float(np.linalg.norm(one.best.size))
    assert size == pytest.approx(17.0 * MG, abs=4.0 * np.sqrt(np.max(np.diag(one.best.cov))))
    assert one.before > one.after
    text = say_blunder(one, drawn.run, NAMES)
    depth = 2.0 * (drawn.onset + 1)
    assert text.startswith(f"accelerometer of tube {drawn.tube + 1} steps by ")
    assert text.endswith(f" mg from the stop at {depth:.1f} m on")
    assert float(text.split(" by ")[1].split()[0]) == pytest.approx(17.0, abs=1.0)


def test_a_look_that_may_be_the_first_of_a_step_is_a_doubt() -> None:
    drawn = draw_string(4)
    force = drawn.looks.force.copy()
    force[(drawn.looks.tube == 3) & (drawn.looks.stop == 9), 0] += 10.0 * MG
    found = examined(replace(drawn, looks=replace(drawn.looks, force=force)))
    (one,) = found.blunders
    assert one.is_doubt
    assert one.second is not None
    assert {K.LOOK_WRONG, K.BIAS_STEPPED} & {one.best.hypothesis.kind, one.second.hypothesis.kind}
    assert " or " in say_blunder(one, drawn.run, NAMES)
    assert len(one.taken_in) == 2


@pytest.mark.slow
@pytest.mark.parametrize("begins_deg", [0.0, 30.0, 60.0, 88.0, 120.0, 150.0, 176.6, 178.3])
def test_one_gross_look_among_four_is_named_and_left_out_at_every_inclination(begins_deg: float) -> None:
    """Four tubes read the seventh station, and one of them 12 mg off, which is 0.7 deg; the last holes pass the zenith.

    Nothing else is blamed, and the direction there is as far off as it says.
    """
    squares = 0.0
    for seed in range(3):
        drawn = draw_string(seed, begins_deg=begins_deg)
        wrong = (drawn.looks.station == 7) & (drawn.looks.tube == 1)
        assert np.count_nonzero(drawn.looks.station == 7) == 4
        way = np.random.default_rng([seed, 77]).normal(size=3)
        force = drawn.looks.force + np.outer(wrong, 12.0 * MG * way / np.linalg.norm(way))
        found = examined(replace(drawn, looks=replace(drawn.looks, force=force)))
        (one,) = found.blunders
        assert not one.is_doubt
        assert one.best.hypothesis == Hypothesis(K.LOOK_WRONG, (1,), 7)
        assert " 16.0 m" in say_blunder(one, drawn.run, NAMES)
        assert float(np.linalg.norm(one.best.size)) == pytest.approx(12.0 * MG, rel=0.2)
        there = found.adjusted
        off = there.linear.bases[7] @ (drawn.tangents[7] - there.now.tangents[7])
        squares += float(off @ np.linalg.solve(there.covs[7, :2, :2], off))
    assert squares < 22.46  # one in a thousand of chi-square with six degrees of freedom


@pytest.mark.slow
def test_a_suspicion_is_not_told_moves_no_direction_and_stands_in_the_covariance() -> None:
    """The encoder slips by 6 deg at the third stop, where the hole hardly leans: hardly anything shows it."""
    drawn = draw_string(39, "encoder_slipped", 6.0)
    found = examined(drawn)
    assert drawn.onset == 2
    assert found.blunders == ()
    assert found.suspicion is not None
    assert found.suspicion.best.hypothesis == Hypothesis(K.ENCODER_SLIPPED, (), 2)
    plain = adjust_hole(drawn.looks, drawn.string, drawn.path)
    np.testing.assert_allclose(found.adjusted.now.tangents, plain.now.tangents, atol=1e-5)
    assert found.supposed is not None
    turned = found.supposed.now.tangents - found.adjusted.now.tangents
    np.testing.assert_allclose(np.linalg.norm(found.suspected, axis=1), np.linalg.norm(turned, axis=1), rtol=1e-3)
    assert np.linalg.norm(turned, axis=1).max() > 2.0 * np.sqrt(np.trace(plain.covs[-1, :2, :2]))
    assert toe_departure(found, drawn) < 13.8  # one in a thousand of chi-square with two degrees of freedom


@pytest.mark.parametrize("seed", [157, 184])
def test_what_explains_no_more_than_chance_is_no_suspicion_however_many_stops_there_were(seed: int) -> None:
    """Honest strings that the screen asks more of: one hypothesis of some hundreds gains by chance."""
    drawn = draw_string(seed)
    plain = adjust_hole(drawn.looks, drawn.string, drawn.path)
    assert is_suspicious(plain, drawn.run)
    found = examined(drawn)
    assert (found.blunders, found.suspicion, found.supposed) == ((), None, None)
    np.testing.assert_array_equal(found.suspected, 0.0)
    best = find_blunder(drawn.looks, drawn.string, drawn.path, drawn.run, adjust_with_nothing(drawn))
    assert best is not None
    assert best.best.log_chance > 0.0  # more than one honest hole in one shows as much


def adjust_with_nothing(drawn: DrawnString) -> TakenIn:
    return adjust_with(drawn.looks, drawn.string, drawn.path, drawn.run, ())


def test_two_blunders_are_found_one_after_another() -> None:
    drawn = draw_string(5, "bias_stepped", 17.0)
    yaw = drawn.looks.yaw + np.where(drawn.looks.stop >= 7, 7.2 * DEG, 0.0)
    found = examined(replace(drawn, looks=replace(drawn.looks, yaw=yaw)))
    kinds = {one.best.hypothesis.kind for one in found.blunders}
    assert kinds == {K.BIAS_STEPPED, K.ENCODER_SLIPPED}


def test_a_blunder_that_is_known_is_taken_in_and_not_found_again() -> None:
    drawn = draw_string(6, "encoder_slipped", 7.2)
    first = examined(drawn)
    again = examine_hole(drawn.looks, drawn.string, drawn.path, drawn.run, first.blunders, first.adjusted.now)
    assert [one.best.hypothesis for one in again.blunders] == [one.best.hypothesis for one in first.blunders]
    np.testing.assert_allclose(again.adjusted.now.tangents, first.adjusted.now.tangents, atol=1e-6)


def test_without_a_blunder_it_is_the_plain_adjustment(honest: DrawnString) -> None:
    plain = adjust_hole(honest.looks, honest.string, honest.path)
    taken = adjust_with(honest.looks, honest.string, honest.path, honest.run, ())
    assert (taken.sizes, taken.covs) == ((), ())
    np.testing.assert_array_equal(taken.found.now.tangents, plain.now.tangents)
    assert not is_suspicious(plain, honest.run)


@pytest.mark.parametrize("deg", [8.0, 60.0, -100.0, 170.0])
def test_a_turn_of_any_size_leaves_the_hole_as_it_was(honest: DrawnString, deg: float) -> None:
    """A turn is not linear: sought until it is found, the hole is that of the same looks without it."""
    check_turn(honest, deg, 6, [])


@pytest.mark.parametrize("deg", [-100.0, 170.0])
@pytest.mark.parametrize("seed", [0, 2])
def test_a_large_turn_beside_a_tilt_is_found_too(deg: float, seed: int) -> None:
    """From no turn on the search ends elsewhere: 38 deg in place of 100, and a play of 0.24 deg hides the rest."""
    drawn = draw_string(seed, "tilt_slipped", 2.0)
    check_turn(drawn, deg, drawn.onset - 1, [Hypothesis(K.TILT_SLIPPED, (drawn.tube,), drawn.onset)])


def check_turn(drawn: DrawnString, deg: float, since: int, beside: list[Hypothesis]) -> None:
    """Looks from a stop on whose yaw turned (deg), beside something else that is sought, leave the hole as without."""
    looks, one = drawn.looks, Hypothesis(K.ENCODER_SLIPPED, (), since)
    yaw = looks.yaw + np.where(looks.stop >= since, deg * DEG, 0.0)
    without, with_it = (
        adjust_with(replace(looks, yaw=y), drawn.string, drawn.path, drawn.run, [one, *beside])
        for y in (looks.yaw, yaw)
    )
    off = (with_it.sizes[0] - without.sizes[0] - deg * DEG + np.pi) % (2.0 * np.pi) - np.pi
    assert abs(off[0]) < 0.1 * np.sqrt(without.covs[0][0, 0])
    moved = (with_it.found.now.tangents - without.found.now.tangents)[:, :2]
    stated = np.sqrt(np.einsum("kaa->k", without.found.covs[:, :2, :2]))
    assert (np.linalg.norm(moved, axis=1) < 0.1 * stated).all()


def test_a_blunder_that_was_put_in_comes_out_linearly(honest: DrawnString) -> None:
    """A step of any size: the hole as without it, and the step as it was put in, by the same noise."""
    looks = honest.looks
    wrong = (looks.tube == 2) & (looks.stop >= 6)
    one = Hypothesis(K.BIAS_STEPPED, (2,), 6)
    step = np.array([0.2, -0.1, 0.3])
    force = looks.force + wrong[:, None] * step
    without, with_it = (
        adjust_with(replace(looks, force=f), honest.string, honest.path, honest.run, [one])
        for f in (looks.force, force)
    )
    np.testing.assert_allclose(with_it.sizes[0] - without.sizes[0], step, atol=2e-4)
    np.testing.assert_allclose(with_it.found.now.tangents, without.found.now.tangents, atol=2e-6)


def test_false_blame_of_honest_holes_that_grow() -> None:
    """At every stop of a few holes; ``blame_table.py`` does a thousand."""
    assert not any(examined_as_it_grows(draw_string(200 + seed)) for seed in range(6))


def test_every_kind_has_a_width_a_sentence_and_a_hypothesis(honest: DrawnString) -> None:
    hypotheses = list(all_hypotheses(honest.looks, honest.run))
    assert len(set(hypotheses)) == len(hypotheses)
    assert {one.kind for one in hypotheses} == set(IN_LOOKS)
    assert set(SENTENCES) == set(BlunderKind)
    assert all(np.any(effect_amplitudes(one, honest.looks, honest.run)) for one in hypotheses)


def test_no_two_hypotheses_of_a_kind_are_one(honest: DrawnString) -> None:
    for kind, some in itertools.groupby(all_hypotheses(honest.looks, honest.run), key=lambda one: one.kind):
        if kind in OF_FORCE:
            rows = [tuple(effect_amplitudes(one, honest.looks, honest.run)) for one in some]
            assert len(set(rows)) == len(rows)


@pytest.mark.parametrize("free", [5.0, 90.0, 1e9])
@pytest.mark.parametrize("width", [1, 2, 3])
def test_the_tail_is_that_of_f_and_goes_on_where_that_ends(width: int, free: float) -> None:
    squares = np.array([0.01, 1.0, 30.0, 500.0])
    told, tails = np.full(4, width), f_distribution.logsf(squares / width, width, free)
    np.testing.assert_allclose(log_tail(squares, told, np.full(4, free)), tails, rtol=1e-4, atol=1e-9)
    far = log_tail(np.array([1e4, 1e19]), told[:2], np.full(2, free))
    assert np.all(np.isfinite(far))
    assert far[1] < far[0] < tails[-1]


@pytest.mark.parametrize("count", [1, 16, 17, 24, 25, 400])
def test_stops_are_thinned_to_the_latest_and_some_before(count: int) -> None:
    kept = thinned_stops(list(range(count)))
    assert kept == sorted(set(kept))
    assert kept[-16:] == list(range(count))[-16:]
    assert len(kept) <= 24


@pytest.mark.parametrize("kind", [BlunderKind.DEPTH_WRONG_ONCE, BlunderKind.DEPTH_WRONG_FROM])
@pytest.mark.parametrize(("size", "is_one"), [(-2.9, True), (2.0, True), (3.1, False), (-15.0, False)])
def test_a_depth_is_off_by_a_tube_and_not_by_half_of_the_hole(kind: BlunderKind, size: float, is_one: bool) -> None:
    """Stations are 2 m apart; one tube too many is 2 m."""
    drawn = draw_string(1)
    assert is_plausible(Hypothesis(kind, (), 3), np.array([size]), drawn.run) is is_one
    assert is_plausible(Hypothesis(BlunderKind.JOINT_MISREAD, (1,)), np.array([size]), drawn.run)
