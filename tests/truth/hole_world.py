"""Holes, strings and readings of a world of its own: three-dimensional rotations by scipy, nothing of the product.

Frame: north, east, down. Every function draws many worlds at once; the first axis is that of the worlds.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from scipy.spatial.transform import Rotation

Array = npt.NDArray[np.float64]
DOWN = np.array([0.0, 0.0, 1.0])
SUBSTEPS = 16  # of a leg


@dataclass(frozen=True)
class Holes:
    """Truth of many holes at collar and stations: directions and positions (w, s + 1, 3), curvatures (w, s + 1, 2)."""

    md: Array
    tangents: Array
    curvatures: Array
    positions: Array


@dataclass(frozen=True)
class TubeErrors:
    """Truth of strings: bias (w, m, 3), tilt (w, m, 2), turn (w, m) of tubes and (w, u) of make-ups; gravity (w,)."""

    bias: Array
    tilt: Array
    turn: Array
    made: Array
    gravity: Array


@dataclass(frozen=True)
class Plan:
    """Which tube looks where in which make-up: station (n,) from 1, with the noise of each look, in SI."""

    station: npt.NDArray[np.intp]
    tube: npt.NDArray[np.intp]
    make_up: npt.NDArray[np.intp]
    stop: npt.NDArray[np.intp]
    force_std: Array
    yaw_std: Array
    play_std: float


def direction(inclination: float, azimuth: float) -> Array:
    """Unit vector down the hole."""
    lean = np.sin(inclination)
    return np.array([lean * np.cos(azimuth), lean * np.sin(azimuth), np.cos(inclination)])


def frames_along(tangents: Array) -> Rotation:
    """Some rotation that takes down to each of the directions (w, 3)."""
    axis = np.cross(np.broadcast_to(DOWN, tangents.shape), tangents)
    size = np.linalg.norm(axis, axis=1, keepdims=True)
    axis = np.where(size > 1e-12, axis / np.maximum(size, 1e-12), [1.0, 0.0, 0.0])
    angle = np.arctan2(size[:, 0], tangents[:, 2])
    return Rotation.from_rotvec(axis * angle[:, None])


def draw_holes(
    rng: np.random.Generator,
    worlds: int,
    md: Array,
    collar: Array,
    collar_std: float,
    curvature_std: float | Array,
    length: float,
) -> Holes:
    """Holes whose curvature wanders and is forgotten over ``length`` (m); the collar leans off by its own error.

    ``curvature_std`` is that of all of them, or (w, 1) of each.
    """
    frame = frames_along(np.broadcast_to(collar, (worlds, 3)))
    frame = frame * Rotation.from_rotvec(np.pad(collar_std * rng.normal(size=(worlds, 2)), ((0, 0), (0, 1))))
    curved = curvature_std * rng.normal(size=(worlds, 2))
    tangents, curvatures, positions = [frame.apply(DOWN)], [curved], [np.zeros((worlds, 3))]
    at = positions[0]
    for leg in np.diff(md):
        step = leg / SUBSTEPS
        kept = np.exp(-step / length)
        for _ in range(SUBSTEPS):
            new = kept * curved + curvature_std * np.sqrt(1.0 - kept**2) * rng.normal(size=(worlds, 2))
            bend = 0.5 * step * (curved + new)
            # bending towards the frame's x is a turn about its y, towards y one about minus x
            before = frame.apply(DOWN)
            frame = frame * Rotation.from_rotvec(np.stack([-bend[:, 1], bend[:, 0], np.zeros(worlds)], axis=1))
            at = at + 0.5 * step * (before + frame.apply(DOWN))
            curved = new
        tangents.append(frame.apply(DOWN))
        curvatures.append(curved)
        positions.append(at)
    return Holes(md, *(np.stack(part, axis=1) for part in (tangents, curvatures, positions)))


def draw_tubes(
    rng: np.random.Generator,
    worlds: int,
    bias_std: Array,
    tilt_std: Array,
    told_turn: Array,
    turn_cov: Array,
    gravity: float,
    gravity_std: float,
) -> TubeErrors:
    """Tubes whose errors are as their priors say."""
    count = len(bias_std)
    turns = told_turn + rng.multivariate_normal(np.zeros(len(told_turn)), turn_cov, size=worlds, method="eigh")
    return TubeErrors(
        bias_std[:, None] * rng.normal(size=(worlds, count, 3)),
        tilt_std[:, None] * rng.normal(size=(worlds, count, 2)),
        turns[:, :count],
        turns[:, count:],
        gravity + gravity_std * rng.normal(size=worlds),
    )


def read_tubes(
    rng: np.random.Generator, plan: Plan, holes: Holes, tubes: TubeErrors, tool_faces: Array
) -> tuple[Array, Array]:
    """Forces (w, n, 3), m/s^2, and yaws (w, n), rad, that tubes read with yaws ``tool_faces`` (w, n) of their own."""
    worlds, count = tool_faces.shape
    forces, yaws = np.empty((worlds, count, 3)), np.empty((worlds, count))
    for k in range(count):
        own = plan.tube[k]
        attitude = frames_along(holes.tangents[:, plan.station[k]]) * Rotation.from_rotvec(
            tool_faces[:, k, None] * DOWN
        )
        force = attitude.inv().apply(-DOWN) * tubes.gravity[:, None]
        force = small_rotation(plan.play_std * rng.normal(size=(worlds, 2))).apply(force)
        force = small_rotation(tubes.tilt[:, own]).apply(force)
        forces[:, k] = force + tubes.bias[:, own] + plan.force_std[k] * rng.normal(size=(worlds, 3))
        turned = tubes.turn[:, own] + tubes.made[:, plan.make_up[k]]
        yaws[:, k] = tool_faces[:, k] + turned + plan.yaw_std[k] * rng.normal(size=worlds)
    return forces, yaws


def small_rotation(about_x_and_y: Array) -> Rotation:
    """Rotations about x and y (w, 2), rad."""
    return Rotation.from_rotvec(np.pad(about_x_and_y, ((0, 0), (0, 1))))
