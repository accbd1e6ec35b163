"""Legs of a hole as arcs of minimum curvature: any point of them, and the point nearest to another one, exactly.

An arc leaves its upper station at P along the unit vector t and turns by the angle b over its length L towards the unit
vector n across t. At the fraction f of its length, with x = f b,

    p(f) = P + L f (sin x / x  t + (1 - cos x) / x  n)

A point q from P projects onto the circle at x = atan2(k q.t, 1 - k q.n) with the curvature k = b / L; where that lies
beyond an end of the arc, the nearer end is nearest. Both are regular as b goes to zero. m and rad.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from groundstation.survey.well.methods import sinc

Array = npt.NDArray[np.float64]
Indices = npt.NDArray[np.intp]
STRAIGHT = 1e-12  # rad, below which an arc bends to no side
ROUNDING = 1e-12  # of a distance
AT_ONCE = 1_000_000  # points times arcs that are compared together


@dataclass(frozen=True, slots=True)
class HoleArcs:
    """Arcs between the stations of a hole (s,), each from its upper station on."""

    begin: Array  # (s, 3)
    tangent: Array  # (s, 3) unit vector at the upper station
    normal: Array  # (s, 3) unit vector across it, towards which the arc turns; zero of a straight one
    length: Array  # m
    bend: Array  # rad

    @classmethod
    def of_stations(cls, md: Array, positions: Array, tangents: Array) -> HoleArcs:
        """Arcs of stations (n,) at positions (n, 3) with downhole unit vectors (n, 3)."""
        first, second = tangents[:-1], tangents[1:]
        cosine = np.sum(first * second, axis=-1)
        bend = np.arctan2(np.linalg.norm(np.cross(first, second), axis=-1), cosine)
        across = second - cosine[:, None] * first
        size = np.linalg.norm(across, axis=-1)
        normal = np.where((size > STRAIGHT)[:, None], across / np.maximum(size, STRAIGHT)[:, None], 0.0)
        return cls(positions[:-1], first, normal, np.diff(md), bend)

    def places(self, arc: Indices, fraction: Array) -> Array:
        """Points (..., 3) at fractions (...) of arcs."""
        angle, along = fraction * self.bend[arc], fraction * self.length[arc]
        forward, aside = along * sinc(np, angle), along * np.sin(0.5 * angle) * sinc(np, 0.5 * angle)
        return np.asarray(
            self.begin[arc] + forward[..., None] * self.tangent[arc] + aside[..., None] * self.normal[arc]
        )

    def tangents(self, arc: Indices, fraction: Array) -> Array:
        """Downhole unit vectors (..., 3) at fractions (...) of arcs."""
        angle = (fraction * self.bend[arc])[..., None]
        return np.asarray(np.cos(angle) * self.tangent[arc] + np.sin(angle) * self.normal[arc])

    def nearest(self, points: Array) -> tuple[Indices, Array, Array]:
        """Arc (p,), fraction (p,) and distance (p,) of the point of the hole nearest to each of ``points`` (p, 3)."""
        step = max(AT_ONCE // len(self.length), 1)
        parts = [self._nearest(points[k : k + step]) for k in range(0, len(points), step)]
        arc, fraction, distance = (np.concatenate(columns) for columns in zip(*parts, strict=True))
        return arc, fraction, distance

    def _nearest(self, points: Array) -> tuple[Indices, Array, Array]:
        """As ``nearest``, of as many points as are compared together."""
        point, arc = self._candidates(points)
        fraction = self._fractions(points[point], arc)
        distance = np.linalg.norm(points[point] - self.places(arc, fraction), axis=-1)
        order = np.lexsort((distance, point))
        best = order[np.searchsorted(point[order], np.arange(len(points)))]
        return arc[best], fraction[best], distance[best]

    def _candidates(self, points: Array) -> tuple[Indices, Indices]:
        """Pairs of a point and an arc that may be nearest to it; an arc lies within half its length of its middle."""
        half = 0.5 * self.length
        middles = self.places(np.arange(len(half)), np.full(len(half), 0.5))
        apart = np.sqrt(sum(np.subtract.outer(points[:, axis], middles[:, axis]) ** 2 for axis in range(3)))
        reach = np.min(apart + half, axis=1, keepdims=True)
        point, arc = np.nonzero(apart - half <= reach + ROUNDING * (1.0 + reach))
        return point, arc

    def _fractions(self, points: Array, arc: Indices) -> Array:
        """Fraction (k,) of arcs (k,) that is nearest to points (k, 3)."""
        from_begin = points - self.begin[arc]
        ahead, aside = (np.sum(from_begin * way[arc], axis=-1) for way in (self.tangent, self.normal))
        length, bend = self.length[arc], self.bend[arc]
        curvature = bend / length
        bent = bend > STRAIGHT
        angle = np.arctan2(curvature * ahead, 1.0 - curvature * aside)
        fraction = np.where(bent, angle / np.where(bent, bend, 1.0), ahead / length)
        to_end = np.linalg.norm(points - self.places(arc, np.ones(len(arc))), axis=-1)
        nearer_end = np.where(np.linalg.norm(from_begin, axis=-1) <= to_end, 0.0, 1.0)
        return np.where((fraction >= 0.0) & (fraction <= 1.0), fraction, nearer_end)
