"""Arcs between two directions: the shape of a leg by the minimum curvature method.

A leg of length D that bends by the angle b from the unit tangent t1 to t2 is moved by D/2 RF (t1 + t2) with
RF = (2/b) tan(b/2). It is worked out from the tangents themselves, so it is regular at every inclination.
Frame: north, east, down; m and rad. Source: Sawaryn and Thorogood, SPE 84246-PA.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from groundstation.survey.well.methods import OPPOSITE, SMALL

Array = npt.NDArray[np.float64]
STRAIGHT = 1e-9  # rad, of a bend


def bend_angles(upper: Array, lower: Array) -> Array:
    """Angles (...,), 0 to pi rad, between tangents (..., 3); exact where they are small."""
    cross = np.cross(upper, lower)
    return np.asarray(np.arctan2(np.sqrt((cross * cross).sum(axis=-1)), (upper * lower).sum(axis=-1)))


def arc_displacements(lengths: Array, upper: Array, lower: Array) -> Array:
    """Displacements (n, 3) of legs of lengths (n,) between tangents (n, 3).

    Where the two are opposite no arc is defined: such a leg leads nowhere, as the mean of its tangents does.
    """
    chords = lower - upper
    bends = 2.0 * np.arcsin(np.minimum(0.5 * np.sqrt(np.vecdot(chords, chords)), 1.0))
    if bends.min(initial=math.inf) > SMALL and bends.max(initial=0.0) < math.pi - OPPOSITE:
        return np.asarray((0.5 * lengths * (2.0 / bends * np.tan(0.5 * bends)))[:, None] * (upper + lower))
    bent = (bends > SMALL) & (bends < math.pi - OPPOSITE)
    safe = np.where(bent, bends, 1.0)
    factors = np.where(bent, 2.0 / safe * np.tan(0.5 * safe), 1.0 + np.where(bends < SMALL, bends * bends / 12.0, 0.0))
    return np.asarray((0.5 * lengths * factors)[:, None] * (upper + lower))


def turned_tangents(upper: Array, lower: Array, shares: Array) -> Array:
    """Tangents (n, 3) at shares (n,) of arcs between tangents (n, 3)."""
    bends, f = bend_angles(upper, lower), shares[:, None]
    bent = np.clip(bends, STRAIGHT, math.pi - OPPOSITE)[:, None]
    turned = (np.sin((1.0 - f) * bent) * upper + np.sin(f * bent) * lower) / np.sin(bent)
    return np.where((bends < STRAIGHT)[:, None], upper + f * (lower - upper), turned)


def on_arc(upper: Array, lower: Array, displacement: Array, leg: float, share: float) -> tuple[Array, Array]:
    """Displacement (3,) from the upper station to a share of a leg (m) between tangents (3,), and the tangent there.

    The arc is bent evenly so that it ends where the method put the lower station, ``displacement`` (3,) from the upper.
    """
    tangent = turned_tangents(upper[None], lower[None], np.array([share]))[0]
    arc = arc_displacements(np.array([share * leg, leg]), np.array([upper, upper]), np.array([tangent, lower]))
    return arc[0] + share * (displacement - arc[1]), tangent
