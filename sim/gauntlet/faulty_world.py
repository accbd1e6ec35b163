"""The world of a rig under faults: clocks that start again or jump, sensors that fail, a depth that lies."""

from __future__ import annotations

import copy
import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from node.firmware.tube_settings import MakeUpAngle, TubeSettings
from node.kernels.arithmetic.formats import PERIOD
from sim.world.borehole import Borehole
from sim.world.scenario import Scenario, scenario_of
from sim.world.truth import lean_rotation
from sim.world.world import World
from telemetry.messages import ENCODER

TUBE_LENGTH = 2.0  # m
COUNTS = 4096  # of a turn of the encoder
ODD_WEIGHT = 0.05  # part of gravity, by which no force of a tube at rest is gravity's, however it leans
ODD_AGAIN = 5.0  # s between two such forces that are of one time
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
# the same and a long rest, then a minute without a fault in which it drills on and is surveyed once more
CALM_S = 60.0
CALMED = MINUTE | {
    "rig": COMMON["rig"] | {"depth_at_start_m": 2.3},
    "schedule": MINUTE["schedule"] | {"finish_s": 9.0, "blocks": 2},
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
    deceptions : names of faults that nothing contradicts but the other tubes, at any time
    odd : since when and until when (s) the force that a deceived tube reads was not of gravity's size, by tube
    misread : rad by which the joints of a tube to head and lower tube are told wrong, by tube
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        super().__init__(scenario, seed)
        self._depths: dict[float, float] = {}
        self._measured: dict[float, float] = {}  # m, of a rig without faults
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
        self._measured.clear()
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
        self.deceptions: set[str] = set()
        self.odd: dict[int, tuple[float, float]] = {}
        self.misread: dict[int, tuple[float, float]] = {}
        self._deceivers: dict[int, list[Callable[[Reading], Reading]]] = {}
        self._scales: list[tuple[float, float]] = []  # depth of the bit, m, from which on it counts so much more
        self._leaned: Borehole | None = None

    @property
    def zero_deg(self) -> float:
        """Where the zero of the encoder points now, from site north, clockwise."""
        return -360.0 * self.slipped / COUNTS

    def add_deceiver(self, tube: int, change: Callable[[Reading], Reading]) -> None:
        """Have a tube's readings changed from now on, in a way that its node cannot see."""
        self._deceivers.setdefault(tube, []).append(change)

    def scale_depth(self, scale: float, t: float) -> None:
        """Have the measured depth count ``scale`` more of what the bit advances after the rig time ``t`` (s)."""
        self._scales.append((self.bit_depth(t), scale))

    def lean_hole(self, lean: npt.NDArray[np.float64]) -> None:
        """Have the whole hole lean over by ``lean`` (2,) rad to north and east; its tubes stand in it."""
        before = self._hole_now.tangent(np.zeros(1))[0][0]
        north, east = (before[:2] + before[2] * lean).tolist()
        inclination, azimuth = math.atan2(math.hypot(north, east), before[2]), math.atan2(east, north)
        self._leaned = Borehole.straight(inclination, azimuth, self.scenario.hole.length)

    @property
    def _hole_now(self) -> Borehole:
        return self.scenario.hole if self._leaned is None else self._leaned

    def truth_station(self, md: float) -> dict[str, float]:
        """Direction and position of the hole at one depth (m), as it is now; degrees and metres."""
        if self._leaned is None:
            return super().truth_station(md)
        inclination, azimuth = self._leaned.direction(md)
        north, east, tvd = self._leaned.position(md).tolist()
        return {
            "md_m": md,
            "inclination_deg": math.degrees(inclination),
            "azimuth_deg": math.degrees(azimuth),
            "north_m": north,
            "east_m": east,
            "tvd_m": tvd,
        }

    def tube_settings(self, tube: int) -> TubeSettings:
        """What the crew enters for a tube that is switched on now."""
        settings = super().tube_settings(tube)
        drive, lower = self.misread.get(tube, (0.0, 0.0))
        return replace(
            settings,
            drive_joint=MakeUpAngle(settings.drive_joint.angle + drive, settings.drive_joint.std),
            lower_joint=MakeUpAngle(settings.lower_joint.angle + lower, settings.lower_joint.std),
        )

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
        if self._leaned is not None:
            reading = self._in_leaned_hole(reading, tube, cycle)
        if tube in self._deceivers:
            reading = self._deceived(reading, tube, cycle)
        if tube not in self.spoilers:
            return reading
        self.spoiled = True
        return self.spoilers[tube](reading)

    def measured_depth(self, t: float) -> float:
        """Depth of the bit as the rig measures it, m."""
        if t not in self._measured:
            self._measured[t] = super().measured_depth(t)
        counted = sum(scale * max(self.bit_depth(t) - since, 0.0) for since, scale in self._scales)
        return max(self._measured[t] + counted + self.depth_error, 0.0)

    def bit_depth(self, t: float) -> float:
        """Depth of the bit along the hole, m."""
        if t not in self._depths:
            self._depths[t] = super().bit_depth(t)
        return self._depths[t]

    def _deceived(self, reading: Reading, tube: int, cycle: int) -> Reading:
        """What a tube reads whose readings are changed; noted where its force is not of gravity's size."""
        for change in self._deceivers[tube]:
            reading = change(reading)
        gravity = self.scenario.file.accelerometer.gravity_mps2
        if abs(math.hypot(*reading[3:6]) - gravity) > ODD_WEIGHT * gravity:
            now = self.cycle_end(cycle)
            since, until = self.odd.get(tube, (now, now))
            self.odd[tube] = since if now <= until + ODD_AGAIN else now, now
        return reading

    def _in_leaned_hole(self, reading: Reading, tube: int, cycle: int) -> Reading:
        """What a tube reads that stands in the hole as it leans now, of what it would have read before."""
        yaw = self.yaw_truth(tube, self.cycle_end(cycle) + self.phase(tube) - 0.5 * PERIOD)
        c, s = math.cos(yaw), math.sin(yaw)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        before, now = (hole.tangent(np.zeros(1))[0] for hole in (self.scenario.hole, self._hole_now))
        change = (lean_rotation(now)[0] @ turn).T @ lean_rotation(before)[0] @ turn
        rate, force = change @ np.array(reading[:3]), change @ np.array(reading[3:6])
        return [*rate.tolist(), *force.tolist(), *reading[6:]]
