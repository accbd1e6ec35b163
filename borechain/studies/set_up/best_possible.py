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
OF_TUBE = 6  # bias (3), tilt (2), turn
LEAST = 1e-7  # m/s^2 and rad, of what is known


@dataclass(frozen=True, slots=True)
class TrueLooks:
    """Looks of a rig as they were made.

    Parameters
    ----------
    station, tube : (n,) places from 0
    yaw : (n,) rad, true
    yaw_var, force_var : (n,) rad^2 and (m/s^2)^2, of their noise
    tangents : (s, 3), true directions at the stations
    """

    station: Places
    tube: Places
    yaw: Array
    yaw_var: Array
    force_var: Array
    tangents: Array


@dataclass(frozen=True, slots=True)
class TrueSpread:
    """What tubes and path were drawn from.

    Parameters
    ----------
    bias_std, tilt_std, play_std : m/s^2, rad and rad
    turn_cov : (m, m) rad^2, of the turns of the yaws of the tubes
    path_cov : (2 s, 2 s) rad^2, of the directions at the stations about two axes
    gravity, gravity_std : m/s^2
    """

    bias_std: float
    tilt_std: float
    play_std: float
    turn_cov: Array
    path_cov: Array
    gravity: float = 9.81
    gravity_std: float = 2e-3


def best_direction_cov(looks: TrueLooks, spread: TrueSpread) -> Array:
    """Covariance (2 s, 2 s), rad^2, of the directions at the stations about two axes across each."""
    stations, tubes = len(looks.tangents), len(spread.turn_cov)
    bases = axes_across(looks.tangents)
    size = 2 * stations + OF_TUBE * tubes + 1
    information = np.zeros((size, size))
    information[: 2 * stations, : 2 * stations] = np.linalg.inv(spread.path_cov)
    stds = np.tile([*(spread.bias_std,) * 3, *(spread.tilt_std,) * 2, 1.0], tubes)
    of_tubes = np.diag(stds**-2.0)
    turns = np.arange(tubes) * OF_TUBE + OF_TUBE - 1
    of_tubes[np.ix_(turns, turns)] = np.linalg.inv(spread.turn_cov)
    information[2 * stations : -1, 2 * stations : -1] = of_tubes
    information[-1, -1] = spread.gravity_std**-2.0
    for look in range(len(looks.station)):
        add_look(information, looks, look, bases, spread)
    return np.asarray(np.linalg.inv(information)[: 2 * stations, : 2 * stations])


def add_look(information: Array, looks: TrueLooks, look: int, bases: Array, spread: TrueSpread) -> None:
    """Add what one look tells."""
    station, tube = int(looks.station[look]), int(looks.tube[look])
    unknown = np.zeros(2 + OF_TUBE + 1)

    def force(values: Array, yaw_error: float = 0.0, play: Array | None = None) -> Array:
        lean = looks.tangents[station] + values[:2] @ bases[station]
        tilt = values[5:7] + (0.0 if play is None else play)
        gravity = spread.gravity + values[-1]
        return (
            gravity * seen_up(lean / np.linalg.norm(lean), looks.yaw[look] - values[7] + yaw_error, tilt) + values[2:5]
        )

    here = force(unknown)
    by_unknown = np.stack([(force(unknown + STEP * one) - here) / STEP for one in np.eye(len(unknown))], axis=1)
    by_yaw = (force(unknown, STEP) - here) / STEP
    by_play = np.stack([(force(unknown, 0.0, STEP * one) - here) / STEP for one in np.eye(2)], axis=1)
    noise = looks.force_var[look] * np.eye(3) + looks.yaw_var[look] * np.outer(by_yaw, by_yaw)
    noise += spread.play_std**2 * by_play @ by_play.T
    first = 2 * len(looks.tangents)
    own = first + OF_TUBE * tube
    places = np.array([2 * station, 2 * station + 1, *range(own, own + OF_TUBE), len(information) - 1])
    information[np.ix_(places, places)] += by_unknown.T @ np.linalg.solve(noise, by_unknown)


def seen_up(direction: Array, yaw: float, tilt: Array) -> Array:
    """What a tube along a unit vector down the hole feels (3,), in parts of gravity, its IMU tilted about x and y."""
    c, s = math.cos(yaw), math.sin(yaw)
    north, east, down = direction.tolist()
    felt = np.array([c * north + s * east, c * east - s * north, -down])
    return felt + np.cross([tilt[0], tilt[1], 0.0], felt)


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
    return np.kron(collar_std**2 + curvature_std**2 * bent, np.eye(2))


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
        turn_covariance(world.scenario.tubes, known),
        path,
        gravity,
    )
    variances = np.diag(best_direction_cov(looks, spread)).reshape(-1, 2)
    return np.sqrt(variances.mean(axis=1))


def look_rows(station: SurveyStation) -> list[tuple[float, ...]]:
    """Tube, rig time, variance of the yaw's random part and of the force of every reading of a station."""
    names = ("tube", "at", "yaw_var", "force_var")
    return list(zip(*(station.stops.column(name).tolist() for name in names), strict=True))


def at_station(world: World, rows: list[tuple[float, ...]], place: int) -> list[float]:
    """True depths (m) of the readings at one station."""
    return [world.bit_depth(row[2]) - world.below(int(row[1])) for row in rows if row[0] == place]


def turn_covariance(tubes: int, known: KnownSetUp) -> Array:
    """Covariance (m, m), rad^2, of the yaws of tubes: mounts, joints that add up from the top down, north."""
    mounts = math.radians(known.mount_deg) ** 2 * np.eye(tubes)
    numbers = np.arange(tubes)
    above = tubes - np.maximum(numbers[:, None], numbers)  # joints that two tubes have above them both
    joints = math.radians(known.joint_deg) ** 2 * above
    return np.asarray(mounts + joints + math.radians(known.north_deg) ** 2)
