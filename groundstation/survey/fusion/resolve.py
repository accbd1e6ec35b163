"""From the specific force of a stop and the tracked yaw to the direction of the tube.

The result is the tube's downhole unit vector with the covariance of its three parts, which is regular at every
inclination: its horizontal part, the lean l = (sin I cos A, sin I sin A), where the azimuth is not (I -> 0), and its
vertical part where a lean does not change with the inclination (I = 90 deg).
Source: thesis eqs. 1.1-1.3, with the sign of the specific force of a body at rest (up).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntFlag

import numpy as np
import numpy.typing as npt

from groundstation.errors import SurveyError
from groundstation.survey.bearings import planes_across

Array = npt.NDArray[np.float64]
GRAVITY_TOLERANCE = 0.005  # of g, largest ||f| - g| of a stop at rest
ASYMMETRY = 1e-9  # of the largest entry, rounding in the covariance of a node
CONDITION = 1e14  # beyond it the inverse of a covariance is noise
PLAINLY = 1e-10  # of the trace to the power k, the determinant (k, k) of a matrix that needs no closer look
A_FEW = 64  # numbers, up to which they are looked at one by one
UPRIGHT = 1e-9  # lean, below which there is no azimuth
SHORTEST_SETTLE = 16.0  # s, of the 32-point moving average


class Quality(IntFlag):
    """Faults of a stop as flags; 0 is good."""

    GOOD = 0
    GRAVITY = 1  # |f| is not g
    MOTION = 2  # the readings scatter more than the sensor does
    SETTLE = 4  # the average began before the stop
    SPREAD = 8  # the IMUs of the cluster disagree


@dataclass(frozen=True, slots=True, eq=False)
class Direction:
    """Direction of a tube in the north-east plane.

    ``cov`` (2, 2) is random. ``shared`` (2, s) holds the change of ``lean`` for one standard deviation of each of the
    ``s`` errors that readings share (joints, mounts, accelerometer biases); ``s`` may differ between readings, what is
    missing is zero. ``down`` is the vertical part of the direction.
    """

    lean: Array
    down: float
    cov: Array
    shared: Array

    @property
    def total_cov(self) -> Array:
        """Covariance (2, 2) with the shared errors in it."""
        shared = self.shared
        return np.asarray(self.cov + shared @ shared.T)

    @property
    def width(self) -> int:
        """Number s of shared columns."""
        return int(self.shared.shape[1])

    def fill(self, columns: Array) -> None:
        """Write the shared columns into ``columns``, zeros (2, >= s)."""
        columns[:, : self.width] = self.shared

    @property
    def information(self) -> Array:
        """Inverse (2, 2) of ``total_cov``.

        Raises
        ------
        numpy.linalg.LinAlgError
            When there is none.
        """
        return np.asarray(np.linalg.inv(self.total_cov))


def known_direction(inclination: float, azimuth: float) -> Direction:
    """A direction (rad) that is known."""
    lean = math.sin(inclination) * np.array([math.cos(azimuth), math.sin(azimuth)])
    return Direction(lean, math.cos(inclination), np.zeros((2, 2)), np.zeros((2, 0)))


@dataclass(frozen=True, slots=True)
class Resolved:
    """Resolved stops side by side, or one: directions without shared errors, and how those would act on them."""

    tangent: Array  # (n, 3), or (3,) of one: downhole unit vector
    cov: Array  # (n, 3, 3) of it
    by_force: Array  # (n, 3, 3) its change for one m/s^2 on each body axis
    by_yaw: Array  # (n, 3) its change for one rad of yaw
    yaw_var: Array  # (n,) rad^2, of what is random in the yaw; it is in the covariance

    @property
    def lean(self) -> Array:
        """Horizontal parts (n, 2)."""
        return self.tangent[..., :2]

    @property
    def direction(self) -> Direction:
        """Direction of one stop."""
        from groundstation.survey.fusion.sphere_direction import bare_direction  # which is a direction as defined here

        return bare_direction(self.tangent, self.cov, float(self.yaw_var))


def resolve_direction(force: Array, force_cov: Array, yaw: float, yaw_var: float) -> Resolved:
    """Direction from a mean specific force.

    Parameters
    ----------
    force, force_cov : (3,) m/s^2 and (3, 3), body frame x, y across, z downhole
    yaw, yaw_var : rad and rad^2, of the body about its axis from reference north

    Raises
    ------
    SurveyError
        When the force vanishes or is not finite, or nothing is uncertain in some direction across the tube.
    """
    found = resolve_all(force[None], force_cov[None], [yaw], [yaw_var])
    return Resolved(found.tangent[0], found.cov[0], found.by_force[0], found.by_yaw[0], found.yaw_var[0])


def resolve_all(forces: Array, covs: Array, yaws: Sequence[float], yaw_vars: Sequence[float] | Array) -> Resolved:
    """The same of many stops, (n, 3) and (n, 3, 3), bit for bit; raises where one of them cannot be resolved."""
    sizes = np.sqrt((forces[:, None] @ forces[:, :, None])[:, 0, 0])
    turns = np.zeros(
        (len(forces), 3, 3)
    )  # from the force in the body, which is up, to north, east and down of the tube
    turns[:, 2, 2] = -1.0
    for turn, size, yaw in zip(turns, sizes.tolist(), yaws, strict=True):
        if not math.isfinite(size) or size < 1e-3 or not math.isfinite(yaw):
            raise SurveyError(
                f"resolve: expected a finite specific force and yaw, got |f| = {size} m/s^2, yaw = {yaw} rad"
            )
        turn[0, 0] = turn[1, 1] = math.cos(yaw)
        turn[1, 0] = math.sin(yaw)
        turn[0, 1] = -turn[1, 0]
    units = forces / sizes[:, None]
    tangents = (turns @ units[:, :, None])[:, :, 0]
    by_force = (turns - tangents[:, :, None] * units[:, None]) / sizes[:, None, None]
    by_yaw = np.stack([-tangents[:, 1], tangents[:, 0], np.zeros(len(tangents))], axis=1)
    known = np.array(yaw_vars, float)
    turned = known[:, None, None] * (by_yaw[:, :, None] * by_yaw[:, None])
    found = by_force @ covs @ by_force.transpose(0, 2, 1) + turned
    axes = planes_across(tangents)
    across = axes @ found @ axes.transpose(0, 2, 1)
    if not is_covariance(across):
        raise SurveyError(f"resolve: expected a positive definite covariance across the tube, got {across.tolist()}")
    return Resolved(tangents, found, by_force, by_yaw, known)


def is_covariance(covs: Array) -> bool:
    """Whether every matrix of (..., k, k) is finite, symmetric, positive definite and safely invertible."""
    if covs.size <= A_FEW:
        for cov in covs.reshape(-1, *covs.shape[-2:]).tolist():
            if not _is_plainly_one(cov):
                break
        else:
            return True
    if not np.all(np.isfinite(covs)):
        return False
    asymmetry = np.max(np.abs(covs - np.swapaxes(covs, -1, -2)), axis=(-2, -1))
    values = np.linalg.eigvalsh(covs)
    symmetric = np.all(asymmetry <= ASYMMETRY * np.max(np.abs(covs), axis=(-2, -1)))
    return bool(symmetric and np.all(values[..., 0] * CONDITION > values[..., -1]))


def _is_plainly_one(cov: list[list[float]]) -> bool:
    """Return whether a matrix (k, k), k <= 3, is a covariance by a wide margin: a few products instead of eigenvalues.

    The smallest eigenvalue is at least the determinant over the trace to the power k - 1.
    """
    if len(cov) not in (2, 3):
        return False
    (a, other_b), (b, d) = cov[0][:2], cov[1][:2]
    size, apart = max(abs(a), abs(b), abs(d)), abs(b - other_b)
    minor = a * d - b * b
    det, trace = minor, a + d
    power = trace * trace
    if len(cov) == 3:
        (_, _, other_c), (_, _, other_e), (c, e, f) = cov
        size, apart = max(size, abs(c), abs(e), abs(f)), max(apart, abs(c - other_c), abs(e - other_e))
        det = f * minor - e * (a * e - b * c) + c * (b * e - d * c)
        trace += f
        power = trace * trace * trace  # a power of numbers of a hostile message would raise where this is infinite
    is_symmetric = apart <= ASYMMETRY * size
    return is_symmetric and a > 0.0 and minor > 0.0 and det > PLAINLY * power


def direction_angles(lean: Array, down: float) -> tuple[float, float]:
    """Inclination in [0, pi] and azimuth in [0, 2 pi) of a direction (rad)."""
    inclination = math.atan2(math.hypot(lean[0], lean[1]), down)
    azimuth = math.atan2(lean[1], lean[0]) % (2.0 * math.pi)
    return inclination, azimuth if azimuth < 2.0 * math.pi else 0.0


def angle_stds(lean: Array, down: float, cov: Array) -> tuple[float, float]:
    """Standard deviations (rad) of inclination and azimuth by the covariance (2, 2) of the lean.

    The azimuth's is at most pi, where nothing is known. A lean does not say how well the inclination of a level hole is
    known: ``sphere_direction.stds_of_directions`` does.
    """
    size = math.hypot(lean[0], lean[1])
    if size < UPRIGHT:
        return math.sqrt(float(np.trace(cov)) / 2.0), math.pi
    along, across = lean / size, np.array([-lean[1], lean[0]]) / size
    inclination = math.sqrt(max(float(along @ cov @ along), 0.0)) / max(abs(down), 1e-6)
    return inclination, min(math.sqrt(max(float(across @ cov @ across), 0.0)) / size, math.pi)


def combine_imus(forces: Array, covs: Array) -> tuple[Array, Array]:
    """Inverse-variance mean of the IMUs of a cluster: forces (..., n, 3), covariances (..., n, 3, 3).

    Source: thesis eq. 3.42.

    Raises
    ------
    SurveyError
        When one of the covariances is invalid.
    """
    if not is_covariance(covs):
        raise SurveyError(f"cluster: expected a positive definite force covariance of each IMU, got {covs.tolist()}")
    information = np.linalg.inv(covs)
    cov = np.linalg.inv(information.sum(axis=-3))
    mean = cov @ np.einsum("...nij,...nj->...i", information, forces)[..., None]
    return mean[..., 0], cov


def check_all(
    forces: Array,
    covs: Array,
    combined: tuple[Array, Array],
    gravity: float,
    samples: Sequence[int] | npt.NDArray[np.int64],
    settle_times: Sequence[float] | Array,
    sample_std: float,
) -> list[Quality]:
    """Quality of stops, (n, imus, 3) and (n, imus, 3, 3), given the combined IMUs of each, (n, 3) and (n, 3, 3).

    ``sample_std`` (m/s^2) is the sensor's own noise in one sample.
    """
    means, mean_covs = combined
    largest_var = covs.diagonal(axis1=-2, axis2=-1).max(axis=(-2, -1))
    sizes = np.sqrt((means[:, None] @ means[:, :, None])[:, 0, 0])
    spread = np.abs(forces - means[:, None]).max(axis=(-2, -1))
    spread_var = largest_var + mean_covs.diagonal(axis1=-2, axis2=-1).max(axis=-1)
    wrong = np.where(np.abs(sizes - gravity) > GRAVITY_TOLERANCE * gravity, Quality.GRAVITY, Quality.GOOD)
    wrong |= np.where(largest_var * np.asarray(samples) > (3.0 * sample_std) ** 2, Quality.MOTION, Quality.GOOD)
    wrong |= np.where(np.asarray(settle_times) < SHORTEST_SETTLE, Quality.SETTLE, Quality.GOOD)
    wrong |= np.where(spread**2 > 16.0 * spread_var, Quality.SPREAD, Quality.GOOD)
    return [Quality(each) for each in wrong.tolist()]
