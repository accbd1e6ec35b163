"""Holes that are drawn: kinds of bending, each a smooth course of two small angles against the axis of the design.

The course is followed every ``STEP`` (m), so that what lies between two stations of a rig is a path of its own and no
arc. Sizes are those of holes of tens of metres in soil; a shape of a record is scaled and turned about the axis.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Final

import numpy as np
import numpy.typing as npt

from sim.world.borehole import Borehole, read_displacements, read_stations
from sim.world.path_section import DrawnSection, HoleKind
from sim.world.random_streams import RandomStream, random_stream
from sim.world.shipped import shipped_folder

Array = npt.NDArray[np.float64]
STEP: Final = 0.1  # m
BUILD_DEG: Final = 0.12  # deg/m, 1 sigma of each of two constant curvatures
WALK_DEG: Final = (0.1, 0.02)  # deg/m, likewise: to one side, and across that
SOFT_DEG: Final = 0.25  # deg/m, likewise below where the soil is soft
SOFT_WITHIN: Final = (0.2, 0.8)  # of the length, where it begins
SOFT_RAMP: Final = 2.0  # m, over which the curvature sets in
SCALED: Final = (0.4, 1.2)  # of a record
WANDER_DEG: Final = 0.12  # deg/m, 1 sigma of each of two curvatures that wander
WANDER_M: Final = 12.0  # m, over which they do
Course = Callable[[np.random.Generator, Array], Array]  # of depths (n,) m: two angles (n, 2) rad


def draw_hole(section: DrawnSection, length: float) -> Borehole:
    """The hole of a kind and a number, ``length`` (m) long.

    Raises
    ------
    ScenarioError
        When the program has lost the record whose shape is wanted.
    """
    md = np.linspace(0.0, length, max(math.ceil(length / STEP), 1) + 1)
    random = random_stream(section.seed, RandomStream.DRAWN_HOLES)
    collar = math.radians(section.collar_std_deg) * random.standard_normal(2)
    return hole_of_course(section, md, collar + section.bending * COURSES[section.kind](random, md))


def hole_of_course(section: DrawnSection, md: Array, course: Array) -> Borehole:
    """The hole through the directions that lean by ``course`` (n, 2) rad from the axis: up in its plane, and across.

    A lean is an angle on the sphere and not a slope, so that a course of any size is a direction.
    """
    inclination, azimuth = math.radians(section.inclination_deg), math.radians(section.azimuth_deg)
    c, s, sine = math.cos(azimuth), math.sin(azimuth), math.sin(inclination)
    axis = np.array([sine * c, sine * s, math.cos(inclination)])
    up = np.array([math.cos(inclination) * c, math.cos(inclination) * s, -sine])
    size = np.hypot(course[:, 0], course[:, 1])
    part = np.sinc(size / math.pi)[:, None]
    tangent = np.cos(size)[:, None] * axis + part * (course[:, :1] * up + course[:, 1:] * np.array([-s, c, 0.0]))
    lean = np.hypot(tangent[:, 0], tangent[:, 1])
    return Borehole(md, np.arctan2(lean, tangent[:, 2]), np.arctan2(tangent[:, 1], tangent[:, 0]), "path.drawn")


def go_straight(_: np.random.Generator, md: Array) -> Array:
    """No bending."""
    return np.zeros((len(md), 2))


def build_evenly(random: np.random.Generator, md: Array) -> Array:
    """A constant curvature, any way."""
    return np.asarray(md[:, None] * np.radians(BUILD_DEG) * random.standard_normal(2))


def walk_aside(random: np.random.Generator, md: Array) -> Array:
    """A constant curvature to the right of the axis, where the bit walks."""
    up, right = (np.radians(WALK_DEG[::-1]) * random.standard_normal(2)).tolist()
    return np.asarray(md[:, None] * np.array([up, abs(right)]))


def bend_in_soft_soil(random: np.random.Generator, md: Array) -> Array:
    """Straight down to a layer, and a constant curvature in it, that sets in over two metres."""
    depth = md[-1] * random.uniform(*SOFT_WITHIN)
    share = np.clip((md - depth) / SOFT_RAMP, 0.0, 1.0)
    # integral of the smooth step 3 x^2 - 2 x^3 over the ramp, and then of 1
    turned = SOFT_RAMP * (share**3 - 0.5 * share**4) + np.maximum(md - depth - SOFT_RAMP, 0.0)
    return np.asarray(turned[:, None] * np.radians(SOFT_DEG) * random.standard_normal(2))


def follow_wellbore(random: np.random.Generator, md: Array) -> Array:
    """The shape of the field record of 20 m (thesis Table 4.1)."""
    return scaled_shape(random, md, *read_displacements(shipped_folder() / "wellbore-1-path.csv"))


def steer_back(random: np.random.Generator, md: Array) -> Array:
    """The shape of a hole that leaves its axis, is found to, and is steered back."""
    return scaled_shape(random, md, *read_stations(shipped_folder() / "demo-path.csv"))


def wander_about(random: np.random.Generator, md: Array) -> Array:
    """A curvature that wanders: Gauss-Markov along the hole, stationary from the collar on."""
    left = math.exp(-(md[1] - md[0]) / WANDER_M)
    draws = random.standard_normal((len(md), 2))
    curvature = np.empty_like(draws)
    curvature[0] = draws[0]
    for k in range(1, len(md)):
        curvature[k] = left * curvature[k - 1] + math.sqrt(1.0 - left**2) * draws[k]
    curvature *= math.radians(WANDER_DEG)
    turned = 0.5 * (curvature[1:] + curvature[:-1]) * np.diff(md)[:, None]
    return np.concatenate([np.zeros((1, 2)), np.cumsum(turned, axis=0)])


def scaled_shape(random: np.random.Generator, md: Array, depth: Array, inclination: Array, azimuth: Array) -> Array:
    """Course of a record over its relative depth: a part or more of its lean, turned any way about the axis."""
    from scipy.interpolate import PchipInterpolator  # half a second that only a record pays

    size, turn = random.uniform(*SCALED), random.uniform(0.0, math.tau)
    lean = inclination[:, None] * np.stack([np.cos(azimuth + turn), np.sin(azimuth + turn)], axis=1)
    return np.asarray(size * PchipInterpolator(depth / depth[-1], lean - lean[0], axis=0)(md / md[-1]))


COURSES: Final[dict[HoleKind, Course]] = {
    "straight": go_straight,
    "build": build_evenly,
    "walk": walk_aside,
    "soft": bend_in_soft_soil,
    "wellbore": follow_wellbore,
    "steered": steer_back,
    "random": wander_about,
}
