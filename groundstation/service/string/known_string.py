"""The string as the ground station knows it: its tubes, its nodes, where the bit is and was, what was sent. No I/O."""

from __future__ import annotations

import math
from collections.abc import Sequence

from groundstation.config import GroundConfig
from groundstation.service.string.depth import DepthLog
from groundstation.service.string.doubled_numbers import OTHER, DoubledNumbers
from groundstation.service.string.message_numbers import MessageNumbers
from groundstation.service.string.node_states import NodeStates
from groundstation.service.string.numbered_rows import NumberedRows
from groundstation.service.string.rig_time import RigTime
from groundstation.service.string.stands import take_stand, take_survey
from groundstation.service.string.stops import Stops
from groundstation.service.string.tally import Tally
from groundstation.survey.fusion.joint_angles import JointAngles
from groundstation.survey.fusion.survey_trust import trust_of
from groundstation.survey.fusion.trust_level import Trust
from telemetry.messages import EPOCH_UNKNOWN, DepthReading, Event, NodeState, Stand, StaticRecord, SurveyMeasurement

EVENTS_KEPT = 10_000
STATIC_RECORDS_KEPT = 1_000
ABOVE_COLLAR = 0.01  # m, of rounding; a node higher up is in no hole
ALL_HEARD_WITHIN = 2.0  # s after the last tube that was new, of tubes that speak


