"""The world of a rig under faults: clocks that start again, sensors that fail, a depth that lies."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from sim.world.scenario import Scenario, scenario_of
from sim.world.world import World
from telemetry.messages import ENCODER

TUBE_LENGTH = 2.0  # m
TABLES: dict[str, Any] = {
    "rig": {"tubes": 2, "tube_length_m": TUBE_LENGTH},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "schedule": {"add_s": 60.0, "joint_s": 20.0, "stop_s": 32.0, "finish_s": 150.0},
    "rotation": {"turns": 5.0},
}

Reading = list[Any]


def gauntlet_scenario() -> Scenario:
    """Two tubes, drilled in one after the other, and time to recover at the end."""
    return scenario_of(TABLES)


class FaultyWorld(World):
    """A world whose parts fail when they are told to.

    Attributes
    ----------
    zero : rig time (s) of the truth at which the encoder's clock counts from zero
    jumps : s by which the clocks of processes are off, by address
    spoilers : what becomes of a tube's readings, by tube
    depth_error : m, and None where no depth comes
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        super().__init__(scenario, seed)
        self.zero = 0.0
        self.jumps: dict[int, float] = {}
        self.spoilers: dict[int, Callable[[Reading], Reading]] = {}
        self.depth_error: float = 0.0

    def local_clock(self, address: int, t: float) -> float:
        """What the clock of a process shows at rig time ``t`` (s) of the truth."""
        shown = t - self.zero if address == ENCODER else super().local_clock(address, t)
        return shown + self.jumps.get(address, 0.0)

    def true_time(self, address: int, local: float) -> float:
        """Rig time of the truth at which the clock of a process shows ``local`` (s)."""
        shown = local - self.jumps.get(address, 0.0)
        return shown + self.zero if address == ENCODER else super().true_time(address, shown)

    def encoder_sample(self, t: float) -> tuple[int, float, int, float | None, tuple[float, ...]]:
        """Sample of the counter, its times on the encoder's clock."""
        count, edge_at, rising, torque, earlier = super().encoder_sample(t)
        return count, edge_at - self.zero, rising, torque, tuple(edge - self.zero for edge in earlier)

    def imu_sample(self, tube: int, cycle: int) -> Reading:
        """Reading of a tube, spoiled where its sensor fails."""
        reading = super().imu_sample(tube, cycle)
        return self.spoilers[tube](reading) if tube in self.spoilers else reading

    def bit_depth(self, t: float) -> float:
        """Depth of the bit as the rig measures it, m."""
        return max(super().bit_depth(t) + self.depth_error, 0.0)

    def true_depth(self, t: float) -> float:
        """Depth of the bit, m."""
        return super().bit_depth(t)
