"""What holds the IMUs of a tube slips at a time: they lean and turn against the tube from then on.

It slips in a jump that no gyroscope sees. The yaw of a tube is that of its mark, so it stays as it was; what the IMUs
read is turned against it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from pydantic import Field

from sim.kernel import shared_body
from sim.world.disturbance.one_tube import NEVER, OneTubeSection, is_later, starts_at
from sim.world.disturbance.row import ActsOn, Array, Compiled, Disturbance, ImuSamples, OneImu
from sim.world.scenario_file import ScenarioFile
from sim.world.section import Angle
from sim.world.truth import imu_frame


class MountSlipSection(OneTubeSection):
    """By how much."""

    pitch_deg: float = Field(0.0, ge=-20.0, le=20.0, description="lean of the IMUs, as joints.mount_tilt_std_deg")
    roll_deg: float = Field(0.0, ge=-20.0, le=20.0, description="likewise")
    turn_deg: Angle = Field(0.0, description="of the IMUs about the axis")


def draw_slip(imu: OneImu) -> Array:
    """R_slipped_from_mount (3, 3) of one tube."""
    section = imu.section_of(MOUNT_SLIP)
    if imu.tube != section.tube:
        return np.eye(3)
    pitch, roll, turn = map(math.radians, (section.pitch_deg, section.roll_deg, section.turn_deg))
    c, s = math.cos(turn), math.sin(turn)
    return np.asarray(imu_frame(pitch, roll) @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))


def slip_away(samples: ImuSamples, imu: OneImu, slip: Array) -> None:
    """Turn rates and forces from the mount's frame into that after the slip."""
    later = is_later(imu, imu.section_of(MOUNT_SLIP), samples.t)[:, None]
    if later.any() and not np.array_equal(slip, np.eye(3)):
        samples.rate = np.where(later, samples.rate @ slip.T, samples.rate)
        samples.force = np.where(later, samples.force @ slip.T, samples.force)


def set_slip_time(shared: Any, file: ScenarioFile) -> None:
    """When it slips."""
    at = starts_at(file, MOUNT_SLIP.section_of(file))
    shared["slips_at"] = at if MOUNT_SLIP.name in file.disturbance else NEVER


def set_slip(tube: Any, slip: Array) -> None:
    """How far."""
    tube["slip"] = slip


@shared_body
def feel_slip(shared: Any, tube: Any, now: Any, _drawn: Array, _at: int, row: Array) -> None:
    """Turn rates and forces once it has slipped."""
    if now.end > shared.slips_at:
        for at in (0, 3):
            x, y, z = row[at], row[at + 1], row[at + 2]
            for i in range(3):
                row[at + i] = tube.slip[i, 0] * x + tube.slip[i, 1] * y + tube.slip[i, 2] * z


MOUNT_SLIP = Disturbance(
    "mount-slip",
    (),
    ActsOn.FELT,
    slip_away,
    draw_slip,
    Compiled(
        shared=(("slips_at", "f8"),),  # s, rig time
        tube=(("slip", "f8", (3, 3)),),
        set_shared=set_slip_time,
        set_tube=set_slip,
        felt=feel_slip,
    ),
    section=MountSlipSection,
)