class KnownString:
    """What is known of the string; each part of it is a subject of its own.

    Parameters
    ----------
    config : of the ground station

    Attributes
    ----------
    time : own clock and rig time
    tally : which tube hangs below which
    states : what the nodes say of themselves
    depths, stops : where the bit was, and where it stood to be surveyed
    numbers : which numbers of the tubes' messages have come
    joints : angles at which the tubes were made up
    doubled : numbers that two tubes give themselves; the other of both is known by a number of its own
    events, static_records : the newest that came
    """

    def __init__(self, config: GroundConfig) -> None:
        self.time = RigTime()
        self.tally = Tally(config.tube_length)
        self.states = NodeStates(self.time, config.stale_after)
        self.depths = DepthLog(config.depth_rate, config.depth_gap)
        self.stops = Stops(self.tally, config.survey_after)
        self.numbers = MessageNumbers()
        self.joints = JointAngles()
        self.doubled = DoubledNumbers()
        self.events: NumberedRows[Event] = NumberedRows(EVENTS_KEPT)
        self.static_records: NumberedRows[StaticRecord] = NumberedRows(STATIC_RECORDS_KEPT)
        self._stale_after = config.stale_after
        self._tubes_known_at = math.inf  # s, own clock, from which on every tube is taken to have been heard
        self._depth_heard_at = -math.inf  # s, own clock

    @property
    def tubes(self) -> list[int]:
        """Tubes from the top down."""
        return self.tally.tubes

    @property
    def heard(self) -> list[int]:
        """Tubes that speak, from the top down."""
        return [tube for tube in self.tally.tubes if not self.states.is_stale(tube)]

    @property
    def silent(self) -> list[int]:
        """Tubes that have been silent for too long, from the top down."""
        return [tube for tube in self.tally.tubes if self.states.is_stale(tube)]

    @property
    def bit(self) -> float | None:
        """Newest depth of the bit, m."""
        return self.depths.latest

    @property
    def depth_age(self) -> float:
        """Seconds of the own clock since a depth was believed; infinite before the first."""
        return self.time.now - self._depth_heard_at

    @property
    def depth_heard_at(self) -> float:
        """Time of the own clock (s) at which a depth was believed last; minus infinity before the first."""
        return self._depth_heard_at

    @property
    def knows_tubes(self) -> bool:
        """Whether every tube that speaks has been heard, or is known from before the start."""
        return self.time.now >= self._tubes_known_at

    @property
    def is_known(self) -> bool:
        """Whether rig time is known, a depth is heard and a tube is."""
        return self.time.is_known and self.depth_age <= self._stale_after and bool(self.heard)

    def restore_tubes(self, tubes: Sequence[int]) -> None:
        """Go on with the tubes that were known before a restart."""
        self.tally.restore(list(tubes))
        if tubes:
            self._tubes_known_at = -math.inf

    def on_state(self, state: NodeState, now: float) -> bool:
        """Handle a node's state that came at ``now`` (s, own clock); False of one that is no news."""
        is_newest = self.states.on_state(state, now)
        if is_newest:
            # a tube may be known by a survey that came before the first state
            is_new = state.tube not in self.tally.tubes or math.isinf(self._tubes_known_at)
            if is_new and now < self._tubes_known_at:
                self._tubes_known_at = now + ALL_HEARD_WITHIN
            self._on_hops(state.tube, state.hops)
        return is_newest is not None

    def _on_hops(self, tube: int, hops: int) -> None:
        """Give a tube its place; the other of two with one number has none where one has taken the place of a tube."""
        places = [hops, *(self.tally.place_of(one) for one in self.tally.tubes)]
        if tube < OTHER or tube in self.tally.tubes or len(set(places)) == len(places):
            self.tally.on_hops(tube, hops)
        if self.doubled:
            self._take_out_silent()

    def _take_out_silent(self) -> None:
        """The other of two with one number hangs no more where it is silent, and all others are heard as without it.

        What was hung in by mistake gives way to the right tube; where that is added above it, the places differ.
        """
        tally, is_silent = self.tally, self.states.is_stale
        silent = [tube for tube in tally.tubes if tube > OTHER and is_silent(tube)]
        rest = [tube for tube in tally.tubes if tube not in silent]
        places = {tally.place_of(tube) for tube in rest}
        if silent and not any(map(is_silent, rest)) and places == set(range(1, len(rest) + 1)):
            for tube in silent:
                if tally.place_of(tube) in places:
                    tally.remove(tube)

    def on_doubled(self) -> None:
        """Which of two tubes of one number is the tube was told, or taken back: they change names in the string."""
        for tube in [one - OTHER for one in self.tally.tubes if one > OTHER]:
            upper = self.doubled.upper_of(tube)
            lower = 2 * tube + OTHER - upper
            if tube in self.tally.tubes and self.tally.tubes.index(upper) > self.tally.tubes.index(lower):
                self.tally.exchange(upper, lower)

    def on_rig_time(self, rig_now: float, epoch: int) -> None:
        """Follow rig time (s) of an epoch."""
        if self.time.follow_rig_time(rig_now, epoch):
            self.states.on_new_epoch()

    def on_depth(self, reading: DepthReading, now: float) -> str:
        """Take a reading of the depth at ``now`` (s, own clock); returns why not, or nothing."""
        time = self.time
        refused = self.depths.on_reading(reading, time.epoch, time.rig_now, now, self.tally.deepest)
        if not refused:
            self._depth_heard_at = now
        return refused

    def on_told_stand(self, told: Stand, at: float) -> None:
        """A reading of the depth at rig time ``at`` (s) tells that the bit stood, or still does."""
        epoch = self.time.epoch
        is_present = told.epoch in (EPOCH_UNKNOWN, epoch) and told.ended_at <= at
        is_news = is_present and not self.depths.is_of_before(told, epoch)
        if is_news and told.md <= self.tally.deepest:
            take_stand(self.depths, self.stops, Stand(epoch, told.begun_at, told.ended_at, told.md))

    def on_measurement(self, measurement: SurveyMeasurement, *, is_placed: bool) -> None:
        """A tube has surveyed at a stop; where the depth of it is known that stop may be the first."""
        epoch = self.epoch_of(measurement)
        self.stops.on_survey(epoch, measurement.station_at, measurement.tube)
        if is_placed:
            take_survey(self.depths, self.stops, epoch, measurement.station_at)

    def epoch_of(self, measurement: SurveyMeasurement) -> int:
        """Epoch of rig time of a measurement: the present one where its tube did not know it."""
        return measurement.epoch or self.time.epoch

    def length_below(self, measurement: SurveyMeasurement) -> float | None:
        """Length (m) of string below a tube; None while the tubes known are not those that reach the bit.

        A ground station that has lost its database meets the tubes one after the other, the upper ones first.
        """
        tube, tally = measurement.tube, self.tally
        if tube not in tally.tubes:
            self._on_hops(tube, measurement.hops)
        bit = self.depths.latest
        if bit is None or tally.misfit(bit, ()) or not self.knows_tubes:
            return None
        return tally.length_below(tube)

    def depth_of(self, measurement: SurveyMeasurement, below: float | None) -> float | None:
        """Measured depth (m) of the tube's node when it surveyed; None where no depth brackets its time.

        Nor where the string that hung there then did not reach that depth: tubes below are not known yet.
        """
        below = self.length_below(measurement) if below is None else below
        if below is None or trust_of(measurement.flags) is Trust.UNDATED:
            return None
        bit = self.depths.at(self.epoch_of(measurement), measurement.station_at)
        if bit is None or bit - below < -ABOVE_COLLAR or not self.tally.reaches(bit, measurement.hops, below):
            return None
        return max(bit - below, 0.0)

    def depth_of_node(self, tube: int) -> float | None:
        """Measured depth (m) of a node where the bit is now, above the collar negative; None where it is not known."""
        below, bit = self.tally.length_below(tube), self.depths.latest
        return None if bit is None or below is None else bit - below
