"""Directions on the unit sphere: unit vectors across them, carried along a hole, and steps from one to another."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from groundstation.survey.adjustment.kernels.carried_bases import carry_bases

Array = npt.NDArray[np.float64]
Truths = npt.NDArray[np.bool_]
TINY = 1e-12
NEXT, LAST = np.array([1, 2, 0]), np.array([2, 0, 1])  # of three axes those after each
LARGE_TURN = 1.0  # rad, of an azimuth in one step, beyond which a turn about the vertical is no way there


def carried_bases(tangents: Array) -> Array:
    """Two unit vectors across each of the directions (s, 3), (s, 2, 3), carried from each to the next without twist.

    At the first direction they are as near to north and east as can be.
    """
    bases = np.empty((len(tangents), 2, 3))
    d = tangents[0]
    first = np.array([1.0, 0.0, 0.0]) if abs(d[0]) < 0.9 else np.array([0.0, 0.0, -np.sign(d[0])])
    north = first - (first @ d) * d
    bases[0, 0] = north / np.linalg.norm(north)
    bases[0, 1] = d[NEXT] * bases[0, 0, LAST] - d[LAST] * bases[0, 0, NEXT]  # their cross product
    carry_bases(tangents, bases)
    return bases


def bends_between(tangents: Array, bases: Array) -> Array:
    """Bend (s, 2), rad, from each direction to the next along the great circle, in the basis of the former."""
    before, after = tangents[:-1], tangents[1:]
    across = np.einsum("kai,ki->ka", bases[:-1], after)
    size = np.sqrt(np.add.reduce(across * across, axis=1))
    angle = np.arctan2(size, np.einsum("ki,ki->k", before, after))
    return np.asarray(across * np.where(size > TINY, angle / np.maximum(size, TINY), 1.0)[:, None])


def step_directions(tangents: Array, bases: Array, steps: Array) -> Array:
    """Directions (s, 3) after a step (s, 2), rad, along a great circle from each."""
    angle = np.sqrt(np.add.reduce(steps * steps, axis=1, keepdims=True))
    toward = np.einsum("ka,kai->ki", steps, bases) * np.sinc(angle / np.pi)
    moved = np.cos(angle) * tangents + toward
    return np.asarray(moved / np.sqrt(np.add.reduce(moved * moved, axis=1, keepdims=True)))


def step_about_vertical(tangents: Array, bases: Array, steps: Array, turns: Truths) -> Array:
    """Directions (s, 3) after a step (s, 2), rad, which leaves the inclination where it turns the azimuth.

    Where yaws are poor a step is a turn by many degrees, and a great circle would leave the inclination, of which the
    looks are a thousand times as sure.

    Parameters
    ----------
    turns : (s,), which directions are to be turned so; others, and those that turn by more than a rad, go straight on
    """
    straight = step_directions(tangents, bases, steps)
    if not turns.any():
        return straight
    x, y, z = tangents.T
    lean = np.hypot(x, y)
    north, east, down = np.einsum("ka,kai->ik", steps, bases)
    far = np.maximum(lean, TINY)
    turn = (east * x - north * y) / far**2
    inclination, azimuth = np.arctan2(lean, z) - down / far, np.arctan2(y, x) + turn
    level = np.sin(inclination)
    turned = np.stack([level * np.cos(azimuth), level * np.sin(azimuth), np.cos(inclination)], axis=1)
    return np.where((turns & (np.abs(turn) < LARGE_TURN))[:, None], turned, straight)
