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

from groundstation.survey.as_built import Columns, State
from groundstation.survey.joints import Detour, Joints
from groundstation.survey.voids import power_centre
from groundstation.survey.wall import limits

Array = npt.NDArray[np.float64]
Point = tuple[Array, float]  # shift in standard deviations, and about how likely it is to be passed
SAMPLES = 8192
FEWEST = 1024
BUDGET = 2e8  # joints times depths times samples
BATCH = 512
SURE = 1.0 - 1e-6  # probability of one joint beyond which the whole is not asked
NEGLIGIBLE = 1e-9  # probability of a joint below which it is not sampled but added
SEED = 20_260_101  # the same wall gives the same probability
VOID_DEPTHS = 6  # of a layer, among which the likeliest point of a void is looked for
ACROSS = 0.05  # of a triangle, by which the point between three columns may lie beyond its side
FURTHEST = 6.0  # standard deviations of a design point that is still drawn from


@dataclass(frozen=True, slots=True)
class SystemProbability:
    """Probability of anything too thin or open, its standard error from sampling, and where it must be 1."""

    probability: float
    standard_error: float
    certain: bool  # a column is missing where one is required


@dataclass(frozen=True, slots=True)
class _Errors:
    """Where each standard normal number acts. Columns of ``Columns.own`` and radii by column and layer."""

    columns: Columns
    shared: int
    own: int
    layers: int

    @classmethod
    def of(cls, columns: Columns) -> _Errors:
        return cls(columns, columns.shared.shape[-1], columns.own.shape[-1], int(columns.depth_layers().max()) + 1)

    @property
    def size(self) -> int:
        return self.shared + len(self.columns.names) * (self.own + self.layers) + self.layers

    def own_slice(self, column: int) -> slice:
        begin = self.shared + column * self.own
        return slice(begin, begin + self.own)

    def radius_index(self, column: int, layer: int) -> int:
        return self.shared + len(self.columns.names) * self.own + column * self.layers + layer

    def common_index(self, layer: int) -> int:
        return self.shared + len(self.columns.names) * (self.own + self.layers) + layer

    def centres(self, x: Array, column: int) -> Array:
        """Centres (samples, depths, 2) of one column."""
        c = self.columns
        moved = x[:, : self.shared] @ _flat(c.shared[column]) + x[:, self.own_slice(column)] @ _flat(c.own[column])
        return np.asarray(c.centres[column] + moved.reshape(len(x), len(c.depths), 2))

    def radii(self, x: Array, column: int) -> Array:
        """Radii (samples, depths) of one column."""
        c, layer = self.columns, self.columns.depth_layers()
        rho = c.radius_correlation
        common = x[:, [self.common_index(int(k)) for k in layer]]
        alone = x[:, [self.radius_index(column, int(k)) for k in layer]]
        drawn = math.sqrt(rho) * common + math.sqrt(1.0 - rho) * alone
        return np.asarray(np.maximum(c.radii[column] + c.radius_stds[column] * drawn, 0.0))


def _flat(errors: Array) -> Array:
    """Errors (depths, 2, k) as a matrix (k, 2 depths)."""
    return np.ascontiguousarray(errors.reshape(errors.shape[0] * errors.shape[1], errors.shape[2]).T)


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
    if np.any(found.states == State.MISSING):
        return SystemProbability(1.0, 0.0, certain=True)
    peak = np.where(np.isfinite(found.probability), found.probability, 0.0).max(axis=1)
    if float(peak.max()) > SURE:
        return SystemProbability(float(peak.max()), 0.0, certain=False)
    kept = np.flatnonzero(peak >= NEGLIGIBLE)
    neglected = float(peak[peak < NEGLIGIBLE].sum())
    asked = _Asked.among(columns, found, kept, np.zeros((0, 3), np.intp) if triples is None else triples, detours)
    errors = _Errors.of(asked.columns)
    points = _design_points(errors, asked, required)
    if not points:
        return SystemProbability(min(neglected, 1.0), 0.0, certain=False)
    shifts = np.array([shift for shift, _ in points])
    share = np.array([chance for _, chance in points])
    share /= share.sum()
    judge = _Judge(errors, asked, required)
    samples = int(np.clip(BUDGET / (judge.cost * len(columns.depths)), FEWEST, samples))
    rng = np.random.default_rng(SEED)
    total = square = 0.0
    for begin in range(0, samples, BATCH):
        count = min(BATCH, samples - begin)
        x = rng.standard_normal((count, errors.size)) + shifts[rng.choice(len(share), count, p=share)]
        ratio = np.exp(x @ shifts.T - 0.5 * np.sum(shifts**2, axis=1)) @ share  # q / phi
        weight = np.where(judge.any_open(x), 1.0 / ratio, 0.0)
        total, square = total + float(weight.sum()), square + float((weight**2).sum())
    mean = total / samples
    error = math.sqrt(max(square / samples - mean**2, 0.0) / samples)
    return SystemProbability(min(mean + neglected, 1.0), error, certain=False)


