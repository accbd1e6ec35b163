"""What the drive's torque means for the reference: whether it holds the string twisted, and what it may leave behind.

The drive counts as released when its torque has stayed within the sensor's dead band for several cycles, so that the
unwinding is over. Friction then keeps a part of the largest torque; a grip of less than half of it, as to make up a
joint, frees nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from node.firmware.settings import require

LARGEST = 1e6  # N m
FREEING = 0.5  # of the largest torque, from which on a grip replaces what another has trapped


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
            require(0.0 <= torque <= LARGEST, f"torque.{name}: expected 0..{LARGEST:g} N m, got {torque}")
        part = self.trapped_fraction
        require(0.0 <= part <= 1.0, f"torque.trapped_fraction: expected 0..1, got {part}")
        require(self.release_cycles >= 1, f"torque.release_cycles: expected 1 or more, got {self.release_cycles}")


@dataclass(frozen=True, slots=True)
class Torque:
    """Torque in the string, N m: the drive's, or of a released string what may be trapped (1 sigma)."""

    size: float
    holding: bool


class TorqueWatch:
    """Follows the torque of the drive cycle by cycle."""

    def __init__(self, settings: TorqueSettings) -> None:
        self._settings = settings
        self._largest = settings.drilling  # before a restart the string may have been under it
        self._grip = 0.0  # N m, largest since the drive took hold
        self._holding = False
        self._quiet = 0

    def on_cycle(self, measured: float | None, *, turning: bool) -> Torque:
        """Take the sensor's reading (N m, either sign), or the setting where there is none."""
        settings = self._settings
        if measured is None:
            measured = settings.drilling if turning else 0.0
        size = min(abs(measured), LARGEST) if math.isfinite(measured) else max(self._largest, self._grip)
        within = size <= settings.dead_band
        self._quiet = self._quiet + 1 if within else 0
        if not within:
            self._holding = True
            self._grip = max(self._grip, size)
        elif self._holding and self._quiet >= settings.release_cycles:
            self._holding = False
            self._largest = self._grip if self._grip > FREEING * self._largest else self._largest
            self._grip = 0.0
        trapped = settings.trapped_fraction * max(self._largest, self._grip)
        return Torque(max(size, trapped), holding=True) if self._holding else Torque(trapped, holding=False)
