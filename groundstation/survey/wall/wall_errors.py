"""All errors of a wall as independent standard normal numbers: of what columns share, of each alone, of the radii.

A wall is drawn from them, and the likeliest numbers at which something opens are found among them: of each opening only
those of the columns about it. What is drawn is bounded in size, however many columns there are. m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.as_built import Columns

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
FURTHEST = 6.0  # standard deviations of a design point that is still drawn from
BATCH = 64  # samples at the most that are drawn together
NUMBERS = 2_000_000  # normal numbers at the most that are drawn together
KEPT = 1_000_000  # numbers at the most by which columns are moved that are kept from sample to sample
PLACES = 300_000  # columns times samples times depths at the most that are drawn together
COLUMNS = 128  # at the most whose errors in planes are worked out together


class MostProbablePoint(NamedTuple):
    """The likeliest numbers at which something opens.

    Attributes
    ----------
    numbers : (m,) which of all numbers are not zero there
    shift : (m,) what they are, in standard deviations
    chance : about how likely it is that they are passed
    """

    numbers: Indices
    shift: Array
    chance: float


class Moves(NamedTuple):
    """What each number moves columns by in all planes, (columns, numbers, 2 depths): each column's own, shared ones."""

    own: Array
    shared: Array


@dataclass(frozen=True, slots=True)
class WallErrors:
    """Layout of the standard normal numbers: shared ones, those of each column, those of radii by column and layer."""

    columns: Columns
    shared: int
    own: int
    layers: int

    @classmethod
    def of(cls, columns: Columns) -> WallErrors:
        """Return the errors of some columns."""
        return cls(columns, columns.shared.width, columns.own.width, int(columns.depth_layers().max()) + 1)

    def among(self, which: Sequence[int]) -> WallErrors:
        """Return the errors of a few columns, renumbered; ``numbers`` maps them to all."""
        return WallErrors(self.columns.subset(np.asarray(which, np.intp)), self.shared, self.own, self.layers)

    def numbers(self, which: Sequence[int]) -> Indices:
        """Index among all numbers of those that a few columns have, in the order of ``among``."""
        own = [np.arange(self.own_slice(k).start, self.own_slice(k).stop) for k in which]
        radii = [np.arange(self.layers) + self.radius_index(k, 0) for k in which]
        common = np.arange(self.layers) + self.common_index(0)
        return np.concatenate([np.arange(self.shared), *own, *radii, common]).astype(np.intp)

    def places(self, which: Indices) -> Indices:
        """Index of every column among some that are ``drawn``."""
        out = np.zeros(len(self.columns.names), np.intp)
        out[which] = np.arange(len(which))
        return out

    @property
    def size(self) -> int:
        """Count of numbers."""
        return self.shared + len(self.columns.names) * (self.own + self.layers) + self.layers

    def own_slice(self, column: int) -> slice:
        """Numbers of one column alone."""
        begin = self.shared + column * self.own
        return slice(begin, begin + self.own)

    def radius_index(self, column: int, layer: int) -> int:
        """Index of the number of a column's radius in a layer."""
        return self.shared + len(self.columns.names) * self.own + column * self.layers + layer

    def common_index(self, layer: int) -> int:
        """Index of the number that all radii in a layer share."""
        return self.shared + len(self.columns.names) * (self.own + self.layers) + layer

    def moves(self, which: Indices) -> Moves:
        """What the numbers of some columns, and the shared ones, move them by; for ``drawn`` again and again."""
        return Moves(_by_number(self.columns.own.at(which)), _by_number(self.columns.shared.at(which)))

    def drawn(self, x: Array, which: Indices, moves: Moves | None = None) -> tuple[Array, Array]:
        """Centres (columns, samples, depths, 2) and radii (columns, samples, depths) of some columns.

        ``moves`` are theirs, where they are known already.
        """
        c, layer = self.columns, self.columns.depth_layers()
        own, shared = moves or self.moves(which)
        first = self.shared + self.own * which[:, None]
        mine = np.moveaxis(x[:, first + np.arange(self.own)], 1, 0)
        moved = mine @ own + x[:, : self.shared] @ shared
        centres = c.centres[which][:, None] + moved.reshape(len(which), len(x), len(c.depths), 2)
        alone = np.moveaxis(x[:, self.radius_index(0, 0) + self.layers * which[:, None] + layer], 1, 0)
        rho = c.radius_correlation
        drawn = math.sqrt(rho) * x[:, self.common_index(0) + layer] + math.sqrt(1.0 - rho) * alone
        return centres, np.maximum(c.radii[which][:, None] + c.radius_stds[which][:, None] * drawn, 0.0)