@dataclass(frozen=True, slots=True)
class _Asked:
    """What has to be sampled: the columns that matter, and joints and triples by their index among them."""

    columns: Columns
    pairs: npt.NDArray[np.intp]  # (joints, 2)
    probability: Array  # (joints, depths), nan where nothing is required
    ways: list[list[list[list[int]]]]  # of every joint, its detours
    triples: npt.NDArray[np.intp]  # (t, 3)
    nearby: list[list[int]]  # of every triple, what may cover its middle

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
        nearby = [_near(columns, triple) for triple in triples]
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


def _design_points(errors: _Errors, asked: _Asked, required: float) -> list[Point]:
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
            point = _void_point(errors, triple, near, some)
            if point is not None and point[1] > 0.0:
                points.append(point)
    return points


def _joint_point(errors: _Errors, pair: npt.NDArray[np.intp], depth: int, required: float) -> Point:
    """Most likely point at which a joint is just too thin, and about how likely it is."""
    c = errors.columns
    a, b = (int(k) for k in pair)
    apart = c.centres[b, depth] - c.centres[a, depth]
    distance = max(float(np.hypot(*apart)), 1e-9)
    unit = apart / distance
    normal = np.zeros(errors.size)  # change of (limit - distance) for one standard deviation of each number
    normal[: errors.shared] -= unit @ (c.shared[b, depth] - c.shared[a, depth])
    normal[errors.own_slice(b)] -= unit @ c.own[b, depth]
    normal[errors.own_slice(a)] += unit @ c.own[a, depth]
    for k in (a, b):
        r = float(c.radii[k, depth])
        _add_radius(errors, normal, k, depth, r / math.sqrt(max(r**2 - 0.25 * required**2, 1e-6 * r**2)))
    limit = float(limits(c.radii[a, depth : depth + 1], c.radii[b, depth : depth + 1], required)[0])
    return _design_point(normal, limit - distance)


def _void_point(
    errors: _Errors, triple: npt.NDArray[np.intp], near: list[int], depths: npt.NDArray[np.intp]
) -> Point | None:
    """The same for the point between three columns, at the likeliest of some ``depths``."""
    c = errors.columns
    centres, radii = np.swapaxes(c.centres[triple][:, depths], 0, 1), c.radii[triple][:, depths].T
    middle = power_centre(centres, radii)
    weights = _barycentric(middle, centres)
    points = [
        _void_point_at(errors, triple, near, int(depth), middle[k], weights[k])
        for k, depth in enumerate(depths)
        if np.all(weights[k] > -ACROSS)
    ]
    return max(points, key=lambda point: point[1], default=None)


def _void_point_at(
    errors: _Errors, triple: npt.NDArray[np.intp], near: list[int], depth: int, middle: Array, weights: Array
) -> Point:
    """Nearest x at which the middle of three columns is clear of them and of every other that covers it.

    With the barycentric weights w of the middle, its distance from the three grows by the sum of w times what each of
    them moves away; the others have to move away by themselves.
    """
    c = errors.columns
    rows, rests = [np.zeros(errors.size)], []
    for column, weight in zip(triple.tolist(), weights.tolist(), strict=True):
        rows[0] += weight * _away(errors, column, depth, middle)
    rests.append(_depth_in(c, int(triple[0]), depth, middle))
    for column in near:
        rest = _depth_in(c, column, depth, middle)
        if rest > 0.0:
            rows.append(_away(errors, column, depth, middle))
            rests.append(rest)
    wanted = np.maximum(rests, 0.0)
    shift = -np.linalg.pinv(np.array(rows), rcond=1e-9) @ wanted
    if np.any(-np.array(rows) @ shift < 0.5 * wanted):  # columns that cannot move
        shift = np.zeros(errors.size)
        return shift, 0.0
    size = float(np.linalg.norm(shift))
    return shift * min(1.0, FURTHEST / max(size, 1e-12)), 0.5 * math.erfc(size / math.sqrt(2.0))


def _away(errors: _Errors, column: int, depth: int, middle: Array) -> Array:
    """How much more a column covers a point for one standard deviation of each number: it comes nearer, or is wider."""
    c = errors.columns
    away = middle - c.centres[column, depth]
    unit = away / max(float(np.hypot(*away)), 1e-9)
    out = np.zeros(errors.size)
    out[: errors.shared] = unit @ c.shared[column, depth]
    out[errors.own_slice(column)] = unit @ c.own[column, depth]
    _add_radius(errors, out, column, depth, 1.0)
    return out


def _depth_in(columns: Columns, column: int, depth: int, point: Array) -> float:
    """How deep (m) a point lies in a column; negative outside."""
    away = point - columns.centres[column, depth]
    return float(columns.radii[column, depth] - np.hypot(away[0], away[1]))


