"""The world of a rig under faults: clocks that start again or jump, sensors that fail, a depth that lies."""

from __future__ import annotations

import copy
from collections.abc import Callable
from typing import Any

from sim.world.scenario import Scenario, scenario_of
from sim.world.world import World
from telemetry.messages import ENCODER

TUBE_LENGTH = 2.0  # m
COMMON: dict[str, Any] = {
    "rig": {"tubes": 2, "tube_length_m": TUBE_LENGTH, "tubes_at_start": 2},
    "path": {"straight": {"inclination_deg": 3.0, "azimuth_deg": 40.0}},
    "accelerometer": {"bias_std_deg": 0.002},  # calibrated
}
# a string of two tubes rests, drills a part of a length and is surveyed
MINUTE = COMMON | {
    "schedule": {"add_s": 110.0, "stop_s": 30.0, "finish_s": 22.0, "blocks": 1},
    "rotation": {"turns": 1.5, "advance_m": 0.8},
}
# the tubes are drilled in one after the other
DRILLED_IN = COMMON | {
    "rig": {"tubes": 2, "tube_length_m": TUBE_LENGTH},
    "schedule": {"add_s": 60.0, "joint_s": 20.0, "stop_s": 32.0, "finish_s": 150.0},
    "rotation": {"turns": 5.0},
}

Reading = list[Any]
EncoderSample = tuple[int, float, int, float | None, tuple[float, ...]]


class FaultyWorld(World):
    """A world whose parts fail when they are told to.

    Attributes
    ----------
    zero : rig time (s) of the truth at which the encoder's clock counts from zero
    jumps : s by which the clocks of processes are off, by address
    drifts : since when (s) and by how much a second, by address
    spoilers : what becomes of a tube's readings, by tube
    slipped : counts by which the encoder is off
    misled : the encoder has slipped or stopped at any time
    spoiled : the readings of any tube have been spoiled at any time
    stuck_at : rig time (s) from which on the encoder counts no more, None where it does
    depth_error : m
    depth_hidden : no depth is measured
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        super().__init__(scenario, seed)
        self._depths: dict[float, float] = {}
        self._counted: dict[float, EncoderSample] = {}
        self._heal()

    @classmethod
    def of_tables(cls, tables: dict[str, Any], seed: int) -> FaultyWorld:
        """The world of a scenario and a seed."""
        return cls(scenario_of(tables), seed)

    def healthy(self) -> FaultyWorld:
        """Return the world without faults; computed values are shared."""
        world = copy.copy(self)
        world._heal()
        return world

    def forget(self) -> None:
        """Drop computed values of times that will not come again."""
        self._depths.clear()
        self._counted.clear()

    def _heal(self) -> None:
        self.zero = 0.0
        self.jumps: dict[int, float] = {}
        self.drifts: dict[int, tuple[float, float]] = {}
        self.spoilers: dict[int, Callable[[Reading], Reading]] = {}
        self.slipped = 0
        self.misled = self.spoiled = False
        self.stuck_at: float | None = None
        self.depth_error = 0.0
        self.depth_hidden = False

    def let_drift(self, address: int, t: float, rate: float) -> None:
        """Let the clock of a process run fast by ``rate`` s/s from rig time ``t`` (s) of the truth on.

        It keeps what it has gained by an earlier drift: a clock does not run backwards.
        """
        since, before = self.drifts.get(address, (t, 0.0))
        self.jumps[address] = self.jumps.get(address, 0.0) + before * max(t - since, 0.0)
        self.drifts[address] = (t, rate)

    def local_clock(self, address: int, t: float) -> float:
        """Return the time (s) that the clock of a process shows at rig time ``t`` (s) of the truth."""
        shown = t - self.zero if address == ENCODER else super().local_clock(address, t)
        if address in self.drifts:
            since, rate = self.drifts[address]
            shown += rate * max(t - since, 0.0)
        return shown + self.jumps[address] if address in self.jumps else shown

    def true_time(self, address: int, local: float) -> float:
        """Rig time of the truth at which the clock of a process shows ``local`` (s)."""
        shown = local - self.jumps.get(address, 0.0)
        true = shown + self.zero if address == ENCODER else super().true_time(address, shown)
        if address in self.drifts:
            since, rate = self.drifts[address]
            true -= rate / (1.0 + rate) * max(true - since, 0.0)
        return true

    def encoder_sample(self, t: float) -> EncoderSample:
        """Sample of the counter, its times on the encoder's clock."""
        if self.stuck_at is not None:
            t = self.stuck_at
        self.misled |= self.stuck_at is not None or self.slipped != 0
        if t not in self._counted:
            self._counted[t] = super().encoder_sample(t)
        count, edge_at, rising, torque, earlier = self._counted[t]
        off = self.zero - self.jumps.get(ENCODER, 0.0)
        return count + self.slipped, edge_at - off, rising, torque, tuple([edge - off for edge in earlier])

    def imu_sample(self, tube: int, cycle: int) -> Reading:
        """Reading of a tube, spoiled where its sensor fails."""
        reading = super().imu_sample(tube, cycle)
        if tube not in self.spoilers:
            return reading
        self.spoiled = True
        return self.spoilers[tube](reading)

    def measured_depth(self, t: float) -> float:
        """Depth of the bit as the rig measures it, m."""
        return max(super().measured_depth(t) + self.depth_error, 0.0)

    def bit_depth(self, t: float) -> float:
        """Depth of the bit along the hole, m."""
        if t not in self._depths:
            self._depths[t] = super().bit_depth(t)
        return self._depths[t]
