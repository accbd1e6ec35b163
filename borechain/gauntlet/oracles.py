"""What must hold while a rig runs and at its end, whatever the faults were."""

from __future__ import annotations

import math
import sqlite3
from collections.abc import Collection, Iterator
from functools import partial
from typing import Any

import msgpack

from borechain.gauntlet.gauntlet_rig import GauntletRig
from groundstation.service.hole.surveyed_hole import SurveyedHole
from sim.gauntlet.expected_doubts import misled_by
from sim.gauntlet.fault import TUBES
from sim.gauntlet.faulty_world import TUBE_LENGTH, FaultyWorld
from sim.rig.report import wrap_deg
from telemetry.application.outbox import LIMIT
from telemetry.messages import BASE, NodeFlag, Receipt, Side
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.schema import MessageKind
from telemetry.transport.hop import BEST_EFFORT_LIMIT, QUEUE_LIMIT, WINDOW, parse_frame

DEPTH_TOLERANCE = 0.05  # m
SIGMAS = 5.0  # of a direction in the plane; 3 are exceeded by one good survey in ninety
LATE = 2.0  # s that the ground station may take to notice a silence, or that a survey is overdue
TOLD = frozenset(
    {
        *("survey_missing", "numbers_lost", "numbers_missing", "survey_set_aside", "survey_unplaced"),
        *("disk", "depth_silent", "depth_refused", "same_number"),
    }
)
DEPTH = frozenset({"depth_refused", "depth_contradicts"})  # alarms while which no depth since a gap is sure
YAW = frozenset({"reference", "joint"})  # alarms while which no yaw is sure, where encoder or sensors have failed
RECEIPT = msgpack.packb({"k": int(MessageKind.RECEIPT)})[1:]  # in every frame with a receipt
SURELY_FOUND = 2.0  # times the smallest blunder that is stated to be found
UNKNOWN_DEG = 20.0  # of an azimuth whose yaws are all unknown, at least


