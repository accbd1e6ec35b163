"""Holes of known kinds, drilled in space without a string: how they bend is drawn, and where they go is integrated.

Nothing here knows how the ground station foresees a hole: curvatures are drawn by kind, the frame along the hole is
turned step by step, and positions are the integral of the direction. The constants are other ones than the prior's.
"""

from __future__ import annotations

import math
from collections.abc import Callable
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

    collar_deg: float = 0.2  # of the direction at the collar against the design
    build_deg: float = 0.16  # deg/m, of a constant build
    walk_deg: float = 0.13  # deg/m, of a walk to the right
    layer_m: tuple[float, float] = (4.0, 27.0)  # where a layer begins
    bend_deg: float = 0.2  # deg/m, by which it bends
    random_deg: float = 0.05  # deg/m a root metre, by which a curvature changes
    wave_m: tuple[float, float] = (15.0, 60.0)  # length of a wave
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
    """The published bore of 20 m drawn out to the length of the hole, of another size and towards any direction."""
    record = wellbore_1()
    stretch = LENGTH / record.md[-1]
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


def drill_hole(seed: int, number: int, ground: DrilledGround) -> DrilledHole:
    """Drill one hole of the kind that is its number's turn, by a stream of its own."""
    random = random_stream(seed, RandomStream.PATHS, number)
    kind = list(KINDS)[number % len(KINDS)]
    inclination, azimuth = random.uniform(0.0, STEEPEST), random.uniform(0.0, math.tau)
    md = np.arange(round((LENGTH + BEYOND) / STEP) + 1) * STEP
    off = ground.collar_deg * random.normal(size=2)
    bends = ground.scale * KINDS[kind](random, ground, md[:-1] + 0.5 * STEP)
    frame = _turned(_frame_of(inclination, azimuth), np.radians(off))
    tangents = np.empty((len(md), 3))
    tangents[0] = frame[2]
    for k, turn in enumerate(np.radians(bends * STEP), 1):
        frame = _turned(frame, turn)
        tangents[k] = frame[2]
    legs = 0.5 * STEP * (tangents[:-1] + tangents[1:])
    positions = np.concatenate([np.zeros((1, 3)), np.cumsum(legs, axis=0)])
    return DrilledHole(kind, inclination, azimuth, md, tangents, positions)


def _direction(random: np.random.Generator) -> Array:
    towards = random.uniform(0.0, math.tau)
    return np.array([math.cos(towards), math.sin(towards)])


def _frame_of(inclination: float, azimuth: float) -> Array:
    """Rows: two axes across a direction and the direction, north east down."""
    s, c = math.sin(inclination), math.cos(inclination)
    sin, cos = math.sin(azimuth), math.cos(azimuth)
    return np.array([[c * cos, c * sin, -s], [-sin, cos, 0.0], [s * cos, s * sin, c]])


def _turned(frame: Array, turn: Array) -> Array:
    """Frame (3, 3) after its direction has turned by angles (2,) towards its two axes, without turning about itself."""
    angle = math.hypot(*turn.tolist())
    if angle == 0.0:
        return frame
    towards = (turn / angle) @ frame[:2]
    ahead = math.cos(angle) * frame[2] + math.sin(angle) * towards
    moved = math.cos(angle) * towards - math.sin(angle) * frame[2]
    return np.stack([*(axis + (axis @ towards) * (moved - towards) for axis in frame[:2]), ahead])
