"""Probability that anything at all is open in a wall: joints and voids at all depths, which share their errors.

All errors are standard normal numbers x: of what the columns share, of each column alone, of the radii. A joint is too
thin where the distance of its centres passes what the radii allow; near its most likely point that is a half-space with
the unit normal u and the distance beta. Samples are drawn around these points, s_j = beta_j u_j, in proportion to
a_j = Phi(-beta_j), and weighted back:

    P(any) = mean of 1{any} phi(x) / q(x),    q(x) = sum_j a_j phi(x - s_j) / sum_j a_j

which keeps its relative accuracy however small P is. The events themselves are judged by the exact geometry.
Source: importance sampling of unions, Owen, Maximov and Chertkov (2019); Melchers (1989) for the design point. m.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.wall.as_built import Columns
from groundstation.survey.wall.column_joint import chord_reaches, limit_distances, limit_of_reaches
from groundstation.survey.wall.column_state import ColumnState
from groundstation.survey.wall.void_chance import VOID_DEPTHS, near_triple, void_open, void_point
from groundstation.survey.wall.wall_errors import (
    KEPT,
    Mixture,
    MostProbablePoint,
    Moves,
    WallErrors,
    add_radius,
    batch_groups,
    design_point,
)
from groundstation.survey.wall.wall_joints import Detour, Joints

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
SAMPLES = 8192
FEWEST = 1024
BUDGET = 2e8  # joints times depths times samples
SURE = 1.0 - 1e-6  # probability of one joint beyond which the whole is not asked
NEGLIGIBLE = 1e-9  # probability of a joint below which it is not sampled but added
SEED = 20_260_101  # the same wall gives the same probability


@dataclass(frozen=True, slots=True)
class SystemProbability:
    """Probability of anything too thin or open, its standard error from sampling, and where it must be 1."""

    probability: float
    standard_error: float
    certain: bool  # a column is missing where one is required


def system_probability(
    columns: Columns,
    found: Joints,
    required: float,
    triples: npt.NDArray[np.intp] | None = None,
    detours: Sequence[Detour] = (),
    samples: int = SAMPLES,
) -> SystemProbability:
    """P(any joint too thin, or any void in a grid) at any depth.

    Parameters
    ----------
    found : joints of the columns, each as good as its better way
    triples : (t, 3) columns between which a void may open; none for a wall or a shaft
    detours : ways by remedial columns
    samples : to draw at most; fewer where the wall is large
    """
    if np.any(found.states == ColumnState.MISSING):
        return SystemProbability(1.0, 0.0, certain=True)
    peak = np.where(np.isfinite(found.probability), found.probability, 0.0).max(axis=1)
    if float(peak.max()) > SURE:
        return SystemProbability(float(peak.max()), 0.0, certain=False)
    kept = np.flatnonzero(peak >= NEGLIGIBLE)
    neglected = float(peak[peak < NEGLIGIBLE].sum())
    asked = _Asked.among(columns, found, kept, np.zeros((0, 3), np.intp) if triples is None else triples, detours)
    errors = WallErrors.of(asked.columns)
    points = _design_points(errors, asked, required)
    if not points:
        return SystemProbability(min(neglected, 1.0), 0.0, certain=False)
    mixture = Mixture(points, errors.size)
    samples = int(np.clip(BUDGET / (asked.cost * len(columns.depths)), FEWEST, samples))
    judge = _Judge(errors, asked, required, mixture.at_once(samples))
    total = square = 0.0
    for x, weight in mixture.batches(samples, np.random.default_rng(SEED)):
        counted = np.where(judge.any_open(x), weight, 0.0)
        total, square = total + float(counted.sum()), square + float((counted**2).sum())
    mean = total / samples
    error = math.sqrt(max(square / samples - mean**2, 0.0) / samples)
    return SystemProbability(min(mean + neglected, 1.0), error, certain=False)


@dataclass(frozen=True, slots=True)
class _Asked:
    """Scope of the sampling: the columns that matter, and joints and triples by their index among them."""

    columns: Columns
    pairs: npt.NDArray[np.intp]  # (joints, 2)
    probability: Array  # (joints, depths), nan where nothing is required
    ways: list[list[list[list[int]]]]  # of every joint, its detours
    triples: npt.NDArray[np.intp]  # (t, 3)
    nearby: list[list[int]]  # of every triple, what may cover its middle

    @property
    def cost(self) -> int:
        """Relative cost of a sample at one depth: numbers drawn plus tests made."""
        return len(self.pairs) + sum(2 + len(near) for near in self.nearby) + len(self.columns.names)

    @classmethod
    def among(
        cls,
        columns: Columns,
        found: Joints,
        kept: npt.NDArray[np.intp],
        triples: npt.NDArray[np.intp],
        detours: Sequence[Detour],
    ) -> _Asked:
        pairs = found.pairs[kept]
        ways = [[d.pairs.tolist() for d in detours if d.joint == joint] for joint in kept.tolist()]
        nearby = [near_triple(columns, triple) for triple in triples]
        legs = [leg for some in ways for way in some for leg in way]
        used = np.unique([k for group in (*pairs.tolist(), *triples.tolist(), *nearby, *legs) for k in group])
        used = used.astype(np.intp)
        new = np.zeros(len(columns.names), np.intp)
        new[used] = np.arange(len(used))
        return cls(
            columns.subset(used),
            new[pairs],
            found.probability[kept],
            [[[new[leg].tolist() for leg in way] for way in some] for some in ways],
            new[triples],
            [new[near].tolist() for near in nearby],
        )


def _design_points(errors: WallErrors, asked: _Asked, required: float) -> list[MostProbablePoint]:
    """Design points of every joint and every void, one a layer: between layers the radii err on their own."""
    points = []
    layer = errors.columns.depth_layers()
    for k in range(errors.layers):
        depths = np.flatnonzero(layer == k)
        here = np.where(np.isfinite(asked.probability[:, depths]), asked.probability[:, depths], -1.0)
        for pair, chance in zip(asked.pairs, here, strict=True):
            at = int(np.argmax(chance))
            if chance[at] >= 0.0:
                points.append(_joint_point(errors, pair, int(depths[at]), required))
        some = depths[np.unique(np.linspace(0, len(depths) - 1, VOID_DEPTHS).astype(np.intp))]
        for triple, near in zip(asked.triples, asked.nearby, strict=True):
            point = void_point(errors, triple, near, some)
            if point is not None and point.chance > 0.0:
                points.append(point)
    return points


def _joint_point(errors: WallErrors, pair: npt.NDArray[np.intp], depth: int, required: float) -> MostProbablePoint:
    """Most probable point at which a joint becomes too thin, and its approximate chance."""
    both = pair.tolist()
    two = errors.among(both)
    c = two.columns
    apart = c.centres[1, depth] - c.centres[0, depth]
    distance = max(float(np.hypot(*apart)), 1e-9)
    unit = apart / distance
    own, shared = c.own.at(range(2))[:, depth], c.shared.at(range(2))[:, depth]
    normal = np.zeros(two.size)  # change of (limit - distance) for one standard deviation of each number
    normal[: two.shared] -= unit @ (shared[1] - shared[0])
    normal[two.own_slice(1)] -= unit @ own[1]
    normal[two.own_slice(0)] += unit @ own[0]
    for k in range(2):
        r = float(c.radii[k, depth])
        add_radius(two, normal, k, depth, r / math.sqrt(max(r**2 - 0.25 * required**2, 1e-6 * r**2)))
    limit = float(limit_distances(c.radii[0, depth : depth + 1], c.radii[1, depth : depth + 1], required)[0])
    return design_point(errors.numbers(both), normal, limit - distance)


class _Judge:
    """Judges samples by the exact geometry, a part of the wall at a time; not more ``samples`` at once."""

    def __init__(self, errors: WallErrors, asked: _Asked, required: float, samples: int) -> None:
        self._errors, self._asked, self._required = errors, asked, required
        joints = [
            [*pair, *(k for way in ways for leg in way for k in leg)]
            for pair, ways in zip(asked.pairs.tolist(), asked.ways, strict=True)
        ]
        voids = [[*triple, *near] for triple, near in zip(asked.triples.tolist(), asked.nearby, strict=True)]
        depths = len(errors.columns.depths)
        self._joints, self._voids = (list(batch_groups(groups, samples, depths)) for groups in (joints, voids))
        columns = sum(len(which) for _, which in (*self._joints, *self._voids))
        self._keeps = 2 * depths * columns * (errors.own + errors.shared) <= KEPT  # of a larger wall they are made anew
        self._moves: dict[bytes, Moves] = {}  # of the columns of a part

    def _drawn(self, x: Array, which: Indices) -> tuple[Array, Array]:
        """Centres and radii of the columns of a part."""
        moves = self._moves.get(which.tobytes())
        if moves is None:
            moves = self._errors.moves(which)
            if self._keeps:
                self._moves[which.tobytes()] = moves
        return self._errors.drawn(x, which, moves)

    def any_open(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether anything is open in each sample (n,)."""
        found = np.zeros(len(x), bool)
        judged = np.isfinite(self._asked.probability)
        for some, which in self._joints:
            centres, radii = self._drawn(x, which)
            place = self._errors.places(which)
            pairs = self._asked.pairs[some.start : some.stop]
            reaches = chord_reaches(radii, self._required)
            thin = self._thin(centres, reaches, place, pairs)
            for k, ways in enumerate(self._asked.ways[some.start : some.stop]):
                for way in ways:
                    if np.any(thin[k]):
                        thin[k] &= np.any(self._thin(centres, reaches, place, np.array(way)), axis=0)
            found |= np.any(thin & judged[some.start : some.stop, None], axis=(0, 2))
        for some, which in self._voids:
            centres, radii = self._drawn(x, which)
            place = self._errors.places(which)
            for k in some:
                three, others = place[self._asked.triples[k]], place[self._asked.nearby[k]]
                found |= np.any(void_open(centres, radii, three, others), axis=1)
        return found

    def _thin(
        self, centres: Array, reaches: Array, place: npt.NDArray[np.intp], pairs: npt.NDArray[np.intp]
    ) -> npt.NDArray[np.bool_]:
        """Whether joints are too thin or not there (joints, samples, depths); ``place`` of columns in what is drawn.

        ``reaches`` are the ``chord_reaches`` of their radii.
        """
        a, b = place[pairs[:, 0]], place[pairs[:, 1]]
        apart = centres[b] - centres[a]
        with np.errstate(invalid="ignore"):
            thick = np.hypot(apart[..., 0], apart[..., 1]) <= limit_of_reaches(reaches[a], reaches[b])
        stands = np.all(self._errors.columns.states[pairs] <= ColumnState.UNSURVEYED, axis=1)
        return np.asarray(~(thick & stands[:, None]))
