"""The best possible estimate of the same looks: dense least squares at the truth, with the true variances.

It shares no code with the ground station's adjustment: unknowns stand in one matrix, derivatives are differences, and
the path is a covariance of all stations at once. No unbiased estimate that knows no more of the rig can be better
(Cramer and Rao; the priors are measurements of their own).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from borechain.studies.drawn_rigs import KnownSetUp
from groundstation.config import GroundConfig
from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.surveyed_hole import SurveyedHole
from sim.world.world import World

Array = npt.NDArray[np.float64]
Places = npt.NDArray[np.intp]
STEP = 1e-5  # rad and m/s^2, of differences
OF_TUBE = 5  # bias (3) and tilt (2)
LEAST = 1e-7  # m/s^2 and rad, of what is known


@dataclass(frozen=True, slots=True)
class TrueLooks:
    """Looks of a rig as they were made.

    Parameters
    ----------
    station, tube, top : (n,) places from 0, the last of the topmost tube at that time
    yaw : (n,) rad, true
    yaw_var, force_var : (n,) rad^2 and (m/s^2)^2, of their noise
    tangents : (s, 3), true directions at the stations
    """

    station: Places
    tube: Places
    top: Places
    yaw: Array
    yaw_var: Array
    force_var: Array
    tangents: Array


@dataclass(frozen=True, slots=True)
class TrueSpread:
    """What tubes, marks and path were drawn from.

    Parameters
    ----------
    bias_std, tilt_std, play_std : m/s^2, rad and rad
    mount_std, joint_std, north_std : rad, of the turn of every mount, of every mark, and of the encoder's zero
    path_cov : (2 s, 2 s) rad^2, of the directions at the stations about two axes
    gravity, gravity_std : m/s^2
    """

    bias_std: float
    tilt_std: float
    play_std: float
    mount_std: float
    joint_std: float
    north_std: float
    path_cov: Array
    gravity: float = 9.81
    gravity_std: float = 2e-3


def best_direction_cov(looks: TrueLooks, spread: TrueSpread) -> Array:
    """Covariance (2 s, 2 s), rad^2, of the directions at the stations about two axes across each."""
    directions, tubes = 2 * len(looks.tangents), 1 + int(max(looks.tube.max(), looks.top.max()))
    own = np.tile([*(spread.bias_std,) * 3, *(spread.tilt_std,) * 2], tubes)
    turns = np.repeat([spread.mount_std, spread.joint_std, spread.joint_std], tubes)
    stds = np.concatenate([own, turns, [spread.north_std, spread.gravity_std]])
    information = np.zeros((directions + len(stds),) * 2)
    information[:directions, :directions] = np.linalg.inv(spread.path_cov)
    information[directions:, directions:] = np.diag(stds**-2.0)
    bases = axes_across(looks.tangents)
    for look in range(len(looks.station)):
        derivative, noise = look_equations(looks, look, bases, spread, tubes, len(information))
        information += derivative.T @ np.linalg.solve(noise, derivative)
    return np.asarray(np.linalg.inv(information)[:directions, :directions])


def look_equations(
    looks: TrueLooks, look: int, bases: Array, spread: TrueSpread, tubes: int, size: int
) -> tuple[Array, Array]:
    """How the force (3,) of one look changes with every unknown (3, size), and the covariance (3, 3) of its noise."""
    station, tube, top = (int(places[look]) for places in (looks.station, looks.tube, looks.top))

    def force(values: Array, play: Array) -> Array:
        lean = looks.tangents[station] + values[:2] @ bases[station]
        gravity, yaw = spread.gravity + values[8], looks.yaw[look] - values[7]
        felt = gravity * seen_up(lean / np.linalg.norm(lean), yaw, values[5:7] + play)
        return np.asarray(felt + values[2:5])

    nothing, still = np.zeros(9), np.zeros(2)
    here = force(nothing, still)
    by_own = np.stack([(force(STEP * one, still) - here) / STEP for one in np.eye(9)], axis=1)
    by_play = np.stack([(force(nothing, STEP * one) - here) / STEP for one in np.eye(2)], axis=1)
    first = 2 * len(looks.tangents)
    derivative = np.zeros((3, size))
    derivative[:, 2 * station : 2 * station + 2] = by_own[:, :2]
    derivative[:, first + OF_TUBE * tube : first + OF_TUBE * (tube + 1)] = by_own[:, 2:7]
    marks = first + OF_TUBE * tubes
    # what a yaw is told too large by: the mark at the head and those down to the tube, less mount and north
    derivative[:, marks + tube] = -by_own[:, 7]
    derivative[:, marks + tubes + tube + 1 : marks + tubes + top + 1] = by_own[:, 7:8]
    derivative[:, marks + 2 * tubes + top] = by_own[:, 7]
    derivative[:, marks + 3 * tubes] = -by_own[:, 7]
    derivative[:, -1] = by_own[:, 8]
    noise = looks.force_var[look] * np.eye(3) + looks.yaw_var[look] * np.outer(by_own[:, 7], by_own[:, 7])
    return derivative, noise + spread.play_std**2 * by_play @ by_play.T


def seen_up(direction: Array, yaw: float, tilt: Array) -> Array:
    """What a tube along a unit vector down the hole feels (3,), in parts of gravity, its IMU tilted about x and y."""
    c, s = math.cos(yaw), math.sin(yaw)
    north, east, down = direction.tolist()
    felt = np.array([c * north + s * east, c * east - s * north, -down])
    return np.asarray(felt + np.cross([tilt[0], tilt[1], 0.0], felt))


def axes_across(tangents: Array) -> Array:
    """Two unit vectors (s, 2, 3) across each direction."""
    first = np.cross(tangents, [0.0, 1.0, 0.0])
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([first, np.cross(tangents, first)], axis=1)


def path_covariance(md: Array, collar_std: float, curvature_std: float, length: float) -> Array:
    """Covariance (2 s, 2 s), rad^2, of directions at depths (s,) m below a collar, of a curvature that wanders.

    The curvature has the covariance ``sigma^2 exp(-|u - v| / l)``; its double integral is in closed form.
    """
    low, high = np.minimum(md[:, None], md), np.maximum(md[:, None], md)
    bent = 2.0 * length * low - length**2 * (
        1.0 - np.exp(-low / length) - np.exp(-high / length) + np.exp(-(high - low) / length)
    )
    return np.asarray(np.kron(collar_std**2 + curvature_std**2 * bent, np.eye(2)), np.float64)


def best_of_rig(world: World, hole: SurveyedHole, config: GroundConfig, known: KnownSetUp) -> Array:
    """Best standard deviations (s,), rad, of the directions at the stations of a rig, over two axes.

    The looks are those that the ground station has; the path is known before as the ground station knows it.
    """
    stations = [station for station in hole.stations if station.md > 0.0]
    rows = [(place, *row) for place, station in enumerate(stations) for row in look_rows(station)]
    place, tube, at, yaw_var, force_var = np.array(rows).T
    tubes = tube.astype(np.intp)
    depths = np.array([float(np.mean(at_station(world, rows, k))) for k in range(len(stations))])
    looks = TrueLooks(
        place.astype(np.intp),
        tubes - 1,
        world.motion.tops(at) - 1,
        np.array([world.yaw_truth(one, t) for one, t in zip(tubes.tolist(), at.tolist(), strict=True)]),
        yaw_var,
        np.full(len(rows), float(np.mean(force_var))),
        world.scenario.hole.tangent(depths)[0],
    )
    gravity = world.scenario.file.accelerometer.gravity_mps2
    path = path_covariance(
        depths,
        math.radians(known.collar_deg),
        math.radians(config.curvature_std_deg_per_m),
        config.curvature_length,
    )
    spread = TrueSpread(
        max(known.bias_mg * 1e-3 * gravity, LEAST),
        max(math.radians(known.tilt_deg), LEAST),
        math.radians(known.play_deg),
        math.radians(known.mount_deg),
        math.radians(known.joint_deg),
        math.radians(known.north_deg),
        path,
        gravity,
    )
    variances = np.diag(best_direction_cov(looks, spread)).reshape(-1, 2)
    return np.asarray(np.sqrt(variances.mean(axis=1)))


def look_rows(station: SurveyStation) -> list[tuple[float, ...]]:
    """Tube, rig time, variance of the yaw's random part and of the force of every reading of a station."""
    names = ("tube", "at", "yaw_var", "force_var")
    return list(zip(*(station.stops.column(name).tolist() for name in names), strict=True))


def at_station(world: World, rows: list[tuple[float, ...]], place: int) -> list[float]:
    """True depths (m) of the readings at one station."""
    return [world.bit_depth(row[2]) - world.below(int(row[1])) for row in rows if row[0] == place]
