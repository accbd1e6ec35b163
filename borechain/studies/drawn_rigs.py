"""Rigs whose set-up errs as it is stated: scenarios of a kind of hole, drawn from sigmas by a number."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from sim.studies.scenarios import Tables, change_sections
from sim.world.path_section import HOLE_KINDS, HoleKind
from sim.world.random_streams import RandomStream, random_stream

TUBES: Final = 10
LENGTH: Final = 2.0  # m, of a tube
MILLI_G_DEG: Final = math.degrees(1e-3)  # deg, of the tilt that a bias of 1 mg is seen as
TURNS: Final = 5.0  # of a block: without a spread the same tool face comes again
ANYWHERE: Final[dict[str, Any]] = {"samples_hz": 50.0, "drive": {"stop_spread_deg": 360.0}}  # a driller who stops so


@dataclass(frozen=True, slots=True)
class KnownSetUp:
    """How well the set-up of a rig is known: what the crew states, and by which a seed draws what is so; 1 sigma.

    Attributes
    ----------
    bias_mg : of each axis of every accelerometer
    tilt_deg, mount_deg : of every mount, across and about the axis of its tube
    joint_deg : of every mark
    north_deg, collar_deg : of the encoder's zero, and of the direction of the collar each way
    play_deg : of a tube in the hole, at every stop
    length_m : of every tube
    depth_scale, depth_offset_m, depth_m : of the measured depth, the last at every stop
    """

    bias_mg: float = 1.0
    tilt_deg: float = 0.5
    mount_deg: float = 0.05
    joint_deg: float = 0.05
    north_deg: float = 0.1
    collar_deg: float = 0.15
    play_deg: float = 0.01
    length_m: float = 1e-3
    depth_scale: float = 5.6e-4
    depth_offset_m: float = 0.01
    depth_m: float = 2e-3


@dataclass(frozen=True, slots=True)
class RigDraw:
    """One rig: how well it is known, its hole, and whether it stops at any tool face."""

    known: KnownSetUp
    seed: int
    kind: HoleKind
    stops_anywhere: bool = True
    inclination_deg: float = 2.0
    azimuth_deg: float = -110.0


def tables_of(draw: RigDraw) -> Tables:
    """Scenario of a rig."""
    known = draw.known
    stops = {"rough": ANYWHERE} if draw.stops_anywhere else {}
    return stops | {
        "rig": {"tubes": TUBES, "tube_length_m": LENGTH},
        "path": {
            "drawn": {
                "kind": draw.kind,
                "seed": draw.seed,
                "inclination_deg": draw.inclination_deg,
                "azimuth_deg": draw.azimuth_deg,
            }
        },
        "schedule": {"add_s": 58.0, "stop_s": 26.0, "finish_s": 10.0},
        "rotation": {"turns": TURNS},
        "joints": {
            "reading_std_deg": known.joint_deg,
            "mount_std_deg": known.mount_deg,
            "mount_tilt_std_deg": known.tilt_deg,
        },
        "accelerometer": {"bias_std_deg": known.bias_mg * MILLI_G_DEG},
        "design": {"inclination_deg": draw.inclination_deg, "azimuth_deg": draw.azimuth_deg},
        "medium": {"link": "off"},
        "encoder": {"phase": "locked"},
        "disturbance": {"play": {"sigma_deg": known.play_deg}},
        "told": drawn_errors(known, draw.seed),
        "setup": {
            "north_std_deg": known.north_deg,
            "collar_std_deg": known.collar_deg,
            "stick_up_std_m": known.depth_offset_m,
        },
    }


def drawn_errors(known: KnownSetUp, seed: int) -> dict[str, Any]:
    """What the crew of a seed tells wrongly, as far off as it states."""
    draws = random_stream(seed, RandomStream.SET_UP).standard_normal(5 + TUBES + 2)
    north, collar_north, collar_east, scale, offset = draws[:5].tolist()
    return {
        "north_deg": known.north_deg * north,
        "collar_north_deg": known.collar_deg * collar_north,
        "collar_east_deg": known.collar_deg * collar_east,
        "depth_scale": known.depth_scale * scale,
        "depth_offset_m": known.depth_offset_m * offset,
        "depth_std_m": known.depth_m,
        "lengths_off_m": tuple((known.length_m * draws[5 : 5 + TUBES]).tolist()),
        "north_check_deg": known.north_deg * float(draws[-2]),
        "stick_up_check_m": known.depth_offset_m * float(draws[-1]),
    }


def drawn_rigs(known: KnownSetUp, seeds: int, first: int = 1, *, stops_anywhere: bool = True) -> list[RigDraw]:
    """Rigs of as many numbers from the first on, the kinds of holes in turn."""
    numbers = range(first, first + seeds)
    return [RigDraw(known, seed, HOLE_KINDS[seed % len(HOLE_KINDS)], stops_anywhere) for seed in numbers]


def change_tables(tables: Tables, **sections: dict[str, Any]) -> Tables:
    """The scenario with other values of some keys, and further disturbances."""
    disturbance = {**tables.get("disturbance", {}), **sections.pop("disturbance", {})}
    return {**change_sections(tables, **sections), "disturbance": disturbance}


def rms_of(values: Any) -> float:
    """Root mean square; NaN of nothing."""
    found = np.asarray(values, np.float64)
    return float(np.sqrt(np.mean(found**2))) if found.size else math.nan
