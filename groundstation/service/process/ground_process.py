"""The ground station as a process: link to the string, model, store, and the operator's doors."""

from __future__ import annotations

import math
import secrets
import time
from collections import deque
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Protocol

from groundstation.config import GroundConfig
from groundstation.errors import SelectorError
from groundstation.service.alarms.conditions import conditions_of
from groundstation.service.alarms.crew_alarms import Condition
from groundstation.service.alarms.watch import Watch
from groundstation.service.answers.model import RigModel
from groundstation.service.answers.revisions import BEATS
from groundstation.service.disk.ground_store import Store
from groundstation.service.disk.keeper import StringKeeper, refusing_disk
from groundstation.service.hole.blunder_search import RunApart
from groundstation.service.orders.order_book import SentOrder
from groundstation.service.orders.uploads import uploads_of
from groundstation.service.process.doubled_book import DoubledBook
from groundstation.service.process.intake_tape import DEPTH, MESSAGE, ORDER, TIMER, Tape
from groundstation.service.process.learner import Learner
from groundstation.service.process.operator_access import BlockUpload, OperatorAccess, Outgoing
from groundstation.service.process.station_clock import StationClock
from groundstation.service.setup.setup_items import shown_marks
from telemetry.application.endpoint import Endpoint
from telemetry.application.seal_watch import SealWatch, refusal_of
from telemetry.errors import DecodeError
from telemetry.messages import (
    BASE,
    EPOCH_UNKNOWN,
    BlockStatus,
    DepthReading,
    Event,
    Message,
    NodeState,
    Reply,
    Scalar,
    Severity,
    Side,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.presentation.msgpack_codec import decode_message
from telemetry.runtime.disk import MACHINE, Disk
from telemetry.runtime.process_interface import Process, SentFrames
from telemetry.unwritten import Content

if TYPE_CHECKING:
    from groundstation.service.alarms.certificate_watch import CertificateWatch

STARTS = 1 << 31  # numbers of a start by lot
HEARTBEAT = 1.0  # s, own clock, between two verdicts
EARLY = 64  # readings of the depth that may come before rig time is known
GROUND_STATION = "ground station"  # who orders that something be sent again


class RigClock(Protocol):
    """What tells rig time: the clock of the link, or a recording."""

    @property
    def synchronised(self) -> bool:
        """Whether rig time is known."""

    @property
    def epoch(self) -> int:
        """Epoch of rig time."""

    def rig_from_local(self, local: float) -> float:
        """Rig time (s) at a time of the own clock (s)."""


Listener = Callable[[list[str]], None]  # takes the paths below ground/ that changed


class GroundProcess(Process):
    """Everything the ground station does at each event of its link.

    Its driver and the callers of ``operator`` run on one thread.

    Parameters
    ----------
    config : validated settings
    lot : number below its argument by lot; a simulated rig draws from its seed
    disk : that holds the database
    date : of this machine, UTC, s since 1970
    run_apart : does something beside everything else, such as the search for what is wrong with the hole: by a clock of
        its own no question is to wait for it; without it what is answered is the same at the same step every time

    Raises
    ------
    StoreError
        When the database cannot be opened.
    KeyFileError
        When a key file is configured and holds no key.
    """

    def __init__(
        self,
        config: GroundConfig,
        lot: Callable[[int], int] = secrets.randbelow,
        disk: Disk = MACHINE,
        *,
        date: Callable[[], float] = time.time,
        run_apart: RunApart | None = None,
    ) -> None:
        self.config = config
        seals = None
        if config.keys is not None:
            from telemetry.application.seals import seals_of  # without keys no cryptography is loaded

            seals = seals_of(config.keys, BASE, [Side.LOWER], rig=config.rig)
        self._uploads = uploads_of(config, seals)
        self.store = Store(config.url, disk)
        # by lot, not counted: a database that was deleted or restored must not repeat a number that the string has seen
        start = 1 + lot(STARTS)
        self.model = model = RigModel.begin(config)
        if run_apart is not None:
            model.hole.search_apart(run_apart)
        self._string = model.string
        self.watch = Watch(model.string, model.hole, model.placement, model.rig_alarms, config.stale_after)
        self.endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=start, seals=seals)
        self._seal_watch = SealWatch(self.endpoint, self._on_refused)
        self._certificates: CertificateWatch | None = None
        if config.keys is not None:
            from groundstation.service.alarms.certificate_watch import CertificateWatch

            self._certificates = CertificateWatch(config.keys, model.rig_alarms)
        self.clock: RigClock = self.endpoint.clock
        self.tape = Tape()
        self._time = StationClock(model.rig_alarms, date)
        self.start_number = start
        self.listeners: list[Listener] = []
        self._stale: set[int] = set()
        self._doubled = DoubledBook(self.store, model.setup, GROUND_STATION)
        self._early: deque[DepthReading] = deque(maxlen=EARLY)
        self._setup_marks: tuple[object, ...] = ()  # of the setup as it was published
        self._beat_at = -math.inf
        self._plane = -1  # of the wall, that the bit has passed last
        self._keeper = StringKeeper(self.store, model.string)
        self._learner = Learner(self.store, model, self.watch, self._keeper)
        self.operator = OperatorAccess(config, self.model, self.store, self._uploads, start)
        self.operator.changed = self._publish
        self.operator.ended = self.endpoint.mail.withdraw
        self.operator.accepted = self._note_order
        self.operator.follow_setup = self._follow_setup
        self._learner.restore()
        self.model.crew_alarms.restore(self.store.alarms(), self._conditions())

    def on_frame(self, side: Side, frame: Content, now: float, margin: float = math.inf) -> None:
        """A frame arrived from the encoder."""
        now = self._time.follow(now)
        if now - self._string.time.now > HEARTBEAT:
            self._advance_time(now)  # it stood still: what it knew then must not be shown as of now
        self._send_pending(now)
        for received in self.endpoint.receive(side, frame, now, margin):
            self.on_message(received.message, now)

    def before_frames(self) -> None:
        """Receipts leave for what came since the last time, once it is stored."""
        self._keep_arrived()

    def on_depth(self, payload: bytes, now: float) -> None:
        """The rig measured the depth of the bit; bytes that are no reading are counted."""
        now = self._time.follow(now)
        self._keep_arrived()
        seals = self.endpoint.seals
        content = payload if seals is None else seals.depth_content(payload)
        if content is None:
            return
        self._note(DEPTH, now, content)
        try:
            reading = decode_message(content)
        except DecodeError:
            reading = None
        if not isinstance(reading, DepthReading):
            self.endpoint.counters["bad_depths"] += 1
            self.model.rig_alarms.alert("bad_input", "depth", "bytes that are no reading of the depth")
            return
        if seals is not None and not seals.is_next_depth(reading.sequence):
            return
        self._advance_time(now)
        if not self.clock.synchronised:
            self._early.append(reading)  # what bounds it is not known yet
            return
        self._on_reading(reading, now)

    def on_timer(self, now: float) -> None:
        """Advance to ``now``: orders and uploads, hello, time requests, repetition, and what is wrong by now."""
        now = self._time.follow(now)
        self._keep_arrived()
        if self.watch.is_due(now) or self._early:
            self._note(TIMER, now)
        self._advance_time(now)
        self._send_pending(now)
        with refusing_disk():
            for outgoing in self.operator.due_requests(now):
                self._send(outgoing, now)
        for segment in self._uploads.due_segments(now) if self._uploads is not None else ():
            self.endpoint.mail.send_segment(segment)
        super().on_timer(now)
        if self.watch.is_due(now):
            self._look(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer."""
        if self.operator.has_pending:
            return now
        due = self._uploads.next_due() if self._uploads is not None else math.inf
        return self._time.shown_at(min(super().next_wake(self._time.follow(now)), due))

    def take_frames(self, now: float) -> SentFrames:
        """Frames to send now."""
        return super().take_frames(self._time.follow(now))

    def bar(self, trouble: str, now: float) -> None:
        """Tell the crew why nothing is taken in from now on, or by an empty text that it is again; nothing is kept."""
        self.operator.barred = trouble
        self.model.rig_alarms.hold("lease", GROUND_STATION, trouble)
        now = self._time.follow(now)
        self.model.crew_alarms.update(self._conditions(), self._time.times_at(now, self._string.time.rig_now))
        self.model.revisions.on_event()
        self._publish(["alarms", "status", "verdict"])

    def close(self) -> None:
        """Close the database."""
        self.store.close()

    def _note(self, kind: str, now: float, content: object = None) -> None:
        """Put an event on the tape, with the rig time at which it came."""
        clock = self.clock
        rig_now = clock.rig_from_local(now) if clock.synchronised else math.nan
        self.tape.add(kind, now, rig_now, clock.epoch, content)

    def _note_order(self, name: str, parameters: Mapping[str, str], by: str) -> None:
        self._note(ORDER, self._string.time.now, [name, dict(parameters), by])

    def _send_pending(self, now: float) -> None:
        for outgoing in self.operator.take_pending():
            self._send(outgoing, now)

    def _send(self, outgoing: Outgoing, now: float) -> None:
        if isinstance(outgoing, BlockUpload):
            self.operator.start_upload(outgoing, now)
        else:
            self.endpoint.mail.command(outgoing, now)

    def _advance_time(self, now: float) -> None:
        """Follow rig time and its epoch, also where nothing comes any more."""
        time, clock = self._string.time, self.clock
        time.now = now
        self.model.revisions.on_event()
        if not clock.synchronised:
            return
        is_new, before = clock.epoch != time.epoch, time.epoch
        self._string.on_rig_time(clock.rig_from_local(now), clock.epoch)
        if is_new:
            if before != EPOCH_UNKNOWN:
                self.watch.on_epoch(clock.epoch)
            with refusing_disk():
                self.store.keep_epoch(clock.epoch)
        while self._early:
            self._on_reading(self._early.popleft(), now)

    def _look(self, now: float) -> None:
        """Find what is wrong, ask again for what is missing, and publish who fell silent or came back."""
        self.store.check_place()
        self._keeper.keep_depth_doubt()
        self._place_waiting()
        self._follow_setup()
        if consequences := self._learner.find_consequences():
            self._publish(consequences)
        self.watch.look(now)
        alarms, refusal = self.model.rig_alarms, self.store.refusal
        self._time.look()
        alarms.hold("disk", "database", refusal)
        alarms.hold("database", "database", f"{self.store.damaged} rows" if self.store.damaged else "")
        alarms.hold("database", "journal", self.store.parted)
        alarms.hold("queue", "ground station", f"{dropped} dropped" if (dropped := self.endpoint.dropped) else "")
        self._seal_watch.look(now)
        alarms.hold(
            "key_file", "ground station", self.endpoint.seals.trouble if self.endpoint.seals is not None else ""
        )
        if self._certificates is not None:
            self._certificates.look(now)
        for tube, (first, last) in self.watch.gaps_to_ask(now):
            self._ask_again(tube, first, last)
        self.operator.expire_orders(now)
        states = self._string.states
        stale = {tube for tube in states.newest if states.is_stale(tube)}
        changed, self._stale = sorted(stale ^ self._stale), stale
        if changed:
            self._publish([*(f"nodes/{tube}" for tube in changed), "status", "string"])
        if (marks := shown_marks(self.model.setup, self._string)) != self._setup_marks:
            self._setup_marks = marks
            self._publish(["setup"])
        self._tell_crew(now)
        if alarms.drain_changed():
            self._publish(["alarms", "status", "verdict"])
            self._beat_at = now
        if now >= self._beat_at + HEARTBEAT:
            self._beat_at = now
            self._publish(list(BEATS))

    def _on_refused(self, _severity: Severity, code: str, arguments: dict[str, Scalar]) -> None:
        """Frames or messages came under seals that are not to be believed."""
        self.model.rig_alarms.alert(code, "ground station", refusal_of(arguments))

    def _tell_crew(self, now: float) -> None:
        """Follow what is wrong with the alarms that the crew works with, and keep them."""
        alarms, times = self.model.crew_alarms, self._time.times_at(now, self._string.time.rig_now)
        self._time.look_at_date(alarms, times.utc)
        alarms.update(self._conditions(), times)
        if changed := alarms.drain_changed():
            with refusing_disk():
                self.store.keep_alarms(changed)
            self._publish(["alarms"])

    def _follow_setup(self) -> int:
        """Adjust the hole to what was told of the rig; returns how many surveys it is made of."""
        if changed := self._learner.follow_setup():
            self._publish(changed)
        return len(self.model.hole.stops)

    def _conditions(self) -> list[Condition]:
        return conditions_of(self.model.rig_alarms, self._string, self.model.hole)

    def _ask_again(self, tube: int, first: int, last: int) -> None:
        """Order a tube to send the surveys of a range of numbers again."""
        try:
            order = self.operator.command(tube, "resend", {"first": first, "last": last}, by=GROUND_STATION)
        except SelectorError:
            return  # the tube is not known yet; the gap stays
        order.when_answered(lambda: self._on_resent(order, first))

    def _on_resent(self, order: SentOrder, first: int) -> None:
        values = order.values
        if order.done and order.tube is not None:
            sent, complete_from = int(str(values.get("sent", 0))), int(str(values.get("complete_from", 0)))
            self.watch.on_resent(order.tube, first, sent, complete_from, self._string.time.now)

    def _on_reading(self, reading: DepthReading, now: float) -> None:
        refused = self._string.on_depth(reading, now)
        self.watch.on_depth("" if refused == "repeated" else refused)
        self._keeper.keep_depth_doubt()
        if refused:
            return
        for stand in reading.stands:
            self._string.on_told_stand(stand, reading.at)
        self._keeper.keep_stand(reading)
        self._place_waiting()
        self._publish(["status", "string"])
        if self.model.wall is not None and (plane := self.model.wall.plane_of(reading.md)) != self._plane:
            self._plane = plane
            self._publish(["wall"])

    def on_message(self, message: Message, now: float) -> None:
        """A message has come, from the string or from a recording."""
        self._note(MESSAGE, now, message)
        self._advance_time(now)
        if isinstance(message, NodeState):
            message = self._doubled.state_apart(message)
        match message:
            case NodeState() if self._string.on_state(message, now):
                self.model.recalibration.on_state(message)
                self.model.setup.on_flags(message.tube, message.hops, message.flags)
                self.watch.on_state(message)
                with refusing_disk():
                    self._keeper.keep_tally()
                    self._keeper.keep_joints()
                self._publish([f"nodes/{message.tube}"])
            case SurveyMeasurement() | Event() | StaticRecord():
                self._learner.take(message)
            case Reply():
                self.model.orders.on_reply(message)
                self.model.recalibration.on_reply(message, now)
            case BlockStatus():
                self.operator.on_block_status(message)
        self.operator.publish_orders()

    def _keep_arrived(self) -> None:
        """Store and learn what came together before any of it is acknowledged."""
        stored, changed = self._learner.learn_arrived()
        for message in stored:
            self.endpoint.mail.acknowledge(message)
        if stored:
            self._publish(changed)

    def _place_waiting(self) -> None:
        if changed := self._learner.place_waiting():
            self._publish(changed)

    def _publish(self, changed: list[str]) -> None:
        self.model.revisions.on_published(changed)
        for listener in self.listeners:
            listener(changed)
