"""What the crew of a rig tells wrongly: the table ``[told]`` of a scenario, all right by default.

The truth is what the other tables say; node and ground station are told what is off by what stands here.
"""

from __future__ import annotations

import math
from typing import Annotated

from pydantic import Field

from sim.world.section import Angle, NotNegative, ScenarioSection


class ToldSection(ScenarioSection):
    """Errors of what is told, blunders or draws of a study; 0 and absent: told as it is."""

    joint_tube: int = Field(1, ge=1, description="tube whose joints are misread")
    joint_deg: Angle = Field(0.0, description="by which the joint to the tube below it is told wrong")
    drive_deg: Angle = Field(0.0, description="by which its joint to the drive head is told wrong")
    north_deg: Angle = Field(0.0, description="of the encoder's zero, by which it lies east of the north that is told")
    north_check_deg: Angle = Field(0.0, description="by which a second bearing, which checks the north, is off")
    collar_north_deg: float = Field(0.0, ge=-10.0, le=10.0, description="lean of the collar as told, less the true one")
    collar_east_deg: float = Field(0.0, ge=-10.0, le=10.0, description="likewise")
    lengths_off_m: tuple[Annotated[float, Field(ge=-1.0, le=1.0)], ...] = Field(
        (), description="by which tubes are longer than all are told to be, from tube 1 up; none of the others"
    )
    depth_offset_m: float = Field(0.0, ge=-10.0, le=10.0, description="of the measured depth, as of a stick-up")
    stick_up_check_m: float = Field(0.0, ge=-10.0, le=10.0, description="by which a second reading of it is off")
    depth_scale: float = Field(0.0, ge=-0.2, le=0.2, description="of the measured depth, by which it counts too much")
    depth_std_m: NotNegative = Field(0.0, le=1.0, description="of it, another error at every stop; 1 sigma")
    depth_stuck_after_s: NotNegative | None = Field(
        None, description="after the start: the measured depth follows the bit no more; absent: it always does"
    )
    depth_stuck_s: NotNegative | None = Field(None, description="for so long; what it missed stays so; absent: ever")

    @property
    def north(self) -> float:
        """Angle (rad) by which the encoder's zero lies east of the north that is told."""
        return math.radians(self.north_deg)

    def misread(self, tube: int) -> tuple[float, float]:
        """What the marks of a tube are told wrong by, rad: to the drive head, to the tube below."""
        if tube != self.joint_tube:
            return 0.0, 0.0
        return math.radians(self.drive_deg), math.radians(self.joint_deg)

    def below(self, tube: int, length: float) -> float:
        """Length (m) of the string below the node of a tube, of tubes that are told to have a ``length`` (m)."""
        return (tube - 1) * length + sum(self.lengths_off_m[: tube - 1])
