"""The ground station's knowledge of one rig: string, nodes, stations, trajectory. No I/O."""

from __future__ import annotations

import contextlib
import math
from collections import Counter, deque
from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np

from groundstation.config import GroundConfig
from groundstation.errors import SurveyError
from groundstation.service.alarms.crew_alarms import CrewAlarms
from groundstation.service.alarms.rig_alarms import Health, RigAlarms
from groundstation.service.answers.row_texts import RowTexts
from groundstation.service.hole.live_wall import LiveWall
from groundstation.service.hole.resolved_stops import cluster_of
from groundstation.service.hole.resolving import ResolvedSurvey, resolve_survey, resolve_surveys
from groundstation.service.hole.station import SurveyStation
from groundstation.service.hole.surveyed_hole import Hole
from groundstation.service.orders.order_book import OrderBook
from groundstation.service.orders.recalibration.procedure import FieldProcedure
from groundstation.service.string.depth import DepthLog
from groundstation.service.string.message_numbers import Numbers
from groundstation.service.string.stops import Stops
from groundstation.service.string.tally import Tally
from groundstation.survey.fusion.joint_angles import JointAngles
from groundstation.survey.fusion.resolve import Direction, Quality, Resolved
from groundstation.survey.fusion.shared import SharedErrors, StopDirection, weigh_together
from groundstation.survey.fusion.survey_trust import Trust, trust_of, with_uncertain_yaw, with_unknown_yaw
from telemetry.messages import EPOCH_UNKNOWN, Event, NodeFlag, NodeState, StaticRecord, SurveyMeasurement

EVENTS_SHOWN = 10_000
UNTRUSTED = "survey_untrusted"  # alarm: a survey is fused with an unknown yaw
STATIC_RECORDS_SHOWN = 1_000
ABOVE_COLLAR = 0.01  # m, of rounding; a node higher up is in no hole
EPOCHS_KEPT = 8
UNDATED_KEPT = 64  # states of a tube before it knows rig time
ALL_HEARD_WITHIN = 2.0  # s after the last tube that was new, of tubes that speak


@dataclass(frozen=True, slots=True)
class Waiting:
    """A stored survey that waits for its depth, and the length (m) of string below its tube when it came.

    ``kept`` is the depth (m) that the store has of it already; the next reading may yet say otherwise.
    """

    measurement: SurveyMeasurement
    below: float | None
    kept: float | None = None