class Observer:
    """Looks at a rig while it runs.

    Nothing stale is shown fresh, no queue grows without bound, no number of a start is used twice, and what the ground
    station receipts is on its disk.
    """

    def __init__(self, rig: GauntletRig, since: float = math.inf, *, of_few: bool = True) -> None:
        self._rig = rig
        self._of_few = of_few  # faults: then nothing is excused as unobservable
        self._since = since  # s, rig time of the truth at which the first fault begins
        self.seen: set[tuple[str, str, int]] = set()  # code, subject and count of every alarm so far
        self.told: dict[str, float] = {}  # s after the first fault at which an alarm was first seen
        self._starts: dict[int, tuple[object, set[int]]] = {}  # process that is known, and numbers of all, by address
        self._kept: tuple[bytes, set[tuple[int, int, str]]] = (b"", set())
        self._keeper: object = None  # the ground station's process that has written it
        self._reader = sqlite3.connect(":memory:")
        self._reader.text_factory = partial(str, encoding="utf-8", errors="replace")  # what rots is no text
        self.found: list[str] = []
        rig.channel.listeners.append(self.on_frame)
        rig.before_cut.append(self._see_alarms)  # what the crew has seen does not go with the power

    def look(self) -> None:
        """Look at the rig now."""
        self._see_alarms()
        for text in (*self._freshness(), *overlong_queues(self._rig), *self._repeated_starts()):
            self._tell(text)

    def on_frame(self, sender: int, side: Side, frame: bytes) -> None:
        """Check a frame that leaves a port: a receipt of the ground station must be true now."""
        if sender != BASE or RECEIPT not in frame or (parsed := parse_frame(frame)) is None:
            return
        for _, payload in parsed[1]:
            message = decode_message(payload)
            if isinstance(message, Receipt):
                known = (message.tube, message.sequence, message.content.hex())
                if known not in self._stored():
                    self._tell(f"tube {known[0]}: message {known[1]} is receipted and not on the disk")

    def _see_alarms(self) -> None:
        """Note which alarms are raised, or counted up, after the first fault."""
        if self._rig.ground is None:
            return
        for alarm in self._rig.ground.model.rig_alarms:
            row = (alarm.kind.code, alarm.subject, alarm.count)
            if row not in self.seen:
                self.seen.add(row)
                if self._rig.now >= self._since:
                    self.told.setdefault(alarm.kind.code, self._rig.now - self._since)

    def _tell(self, text: str) -> None:
        if text not in self.found:
            self.found.append(text)

    def _stored(self) -> set[tuple[int, int, str]]:
        """Tube, number and content of what the database would hold after a cut.

        Messages removed from outside count while the process that stored them lives: its receipts may be under way.
        """
        disk, keeper = self._rig.disk(BASE), self._rig.stepper.processes.get(BASE)
        image = disk.kept("ground.sqlite")
        if image is not self._kept[0] or keeper is not self._keeper:
            taken = self._kept[1] if disk.handled and keeper is self._keeper else set()
            self._keeper = keeper
            self._kept = image, taken | (self._messages_of(image) if image else set())
        return self._kept[1]

    def _messages_of(self, image: bytes) -> set[tuple[int, int, str]]:
        """Tube, number and content of every message in the image of a database."""
        self._reader.deserialize(image)
        return set(self._reader.execute("SELECT tube, sequence, content FROM messages"))

    def _repeated_starts(self) -> Iterator[str]:
        for address, process in self._rig.stepper.processes.items():
            known, numbers = self._starts.setdefault(address, (None, set()))
            if process is known or process.endpoint.address != address:
                continue  # another tube hangs in its place, with a count of its own
            number = process.endpoint.boot_count
            if number in numbers and not self._rig.disk(address).handled:
                yield f"process {address}: two starts have the number {number}"
            numbers.add(number)
            self._starts[address] = (process, numbers)

    def _freshness(self) -> Iterator[str]:
        rig = self._rig
        if rig.ground is None or rig.stepper.is_frozen(BASE):
            return
        string = rig.ground.model.string
        states = string.states
        for tube in TUBES:
            if states.age(tube) < 0.0:
                yield f"tube {tube} was heard in the future"
            is_off = rig.silent_for(tube) > rig.ground.config.stale_after + LATE
            state = states.newest.get(tube)
            if state is None or not (self._of_few or string.time.is_dated(state)):
                continue  # held up on its way, and of an epoch that this ground station has never heard
            if is_off and not states.is_stale(tube):
                yield f"tube {tube} without power is shown fresh"


def find_violations(
    rig: GauntletRig,
    seen: Collection[str] = (),
    *,
    encoder_can_be_judged: bool = True,
    depth_can_be_judged: bool = True,
) -> list[str]:
    """Every oracle that does not hold at the end, in words; ``seen`` are the alarms that the crew saw meanwhile.

    Where the encoder cannot be judged, its failure showing in nothing that measures, directions are not; where the
    depth cannot, neither is what it places and what it says is missing. Likewise of what a deception makes wrong, see
    ``sim.gauntlet.expected_doubts``. Events are not sent again, so an alarm that rests on them is lost with a database
    that is deleted or replaced under a crew that has seen it, and what the crew has answered stands no longer.
    """
    shown = rig.inline.ask("alarms")
    standing = {row["code"] for row in shown["rig"]}
    warned = standing | (set(seen) if rig.disk(BASE).handled or rig.repaired else set())
    told = standing | {row["code"] for row in shown["rig_cleared"]}
    rows = rig.inline.ask("measurements")["measurements"]
    misled = misled_by(rig.world.deceptions)
    depth_can_be_judged = depth_can_be_judged and "depth" not in misled
    is_bent = encoder_can_be_judged and "direction" in misled and not warned & YAW
    encoder_can_be_judged = encoder_can_be_judged and not misled & {"direction", "north"}
    return [
        *_each_once(rows),
        *(() if standing & DEPTH or not depth_can_be_judged else _depths(rows, rig.world)),
        *(() if _is_told(rig.world, warned) or not encoder_can_be_judged else _directions(rig)),
        *(_beyond_reliability(rig) if is_bent else ()),
        *_flags(rig.inline.ground.model.hole),
        *(_missing(rows, rig, standing | (told & {"depth_refused"})) if depth_can_be_judged else ()),
        *_health(rig.inline.ask("status")["health"], standing),
        *overlong_queues(rig),
    ]


