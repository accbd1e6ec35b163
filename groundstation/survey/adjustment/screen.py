"""A quick look whether anything is wrong with a hole at all, so that a hole that fits costs nearly nothing.

Each look alone, each tube from each stop on, each chain of tubes below a joint from each stop on, and each tube and
the collar against what was known of them before. In a hole of many stops only the latest, which no earlier screen has
seen, and each tube for itself. Source: Baarda's data snooping, by sums from the end.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.collar import collar_departure
from groundstation.survey.adjustment.equations import string_departure, turn_places
from groundstation.survey.adjustment.hypotheses import turns_of_drift
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right
from groundstation.survey.adjustment.looks import BIAS, OF_TUBE, TILT
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.scores import UNTOLD, best_sizes, log_chances

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
SUSPICIOUS = 0.05  # chance that an honest hole is looked into more closely at a stop
PLAY_TOO_LARGE = 10.0  # times the variance that was told
LATEST = 16  # stops
LEAST_TOLD = 1e-6  # part of a variance
MOST_WHOLE = 150  # looks up to which the screen is exact
MOST_TOLD = 3  # degrees of freedom of a test


def is_suspicious(found: Adjusted, run: RunOfStops) -> bool:
    """Whether a hole is worth asking what is wrong with it; where tubes seem to lie far more askew than told, it is."""
    too_large = found.now.play_var > PLAY_TOO_LARGE * found.string.play_std**2
    return bool(too_large or least_chance(found, run) < math.log(SUSPICIOUS))


def least_chance(found: Adjusted, run: RunOfStops) -> float:
    """Logarithm of the chance, at most, that an honest hole has any test as unlikely as the worst here."""
    is_whole = len(found.looks) <= MOST_WHOLE
    tests = [against_prior(found), *(whole_tests(found, run) if is_whole else late_tests(found))]
    left, redundancy = (found.squares, found.redundancy) if is_whole else (1e9, 1e9)
    squares, told = (np.concatenate(some) for some in zip(*tests, strict=True))
    # of as many degrees of freedom the largest square has the least chance
    freedoms = np.arange(MOST_TOLD + 1)
    largest = np.max(np.where(told == freedoms[:, None], squares, 0.0), axis=1)
    chances = log_chances(largest, freedoms, left, redundancy)
    return min(collar_departure(found).log_chance(), float(np.min(chances))) + math.log(1 + len(squares))


def against_prior(found: Adjusted) -> tuple[Array, Places]:
    """Squares, each of one degree of freedom, of bias, tilt and turns against what was known of them."""
    string, width = found.string, found.string.width
    off = string_departure(string, found.now)[:width] + found.solution.common[:width]
    stds = np.ones((string.count, OF_TUBE))
    stds[:, BIAS], stds[:, TILT] = string.bias_std[:, None], string.tilt_std[:, None]
    before = np.ones(width)
    before[: stds.size], before[stds.size] = stds.ravel() ** 2, string.gravity_std**2
    before[turn_places(string)] = np.diag(string.turn_cov)
    free = before - found.common_vars[:width]
    is_told = free > LEAST_TOLD * before
    return np.where(is_told, off * off / np.where(is_told, free, 1.0), 0.0), is_told.astype(np.intp)


def whole_tests(found: Adjusted, run: RunOfStops) -> list[tuple[Array, Places]]:
    """Squares and their degrees of freedom of every look, every tube and every chain of tubes from a stop on."""
    weights = found.linear.weights
    white = white_looks(found)
    pulled = np.einsum("kab,kb->ka", weights, found.left)
    order, ends = _from_the_end(found.looks.tube, found.looks.stop)
    alike = [np.concatenate([part, _sums(part[order], ends)]) for part in (pulled, weights, white)]
    return [squares_of(*alike), *_turn_and_depth_tests(found, run, pulled, white), _moved_test(found, pulled, white)]


def white_looks(found: Adjusted) -> Array:
    """Columns Z (n, d, 3) of every look, of its three axes, with Z_k^T Z_l = W_k A_k Q A_l^T W_l."""
    looks, solution, count = found.looks, found.solution, len(found.looks)
    rows, of_string = np.arange(count), OF_TUBE * found.string.count
    pulled = np.swapaxes(found.linear.jacobians, 1, 2) @ found.linear.weights
    of_path = np.zeros((len(solution.diagonal), 4, count, 3))
    of_path[looks.station, :2, rows] = pulled[:, :2]
    in_common = np.zeros((len(found.known), count, 3))
    own = in_common[:of_string].reshape(-1, OF_TUBE, count, 3)
    own[looks.tube, :, rows] = pulled[:, 2:8]
    in_common[of_string] = pulled[:, 8]
    in_common[of_string + 1 + looks.make_up, rows] = pulled[:, 7]
    in_common[found.string.width :] = np.swapaxes(np.swapaxes(found.extra.columns, 1, 2) @ found.linear.weights, 0, 1)
    right = of_path.reshape(len(of_path), 4, -1)
    reduce_right(solution.diagonal, solution.tied, right)
    flat = right.reshape(-1, 3 * count)
    left = in_common.reshape(-1, 3 * count) - solution.coupled.reshape(len(flat), -1).T @ flat
    white = np.concatenate([flat, found.common_root.T @ left])
    return np.moveaxis(white.reshape(-1, count, 3), 1, 0).copy()


def squares_of(pulled: Array, whole: Array, white: Array) -> tuple[Array, Places]:
    """Squares T (h,) and their degrees of freedom, of what tests pull (h, q), weigh (h, q, q) and share (h, d, q)."""
    if pulled.shape[1] == 1:
        free = whole[:, 0, 0] - np.einsum("hdq,hdq->h", white, white)
        is_told = free > UNTOLD * np.maximum(whole[:, 0, 0], 1e-300)
        return np.where(is_told, pulled[:, 0] ** 2 / np.where(is_told, free, 1.0), 0.0), is_told.astype(np.intp)
    _, _, told, squares = best_sizes(pulled, whole, whole - np.swapaxes(white, 1, 2) @ white)
    return squares, told


def _turn_and_depth_tests(found: Adjusted, run: RunOfStops, pulled: Array, white: Array) -> list[tuple[Array, Places]]:
    """Of every cause of turns and of the encoder from every stop on and an encoder that drifts, and of the depth."""
    looks, jacobians = found.looks, found.linear.jacobians
    stops = np.unique(looks.stop)[:, None]
    since = looks.stop >= stops
    turned = np.concatenate([run.causes.turned_looks(looks), np.ones((1, len(looks)))])
    from_stops = (turned[:, None] * since).reshape(-1, len(looks))
    turns = np.concatenate([from_stops, turns_of_drift(looks)[None]])
    along = np.einsum("kab,kb->ka", jacobians[:, :, :2], found.now.curvatures[looks.station])[:, :, None]
    depths = np.concatenate([since, looks.stop == stops]).astype(np.float64)
    pairs = ((turns, jacobians[:, :, 7:8]), (depths, along))
    return [_masked_test(found, pulled, white, masks, columns) for masks, columns in pairs]


def _moved_test(found: Adjusted, pulled: Array, white: Array) -> tuple[Array, Places]:
    """Of two neighbouring stations from every stop on."""
    looks = found.looks
    pairs = np.arange(1, max(2, len(found.path.md) - 1))[:, None]
    near = (looks.station == pairs) | (looks.station == pairs + 1)
    moved = ((looks.stop >= np.unique(looks.stop)[:, None])[:, None] & near).reshape(-1, len(looks))
    return _masked_test(found, pulled, white, moved.astype(np.float64), found.linear.jacobians[:, :, :2])


def _masked_test(found: Adjusted, pulled: Array, white: Array, masks: Array, columns: Array) -> tuple[Array, Places]:
    """Of columns (n, 3, q) of the looks, as much of each as a mask (h, n) says."""
    count, width = len(masks), columns.shape[2]
    whole = np.swapaxes(columns, 1, 2) @ found.linear.weights @ columns
    score = (pulled[:, None] @ columns)[:, 0]
    shared = masks @ (white @ columns).reshape(len(columns), -1)
    weighed = (masks * masks) @ whole.reshape(len(columns), -1)
    return squares_of(masks @ score, weighed.reshape(count, width, width), shared.reshape(count, -1, width))


def late_tests(found: Adjusted) -> list[tuple[Array, Places]]:
    """The same of looks and tubes at the latest stops, as if all else were known, which finds a little less."""
    looks = found.looks
    rows = np.flatnonzero(looks.stop > looks.stop.max() - LATEST)
    weights = found.linear.weights[rows]
    left = found.left_of(rows)
    pulled = np.einsum("kab,kb->ka", weights, left)
    order, ends = _from_the_end(looks.tube[rows], looks.stop[rows])
    told = np.full(len(rows), 3)
    sums, whole = _sums(pulled[order], ends), _sums(weights[order], ends)
    of_sums = np.einsum("ka,ka->k", sums, np.linalg.solve(whole, sums[:, :, None])[:, :, 0])
    return [(np.einsum("ka,ka->k", pulled, left), told), (of_sums, told)]


def _from_the_end(tube: Places, stop: Places) -> tuple[Places, Places]:
    """Order of looks tube by tube, the latest first, and for each the place of the first of its tube in that order."""
    order = np.lexsort((-stop, tube))
    sorted_tubes = tube[order]
    return order, np.searchsorted(sorted_tubes, sorted_tubes)


def _sums(parts: Array, starts: Places) -> Array:
    """Sums (n, ...) from the first of each tube on."""
    total = np.cumsum(parts, axis=0)
    return np.asarray(total - (total - parts)[starts])
