"""Holes of known kinds, drilled in space without a string: how they bend is drawn, and where they go is integrated.

Nothing here knows how the ground station foresees a hole: curvatures are drawn by kind, the frame along the hole is
turned step by step, and positions are the integral of the direction. The constants are other ones than the prior's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from sim.studies.published import wellbore_1
from sim.world.random_streams import RandomStream, random_stream

Array = npt.NDArray[np.float64]
LENGTH = 30.0  # m, of the design
STEP = 0.05  # m, of the integration
BEYOND = 2.0  # m, drilled beyond the design's length, that a leaning hole comes to its depth
STEEPEST = math.radians(60.0)  # inclination of a design


@dataclass(frozen=True, slots=True)
class DrilledGround:
    """Constants of a ground, deg and m; ``scale`` is of every curvature."""

    collar_deg: float = 0.1  # of the direction at the collar against the design
    build_deg: float = 0.16  # deg/m, of a constant build
    walk_deg: float = 0.13  # deg/m, of a walk to the right
    layer_m: tuple[float, float] = (2.0, 30.0)  # where a layer begins
    bend_deg: float = 0.2  # deg/m, by which it bends
    random_deg: float = 0.05  # deg/m a root metre, by which a curvature changes
    wave_m: tuple[float, float] = (15.0, 60.0)  # length of a wave
    stretch: tuple[float, float] = (1.6, 2.4)  # of the length of a recorded shape
    shape: float = 0.45  # of the logarithm of the size of a recorded shape
    scale: float = 1.0


Bend = Callable[[np.random.Generator, DrilledGround, Array], Array]


def _straight(_random: np.random.Generator, _ground: DrilledGround, places: Array) -> Array:
    return np.zeros((len(places), 2))


def _constant_build(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """Bent evenly in one direction."""
    return np.broadcast_to(ground.build_deg * random.normal() * _direction(random), (len(places), 2))


def _walk_to_the_right(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """Bent to the right of a build that is a third as large."""
    ahead = _direction(random)
    right = np.array([-ahead[1], ahead[0]])
    walk = abs(random.normal()) * right + random.normal() * ahead / 3.0
    return np.broadcast_to(ground.walk_deg * walk, (len(places), 2))


def _soft_layer(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """Straight to a depth, and bent from there on."""
    begins = random.uniform(*ground.layer_m)
    return np.where(places[:, None] > begins, ground.bend_deg * random.normal(size=2), 0.0)


def _wellbore_1(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """The published bore of 20 m drawn out to the length of the hole or more, of another size, in any direction."""
    record = wellbore_1()
    stretch = random.uniform(*ground.stretch)
    leans = record.inclination * np.stack([np.cos(record.azimuth), np.sin(record.azimuth)])
    ends = (places[:, None] + STEP * np.array([-0.5, 0.5])) / stretch
    turned = np.stack([np.diff(np.interp(ends, record.md, lean))[:, 0] for lean in leans], axis=1)
    along = _direction(random)
    towards = np.array([along, [-along[1], along[0]]])
    return np.asarray(math.exp(ground.shape * random.normal()) * np.degrees(turned) / STEP / stretch @ towards)


def _wave(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """Bent to one side and back again."""
    length, begins = random.uniform(*ground.wave_m), random.uniform(0.0, math.tau)
    size = ground.build_deg * random.normal() * _direction(random)
    return np.sin(math.tau * places / length + begins)[:, None] * size


def _wanders(random: np.random.Generator, ground: DrilledGround, places: Array) -> Array:
    """A curvature that changes at random and is never forgotten."""
    steps = random.normal(size=(len(places), 2)) * math.sqrt(places[1] - places[0])
    return np.asarray(ground.random_deg * np.cumsum(steps, axis=0))


KINDS: dict[str, Bend] = {
    "straight": _straight,
    "constant build": _constant_build,
    "walk to the right": _walk_to_the_right,
    "soft layer": _soft_layer,
    "wellbore 1": _wellbore_1,
    "wave": _wave,
    "wanders": _wanders,
}


@dataclass(frozen=True, slots=True)
class DrilledHole:
    """The truth of one hole: its design, and its course by measured depth."""

    kind: str
    inclination: float  # rad, of the design
    azimuth: float
    md: Array  # (m,) m
    tangents: Array  # (m, 3)
    positions: Array  # (m, 3) m

    def end(self, axis: Array) -> Array:
        """Where it crosses the plane across the design ``axis`` (3,) at its length: (3,) m."""
        along = self.positions @ axis
        return np.array([np.interp(LENGTH, along, column) for column in self.positions.T])


def drill_holes(seed: int, numbers: Sequence[int], ground: DrilledGround) -> list[DrilledHole]:
    """Drill holes, each of the kind that is its number's turn, by a stream of its own."""
    md = STEP * np.arange(float(round((LENGTH + BEYOND) / STEP) + 1))
    kinds = [list(KINDS)[number % len(KINDS)] for number in numbers]
    drawn = [
        _drawn(random_stream(seed, RandomStream.PATHS, n), kind, ground, md)
        for n, kind in zip(numbers, kinds, strict=True)
    ]
    designs, offs, bends = zip(*drawn, strict=True)
    frames = _turned(np.array([_frame_of(*design) for design in designs]), np.radians(offs))
    turns = np.radians(np.array(bends) * STEP)
    tangents = np.empty((len(drawn), len(md), 3))
    tangents[:, 0] = frames[:, 2]
    for k in range(1, len(md)):
        frames = _turned(frames, turns[:, k - 1])
        tangents[:, k] = frames[:, 2]
    positions = np.zeros_like(tangents)
    positions[:, 1:] = np.cumsum(0.5 * STEP * (tangents[:, :-1] + tangents[:, 1:]), axis=1)
    return [
        DrilledHole(kind, inclination, azimuth, md, directions, places)
        for kind, (inclination, azimuth), directions, places in zip(kinds, designs, tangents, positions, strict=True)
    ]


def _drawn(
    random: np.random.Generator, kind: str, ground: DrilledGround, md: Array
) -> tuple[tuple[float, float], Array, Array]:
    """Inclination and azimuth of a design (rad), what the collar is off it (deg), and the curvature (deg/m)."""
    design = random.uniform(0.0, STEEPEST), random.uniform(0.0, math.tau)
    off = ground.collar_deg * random.normal(size=2)
    return design, off, ground.scale * KINDS[kind](random, ground, md[:-1] + 0.5 * STEP)


def _direction(random: np.random.Generator) -> Array:
    towards = random.uniform(0.0, math.tau)
    return np.array([math.cos(towards), math.sin(towards)])


def _frame_of(inclination: float, azimuth: float) -> Array:
    """Rows: two axes across a direction and the direction, north east down."""
    s, c = math.sin(inclination), math.cos(inclination)
    sin, cos = math.sin(azimuth), math.cos(azimuth)
    return np.array([[c * cos, c * sin, -s], [-sin, cos, 0.0], [s * cos, s * sin, c]])


def _turned(frames: Array, turns: Array) -> Array:
    """Frames (n, 3, 3) after their directions have turned by angles (n, 2) towards their two axes."""
    angles = np.hypot(*turns.T)[:, None]
    units = turns / np.where(angles > 0.0, angles, 1.0)
    towards, ahead = np.einsum("ni,nij->nj", units, frames[:, :2]), frames[:, 2]
    moved = np.cos(angles) * towards - np.sin(angles) * ahead
    axes = frames[:, :2] + units[:, :, None] * (moved - towards)[:, None]
    return np.concatenate([axes, (np.cos(angles) * ahead + np.sin(angles) * towards)[:, None]], axis=1)
