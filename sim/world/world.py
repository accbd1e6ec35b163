"""The world of one scenario and seed: what every sensor reads and what the truth is, at any rig time, in any order."""

from __future__ import annotations

import copy
import math
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np

from node.firmware.imu_settings import ImuSettings
from node.firmware.kernel_choice import CHIP
from node.firmware.torque import TorqueSettings
from node.firmware.tube_settings import TubeSettings
from node.kernels.record.filter_record import Scheme
from sim.errors import ScenarioError
from sim.node_kills import KillNode
from sim.world.depth_meter import DepthMeter
from sim.world.drill_string import DrillString
from sim.world.radio import RadioLinks
from sim.world.random_streams import RandomStream, random_stream
from sim.world.scenario import Scenario
from sim.world.sensors import Sensors
from sim.world.torsion import torsional_stiffness
from telemetry.messages import BASE, ENCODER


class World(DrillString):
    """A string with everything that reads of it: sensors, encoder, clocks, the crew, and what is to go wrong.

    Parameters
    ----------
    scenario : validated
    seed : of every draw; a stream depends on the seed, its purpose and its tube, on nothing else

    Raises
    ------
    ScenarioError
        When a fault falls outside the schedule, or cuts a node's power while the node is down.
    """

    def __init__(self, scenario: Scenario, seed: int) -> None:
        super().__init__(scenario, seed)
        self.sensors = Sensors(self)
        self.on_chips: frozenset[int] = frozenset()  # tubes whose node steps on an emulated chip
        self.faults: tuple[KillNode, ...] = scenario.faults
        self._check_faults()
        self.radio = self._radio_links()
        self.depth_meter = DepthMeter(scenario, seed, self.motion, self.begin)

    def aided_like(self, scenario: Scenario) -> World:
        """The same world under the aiding of another scenario: what was worked out of it holds for either."""
        other = copy.copy(self)
        other.scenario = self.scenario.aided_like(scenario)
        return other

    def imu_sample(self, tube: int, cycle: int) -> list[Any]:
        """What a tube reads in a cycle, see ``Sensors.sample``."""
        return self.sensors.sample(tube, cycle)

    def encoder_sample(self, t: float) -> tuple[int, float, int, float | None, tuple[float, ...]]:
        """Count, rig time of its last edge, 1 (the string turns one way, so every edge rises), torque, earlier edges.

        A rig of a rigid string, or one that is to ignore its torsion, has no torque (N m): None. In a rough world an
        edge may fall.
        """
        rising = 1
        if self.scenario.file.rough is not None:
            count, edge_at, rising, earlier = self.rough_run.disc.sample(t)
        else:
            count, edge_at, earlier = self.disc.sample(t, self._head_angles.get(t))
        if t <= self.motion.begin:
            edge_at = self.begin
        if self.torsion is None or self.scenario.file.node.torsion == "ignore":
            return count, edge_at, rising, None, earlier
        torque = self._torques.get(t)
        if torque is None:
            torque = float(self.torsion.torque(np.array([t]))[0])
        return count, edge_at, rising, torque, earlier

    def bit_depth(self, t: float) -> float:
        """Depth of the bit along the hole, m."""
        return float(self.motion.depth(np.array([t]))[0][0])

    def measured_depth(self, t: float) -> float:
        """Depth of the bit as the rig measures it, m."""
        return self.depth_meter.measure_depth(t)

    def local_clock(self, address: int, t: float) -> float:
        """What the clock of a process shows at rig time ``t`` (s)."""
        offset, drift = self._clocks[address]
        return t + offset + drift * (t - self.begin)

    def true_time(self, address: int, local: float) -> float:
        """Rig time at which the clock of a process shows ``local`` (s)."""
        offset, drift = self._clocks[address]
        return self.begin + (local - offset - self.begin) / (1.0 + drift)

    def tube_settings(self, tube: int) -> TubeSettings:
        """What the crew enters for a tube: the readings of its scribe marks and their stated errors."""
        joints = self.marks.read(tube)
        passed = range(tube + 1, min(tube + self.reach - 1, self.scenario.tubes) + 1)
        return TubeSettings(
            tube=tube,
            drive_joint=joints.drive_joint,
            lower_joint=joints.lower_joint,
            mount_std=math.radians(self.scenario.file.joints.mount_std_deg),
            scheme=Scheme[self.scenario.file.node.scheme.upper()],
            kernel=CHIP if tube in self.on_chips else self.scenario.file.node.kernel,
            stiffness=self._stiffness,
            torsion="variance" if self.scenario.file.node.torsion == "variance" else "gate",
            joints=self.scenario.file.node.joints,
            imus=self._imu_settings,
            reach=self.reach,
            above=tuple(self.marks.read(other) for other in passed),
        )

    @cached_property
    def _imu_settings(self) -> tuple[ImuSettings, ...]:
        radius = self.scenario.file.accelerometer.radius_m
        return tuple(ImuSettings((radius, 0.0), noise) for noise in self.sensors.noises)

    @property
    def reach(self) -> int:
        """Tubes away that a node hears."""
        return 1 if self.radio is None else self.radio.reach

    def torque_settings(self) -> TorqueSettings:
        """What the crew enters at the encoder node; the drilling torque is what an encoder node starts from."""
        section = self.scenario.file.torsion
        if section is None or self.scenario.file.node.torsion == "ignore":
            return TorqueSettings()
        return TorqueSettings(section.bit_torque_nm, section.trapped_fraction)

    def _radio_links(self) -> RadioLinks | None:
        section = self.scenario.file.radio
        if section is None:
            return None
        hole = self.scenario.hole
        return RadioLinks(
            section,
            self.seed,
            self.scenario.tubes,
            self.scenario.tube_length,
            self.begin,
            self.end,
            self.bit_depth,
            lambda md: float(hole.position(md)[2]),
        )

    @property
    def _stiffness(self) -> float:
        """Of a tube as the crew knows it, N m/rad."""
        section = self.scenario.file.torsion
        return math.inf if section is None else torsional_stiffness(section, self.scenario.tube_length)

    @cached_property
    def _torques(self) -> dict[float, float]:
        """Torque of the drive (N m) at the end of every cycle of the encoder, all worked out at once."""
        if self.torsion is None:
            return {}
        return dict(zip(self.ends.tolist(), self.torsion.torque(self.ends).tolist(), strict=True))

    @cached_property
    def _head_angles(self) -> dict[float, float]:
        """Angle of the head (rad) at the end of every cycle, by its rig time."""
        return dict(zip(self.ends.tolist(), self.disc.angles(self.ends).tolist(), strict=True))

    @cached_property
    def _clocks(self) -> dict[int, tuple[float, float]]:
        """Offset (s) and drift of the clock of each process against that of the encoder, by address."""
        clocks = self.scenario.file.clocks
        draws = random_stream(self.seed, RandomStream.CLOCKS, 0).standard_normal((self.scenario.tubes + 1, 2))
        drawn = [(clocks.offset_std_s * a, clocks.drift_std_ppm * 1e-6 * b) for a, b in draws.tolist()]
        return {ENCODER: (0.0, 0.0), BASE: drawn[0]} | dict(enumerate(drawn[1:], 1))

    def _check_faults(self) -> None:
        racked = self.rack.end if self.rack is not None else self.begin
        for fault in self.faults:
            if self.begin + fault.after + fault.down < racked:
                continue
            added = (phase.start for phase in self.phases if phase.kind == "add" and phase.tube == fault.address)
            on = next(added, self.begin)  # a tube in the hole from the start is not added
            if not on < self.begin + fault.after < self.end - fault.down:
                raise ScenarioError(
                    f"fault {fault}: expected a time between {on - self.begin:.0f} s, "
                    f"when the tube is added, and {self.end - fault.down - self.begin:.0f} s"
                )
        in_order = sorted(self.faults, key=lambda fault: (fault.address, fault.after))
        for first, second in pairwise(in_order):
            if first.address == second.address and second.after <= first.after + first.down:
                raise ScenarioError(
                    f"fault {second}: expected a time after {first.after + first.down:g} s, "
                    f"for the node is down until then by {first}"
                )