@dataclass(frozen=True, slots=True)
class Prepared:
    """A survey that is about to be fused: what is wrong with its stop, and its direction with what it shares."""

    quality: Quality
    direction: StopDirection


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
        self.events: deque[Event] = deque(maxlen=EVENTS_SHOWN)
        self.static_records: deque[StaticRecord] = deque(maxlen=STATIC_RECORDS_SHOWN)
        self.seen = Counter[str]()  # rows of each stream since the start
        self.revision = 0  # grows with everything that comes in, and with all that is published
        self.changed_at: dict[str, int] = {}  # revision at which each path without a number changed last
        self.waiting: list[Waiting] = []  # surveys whose depth is not known yet
        self.undated = 0  # surveys without rig time, which never have one
        self.set_aside: list[SurveyMeasurement] = []  # of a faulty sensor, never fused
        self.refused = 0
        self.now = math.nan  # s, own clock
        self.rig_now = math.nan
        self.epoch = EPOCH_UNKNOWN
        self._tally_known_at = math.inf  # s, own clock, from which on every tube is taken to have been heard
        self.depth_heard_at = -math.inf  # s, own clock
        self._begun_at: dict[int, float] = {}  # s, own clock, of rig time 0 of each epoch that was heard
        self._newest: dict[int, dict[int, tuple[float, int]]] = {}  # times and cycles by tube and epoch
        self._numbered: dict[int, int] = {}  # newest number given, by tube, as its newest state with a time tells
        self._undated: dict[int, deque[tuple[int, float, int]]] = {}  # epochs, times and cycles by tube
        self._heard_at: dict[int, float] = {}  # s, own clock, of each tube's newest state
        self.shared = SharedErrors()
        self.hole = Hole(config, self.shared)
        self.recalibration = FieldProcedure(config.gravity)
        self.orders = OrderBook()
        self._shown: dict[Hashable, tuple[int, bytes]] = {}
        self.measurement_texts = RowTexts(marks=2)
        self.wall = None if config.wall is None else LiveWall(config.wall, config.hole)

    @property
    def stations(self) -> list[SurveyStation]:
        """Stations of the hole from the collar down."""
        return self.hole.stations

    def on_state(self, state: NodeState, now: float) -> bool:
        """Handle a node's state that came at ``now`` (s, own clock), unless a newer one of its epoch is known.

        One that has come before is no sign of life, for it may be a recording: False. Nor is one that was on its
        way for long; it tells that the node spoke then, which is all that a ground station knows after its start.
        """
        known = self.nodes.get(state.tube)
        if self._is_repeated(state) or (known is not None and self._is_of_before(state, known)):
            return False
        self.recalibration.on_state(state)
        spoke_at = now - self._time_on_its_way(state)
        self._heard_at[state.tube] = max(self._heard_at.get(state.tube, -math.inf), spoke_at)
        if known is None or state.epoch != known.epoch or state.at >= known.at:
            self.nodes[state.tube] = state
            if self.is_dated(state):
                self._numbered[state.tube] = state.numbered
            if state.tube not in self.tally.tubes and now < self._tally_known_at:
                self._tally_known_at = now + ALL_HEARD_WITHIN
            self.tally.on_hops(state.tube, state.hops)
        return True

    def on_rig_time(self, rig_now: float, epoch: int) -> None:
        """Follow rig time (s) of an epoch; where it is heard first, states that came before have an age by it."""
        self.rig_now, self.epoch = rig_now, epoch
        begins = epoch not in self._begun_at
        self._begun_at[epoch] = self.now - rig_now
        while len(self._begun_at) > EPOCHS_KEPT:
            del self._begun_at[next(iter(self._begun_at))]
        if begins:
            for tube, state in self.nodes.items():
                self._heard_at[tube] = min(self._heard_at[tube], self.now - self._time_on_its_way(state))

    def _is_repeated(self, state: NodeState) -> bool:
        """Whether a state has come before, or a newer one of its epoch; a clock or a count may go back, not both.

        Without an epoch there is no newer: a board that starts again counts from the beginning. And as clock and count
        may go back in turn, those whose clock says nothing are known one by one: their time does not betray their age.
        The number that was given last does, for a start goes on with larger ones.
        """
        now = state.at, state.cycles
        if state.epoch == EPOCH_UNKNOWN or NodeFlag.CLOCK_UNSYNCHRONISED in state.flags:
            undated = self._undated.setdefault(state.tube, deque(maxlen=UNDATED_KEPT))
            if (state.epoch, *now) in undated or 0 < state.numbered < self._numbered.get(state.tube, 0):
                return True
            undated.append((state.epoch, *now))
        if state.epoch == EPOCH_UNKNOWN:
            return False
        newest = self._newest.setdefault(state.tube, {})
        known = newest.get(state.epoch)
        if known is not None and state.at <= known[0] and state.cycles <= known[1]:
            return True
        newest[state.epoch] = now
        while len(newest) > EPOCHS_KEPT:
            del newest[next(iter(newest))]
        return False

    def _is_of_before(self, state: NodeState, known: NodeState) -> bool:
        """Whether a state leaves its tube's epoch for one that the encoder is not in: a recording."""
        possible = (known.epoch, self.epoch, EPOCH_UNKNOWN)
        return self.epoch != EPOCH_UNKNOWN and state.epoch not in possible

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
        """Measured depth (m) of the tube's node when it surveyed; None where no depth brackets its time.

        Nor where the string that hung there then did not reach that depth: tubes below are not known yet.
        """
        below = self.string_below(measurement) if below is None else below
        if below is None or trust_of(measurement.flags) is Trust.UNDATED:
            return None
        bit = self.depths.at(measurement.epoch or self.epoch, measurement.station_at)
        if bit is None or bit - below < -ABOVE_COLLAR or not self.tally.reaches(bit, measurement.hops, below):
            return None
        return max(bit - below, 0.0)

    def placeable(self) -> list[tuple[Waiting, float]]:
        """Surveys that waited for their depth and have it now; they wait no more."""
        if not self.waiting:
            return []  # the usual case: called at every reading
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

    def on_survey(
        self,
        measurement: SurveyMeasurement,
        md: float | None,
        below: float | None = None,
        prepared: Prepared | None = None,
        kept: float | None = None,
    ) -> str:
        """Resolve and fuse a stored measurement; returns the kind of alarm where it is not used as it is, or ''.

        ``prepared`` is what it comes to, where ``prepare`` has worked that out; ``kept`` is for one that waits, see
        ``Waiting``.
        """
        trust = trust_of(measurement.flags)
        if trust is Trust.UNDATED:
            self.undated += 1
            return "survey_unplaced"
        if trust is Trust.SET_ASIDE:
            self.set_aside.append(measurement)
            return "survey_set_aside"
        if md is None:
            self.waiting.append(Waiting(measurement, below, kept))
            return ""  # most wait for a moment; the watch tells of those that wait longer
        try:
            self._fuse(measurement, md, trust, prepared or self._prepare_one(measurement))
        except (SurveyError, np.linalg.LinAlgError):
            self.refused += 1
            return "survey_refused"
        return "" if trust is Trust.FULL else UNTRUSTED

    def prepare(self, measurements: Sequence[SurveyMeasurement]) -> list[Prepared | None]:
        """What many measurements come to, worked out together; to be fused in this order, and the next after them.

        None for each that is not fused, or is to be looked at by itself.
        """
        placed = [one for one in measurements if trust_of(one.flags) not in (Trust.UNDATED, Trust.SET_ASIDE)]
        resolved = resolve_surveys(placed, self.config.gravity)
        if any(one is None for one in resolved):
            return [None] * len(measurements)
        found = {id(one): self._prepare(one, own) for one, own in zip(placed, resolved, strict=True) if own is not None}
        with contextlib.suppress(np.linalg.LinAlgError):  # of one, which is refused when its turn has come
            weigh_together([one.direction for one in found.values()])
        return [found.get(id(one)) for one in measurements]

    def _prepare_one(self, measurement: SurveyMeasurement) -> Prepared:
        return self._prepare(measurement, resolve_survey(measurement, self.config.gravity))

    def _prepare(self, measurement: SurveyMeasurement, resolved: ResolvedSurvey) -> Prepared:
        return Prepared(resolved.quality, self._direction(measurement, trust_of(measurement.flags), resolved.resolved))

    def _fuse(self, measurement: SurveyMeasurement, md: float, trust: Trust, prepared: Prepared) -> None:
        epoch = measurement.epoch or self.epoch
        number = self.seen["measurements"] + 1
        cluster = cluster_of(measurement, md, prepared.direction, prepared.quality, trust, number)
        if self.hole.add_cluster(cluster, epoch):
            self.seen["measurements"] = number

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

    def is_dated(self, state: NodeState) -> bool:
        """Whether the time of a state can be compared with the own clock: of an epoch heard since the start."""
        return state.epoch in self._begun_at and NodeFlag.CLOCK_UNSYNCHRONISED not in state.flags

    def _time_on_its_way(self, state: NodeState) -> float:
        """Seconds for which a state has been on its way; 0 where its time cannot be compared with the own clock."""
        return max(self.now - self._begun_at[state.epoch] - state.at, 0.0) if self.is_dated(state) else 0.0

    def _hops_if_unknown(self, measurement: SurveyMeasurement) -> int:
        return measurement.hops if measurement.tube not in self.tally.tubes else -1

    def _direction(self, m: SurveyMeasurement, trust: Trust, resolved: Resolved) -> StopDirection:
        """Direction of a measurement with what it shares with others."""
        if trust is Trust.UNKNOWN_YAW:
            resolved = with_unknown_yaw(resolved)
        else:
            resolved = with_uncertain_yaw(resolved, m.yaw_var + m.systematic_var)
        return self.shared.reading(
            resolved,
            m.tube,
            self.tally.above(m.tube, m.hops),
            m.systematic_var,
            math.radians(self.config.mount_std_deg) ** 2,
            math.radians(self.config.accelerometer_bias_std_deg) * self.config.gravity,
        )

    def last_shown(self, view: Hashable, render: Callable[[], bytes]) -> bytes:
        """What a view of the hole shows, as it is sent; rendered anew where a survey has come since.

        As objects what is shown of a long hole would take ten times the room.
        """
        version = self.hole.version
        if self._shown.get(view, (-1,))[0] != version:
            self._shown[view] = version, render()
        return self._shown[view][1]

    def fused(self, station: SurveyStation) -> Direction:
        """Direction of the hole at a station from the clusters that count."""
        return self.hole.direction_of(station)