def _add_radius(errors: _Errors, normal: Array, column: int, depth: int, slope: float) -> None:
    """What the radius of a column adds to a normal: ``slope`` (m/m)."""
    c, layer = errors.columns, int(errors.columns.depth_layers()[depth])
    change, rho = slope * float(c.radius_stds[column, depth]), c.radius_correlation
    normal[errors.common_index(layer)] += change * math.sqrt(rho)
    normal[errors.radius_index(column, layer)] += change * math.sqrt(1.0 - rho)


def _barycentric(point: Array, three: Array) -> Array:
    """Weights (n, 3) of points (n, 2) in triangles (n, 3, 2); nan in flat ones."""
    u, v, w = three[:, 1] - three[:, 0], three[:, 2] - three[:, 0], point - three[:, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        det = u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0]
        second = (w[:, 0] * v[:, 1] - w[:, 1] * v[:, 0]) / det
        third = (u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0]) / det
    return np.stack([1.0 - second - third, second, third], axis=-1)


def _design_point(normal: Array, rest: float) -> Point:
    """Point beta u of a half-space ``rest`` + normal x < 0, and Phi(-beta)."""
    size = max(float(np.linalg.norm(normal)), 1e-12)
    beta = min(max(rest / size, 0.0), FURTHEST)
    return -beta / size * normal, 0.5 * math.erfc(beta / math.sqrt(2.0))


class _Judge:
    """Judges samples by the exact geometry."""

    def __init__(self, errors: _Errors, asked: _Asked, required: float) -> None:
        self._errors, self._asked, self._required = errors, asked, required
        self.cost = len(asked.pairs) + sum(2 + len(near) for near in asked.nearby) + len(asked.columns.names)

    def any_open(self, x: Array) -> npt.NDArray[np.bool_]:
        """Whether anything is open in each sample (n,)."""
        count = range(len(self._asked.columns.names))
        centres = [self._errors.centres(x, k) for k in count]
        radii = [self._errors.radii(x, k) for k in count]
        found = np.zeros(len(x), bool)
        judged = np.isfinite(self._asked.probability)
        for pair, ways, here in zip(self._asked.pairs.tolist(), self._asked.ways, judged, strict=True):
            thin = self._thin(centres, radii, pair)
            for way in ways:
                if np.any(thin):
                    thin &= np.any([self._thin(centres, radii, leg) for leg in way], axis=0)
            found |= np.any(thin & here, axis=1)
        for triple, near in zip(self._asked.triples.tolist(), self._asked.nearby, strict=True):
            found |= _void_open(centres, radii, triple, near)
        return found

    def _thin(self, centres: list[Array], radii: list[Array], pair: list[int]) -> npt.NDArray[np.bool_]:
        """Whether a joint is too thin or not there: (samples, depths)."""
        a, b = pair
        apart = centres[b] - centres[a]
        with np.errstate(invalid="ignore"):
            thick = np.hypot(apart[..., 0], apart[..., 1]) <= limits(radii[a], radii[b], self._required)
        stands = np.all(self._errors.columns.states[pair] <= State.UNSURVEYED, axis=0)
        return np.asarray(~(thick & stands))


def _near(columns: Columns, triple: npt.NDArray[np.intp]) -> list[int]:
    """Columns beside three that may cover the point between them."""
    apart = np.hypot(*np.moveaxis(columns.designs - columns.designs[triple].mean(axis=0), -1, 0))
    reach = 2.0 * float(np.max(columns.radii)) + float(np.max(apart[triple]))
    return [k for k in np.flatnonzero(apart < reach).tolist() if k not in triple.tolist()]


def _void_open(centres: list[Array], radii: list[Array], triple: list[int], near: list[int]) -> npt.NDArray[np.bool_]:
    """Whether the point between three columns lies outside all discs and among the three (n,)."""
    three = np.stack([centres[k] for k in triple], axis=-2)
    round_ = np.stack([radii[k] for k in triple], axis=-1)
    shape = three.shape[:2]
    middle = power_centre(three.reshape(-1, 3, 2), round_.reshape(-1, 3)).reshape(*shape, 2)
    with np.errstate(invalid="ignore"):
        away = middle - three[..., 0, :]
        free = (np.sum(away**2, axis=-1) > round_[..., 0] ** 2) & _within(middle, three)
        for k in near:
            if not np.any(free):
                break
            away = middle - centres[k]
            free &= np.sum(away**2, axis=-1) >= radii[k] ** 2
    return np.asarray(np.any(free, axis=1))


def _within(point: Array, three: Array) -> npt.NDArray[np.bool_]:
    """Whether points (..., 2) lie in triangles (..., 3, 2), their edges included."""
    sides = []
    for k in range(3):
        p, q = three[..., k, :], three[..., (k + 1) % 3, :]
        edge, to = q - p, point - p
        sides.append(edge[..., 0] * to[..., 1] - edge[..., 1] * to[..., 0])
    signs = np.stack(sides, axis=-1)
    slack = 1e-12 + 1e-9 * np.max(np.abs(signs), axis=-1, keepdims=True)
    return np.asarray(np.all(signs >= -slack, axis=-1) | np.all(signs <= slack, axis=-1))
