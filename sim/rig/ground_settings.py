"""What the operator enters at the ground station of a simulated rig."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sim.world.world import World


def ground_settings(world: World) -> dict[str, Any]:
    """What the operator enters at the ground station: tally, design, and what calibration left."""
    file = world.scenario.file
    return (
        {
            "tube_length": world.scenario.tube_length,
            "gravity": file.accelerometer.gravity_mps2,
            "accelerometer_bias_std_deg": file.accelerometer.bias_std_deg,
            "mount_std_deg": file.joints.mount_std_deg,
            "mount_tilt_std_deg": file.joints.mount_tilt_std_deg,
            "target": file.design.length_m or world.scenario.tubes * world.scenario.tube_length,
            "design_inclination_deg": file.design.inclination_deg,
            "design_azimuth_deg": file.design.azimuth_deg,
            "column_radius": file.design.radius_m,
            "tolerance": file.design.tolerance,
        }
        | plan_settings(world)
        | transport_settings(world)
    )


def plan_settings(world: World) -> dict[str, Any]:
    """What the operator enters where the design has legs."""
    design = world.scenario.file.design
    if not design.leg:
        return {}
    legs = [leg.model_dump(exclude_defaults=True) for leg in design.leg]
    first = {"inclination_deg": design.inclination_deg, "azimuth_deg": design.azimuth_deg}
    return {"plan": first | {"leg": legs}}


def transport_settings(world: World) -> dict[str, Any]:
    """What the operator enters where the string turns in a bent hole: that it does, and how the hole begins."""
    rough = world.scenario.file.rough
    if rough is None or rough.string.transport == "shortest":
        return {}
    inclination, azimuth = world.scenario.hole.direction(0.0)
    return {
        "string_transport": rough.string.transport,
        "collar_inclination_deg": math.degrees(inclination),
        "collar_azimuth_deg": math.degrees(azimuth),
    }
