"""What the operator enters at the ground station of a simulated rig."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from sim.world.scenario_file import EXACTLY_DEG

if TYPE_CHECKING:
    from sim.world.world import World


def ground_settings(world: World) -> dict[str, Any]:
    """What the operator enters at the ground station: tally, design, and what calibration left."""
    file = world.scenario.file
    transport = {} if file.rough is None else {"string_transport": file.rough.string.transport}
    return {
        "tube_length": world.scenario.tube_length,
        "gravity": file.accelerometer.gravity_mps2,
        "accelerometer_bias_std_deg": file.accelerometer.bias_std_deg,
        "mount_std_deg": file.joints.mount_std_deg,
        "target": file.design.length_m or world.scenario.tubes * world.scenario.tube_length,
        "design_inclination_deg": file.design.inclination_deg,
        "design_azimuth_deg": file.design.azimuth_deg,
        "column_radius": file.design.radius_m,
        "tolerance": file.design.tolerance,
    } | (transport | told_settings(world) | plan_settings(world))


def plan_settings(world: World) -> dict[str, Any]:
    """What the operator enters where the design has legs."""
    design = world.scenario.file.design
    if not design.leg:
        return {}
    legs = [leg.model_dump(exclude_defaults=True) for leg in design.leg]
    first = {"inclination_deg": design.inclination_deg, "azimuth_deg": design.azimuth_deg}
    return {"plan": first | {"leg": legs}}


def told_settings(world: World) -> dict[str, Any]:
    """What the crew tells of the rig: the truth, but for what it tells wrongly or does not tell."""
    told = world.scenario.file.setup
    inclination, azimuth = told_collar(world)
    by_name = {
        "north": {"north_std_deg": told.north_std_deg},
        "collar": {
            "collar_inclination_deg": math.degrees(inclination),
            "collar_azimuth_deg": math.degrees(azimuth),
            "collar_std_deg": told.collar_std_deg,
        },
        "stick-up": {"stick_up_std_m": told.stick_up_std_m},
        "mounts": {"mount_tilt_std_deg": max(world.scenario.file.joints.mount_tilt_std_deg, EXACTLY_DEG)},
    }
    by_name = {name: settings for name, settings in by_name.items() if name not in told.untold}
    checks = {name: settings for name, settings in checked_settings(world).items() if name in by_name}
    return {key: value for settings in (*by_name.values(), *checks.values()) for key, value in settings.items()}


def checked_settings(world: World) -> dict[str, dict[str, Any]]:
    """Second readings of what no survey shows, by name: as good as the first, and of what is so."""
    told, wrong = world.scenario.file.setup, world.scenario.file.told
    by_name = {
        "north": {
            "north_check_deg": wrong.north_deg + wrong.north_check_deg,
            "north_check_std_deg": told.north_std_deg,
        },
        "stick-up": {
            "stick_up_check_m": wrong.depth_offset_m + wrong.stick_up_check_m,
            "stick_up_check_std_m": told.stick_up_std_m,
        },
    }
    return {name: settings for name, settings in by_name.items() if name not in told.unchecked}


def told_collar(world: World) -> tuple[float, float]:
    """Inclination and azimuth (rad) of the collar as the crew tells them."""
    hole, wrong = world.scenario.hole, world.scenario.file.told
    if wrong.collar_north_deg == wrong.collar_east_deg == 0.0:
        return hole.direction(0.0)
    off = np.radians([wrong.collar_north_deg, wrong.collar_east_deg, 0.0])
    north, east, down = (hole.tangent(np.zeros(1))[0][0] + off).tolist()
    return math.atan2(math.hypot(north, east), down), math.atan2(east, north)