def _is_told(world: FaultyWorld, warned: set[str]) -> bool:
    """Return whether the crew knows that a yaw is wrong, and one may be: an alarm without a cause excuses nothing."""
    return bool(warned & YAW and (world.misled or (world.spoiled and "joint" in warned)))


def overlong_queues(rig: GauntletRig) -> Iterator[str]:
    """Queues that are longer than their limits."""
    for address, process in rig.stepper.processes.items():
        endpoint = process.endpoint
        if endpoint.mail.outbox_size > LIMIT:
            yield f"process {address}: {endpoint.mail.outbox_size} messages wait"
        if endpoint.waiting > 2 * (QUEUE_LIMIT + WINDOW + BEST_EFFORT_LIMIT):
            yield f"process {address}: {endpoint.waiting} payloads wait in its links"


def _each_once(rows: list[dict[str, Any]]) -> Iterator[str]:
    seen: set[tuple[int, int, float]] = set()
    for row in rows:
        key = (row["tube"], row["sequence"], row["station_at_s"])
        if key in seen:
            yield f"tube {row['tube']}: survey {row['sequence']} counts twice"
        seen.add(key)


def _depths(rows: list[dict[str, Any]], world: FaultyWorld) -> Iterator[str]:
    """Violations of the surveys' depths: each is taken at rest, at a place of its tube in a rest of the schedule."""
    allowed = _rests(world)
    for row in rows:
        md, tube = row["md_m"], row["tube"]
        if not is_at_place((tube, md), allowed):
            yield f"tube {tube}: survey {row['sequence']} is placed at {md:.3f} m"


def _directions(rig: GauntletRig) -> Iterator[str]:
    for station in rig.inline.ask("stations")["stations"]:
        truth = rig.world.truth_station(station["md_m"])
        inclination = math.radians(truth["inclination_deg"])
        along = math.radians(station["inclination_deg"] - truth["inclination_deg"])
        across = math.radians(wrap_deg(station["azimuth_deg"] - truth["azimuth_deg"])) * math.sin(inclination)
        sigma_along = math.radians(station["sigma_inclination_deg"])
        sigma_across = math.radians(station["sigma_azimuth_deg"]) * math.sin(inclination)
        size = math.hypot(along / sigma_along, across / sigma_across)
        if size > SIGMAS:
            yield f"station at {station['md_m']:.2f} m is {size:.1f} sigmas from the truth"


def _beyond_reliability(rig: GauntletRig) -> Iterator[str]:
    """Directions that a deception has bent by more than what is stated to be found, without a word of it.

    A blunder of the smallest size that is stated is found four times in five, one of twice that size always. That is
    of a tube's newest stop. What one tube alone has read is its newest stop's where it was read once and last;
    else the tube may have been bent before, and was compared with nothing.
    """
    found, verdict = rig.inline.ask("adjustment"), rig.inline.ask("verdict")
    if found["blunders"] or set(verdict["doubts"]) - {"setup"}:
        return
    steps = [row["smallest_step_mg"] for row in found["tubes"]]
    if not steps or None in steps:
        return  # it is said that nothing can tell
    stations = rig.inline.ask("stations")["stations"]
    compared = _compared(rig.inline.ask("measurements")["measurements"], len(stations))
    for station in stations:
        if station["station"] not in compared:
            continue
        off_mg = 1e3 * math.sin(_angle_off(station, rig.world.truth_station(station["md_m"])))
        if off_mg > SURELY_FOUND * max(steps):
            yield f"station at {station['md_m']:.2f} m is off by {off_mg:.0f} mg, {max(steps):.0f} are said to be found"


def _compared(rows: list[dict[str, Any]], newest: int) -> set[int]:
    """Stations that two tubes have read, and the newest where it was read once."""
    looks = {row["station"]: [one["tube"] for one in rows if one["station"] == row["station"]] for row in rows}
    return {k for k, tubes in looks.items() if len(set(tubes)) > 1 or (k == newest and len(tubes) == 1)}


