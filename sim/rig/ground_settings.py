"""What the operator enters at the ground station of a simulated rig."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

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
    } | (transport | told_settings(world))


def told_settings(world: World) -> dict[str, Any]:
    """What the crew tells of the rig: it knows the truth as well as it states, but for what it does not tell."""
    told = world.scenario.file.setup
    inclination, azimuth = world.scenario.hole.direction(0.0)
    by_name = {
        "north": {"north_std_deg": told.north_std_deg},
        "collar": {
            "collar_inclination_deg": math.degrees(inclination),
            "collar_azimuth_deg": math.degrees(azimuth),
            "collar_std_deg": told.collar_std_deg,
        },
        "mounts": {"mount_tilt_std_deg": max(world.scenario.file.joints.mount_tilt_std_deg, EXACTLY_DEG)},
    }
    return {key: value for name, told_ in by_name.items() if name not in told.untold for key, value in told_.items()}
