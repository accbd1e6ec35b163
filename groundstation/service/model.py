"""The ground station's knowledge of one rig: string, nodes, stations, trajectory. No I/O."""

from __future__ import annotations

import math
from collections import Counter, deque
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from groundstation.config import GroundConfig
from groundstation.errors import SurveyError
from groundstation.service.alarms import AlarmList
from groundstation.service.crew_alarms import CrewAlarms
from groundstation.service.depth import DepthLog
from groundstation.service.history import SAME_STOP, History
from groundstation.service.live_wall import LiveWall
from groundstation.service.numbers import Numbers
from groundstation.service.orders import OrderBook
from groundstation.service.recalibration.procedure import FieldProcedure
from groundstation.service.rig_alarms import Health, RigAlarms
from groundstation.service.stops import Stops
from groundstation.service.tally import Tally
from groundstation.survey.columns import Deviation, deviation, project
from groundstation.survey.fusion import Departure, Evidence, departure, judge_departure, weighted
from groundstation.survey.joint_angles import JointAngles
from groundstation.survey.resolve import Direction, Quality, check, combine_imus, resolve
from groundstation.survey.shared import SharedErrors
from groundstation.survey.trajectory import Point, Trajectory
from groundstation.survey.trust import UNKNOWN_YAW_VAR, Trust, trust_of, with_unknown_yaw
from telemetry.messages import EPOCH_UNKNOWN, Event, NodeFlag, NodeState, StaticRecord, SurveyMeasurement

Array = npt.NDArray[np.float64]
EVENTS_SHOWN = 10_000
STATIC_RECORDS_SHOWN = 1_000
ACCELEROMETER_NOISE_DEG = 0.02  # one sample, for the check of motion
ABOVE_COLLAR = 0.01  # m, of rounding; a node higher up is in no hole
ALL_HEARD_WITHIN = 2.0  # s, of tubes that speak


@dataclass(frozen=True, slots=True)
class ResolvedStop:
    """One resolved survey measurement."""

    measurement: SurveyMeasurement
    md: float
    direction: Direction
    quality: Quality
    trust: Trust = Trust.FULL
    seq: int = 0  # place in the order in which surveys were placed

    @property
    def at(self) -> float:
        """Rig time of the stop, s."""
        return self.measurement.station_at

    @property
    def yaw_var(self) -> float:
        """Random variance of the yaw (rad^2) with which it is fused."""
        return self.measurement.yaw_var + (UNKNOWN_YAW_VAR if self.trust is Trust.UNKNOWN_YAW else 0.0)


@dataclass(frozen=True, slots=True)
class Waiting:
    """A stored survey whose depth is not known, and the length (m) of string below its tube when it came."""

    measurement: SurveyMeasurement
    below: float | None


@dataclass(slots=True)
class SurveyStation:
    """One depth of the hole and every cluster measured there, oldest first.

    ``drops`` are the places of clusters that found another hole than those before them.
    """

    md: float
    clusters: list[ResolvedStop] = field(default_factory=list)
    drops: list[int] = field(default_factory=list)
    _departures: dict[int, Departure] = field(default_factory=dict)

    @property
    def count(self) -> int:
        """Clusters measured here."""
        return len(self.clusters)

    @property
    def first(self) -> int:
        """Place of the first cluster that counts."""
        return self.first_before(self.count)

    def first_before(self, place: int) -> int:
        """Place of the first cluster that counted when the one at ``place`` came."""
        return max((drop for drop in self.drops if drop < place), default=0)

    def add_stop(self, cluster: ResolvedStop) -> None:
        """Add a cluster in the order of time; what was judged of later ones is forgotten."""
        self.clusters.append(cluster)
        self.clusters.sort(key=lambda known: (known.at, known.measurement.tube))
        self.forget(self.clusters.index(cluster))

    def forget(self, place: int) -> None:
        """Forget decisions from ``place`` on."""
        self.drops = [drop for drop in self.drops if drop < place]
        self._departures = {k: d for k, d in self._departures.items() if k < place}

    @property
    def counting(self) -> list[ResolvedStop]:
        """Clusters that count: of those since the hole moved the trusted ones, or all where none is."""
        since = self.clusters[self.first :]
        return [cluster for cluster in since if cluster.trust is Trust.FULL] or since

    @property
    def untrusted(self) -> int:
        """Clusters measured here whose yaw is not believed."""
        return sum(cluster.trust is not Trust.FULL for cluster in self.clusters)

    def readings(self) -> list[Direction]:
        """Directions of the clusters that count."""
        return [cluster.direction for cluster in self.counting]

    def departure(self, place: int) -> Departure | None:
        """How far the cluster at ``place`` departed from those before; None for the first of its hole."""
        first = self.first_before(place)
        if first == place:
            return None
        if place not in self._departures:
            self._departures[place] = departure([c.direction for c in self.clusters[first : place + 1]])
        return self._departures[place]


