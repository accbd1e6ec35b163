"""The ground station's knowledge of one rig: string, nodes, stations, trajectory. No I/O."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass, field

import numpy as np

from groundstation.config import GroundConfig
from groundstation.errors import SurveyError
from groundstation.service.string_order import DepthLog, StringOrder
from groundstation.survey.fusion import StationFusion
from groundstation.survey.resolve import Lean, Quality, check, combine_imus, resolve
from groundstation.survey.trajectory import Point, Trajectory
from telemetry.messages import Event, NodeState, StaticRecord, SurveyMeasurement

EVENTS_SHOWN = 10_000
STATIC_RECORDS_SHOWN = 1_000
ACCELEROMETER_NOISE_DEG = 0.02  # one sample, for the check of motion


@dataclass(frozen=True, slots=True)
class Cluster:
    """One resolved survey measurement."""

    measurement: SurveyMeasurement
    md: float
    direction: Lean
    quality: Quality


@dataclass(slots=True)
class SurveyStation:
    """One depth of the hole and every cluster measured there."""

    md: float
    clusters: list[Cluster] = field(default_factory=list)
    fusion: StationFusion = field(default_factory=StationFusion)

    def add(self, cluster: Cluster) -> None:
        """Fuse one more cluster."""
        self.clusters.append(cluster)
        self.fusion.add(cluster.direction)


class Knowledge:
    """Everything an operator can ask for.

    Parameters
    ----------
    config : of the ground station
    """

    def __init__(self, config: GroundConfig) -> None:
        self.config = config
        self.order = StringOrder(config.tube_length)
        self.depths = DepthLog()
        self.nodes: dict[int, NodeState] = {}
        self.stations: list[SurveyStation] = []
        self.events: deque[Event] = deque(maxlen=EVENTS_SHOWN)
        self.static_records: deque[StaticRecord] = deque(maxlen=STATIC_RECORDS_SHOWN)
        self.unplaced = 0
        self.refused = 0
        self.rig_now = math.nan
        self.trajectory: list[Point] = Trajectory().points

    def take_state(self, state: NodeState) -> None:
        """Take a node's account of itself, unless a newer one is known."""
        known = self.nodes.get(state.tube)
        if known is None or state.at >= known.at:
            self.nodes[state.tube] = state
            self.order.report(state.tube, state.hops)

    def place(self, measurement: SurveyMeasurement) -> float | None:
        """Measured depth (m) of the tube's node when it surveyed; None when the bit's depth then is not known."""
        self.order.report(measurement.tube, self._hops_if_unknown(measurement))
        bit, below = self.depths.at(measurement.station_at), self.order.length_below(measurement.tube)
        return None if bit is None or below is None else bit - below

    def take_survey(self, measurement: SurveyMeasurement, md: float | None) -> bool:
        """Resolve and fuse a stored measurement; False when it belongs to no depth or is no survey."""
        if md is None:
            self.unplaced += 1
            return False
        forces = np.array([imu.force for imu in measurement.imus])
        covs = np.array([imu.force_cov for imu in measurement.imus])
        bias_var = math.radians(self.config.accelerometer_bias_std_deg) ** 2
        try:
            force, cov = combine_imus(forces, covs)
            direction = resolve(force, cov, measurement.yaw, measurement.yaw_var, measurement.systematic_var, bias_var)
        except (SurveyError, np.linalg.LinAlgError):
            self.refused += 1
            return False
        noise = math.radians(ACCELEROMETER_NOISE_DEG) * self.config.gravity
        quality = check(forces, covs, self.config.gravity, measurement.samples, measurement.settle_time, noise)
        self._station_at(md).add(Cluster(measurement, md, direction, quality))
        self._recompute()
        return True

    def take_event(self, event: Event) -> None:
        """Remember what happened."""
        self.events.append(event)

    def take_static(self, record: StaticRecord) -> None:
        """Remember an average at rest."""
        self.static_records.append(record)

    def age(self, tube: int) -> float:
        """Rig seconds since a node's newest state; infinite for one never heard."""
        state = self.nodes.get(tube)
        return math.inf if state is None else self.rig_now - state.at

    def is_stale(self, tube: int) -> bool:
        """Whether a node has been silent for too long."""
        return not self.age(tube) <= self.config.stale_after

    def _hops_if_unknown(self, measurement: SurveyMeasurement) -> int:
        return measurement.hops if measurement.tube not in self.order.tubes else -1

    def _station_at(self, md: float) -> SurveyStation:
        for station in self.stations:
            if abs(station.md - md) <= self.config.station_tolerance:
                return station
        station = SurveyStation(md)
        self.stations.append(station)
        self.stations.sort(key=lambda known: known.md)
        return station

    def _recompute(self) -> None:
        trajectory = Trajectory()
        for station in self.stations:
            if station.md > 0.0:
                trajectory.append(station.md, station.fusion.fused())
        self.trajectory = trajectory.points