def _angle_off(one: dict[str, Any], other: dict[str, Any]) -> float:
    """Angle (rad) between two directions."""
    (i, a), (j, b) = ((math.radians(row["inclination_deg"]), math.radians(row["azimuth_deg"])) for row in (one, other))
    return math.acos(min(math.cos(i) * math.cos(j) + math.sin(i) * math.sin(j) * math.cos(a - b), 1.0))


def _flags(hole: SurveyedHole) -> Iterator[str]:
    """Violations of the flags' effects: a faulty sensor's survey is not fused, an unknown yaw gives no azimuth."""
    for station in hole.stations:
        for stop in station.stops:
            if NodeFlag.SENSOR_FAULT in stop.flags:
                yield f"tube {stop.tube}: a survey of a faulty sensor is fused"
        counting = [station.stops[place] for place in station.counting]
        yaws = [stop.fused_yaw_var for stop in counting]
        flagged = [NodeFlag.YAW_UNTRUSTED in stop.flags for stop in counting]
        if flagged and all(flagged) and min(yaws) < math.radians(UNKNOWN_DEG) ** 2:
            yield f"station at {station.md:.2f} m: untrusted yaws have a sigma of {math.sqrt(min(yaws)):.4f} rad"
        if any(flagged) and not all(flagged):
            yield f"station at {station.md:.2f} m: an untrusted survey counts beside a trusted one"


def _missing(rows: list[dict[str, Any]], rig: GauntletRig, standing: set[str]) -> Iterator[str]:
    lacking = [
        f"tube {tube} at {md:.2f} m"
        for tube, md in _expected(rig)
        if not is_at_place((tube, md), [(row["tube"], row["md_m"]) for row in rows])
    ]
    if lacking and not standing & TOLD:
        yield f"no survey of {', '.join(lacking)}, and no alarm of it stands"


def _rests(world: FaultyWorld) -> list[tuple[int, float]]:
    """Tube and its depth (m) in every rest of the schedule; a string rests too while a tube is added."""
    return _nodes([(phase.tube, world.bit_depth(phase.start)) for phase in world.phases if phase.kind != "drill"])


def _expected(rig: GauntletRig) -> list[tuple[int, float]]:
    """Tube and depth (m) of every survey that the stops of the schedule owe, but of one that is not due yet.

    A ground station that was off while the encoder started again, or lost its database, does not know how long the bit
    has stood: it counts what it has heard, and tells the crew later. A survey taken after the newest reading of the
    depth is placed by the next.
    """
    stops = [(phase.tube, rig.world.bit_depth(phase.end)) for phase in rig.world.phases if phase.kind == "stop"]
    ground = rig.inline.ground
    string, waiting = ground.model.string, ground.model.placement.waiting
    due, epoch = ground.config.survey_after + LATE, string.time.epoch
    waits = [one.stand.md for one in string.stops if not one.judged and one.age(epoch, string.time.rig_now) < due]
    owed = _nodes([stop for stop in stops if not any(abs(stop[1] - md) <= DEPTH_TOLERANCE for md in waits)])
    heard = max((stand.ended_at for stand in string.depths.stands if stand.epoch == epoch), default=math.inf)
    late = {one.message.tube for one in waiting if one.message.station_at > heard}
    coming = [one for one in _nodes([(max(late, default=0), rig.world.bit_depth(rig.world.end))]) if one[0] in late]
    return [one for one in owed if not is_at_place(one, coming)]


def is_at_place(one: tuple[int, float], others: list[tuple[int, float]]) -> bool:
    """Whether a tube is at its depth (m) in a list of both."""
    return any(one[0] == tube and abs(one[1] - md) <= DEPTH_TOLERANCE for tube, md in others)


def _nodes(rests: list[tuple[int, float]]) -> list[tuple[int, float]]:
    """Tube and its depth (m) for every tube of each rest, given the top tube and the depth of the bit."""
    return [(tube, md - TUBE_LENGTH * (tube - 1)) for top, md in rests for tube in range(1, top + 1)]


def _health(health: str, standing: set[str]) -> Iterator[str]:
    if health == "good" and standing & TOLD:
        yield f"health is good while {sorted(standing & TOLD)} stand"
