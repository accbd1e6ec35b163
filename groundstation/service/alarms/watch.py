"""What the ground station looks at from time to time: what stands in its model becomes alarms. No I/O."""

from __future__ import annotations

import math
from dataclasses import dataclass

from groundstation.service.alarms.encoder_cross_check import OFF_BEFORE, EncoderCrossCheck
from groundstation.service.alarms.rig_alarms import RigAlarms
from groundstation.service.hole.examined_hole import UNSOLVED
from groundstation.service.hole.placement import UNTRUSTED, Placement
from groundstation.service.hole.surveyed_hole import SurveyedHole
from groundstation.service.string.depth import CONTRADICTION
from groundstation.service.string.idle_turning import IdleTurning
from groundstation.service.string.known_string import KnownString
from groundstation.service.string.message_numbers import Range
from groundstation.service.string.number_growth import NumberGrowth
from groundstation.survey.fusion.joint_angles import Pair, RestingYaw
from groundstation.survey.fusion.shared_scale import shared_scale
from groundstation.survey.fusion.survey_trust import trust_of
from groundstation.survey.fusion.trust_level import Trust
from telemetry.application.seal_watch import CODE, refusal_of
from telemetry.application.series import SERIES_SHIFT
from telemetry.messages import EPOCH_UNKNOWN, Event, NodeFlag, NodeMode, NodeState, SurveyMeasurement

LOOK_EVERY = 0.5  # s, own clock
DOUBTING_VAR = math.radians(5.0) ** 2  # rad^2, systematic, of a yaw that may have jumped
AHEAD = 0.5  # s by which a node's rig time may be ahead of the ground station's
PLACED_WITHIN = 5.0  # s of rig time after which a survey without a depth is told
GAP_AFTER = 30.0  # s that a number may be on its way
ASK_EVERY = 120.0  # s between two orders to send a range again
ASKED_AT_MOST = 3
COMES_WITHIN = 10.0  # s of an answer, in which what was sent again has come
REFUSALS = 3  # readings of the depth refused in a row until that is told
SENSOR = NodeFlag.SENSOR_FAULT | NodeFlag.YAW_UNTRUSTED | NodeFlag.RATE_EXCEEDED
AT_REST = (NodeMode.STILL, NodeMode.SURVEY)
OF_THE_DISK = ("saved_state_lost", "boot_counter_lost", "parameters_fallback")


@dataclass(slots=True)
class Gap:
    """A range of a tube's numbers that has not come."""

    numbers: Range
    found_at: float  # s, own clock
    asked_at: float = -math.inf
    asked: int = 0
    complete_from: int = 0  # number from which on the tube has kept its surveys