@dataclass(frozen=True, slots=True)
class Moved:
    """The decision that the hole moved at a station, with its evidence."""

    md: float
    at: float  # s
    dropped: int  # earlier clusters that no longer count
    evidence: Evidence


class RigModel:
    """Everything an operator can ask for.

    Parameters
    ----------
    config : of the ground station
    """

    def __init__(self, config: GroundConfig) -> None:
        self.config = config
        self.tally = Tally(config.tube_length)
        self.depths = DepthLog(config.depth_rate, config.depth_gap)
        self.stops = Stops(self.tally, config.survey_after)
        self.numbers = Numbers()
        self.joints = JointAngles()
        self.rig_alarms = RigAlarms()
        self.crew_alarms = CrewAlarms()
        self.nodes: dict[int, NodeState] = {}
        self.stations: list[SurveyStation] = []
        self.events: deque[Event] = deque(maxlen=EVENTS_SHOWN)
        self.static_records: deque[StaticRecord] = deque(maxlen=STATIC_RECORDS_SHOWN)
        self.seen = Counter[str]()  # rows of each stream since the start
        self.revision = 0  # grows with everything that comes in
        self.waiting: list[Waiting] = []  # surveys whose depth is not known yet
        self.undated = 0  # surveys without rig time, which never have one
        self.set_aside: list[SurveyMeasurement] = []  # of a faulty sensor, never fused
        self.refused = 0
        self.now = math.nan  # s, own clock
        self.rig_now = math.nan
        self.epoch = EPOCH_UNKNOWN
        self._tally_known_at = math.inf  # s, own clock, from which on every tube that speaks has been heard
        self.depth_heard_at = -math.inf  # s, own clock
        self._heard_at: dict[int, float] = {}  # s, own clock, of each tube's newest state
        self.shared = SharedErrors()
        self.moved: list[Moved] = []
        self.alarms = AlarmList()
        self.trajectory: list[Point] = Trajectory().points
        self.projection: Deviation | None = None
        self.history = History()
        self.recalibration = FieldProcedure(config.gravity)
        self.orders = OrderBook()
        self.wall = None if config.wall is None else LiveWall(config.wall, config.hole)

    def on_state(self, state: NodeState, now: float) -> bool:
        """Handle a node's state that came at ``now`` (s, own clock), unless a newer one of its epoch is known.

        One that has come before is no sign of life, somebody may have recorded it: False. Nor is one that was on its
        way for long; it tells that the node spoke then, which is all that a ground station knows after its start.
        """
        known = self.nodes.get(state.tube)
        if known is not None and is_repeated(state, known):
            return False
        self.recalibration.on_state(state)
        spoke_at = now - self._time_on_its_way(state)
        self._heard_at[state.tube] = max(self._heard_at.get(state.tube, -math.inf), spoke_at)
        if known is None or state.epoch != known.epoch or state.at >= known.at:
            self.nodes[state.tube] = state
            self._tally_known_at = min(self._tally_known_at, now + ALL_HEARD_WITHIN)
            self.tally.on_hops(state.tube, state.hops)
        return True

    def restore_tally(self, tubes: list[int]) -> None:
        """Go on with the tubes that were known before a restart."""
        self.tally.restore(tubes)
        if tubes:
            self._tally_known_at = -math.inf

    @property
    def knows_tubes(self) -> bool:
        """Whether every tube that speaks has been heard, or is known from before the start."""
        return self.now >= self._tally_known_at

    def string_below(self, measurement: SurveyMeasurement) -> float | None:
        """Length (m) of string below a tube; None while the tubes known are not those that reach the bit.

        A ground station that has lost its database meets the tubes one after the other, the upper ones first.
        """
        self.tally.on_hops(measurement.tube, self._hops_if_unknown(measurement))
        bit = self.depths.latest
        if bit is None or self.tally.misfit(bit, ()) or not self.knows_tubes:
            return None
        return self.tally.length_below(measurement.tube)

    def depth_of(self, measurement: SurveyMeasurement, below: float | None) -> float | None:
        """Measured depth (m) of the tube's node when it surveyed; None where no depth brackets its time."""
        below = self.string_below(measurement) if below is None else below
        if below is None or trust_of(measurement.flags) is Trust.UNDATED:
            return None
        bit = self.depths.at(measurement.epoch or self.epoch, measurement.station_at)
        if bit is None or bit - below < -ABOVE_COLLAR:
            return None
        return max(bit - below, 0.0)

    def placeable(self) -> list[tuple[Waiting, float]]:
        """Surveys that waited for their depth and have it now; they wait no more."""
        found = [(one, self.depth_of(one.measurement, one.below)) for one in self.waiting]
        self.waiting = [one for one, md in found if md is None]
        return [(one, md) for one, md in found if md is not None]

    @property
    def unplaced(self) -> int:
        """Surveys without a known depth."""
        return len(self.waiting) + self.undated

    @property
    def health(self) -> Health:
        """The worst that is known, or that nothing is known."""
        heard = [tube for tube in self.tally.tubes if not self.is_stale(tube)]
        depth_is_heard = self.now - self.depth_heard_at <= self.config.stale_after
        knows = math.isfinite(self.rig_now) and depth_is_heard and bool(heard)
        return max(self.rig_alarms.health, Health.GOOD if knows else Health.UNKNOWN)

    def on_survey(self, measurement: SurveyMeasurement, md: float | None, below: float | None = None) -> str:
        """Resolve and fuse a stored measurement; returns the kind of alarm where it is not used as it is, or ''."""
        trust = trust_of(measurement.flags)
        if trust is Trust.UNDATED:
            self.undated += 1
            return "survey_unplaced"
        if trust is Trust.SET_ASIDE:
            self.set_aside.append(measurement)
            return "survey_set_aside"
        if md is None:
            self.waiting.append(Waiting(measurement, below))
            return ""  # most wait for a moment; the watch tells of those that wait longer
        try:
            self._fuse(measurement, md, trust)
        except (SurveyError, np.linalg.LinAlgError):
            self.refused += 1
            return "survey_refused"
        return "" if trust is Trust.FULL else "survey_untrusted"

    def _fuse(self, measurement: SurveyMeasurement, md: float, trust: Trust) -> None:
        forces = np.array([imu.force for imu in measurement.imus])
        covs = np.array([imu.force_cov for imu in measurement.imus])
        direction = self._direction(measurement, trust, *combine_imus(forces, covs))
        noise = math.radians(ACCELEROMETER_NOISE_DEG) * self.config.gravity
        quality = check(forces, covs, self.config.gravity, measurement.samples, measurement.settle_time, noise)
        epoch, at = measurement.epoch or self.epoch, measurement.station_at
        if self.history.begins_stop(epoch, at):
            rows = [deviation(point, self.config.design) for point in self.trajectory]
            self.history.add(rows, self.projection)
        self.history.on_survey(epoch, at)
        station = self._station_at(md)
        self.seen["measurements"] += 1
        station.add_stop(ResolvedStop(measurement, md, direction, quality, trust, self.seen["measurements"]))
        self._judge_movement(measurement.station_at)
        self._recompute()

    def on_event(self, event: Event) -> None:
        """Remember what happened."""
        self.seen["events"] += 1
        self.events.append(event)
        self.orders.on_event(event)

    def on_static_record(self, record: StaticRecord) -> None:
        """Remember an average at rest."""
        self.seen["static_records"] += 1
        self.static_records.append(record)
        self.orders.on_static_record(record)
        self.recalibration.on_static_record(record)

    def age(self, tube: int) -> float:
        """Seconds of the own clock since a node's newest state came; infinite for one never heard."""
        return self.now - self._heard_at.get(tube, -math.inf)

    def is_stale(self, tube: int) -> bool:
        """Whether a node has been silent for too long."""
        return not self.age(tube) <= self.config.stale_after

    def _time_on_its_way(self, state: NodeState) -> float:
        """Seconds for which a state has been on its way; 0 where its time cannot be compared with the rig time here."""
        is_dated = state.epoch == self.epoch != EPOCH_UNKNOWN and NodeFlag.CLOCK_UNSYNCHRONISED not in state.flags
        return max(self.rig_now - state.at, 0.0) if is_dated and math.isfinite(self.rig_now) else 0.0

    def _hops_if_unknown(self, measurement: SurveyMeasurement) -> int:
        return measurement.hops if measurement.tube not in self.tally.tubes else -1

    def _station_at(self, md: float) -> SurveyStation:
        for station in self.stations:
            if abs(station.md - md) <= self.config.station_tolerance:
                return station
        station = SurveyStation(md)
        self.stations.append(station)
        self.stations.sort(key=lambda known: known.md)
        return station

    def _direction(self, m: SurveyMeasurement, trust: Trust, force: Array, force_cov: Array) -> Direction:
        """Direction of a measurement with what it shares with others."""
        resolved = resolve(force, force_cov, m.yaw, m.yaw_var)
        if trust is Trust.UNKNOWN_YAW:
            resolved = with_unknown_yaw(resolved)
        return self.shared.reading(
            resolved,
            m.tube,
            self.tally.above(m.tube, m.hops),
            m.systematic_var,
            math.radians(self.config.mount_std_deg) ** 2,
            math.radians(self.config.accelerometer_bias_std_deg) * self.config.gravity,
        )

    def _judge_movement(self, since: float) -> None:
        """Drop earlier clusters where the hole moved, at every stop from the one at rig time ``since`` (s) on.

        Each stop is judged as a whole, so the order in which its surveys arrive changes nothing.
        """
        stops = [stop for stop in self._stops() if stop[-1][0] >= since]
        begin = stops[0][0][0]
        self.moved = [moved for moved in self.moved if moved.at < begin]
        for stop in stops:
            for _, number, place in stop:
                self.stations[number].drops = [d for d in self.stations[number].drops if d != place]
        for stop in stops:
            self._judge_stop(stop)

    def _stops(self) -> list[list[tuple[float, int, int]]]:
        """Clusters as (time, station, place) in the order of time, parted where the string was not read for a while."""
        every = sorted((c.at, n, place) for n, s in enumerate(self.stations) for place, c in enumerate(s.clusters))
        stops: list[list[tuple[float, int, int]]] = []
        for cluster in every:
            if not stops or cluster[0] - stops[-1][-1][0] >= SAME_STOP:
                stops.append([])
            stops[-1].append(cluster)
        return stops

    def _judge_stop(self, stop: list[tuple[float, int, int]]) -> None:
        """Neighbours are the nearest stations above and below that were read at the same stop."""
        by_depth = sorted(stop, key=lambda cluster: cluster[1:])
        seen = [self.stations[number].departure(place) for _, number, place in by_depth]
        for k, (at, number, place) in enumerate(by_depth):
            own = seen[k]
            if own is None:
                continue
            around = [d for d in (*seen[max(k - 1, 0) : k], *seen[k + 1 : k + 2]) if d is not None]
            evidence = judge_departure(own, around)
            if evidence.moved:
                station = self.stations[number]
                self.moved.append(Moved(station.md, at, place - station.first_before(place), evidence))
                station.drops.append(place)

    def fused(self, station: SurveyStation) -> Direction:
        """Direction of a station from the clusters that count."""
        return weighted(station.readings(), self.config.weighting)

    def _recompute(self) -> None:
        trajectory = Trajectory()
        direction = None
        for station in self.stations:
            if station.md > 0.0:
                direction = self.fused(station)
                trajectory.append(station.md, direction)
        self.trajectory = trajectory.points
        if direction is None:
            return
        at = max(cluster.at for station in self.stations for cluster in station.clusters)
        worst = max((deviation(point, self.config.design) for point in self.trajectory[1:]), key=lambda d: d.ratio)
        self.projection = project(self.trajectory[-1], direction, self.config.design)
        self.alarms.judge_deviation("deviation", worst, at)
        self.alarms.judge_deviation("projection", self.projection, at)


def is_repeated(state: NodeState, known: NodeState) -> bool:
    """Whether a state is the newest known or one before it; a clock or a count of cycles may go back, not both."""
    return state.epoch == known.epoch and state.at <= known.at and state.cycles <= known.cycles
