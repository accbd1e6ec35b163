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
from groundstation.survey.adjustment.looks import BIAS, OF_TUBE, TILT
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.scores import best_sizes, log_chances, whitened_effects

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
SUSPICIOUS = 0.05  # chance that an honest hole is looked into more closely at a stop
PLAY_TOO_LARGE = 10.0  # times the variance that was told
LATEST = 16  # stops
LEAST_TOLD = 1e-6  # part of a variance
MOST_WHOLE = 150  # looks up to which the screen is exact


def is_suspicious(found: Adjusted, run: RunOfStops) -> bool:
    """Whether a hole is worth asking what is wrong with it; where tubes seem to lie far more askew than told, it is."""
    too_large = found.now.play_var > PLAY_TOO_LARGE * found.string.play_std**2
    return bool(too_large or least_chance(found, run) < math.log(SUSPICIOUS))


def least_chance(found: Adjusted, run: RunOfStops) -> float:
    """Logarithm of the chance, at most, that an honest hole has any test as unlikely as the worst here."""
    is_whole = len(found.looks) <= MOST_WHOLE
    tests = [against_prior(found), *(whole_tests(found, run) if is_whole else late_tests(found))]
    left, redundancy = (found.squares, found.redundancy) if is_whole else (1e9, 1e9)
    chances = [log_chances(squares, told, left, redundancy) for squares, told in tests]
    least = min(collar_departure(found).log_chance(), *(float(np.min(some, initial=0.0)) for some in chances))
    return least + math.log(1 + sum(len(some) for some in chances))


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
    count = len(found.looks)
    blocks = np.zeros((count, 3, count, 3))
    blocks[np.arange(count), :, np.arange(count)] = found.linear.weights
    white = np.concatenate(whitened_effects(found, np.arange(count), blocks.reshape(count, 3, -1)))
    white = np.moveaxis(white.reshape(-1, count, 3), 1, 0).copy()
    pulled = np.einsum("kab,kb->ka", found.linear.weights, found.left)
    tests = [_squares(pulled, found.linear.weights, white)]
    order, ends = _from_the_end(found.looks.tube, found.looks.stop)
    sums = [_sums(part[order], ends) for part in (pulled, found.linear.weights, white)]
    return [*tests, _squares(*sums), _turn_test(found, run, pulled, white), *_hole_tests(found, pulled, white)]


def _squares(pulled: Array, whole: Array, white: Array) -> tuple[Array, Places]:
    _, _, told, squares = best_sizes(pulled, whole, whole - np.swapaxes(white, 1, 2) @ white)
    return squares, told


def _turn_test(found: Adjusted, run: RunOfStops, pulled: Array, white: Array) -> tuple[Array, Places]:
    """Of every cause of turns and of the encoder from every stop on, and of an encoder that drifts."""
    looks = found.looks
    since = looks.stop >= np.unique(looks.stop)[:, None]
    turned = np.concatenate([run.causes.turned_looks(looks), np.ones((1, len(looks)))])
    masks = np.concatenate([(turned[:, None] * since).reshape(-1, len(looks)), turns_of_drift(looks)[None]])
    return _masked_test(found, pulled, white, masks, found.linear.jacobians[:, :, 7:8])


def _hole_tests(found: Adjusted, pulled: Array, white: Array) -> list[tuple[Array, Places]]:
    """Of two neighbouring stations from every stop on, and of the depth at and from every stop on."""
    looks, jacobians = found.looks, found.linear.jacobians
    stops = np.unique(looks.stop)
    since = looks.stop >= stops[:, None]
    pairs = np.arange(1, max(2, len(found.path.md) - 1))[:, None]
    near = (looks.station == pairs) | (looks.station == pairs + 1)
    along = np.einsum("kab,kb->ka", jacobians[:, :, :2], found.now.curvatures[looks.station])[:, :, None]
    moved = (since[:, None] & near).reshape(-1, len(looks))
    at_depth = np.concatenate([since, looks.stop == stops[:, None]])
    masks = ((moved, jacobians[:, :, :2]), (at_depth, along))
    return [_masked_test(found, pulled, white, mask.astype(np.float64), columns) for mask, columns in masks]


def _masked_test(found: Adjusted, pulled: Array, white: Array, masks: Array, columns: Array) -> tuple[Array, Places]:
    """Of columns (n, 3, q) of the looks, as much of each as a mask (h, n) says."""
    whole = np.swapaxes(columns, 1, 2) @ found.linear.weights @ columns
    score = np.einsum("ka,kaq->kq", pulled, columns)
    parts = ((masks, score), (masks**2, whole), (masks, white @ columns))
    return _squares(*(np.tensordot(mask, part, axes=1) for mask, part in parts))


def late_tests(found: Adjusted) -> list[tuple[Array, Places]]:
    """The same of looks and tubes at the latest stops, as if all else were known, which finds a little less."""
    looks = found.looks
    rows = np.flatnonzero(looks.stop > looks.stop.max() - LATEST)
    weights = found.linear.weights[rows]
    pulled = np.einsum("kab,kb->ka", weights, found.left_of(rows))
    order, ends = _from_the_end(looks.tube[rows], looks.stop[rows])
    told = np.full(len(rows), 3)
    sums, whole = _sums(pulled[order], ends), _sums(weights[order], ends)
    return [
        (np.einsum("ka,ka->k", one, np.linalg.solve(weight, one[:, :, None])[:, :, 0]), told)
        for one, weight in ((pulled, weights), (sums, whole))
    ]


def _from_the_end(tube: Places, stop: Places) -> tuple[Places, Places]:
    """Order of looks tube by tube, the latest first, and for each the place of the first of its tube in that order."""
    order = np.lexsort((-stop, tube))
    sorted_tubes = tube[order]
    return order, np.searchsorted(sorted_tubes, sorted_tubes)


def _sums(parts: Array, starts: Places) -> Array:
    """Sums (n, ...) from the first of each tube on."""
    total = np.cumsum(parts, axis=0)
    return np.asarray(total - (total - parts)[starts])
