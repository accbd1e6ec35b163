"""What the crew knows of the drive's torque; ``node.kernels.string.drive_torque`` follows it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from node.firmware.tube_settings import require_setting
from node.kernels.arithmetic.formats import Array
from node.kernels.string.drive_torque import DRIVE, LARGEST


@dataclass(frozen=True, slots=True)
class TorqueSettings:
    """What the crew knows of the drive."""

    drilling: float = 0.0  # N m, before a start, and while the head turns if there is no sensor; 0: a rigid string
    trapped_fraction: float = 0.01  # of the torque, that may stay in a released string, 1 sigma
    dead_band: float = 1.0  # N m, what a released drive may read
    release_cycles: int = 4  # within the dead band

    def __post_init__(self) -> None:
        """Refuse what cannot be.

        Raises
        ------
        ConfigurationError
            With the field, its range and what was given.
        """
        for name, torque in (("drilling", self.drilling), ("dead_band", self.dead_band)):
            require_setting(0.0 <= torque <= LARGEST, f"torque.{name}: expected 0..{LARGEST:g} N m, got {torque}")
        part = self.trapped_fraction
        require_setting(0.0 <= part <= 1.0, f"torque.trapped_fraction: expected 0..1, got {part}")
        require_setting(
            self.release_cycles >= 1, f"torque.release_cycles: expected 1 or more, got {self.release_cycles}"
        )


def drive_record(settings: TorqueSettings) -> Array:
    """Settings as the step reads them, one record of dtype ``DRIVE``."""
    made = np.zeros(1, DRIVE)
    for name in DRIVE.names or ():
        made[name] = getattr(settings, name)
    return made
