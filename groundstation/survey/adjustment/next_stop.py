"""Where to stop next: how well the toe will be known, by the angle that the string is turned by against this stop.

Every tube goes one station down, the lowest to a new one; the tool faces of all turn by one angle. A bias of a tube
and the direction of the hole look alike from one tool face and apart from another, so a turn between stops tells
them. The looks to come have the covariance of those at this stop, and the turns of its make-up; the update is linear.
Source: optimal design of a linear estimate, Fedorov, "Theory of Optimal Experiments", Academic Press (1972).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.adjusted import Adjusted
from groundstation.survey.adjustment.kernels.observations import linearise_looks
from groundstation.survey.adjustment.kernels.path_elimination import reduce_right
from groundstation.survey.adjustment.looks import BIAS, OF_TUBE, TILT, TURN, Looks
from groundstation.survey.adjustment.sphere import step_directions
from groundstation.survey.adjustment.toe_weights import toe_weights
from groundstation.survey.path.curvature_process import process_step

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
OF_LOOK = 9  # unknowns of a look


@dataclass(frozen=True, slots=True)
class NextStop:
    """What each angle of the next stop is worth.

    Parameters
    ----------
    angles : (a,) rad, by which all tool faces are turned against the last stop
    toe_stds : (a,) m, root of the variances of the new toe to north, east and down together
    """

    angles: Array
    toe_stds: Array

    @property
    def best(self) -> float:
        """Angle (rad) after which the toe is known best."""
        return float(self.angles[np.argmin(self.toe_stds)])

    @property
    def worth(self) -> float:
        """By how much (m) it is known better than after a stop without a turn."""
        return float(self.toe_stds[np.argmin(np.abs(self.angles))] - self.toe_stds.min())


def plan_stop(found: Adjusted, length: float, angle_count: int = 24) -> NextStop:
    """Plan the next stop.

    Parameters
    ----------
    found : the hole, adjusted
    length : m, to the next station
    angle_count : angles that are tried, evenly around from no turn on
    """
    angles = np.linspace(0.0, 2.0 * np.pi, angle_count, endpoint=False, dtype=np.float64)
    last = _last_of_tubes(found.looks)
    jacobians, noise = _looks_to_come(found, last, length, angles)
    cov, toe_cov, of_toe = _covariances(found, last, length)
    left = toe_cov - _gains(jacobians, noise, cov, of_toe)
    return NextStop(angles, np.asarray(np.sqrt(np.maximum(left, 0.0))))


def _last_of_tubes(looks: Looks) -> Places:
    """Places (t,) of the last look of each tube that looked at the last stop."""
    return np.flatnonzero(looks.stop == looks.stop.max())


def _ahead(found: Adjusted, length: float) -> tuple[Array, float, float]:
    """Direction (3,) at the next station, lever of the curvature (m) on it, and its variance (rad^2) about that."""
    go, spread = process_step(length, found.path.correlation_length)
    lever, var = float(go[1, 2]), float(spread[1, 1]) * found.now.curvature_var
    bent = found.now.curvatures[-1:] * lever
    return step_directions(found.now.tangents[-1:], found.linear.bases[-1:], bent)[0], lever, var


def _looks_to_come(found: Adjusted, last: Places, length: float, angles: Array) -> tuple[Array, Array]:
    """Jacobians (a, t, 3, 9) and noise (a, t, 3, 3) of the looks after each turn."""
    looks, now = found.looks, found.now
    count = len(last) * len(angles)
    tangents = np.concatenate([now.tangents, _ahead(found, length)[0][None]])
    across = found.linear.bases[-1] - np.outer(found.linear.bases[-1] @ tangents[-1], tangents[-1])
    bases = np.concatenate([found.linear.bases, across[None]])  # their length is off by the square of a bend
    yaw = (looks.yaw[last] + angles[:, None]).ravel()
    tube, station = (np.tile(one, len(angles)) for one in (looks.tube[last], looks.station[last] + 1))
    make_up = np.tile(looks.make_up[last], len(angles))
    psi = yaw - now.tubes[tube, TURN] - now.make_ups[make_up]
    d = tangents[station]
    lean = (d[:, 0] + 1j * d[:, 1]) * np.exp(-1j * psi)
    axes = np.stack([lean.real, lean.imag, -d[:, 2]], axis=1)
    tilt = np.concatenate([now.tubes[tube, TILT], np.zeros((count, 1))], axis=1)
    force = now.gravity * (axes + np.cross(tilt, axes)) + now.tubes[tube, BIAS]  # as told, so no yaw error is seen
    jacobians, weights = np.empty((count, 3, OF_LOOK)), np.empty((count, 3, 3))
    force_var, yaw_var = (np.tile(one[last], len(angles)) for one in (looks.force_var, looks.yaw_var))
    linearise_looks(
        station, tube, make_up, force, force_var, yaw, yaw_var, tangents, bases, now.tubes, now.make_ups, now.gravity,
        now.play_var, jacobians, weights, np.empty((count, 3)), np.empty(count),
    )  # fmt: skip
    shape = (len(angles), len(last), 3)
    noise = np.asarray(np.linalg.inv(weights), np.float64)
    return jacobians.reshape(*shape, OF_LOOK), noise.reshape(*shape, 3)


def _covariances(found: Adjusted, last: Places, length: float) -> tuple[Array, float, Array]:
    """Covariance (9 t, 9 t) of the unknowns of the looks to come, variance of the toe, and (9 t, 3) of both."""
    _, lever, spread = _ahead(found, length)
    count = len(last)
    wanted = _wanted_states(found, last, lever, length)
    reduced = wanted.copy()
    reduce_right(found.solution.diagonal, found.solution.tied, reduced)
    flat = reduced.reshape(-1, reduced.shape[2])
    by_common = _by_common(found, wanted, last)
    of_states = flat.T @ flat + by_common.T @ found.common_cov @ by_common
    new = np.zeros((wanted.shape[2], 2))
    new[np.flatnonzero(found.looks.station[last] == len(found.path.md) - 1)[:, None] * 2 + [0, 1], [0, 1]] = 1.0
    new[2 * count :] = 0.5 * length * found.linear.bases[-1].T
    of_states += spread * new @ new.T
    of_looks, of_all = _covariances_in_common(found, last)
    crossed = (of_all @ by_common).reshape(count, OF_TUBE + 1, -1)
    cov = np.empty((count, OF_LOOK, count, OF_LOOK))
    cov[:, :2, :, :2] = of_states[: 2 * count, : 2 * count].reshape(count, 2, count, 2)
    cov[:, 2:, :, :2] = crossed[:, :, : 2 * count].reshape(count, OF_TUBE + 1, count, 2)
    cov[:, :2, :, 2:] = cov[:, 2:, :, :2].transpose(2, 3, 0, 1)
    cov[:, 2:, :, 2:] = of_looks.reshape(count, OF_TUBE + 1, count, OF_TUBE + 1)
    by_path = of_states[: 2 * count, 2 * count :].reshape(count, 2, 3)
    of_toe = np.asarray(np.concatenate([by_path, crossed[:, :, 2 * count :]], axis=1), np.float64)
    return cov, float(np.trace(of_states[2 * count :, 2 * count :])), of_toe


def _covariances_in_common(found: Adjusted, last: Places) -> tuple[Array, Array]:
    """Covariance of tube, whole turn and gravity of the looks, (7 t, 7 t), and with all in common, (7 t, p)."""
    first = found.string.count * OF_TUBE
    own = found.looks.tube[last, None] * OF_TUBE + np.arange(OF_TUBE)
    at = np.concatenate([own, np.full((len(last), 1), first)], axis=1).ravel()
    turns = np.arange(len(last)) * (OF_TUBE + 1) + TURN
    make_ups = first + 1 + found.looks.make_up[last]
    of_all = found.common_cov[at]
    of_all[turns] += found.common_cov[make_ups]
    of_looks = of_all[:, at]
    of_looks[:, turns] += of_all[:, make_ups]
    return of_looks, of_all


def _by_common(found: Adjusted, wanted: Array, last: Places) -> Array:
    """Change (p, r) of the wanted functionals with what is in common; that of a look is of one station."""
    at = np.minimum(found.looks.station[last] + 1, len(found.path.md) - 1)
    of_looks = 2 * len(last)
    here = wanted[at, :, :of_looks].reshape(len(last), -1, len(last), 2)[np.arange(len(last)), :, np.arange(len(last))]
    looks = (np.swapaxes(found.by_common[at], 1, 2) @ here).transpose(1, 0, 2)
    width = found.by_common.shape[2]
    toe = found.by_common.reshape(-1, width).T @ wanted[:, :, of_looks:].reshape(-1, wanted.shape[2] - of_looks)
    return np.concatenate([looks.reshape(width, -1), toe], axis=1)


def _wanted_states(found: Adjusted, last: Places, lever: float, length: float) -> Array:
    """Functionals (s + 1, 4, 2 t + 3) of the states: the direction of every look to come, and the new toe.

    What the new station adds of its own is not in them.
    """
    count, toe = len(last), len(found.path.md) - 1
    wanted = np.zeros((toe + 1, 4, 2 * count + 3))
    new = np.zeros((4, 2))
    new[:2], new[2:] = np.eye(2), lever * np.eye(2)
    for place, station in enumerate((found.looks.station[last] + 1).tolist()):
        where = slice(2 * place, 2 * place + 2)
        if station <= toe:
            wanted[station, :2, where] = np.eye(2)
        else:
            wanted[toe, :, where] = new
    wanted[:, :2, 2 * count :] = toe_weights(found)
    wanted[toe, :, 2 * count :] += 0.5 * length * (np.eye(4, 2) + new) @ found.linear.bases[-1]
    return wanted


def _gains(jacobians: Array, noise: Array, cov: Array, of_toe: Array) -> Array:
    """By how much (a,) the looks to come lower the variance of the toe."""
    many, count = jacobians.shape[:2]
    # what each look has in common with all unknowns, then with all looks
    by_look = jacobians.transpose(1, 0, 2, 3).reshape(count, many * 3, OF_LOOK)
    half = (by_look @ cov.reshape(count, OF_LOOK, -1)).reshape(count, many, 3, count, OF_LOOK)
    half = half.transpose(1, 3, 0, 2, 4).reshape(many, count, 3 * count, OF_LOOK)
    spread = (half @ np.swapaxes(jacobians, 2, 3)).transpose(0, 2, 1, 3).reshape(many, 3 * count, 3 * count)
    for place in range(count):
        at = slice(3 * place, 3 * place + 3)
        spread[:, at, at] += noise[:, place]
    seen = (jacobians @ of_toe).reshape(many, 3 * count, 3)
    return np.array([_square_of(one, its_spread) for one, its_spread in zip(seen, spread, strict=True)])


def _square_of(seen: Array, spread: Array) -> float:
    """Square of columns (m, 3) weighed by the inverse of a covariance (m, m)."""
    from scipy.linalg import lapack

    factor, failed = lapack.dpotrf(spread.T, lower=1)  # symmetric: as the library lays out its matrices
    if failed:
        raise np.linalg.LinAlgError("expected a covariance of the looks to come that is positive definite")
    whitened, _ = lapack.dtrtrs(factor, seen, lower=1)
    return float(np.sum(whitened * whitened))