class Watch:
    """Looks at what is known of a rig and raises its alarms.

    Parameters
    ----------
    string, hole, placement : that it looks at
    alarms : that it raises
    stale_after : s without a depth after which that is told
    """

    def __init__(
        self, string: KnownString, hole: SurveyedHole, placement: Placement, alarms: RigAlarms, stale_after: float
    ) -> None:
        self._string, self._hole, self._placement = string, hole, placement
        self._time, self._states, self._alarms = string.time, string.states, alarms
        self._numbers, self._joints, self._depths = string.numbers, string.joints, string.depths
        self._stale_after = stale_after
        self._looked_at = -math.inf
        self._refused_in_a_row = 0
        self._contradictions = 0
        self._gaps: dict[int, Gap] = {}
        self._growth = NumberGrowth()
        self._cross_check = EncoderCrossCheck()
        self._idle_turning = IdleTurning()
        self._told_unplaced: set[int] = set()  # tubes
        self._doubled: set[int] = set()  # numbers that two tubes give themselves, as told
        self._told_back: set[float] = set()  # m, stations that turn back
        self._blamed: set[str] = set()  # subjects of what was found to be wrong with the hole
        self._depth_due = math.inf  # s, own clock, since when tubes are known and a depth may be expected

    def is_due(self, now: float) -> bool:
        """Whether to look again at ``now`` (s, own clock)."""
        return now >= self._looked_at + LOOK_EVERY

    def look(self, now: float) -> None:
        """Look at everything, at ``now`` (s, own clock)."""
        self._looked_at = now
        self._alarms.advance(now, self._time.rig_now)
        self._look_at_nodes()
        self._look_at_doubled()
        self._look_at_encoder()
        self._look_at_belt()
        self._look_at_depth(now)
        self._look_at_surveys()
        self._look_at_stops()
        self._look_at_hole()

    def on_state(self, state: NodeState) -> None:
        """Judge what a node says of itself."""
        tube, hold = f"tube {state.tube}", self._alarms.hold
        hold("tube_sensor", tube, ", ".join(str(flag.name).lower() for flag in SENSOR & state.flags))
        hold("tube_disk", tube, "its disk refuses" if NodeFlag.NOT_SAVED in state.flags else "")
        hold("clock", tube, self._clock_fault(state))
        self._look_at_joint(state)
        self._idle_turning.on_state(state, self._string.bit)
        if state.tube in self._string.doubled:
            return  # what both have numbered comes under one number
        if self._numbers.on_told(state.tube, state.numbered):
            self._alarms.alert("tube_counts_anew", tube, f"newest number {state.numbered}")

    def _look_at_hole(self) -> None:
        """Tell what is wrong with the hole by its surveys, and what is not any more."""
        examined = self._hole.examined if self._hole.is_adjusted else None
        blunders = {} if examined is None else examined.by_subject
        if self._hole.is_adjusted and self._hole.is_unsolved:
            blunders = {"hole": [UNSOLVED]}
        for subject in self._blamed - blunders.keys():
            self._alarms.clear("blunder", subject)
        for subject, sentences in blunders.items():
            self._alarms.hold("blunder", subject, "; ".join(sentences))
        self._blamed = set(blunders)

    def on_event(self, event: Event) -> None:
        """Judge an event when it comes."""
        tube = f"tube {event.tube}" if event.tube else "encoder"
        is_later_series = event.sequence >> SERIES_SHIFT > 0
        if event.code == "restored" or (event.code == "booted" and is_later_series):
            self._alarms.alert("tube_restarted", tube, event.code)
        elif event.code in OF_THE_DISK:
            self._alarms.alert("tube_restarted", tube, f"{event.code}: {event.arguments.get('detail', '')}"[:200])
        elif event.code == "queue_full":
            self._alarms.alert("tube_queue", tube, f"{event.arguments.get('dropped')} dropped")
        elif event.code == CODE:
            self._alarms.alert(CODE, tube, refusal_of(event.arguments))
        elif event.code == "joint_contradicts_marks":
            angle, marks = (_event_number(event, name) for name in ("angle_deg", "marks_deg"))
            what = f"its angle by the yaws is {angle:.1f} deg, by its marks {marks:.1f} deg"
            self._alarms.alert("joint", f"joint above {tube}", f"{what}; see the command accept_joints")

    def on_known_event(self, event: Event) -> None:
        """Judge an event that has come, or was stored before a restart of the ground station.

        One that the disk refuses is judged each time it comes: its warning must not wait for room on a disk.
        """
        if against := self._cross_check.on_event(event, self._heard):
            self._alarms.alert("reference", "encoder", against)

    def on_measurement(self, measurement: SurveyMeasurement, outcome: str) -> None:
        """Tell what a measurement was not used for: ``outcome`` is a kind of alarm, or empty.

        A tube whose measurements are all believed, for the last that was not is revised, is told of no longer.
        """
        subject = f"tube {measurement.tube}"
        if outcome:
            flags = ", ".join(str(flag.name).lower() for flag in NodeFlag if flag and flag in measurement.flags)
            detail = f"number {measurement.sequence} at {measurement.station_at:.1f} s"
            self._alarms.alert(outcome, subject, f"{detail}: {flags}" if flags else detail)
        elif self._alarms.stands(UNTRUSTED, subject) and not self._hole.has_untrusted(measurement.tube):
            self._alarms.clear(UNTRUSTED, subject)

    def on_epoch(self, epoch: int) -> None:
        """The encoder has started again."""
        self._alarms.alert("epoch", "encoder", f"epoch {epoch}")

    def on_depth(self, refused: str) -> None:
        """A reading of the depth was taken, or refused for a reason."""
        self._refused_in_a_row = self._refused_in_a_row + 1 if refused else 0
        jumped = self._depths.jumped
        if jumped:
            self._alarms.hold("depth_refused", "depth", f"it jumped {jumped}; see the command accept_depth")
        elif self._refused_in_a_row >= REFUSALS or not refused:
            self._alarms.hold("depth_refused", "depth", refused)
        contradictions = self._depths.refusals[CONTRADICTION]
        if contradictions > self._contradictions:
            self._contradictions = contradictions
            self._alarms.alert("depth_refused", "stands", "stands of the bit contradict each other")

    def gaps_to_ask(self, now: float) -> list[tuple[int, Range]]:
        """Tubes and ranges that are to be asked for at ``now`` (s, own clock)."""
        asked = []
        for tube in [one for one in self._numbers.tubes if one not in self._string.doubled]:
            gap = self._gap_of(tube, now)
            if gap is None or now < gap.found_at + GAP_AFTER or now < gap.asked_at + ASK_EVERY:
                continue
            if gap.asked >= ASKED_AT_MOST:
                self._give_up(tube, gap)
            elif not self._states.is_stale(tube):
                gap.asked_at, gap.asked = now, gap.asked + 1
                asked.append((tube, gap.numbers))
        return asked

    def on_resent(self, tube: int, first: int, sent: int, complete_from: int, now: float) -> None:
        """A tube has answered for numbers from ``first`` on; what it does not have any more will not come."""
        gap = self._gaps.get(tube)
        if gap is not None and gap.numbers[0] == first:
            gap.complete_from = complete_from
            gap.asked_at = now - ASK_EVERY + (COMES_WITHIN if sent else 0.0)
            gap.asked = gap.asked if sent else ASKED_AT_MOST

    @property
    def _heard(self) -> list[int]:
        """Tubes that are heard; all where none is, for what comes then is stored."""
        return self._string.heard or self._string.tubes

    def _look_at_joint(self, state: NodeState) -> None:
        """Tell where the yaws of two neighbours part."""
        if state.mode not in AT_REST or trust_of(state.flags) is not Trust.FULL:
            self._joints.on_motion(state.tube)
            return
        yaw = RestingYaw(state.tube, state.at, state.yaw, state.yaw_var)
        if change := self._joints.on_yaw(self._string.tubes, yaw):
            what = f"the yaws part by {math.degrees(change.by):.1f} deg at {state.at:.0f} s"
            self._alarms.alert("joint", subject_of(change.pair), f"{what}; see the command accept_joints")

    def _gap_of(self, tube: int, now: float) -> Gap | None:
        self._growth.note(tube, self._numbers.newest(tube), now)
        numbers, known = self._numbers.gap(tube), self._gaps.get(tube)
        if numbers is None:
            self._gaps.pop(tube, None)
            self._alarms.clear("numbers_missing", f"tube {tube}")
            return None
        if known is None or known.numbers[0] != numbers[0]:
            known = self._gaps[tube] = Gap(numbers, self._growth.given_out_at(tube, numbers[1], now))
        known.numbers = numbers
        if now >= known.found_at + GAP_AFTER:
            self._alarms.hold("numbers_missing", f"tube {tube}", f"numbers {numbers[0]} to {numbers[1]}")
            state = self._states.newest.get(tube)
            doubts = state is not None and state.systematic_var >= DOUBTING_VAR
            if against := self._cross_check.on_lost(tube, numbers, self._heard, doubts=doubts):
                self._alarms.alert("reference", "encoder", against)
        return known

    def _give_up(self, tube: int, gap: Gap) -> None:
        first, last = gap.numbers
        self._numbers.give_up(tube, gap.numbers)
        if first < gap.complete_from:
            what = f"numbers {first} to {last}; surveys may be among those before {gap.complete_from}"
        else:
            what = f"numbers {first} to {last}, which were events"
        self._alarms.alert("numbers_lost", f"tube {tube}", what)

    def _clock_fault(self, state: NodeState) -> str:
        time = self._time
        if state.epoch not in (EPOCH_UNKNOWN, time.epoch):
            return f"it counts from epoch {state.epoch}, the encoder from {time.epoch}"
        if NodeFlag.CLOCK_UNSYNCHRONISED not in state.flags and state.at > time.rig_now + AHEAD:
            return f"its rig time is {state.at - time.rig_now:.1f} s ahead"
        return ""

    def _look_at_nodes(self) -> None:
        for tube in self._string.tubes:
            silent = "silent" if math.isfinite(self._states.age(tube)) else "not heard since the ground station started"
            self._alarms.hold("tube_silent", f"tube {tube}", silent if self._states.is_stale(tube) else "")

    def _look_at_doubled(self) -> None:
        """Tell which two tubes have one number, until it is told which of them is the tube."""
        doubled = self._string.doubled
        for tube in self._doubled - set(doubled.untold):
            self._alarms.clear("same_number", f"tube {tube}")
        for tube in doubled.untold:
            places, upper = doubled.newest(tube), doubled.upper_of(tube)
            two = f"tube {places.upper} from the top, shown as tube {upper}, and tube {places.lower} from the top"
            self._alarms.hold("same_number", f"tube {tube}", f"{two}; see the command same_number")
        self._doubled = set(doubled.untold)

    def _look_at_encoder(self) -> None:
        if not self._string.knows_tubes:
            return  # a tube that ran all the while may not have been heard yet
        lately = [tube for tube in self._string.tubes if self._states.age(tube) <= OFF_BEFORE]
        if unwatched := self._cross_check.look(self._time.epoch, self._time.rig_now, lately):
            self._alarms.alert("reference", "encoder", unwatched)

    def _look_at_belt(self) -> None:
        nodes = self._states.newest
        shared = shared_scale([nodes[tube].scale_factor for tube in self._string.tubes if tube in nodes])
        if shared is None:
            self._alarms.hold("belt", "encoder", "")
            return
        sense = "less" if shared.by > 0.0 else "more"
        what = f"it turns {100.0 * abs(shared.by):.2f} % {sense} than {shared.nodes} gyroscopes say"
        self._alarms.hold("belt", "encoder", what)

    def _look_at_depth(self, now: float) -> None:
        string, heard_at = self._string, self._string.depth_heard_at
        was_heard = math.isfinite(heard_at)
        if string.tubes:
            self._depth_due = min(self._depth_due, now)
        silent = now > max(heard_at, self._depth_due) + self._stale_after
        why = "no reading comes" if was_heard else "not heard since the ground station started"
        self._alarms.hold("depth_silent", "depth", why if silent else "")
        bit = string.bit
        self._alarms.hold("depth_stands", "depth", "" if silent else self._idle_turning.told(bit))
        comparable = was_heard and not silent and string.knows_tubes
        misfit = string.tally.misfit(bit, string.heard) if bit is not None and comparable else ""
        by_surveys = self._hole.depth_misfit(self._depths.accepted_at(self._time.epoch))
        self._alarms.hold("depth_contradicts", "depth", misfit or by_surveys)

    def _look_at_surveys(self) -> None:
        time, waiting = self._time, self._placement.waiting
        overdue: dict[int, list[int]] = {}
        for one in waiting:
            m = one.message
            if m.epoch not in (EPOCH_UNKNOWN, time.epoch) or time.rig_now > m.station_at + PLACED_WITHIN:
                overdue.setdefault(m.tube, []).append(m.sequence)
        for tube in {one.message.tube for one in waiting} | self._told_unplaced:
            numbers = ", ".join(map(str, overdue.get(tube, [])[:10]))
            self._alarms.hold("survey_unplaced", f"tube {tube}", f"numbers {numbers}" if numbers else "")
        self._told_unplaced = set(overdue)
        back = set(self._hole.turned_back)
        for md in back | self._told_back:
            what = "it points back up the hole: the hole is not known from there on" if md in back else ""
            self._alarms.hold("survey_refused", f"station at {md:.2f} m", what)
        self._told_back = back

    def _look_at_stops(self) -> None:
        stops = self._string.stops
        stops.judge(self._time.epoch, self._time.rig_now)
        for stop in stops:
            if stop.judged:
                missing = ", ".join(map(str, sorted(stop.missing)))
                subject = f"stop at {stop.stand.md:.2f} m, {stop.stand.epoch}/{stop.stand.begun_at:.0f} s"
                self._alarms.hold("survey_missing", subject, f"tubes {missing}" if missing else "")


def _event_number(event: Event, name: str) -> float:
    """An argument of an event as a float; NaN if it is missing or no number, for the event may be forged."""
    value = event.arguments.get(name)
    return float(value) if isinstance(value, int | float) else math.nan


def subject_of(pair: Pair) -> str:
    """What an alarm of a joint is about."""
    return f"joint of tubes {pair[0]} and {pair[1]}"