def _by_number(errors: Array) -> Array:
    """Errors (columns, depths, 2, k) as matrices (columns, k, 2 depths)."""
    flat = errors.reshape(len(errors), errors.shape[1] * 2, errors.shape[3])
    return np.ascontiguousarray(np.swapaxes(flat, 1, 2))


def batch_groups(groups: Sequence[Sequence[int]], samples: int, depths: int) -> Iterator[tuple[range, Indices]]:
    """Runs of groups of columns, and the columns of each, of which so many samples may be drawn together."""
    most = min(PLACES // max(samples * depths, 1), COLUMNS)
    begin, used = 0, set[int]()
    for k, group in enumerate(groups):
        if k > begin and len(used | set(group)) > most:
            yield range(begin, k), np.array(sorted(used), np.intp)
            begin, used = k, set()
        used |= set(group)
    if begin < len(groups):
        yield range(begin, len(groups)), np.array(sorted(used), np.intp)


def add_radius(errors: WallErrors, normal: Array, column: int, depth: int, slope: float) -> None:
    """Add the part of a column's radius to a normal: ``slope`` (m/m)."""
    c, layer = errors.columns, int(errors.columns.depth_layers()[depth])
    change, rho = slope * float(c.radius_stds[column, depth]), c.radius_correlation
    normal[errors.common_index(layer)] += change * math.sqrt(rho)
    normal[errors.radius_index(column, layer)] += change * math.sqrt(1.0 - rho)


def design_point(numbers: Indices, normal: Array, rest: float) -> MostProbablePoint:
    """Point beta u of a half-space ``rest`` + normal x < 0, and Phi(-beta)."""
    size = max(float(np.linalg.norm(normal)), 1e-12)
    beta = min(max(rest / size, 0.0), FURTHEST)
    return MostProbablePoint(numbers, -beta / size * normal, 0.5 * math.erfc(beta / math.sqrt(2.0)))


class Mixture:
    """Samples around the likeliest points s_j, in proportion to their chances a_j, and what each counts.

    q(x) = sum_j a_j phi(x - s_j) / sum_j a_j is what they are drawn from; a sample counts phi(x) / q(x). Source:
    importance sampling of unions, Owen, Maximov and Chertkov (2019).
    """

    def __init__(self, points: Sequence[MostProbablePoint], size: int) -> None:
        from scipy.sparse import csr_array  # a survey alone needs none of it

        chances = np.array([point.chance for point in points])
        self._share = chances / chances.sum()
        self._points, self._size = points, size
        ends = np.cumsum([0, *(len(point.numbers) for point in points)])
        numbers, shifts = (np.concatenate([point[part] for point in points]) for part in (0, 1))
        self._shifts = csr_array((shifts, numbers, ends), shape=(len(points), size))
        self._half = 0.5 * np.array([np.sum(point.shift**2) for point in points])
        self._batch = int(np.clip(NUMBERS // size, 1, BATCH))

    def batches(self, samples: int, rng: np.random.Generator) -> Iterator[tuple[Array, Array]]:
        """Numbers (n, size) and weights (n,) of so many samples, as many at a time as memory may hold."""
        for begin in range(0, samples, self._batch):
            count = min(self._batch, samples - begin)
            x = rng.standard_normal((count, self._size))
            for row, chosen in zip(x, rng.choice(len(self._share), count, p=self._share).tolist(), strict=True):
                row[self._points[chosen].numbers] += self._points[chosen].shift
            yield x, 1.0 / (np.exp((self._shifts @ x.T).T - self._half) @ self._share)

    def at_once(self, samples: int) -> int:
        """Samples of a batch at the most."""
        return min(self._batch, samples)
