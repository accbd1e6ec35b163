"""A hole adjusted with blunders that are taken in: as further unknowns, or put right in the looks themselves.

A step of a bias is a further unknown with a wide prior. A turn is so too, and the looks are turned back by what is
found until nothing more is, for a turn of many degrees is not linear (a large one is begun with as the stations that
were seen before tell it, see ``coarse_turns``); nor is a wrong depth where the hole bends, and what a tilt does hangs
on the lean of the hole, which it has spoilt, so columns are made at least twice. After some rounds only a turn is
waited for: a tilt or depth that is not there need not settle (it doubles from round to round, and collapses), and some
size on that way may fit the looks better than what is wrong. What has a known size (axes or tubes exchanged) is put
right in the looks. Source: Teunissen, "An integrity and quality control procedure for use in multi
sensor integration", ION GPS (1990): detection, identification, adaptation.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjust import adjust_hole
from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.blunder_kind import BlunderKind
from groundstation.survey.adjustment.coarse_turns import coarse_turns
from groundstation.survey.adjustment.collar import untold_collar
from groundstation.survey.adjustment.curvature_size import curvature_deviance
from groundstation.survey.adjustment.equations import path_equations, string_departure
from groundstation.survey.adjustment.hypotheses import (
    BY_DEPTH,
    BY_TILT,
    BY_TURN,
    KNOWN_SIZE,
    OF_FORCE,
    SWAPPED,
    WIDTHS,
    Hypothesis,
    effect_amplitudes,
    effect_of,
    exchanged_stations,
)
from groundstation.survey.adjustment.kernels.path_elimination import eliminate_path
from groundstation.survey.adjustment.looks import FurtherEffects, Looks, PathPrior, StartingPoint, StringPrior
from groundstation.survey.adjustment.normal_equations import linearise_all, whole_columns
from groundstation.survey.adjustment.play import PLAY_KNOWN_AS
from groundstation.survey.adjustment.run_of_stops import RunOfStops
from groundstation.survey.adjustment.sphere import bends_between, carried_bases
from groundstation.survey.adjustment.starting_point import first_start

Array = npt.NDArray[np.float64]
WIDE_FORCE, WIDE_TILT, WIDE_TURN, WIDE_DEPTH = 1.0, 0.2, 3.0, 10.0  # m/s^2, rad, rad, m before a blunder is found
BENT = (*BY_DEPTH, *BY_TILT, BlunderKind.HOLE_MOVED)  # whose columns are others once the hole stands right
NOT_SOUGHT = (*KNOWN_SIZE, BlunderKind.COLLAR_WRONG)  # put right in the looks, and left open in the path
ROUNDS = 16  # a turn of 60 deg takes six
BENT_ROUNDS = 4  # in which what is bent settles, where it is there
SETTLED, STRAIGHT = 0.1, 0.01  # standard deviations, and rad or m, of a turn or depth that is found in addition


@dataclass(frozen=True, slots=True)
class TakenIn:
    """A hole adjusted with blunders.

    Parameters
    ----------
    found : the adjustment of the looks as they were put right
    sizes, covs : (q,) and (q, q) of each blunder in the order given; empty where the size is known
    """

    found: Adjusted
    sizes: tuple[Array, ...]
    covs: tuple[Array, ...]


def adjust_with(
    looks: Looks,
    string: StringPrior,
    path: PathPrior,
    run: RunOfStops,
    blunders: Sequence[Hypothesis],
    start: StartingPoint | None = None,
) -> TakenIn:
    """Adjust a hole with blunders taken in; without any it is ``adjust_hole``."""
    looks = put_right(looks, blunders)
    told, sought = path, [one for one in blunders if one.kind not in NOT_SOUGHT]
    if len(sought) < len(blunders) and any(one.kind is BlunderKind.COLLAR_WRONG for one in blunders):
        path = untold_collar(path)
    now = replace(start or first_start(looks, string, path), extra=np.zeros(0))
    is_turn, is_bent = (_is_of(sought, kinds) for kinds in (BY_TURN, BENT))
    sizes = np.repeat(coarse_turns(looks, string, path, run, sought), [WIDTHS[one.kind] for one in sought])
    turned = _turned_back(looks, run, sought, sizes)
    for again in range(ROUNDS if np.any(is_turn | is_bent) else 1):
        extra = further_effects(turned, run, sought, now, sizes)
        found = adjust_hole(turned, string, path, extra, replace(now, extra=np.zeros(len(extra.std))))
        cov = _cov_of_further(found)
        before, sizes = sizes, found.now.extra + np.where(is_turn, sizes, 0.0)
        more = np.abs(sizes - before)
        enough = np.minimum(SETTLED * np.sqrt(np.diag(cov)), STRAIGHT)
        awaited = is_turn | is_bent if again + 1 < BENT_ROUNDS else is_turn
        if again and np.all((more <= enough)[awaited]):
            break
        now = replace(found.now, extra=np.zeros(0))
        turned = _turned_back(looks, run, sought, sizes)
    slices = places_among_further(blunders)
    shares = [_share_of(one, at, sizes, cov, found, told) for one, at in zip(blunders, slices, strict=True)]
    return TakenIn(found, tuple(size for size, _ in shares), tuple(share for _, share in shares))


def _cov_of_further(found: Adjusted) -> Array:
    """Covariance (q, q) of further effects, which are the last of what stations have in common."""
    if not (count := len(found.extra.std)):
        return np.zeros((0, 0))  # the whole covariance would be worked out for nothing
    return found.common_cov[-count:, -count:]


def _share_of(
    one: Hypothesis, at: slice, sizes: Array, cov: Array, found: Adjusted, told: PathPrior
) -> tuple[Array, Array]:
    """Size and covariance of one blunder; empty where the size is known."""
    if one.kind is BlunderKind.COLLAR_WRONG:
        ends = np.stack([found.now.tangents[0], told.collar])
        return bends_between(ends, found.bases[:1].repeat(2, axis=0))[0], found.covs[0, :2, :2]
    return sizes[at], cov[at, at]


def places_among_further(blunders: Sequence[Hypothesis]) -> list[slice]:
    """Where each blunder stands among the further unknowns; empty of one whose size is known."""
    shown = iter(_places([one for one in blunders if one.kind not in NOT_SOUGHT]))
    return [slice(0, 0) if one.kind in NOT_SOUGHT else next(shown) for one in blunders]


def _is_of(sought: Sequence[Hypothesis], kinds: Sequence[BlunderKind]) -> npt.NDArray[np.bool_]:
    """Which columns are of some kinds."""
    return np.array([one.kind in kinds for one in sought for _ in range(WIDTHS[one.kind])], bool)


def _places(sought: Sequence[Hypothesis]) -> list[slice]:
    ends = np.cumsum([0, *(WIDTHS[one.kind] for one in sought)]).tolist()
    return [slice(ends[k], ends[k + 1]) for k in range(len(sought))]


def put_right(looks: Looks, blunders: Sequence[Hypothesis]) -> Looks:
    """Looks without what has a known size."""
    for one in blunders:
        if one.kind is BlunderKind.TUBES_EXCHANGED:
            looks = replace(looks, station=exchanged_stations(looks, one.subject))
        elif one.kind is BlunderKind.AXES_EXCHANGED:
            wrong = (looks.tube == one.subject[0]) & (looks.stop >= one.stop)
            looks = replace(looks, force=np.where(wrong[:, None], looks.force[:, SWAPPED], looks.force))
    return looks


def _turned_back(looks: Looks, run: RunOfStops, sought: Sequence[Hypothesis], sizes: Array) -> Looks:
    turn = np.zeros(len(looks))
    for one, at in zip(sought, _places(sought), strict=True):
        if one.kind in BY_TURN:
            turn += effect_amplitudes(one, looks, run) * sizes[at.start]
    return replace(looks, yaw=looks.yaw - turn)


def further_effects(
    looks: Looks, run: RunOfStops, sought: Sequence[Hypothesis], now: StartingPoint, sizes: Array
) -> FurtherEffects:
    """Blunders of unknown size, about ``sizes``, as further unknowns of an adjustment that begins at ``now``."""
    if not sought:
        return FurtherEffects(np.zeros((len(looks), 3, 0)), np.zeros(0))
    nothing = FurtherEffects(np.zeros((len(looks), 3, 0)), np.zeros(0))
    linear = linearise_all(looks, now, carried_bases(now.tangents), nothing)
    columns = np.zeros((len(looks), 3, sum(WIDTHS[one.kind] for one in sought)))
    stds = np.empty(columns.shape[2])
    for one, at in zip(sought, _places(sought), strict=True):
        reach = float(sizes[at.start]) if one.kind in BY_DEPTH else 0.0
        rows, effect = effect_of(one, looks, run, now, linear, reach)
        columns[rows, :, at] = effect
        stds[at] = wide_std(one, looks, run)
    return FurtherEffects(columns, stds)


def wide_std(one: Hypothesis, looks: Looks, run: RunOfStops) -> float:
    """Standard deviation of a blunder before it is found: wide enough to leave it to the looks."""
    if one.kind is BlunderKind.BIAS_CREEPS:
        return WIDE_FORCE / max(float(np.max(effect_amplitudes(one, looks, run), initial=0.0)), 1e-9)
    if one.kind in OF_FORCE:
        return WIDE_FORCE
    if one.kind in BY_TURN:
        return WIDE_TURN
    return WIDE_TILT if one.kind in BY_TILT or one.kind is BlunderKind.HOLE_MOVED else WIDE_DEPTH


def deviance_of(found: Adjusted) -> float:
    """Minus twice the logarithm of the likelihood of all looks, with further effects at their best.

    Directions, curvatures, tubes and gravity are integrated out; so holes of the same looks compare, whatever was taken
    in and however far tubes then lie askew. Further effects have wide priors, which count nothing.
    """
    solution, looks, now = found.solution, len(found.looks), found.now
    squares, prior_size = path_squares(found)
    departure = string_departure(found.string, now)
    width = len(found.extra.std)
    core = len(found.known) - width
    squares += float(departure[:core] @ found.known[:core, :core] @ departure[:core]) + found.squares
    size = 2.0 * float(np.log(np.einsum("kaa->ka", solution.diagonal)).sum()) - solution.in_common.log_size
    size -= prior_size + _log_size(found.known[:core, :core]) + _log_size(found.linear.weights)
    if width:
        size += _log_size(solution.cov[core:, core:])
    before = found.string.play_std**2
    play = PLAY_KNOWN_AS * (np.log(now.play_var) + before / now.play_var)
    return squares + size + float(play) + curvature_deviance(now, found.path.curvature_std**2) if looks else 0.0


def path_squares(found: Adjusted) -> tuple[float, float]:
    """Weighted squares by which directions and curvatures stand off what is known of a path, and log |information|."""
    diagonal, tied, right = path_equations(found.path, found.now, found.linear.bases)
    off = right[:, :, None].copy()
    eliminate_path(diagonal, tied, off, *whole_columns(off))
    return float(np.sum(off * off)), 2.0 * float(np.log(np.einsum("kaa->ka", diagonal)).sum())


def _log_size(matrices: Array) -> float:
    return float(np.sum(np.linalg.slogdet(matrices)[1]))
