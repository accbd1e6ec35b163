"""The ground station as a process: link to the string, model, store, keys."""

from __future__ import annotations

import contextlib
import itertools
import math
import queue
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import CancelledError, Future
from concurrent.futures import TimeoutError as FutureTimeoutError

from groundstation.calibration.errors import CalibrationError
from groundstation.config import GroundConfig
from groundstation.errors import ConfigurationError, SelectorError, StoreError
from groundstation.gateway.zenoh import Queries, pack
from groundstation.service.blocks import block_of_files
from groundstation.service.commands import parse, reply_view, status_view
from groundstation.service.model import RigModel
from groundstation.service.recalibration.control import COMMAND, Recalibration
from groundstation.service.store import Store
from groundstation.service.uploads import Uploads
from groundstation.service.views import FIXED
from telemetry import keys
from telemetry.application.endpoint import Endpoint
from telemetry.media.zenoh_bus import Query, ZenohBus
from telemetry.messages import (
    BASE,
    BlockStatus,
    Command,
    Event,
    Kept,
    Message,
    NodeState,
    Reply,
    Scalar,
    Side,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.parameters import ParameterBlock
from telemetry.runtime.process import Process
from telemetry.transport.authentication import read_key

COMMAND_TIMEOUT = 30.0  # wall s
BOOT_SHIFT = 20
NO_KEY = "key_file: expected the key file of the rig, without it no node takes a block"


class GroundProcess(Process):
    """Everything the ground station does at each event of its link; operators ask at any time, on other threads.

    Parameters
    ----------
    config : validated settings

    Raises
    ------
    StoreError
        When the database cannot be opened.
    KeyFileError
        When a key file is configured and holds no key.
    """

    def __init__(self, config: GroundConfig) -> None:
        self.config = config
        self._uploads = Uploads(read_key(config.key_file)) if config.key_file is not None else None
        self.store = Store(config.url)
        self.model = RigModel(config)
        self.endpoint = Endpoint(BASE, frozenset({Side.LOWER}), boot_count=self.store.boots)
        self._lock = threading.Lock()
        self._queries: Queries | None = None
        self._orders: queue.SimpleQueue[Callable[[float], None]] = queue.SimpleQueue()
        self._ordered: dict[int, Future[Reply]] = {}
        self._numbers = itertools.count((self.store.boots << BOOT_SHIFT) + 1)
        self._stale: set[int] = set()
        self.model.tally.restore(self.store.tally())
        self._kept_tally = list(self.model.tally.tubes)
        for at, md in self.store.depths():
            self.model.depths.restore(at, md)
        self.recalibration = Recalibration(
            self.model.recalibration,
            self.store,
            config.calibrations,
            lambda tube: self._orders.put(lambda _now: self._give_up(tube)),
        )
        for stored in self.store.messages():
            self._apply_stored(stored.message, stored.md)

    @contextlib.contextmanager
    def serving(self, bus: ZenohBus) -> Iterator[None]:
        """Answer operators on ``bus`` while the context lasts."""
        self._queries = Queries(bus, self.model, self._lock)
        bus.queryable(keys.COMMAND.format(rig=self.config.rig, name="*"), self._order)
        try:
            yield
        finally:
            self._queries = None
            self.store.close()

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived from the encoder."""
        for received in self.endpoint.receive(side, frame, now):
            self._on_message(received.message, now)

    def on_depth(self, rig_time: float, md: float) -> None:
        """The rig measured the depth of the bit; what is no number is not taken."""
        if not (math.isfinite(rig_time) and math.isfinite(md)):
            return
        with self._lock:
            self.model.rig_now = rig_time
            if self.model.depths.append_reading(rig_time, md):
                self.store.add_depth(rig_time, md)
            self._publish(["status", "string"])

    def on_timer(self, now: float) -> None:
        """Let time pass: hello, time requests, repetition, and commands that operators gave."""
        with contextlib.suppress(queue.Empty):
            while True:
                self._orders.get_nowait()(now)
        with self._lock:
            self._recalibrate(now)
        for segment in self._uploads.due_segments(now) if self._uploads is not None else ():
            self.endpoint.send_segment(segment)
        super().on_timer(now)
        self._notice_silence(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer."""
        due = self._uploads.next_due() if self._uploads is not None else math.inf
        return min(super().next_wake(now), due)

    def order(self, tube: int, name: str, arguments: dict[str, Scalar] | None = None) -> Future[Reply]:
        """Send a command down with the next timer; from any thread."""
        outcome: Future[Reply] = Future()
        command = Command(tube, next(self._numbers), name, arguments or {})

        def send(now: float) -> None:
            self._ordered[command.sequence] = outcome
            self.endpoint.command(command, now)

        self._orders.put(send)
        return outcome

    def upload(self, block: ParameterBlock) -> Future[BlockStatus]:
        """Send a block to its tube until the tube has judged it; from any thread.

        Raises
        ------
        ConfigurationError
            When the ground station has no key of the rig.
        SelectorError
            While a calibration in the field uploads to the same tube: one of the two would never end.
        """
        if self._uploads is None:
            raise ConfigurationError(NO_KEY)
        uploads, number = self._uploads, next(self._numbers)
        outcome: Future[BlockStatus] = Future()
        with self._lock:
            if self.model.recalibration.uploads_to(block.tube):
                raise SelectorError(f"tube {block.tube}: a calibration uploads to it; expected action=cancel before")
            self.store.keep_block(block)
            self.model.recalibration.blocks[block.sha256().hex()] = block
        self._orders.put(lambda now: uploads.start(block, number, outcome, now))
        return outcome

    def _recalibrate(self, now: float) -> None:
        """Send what a calibration in the field asks for; kept before any of it leaves."""
        procedure = self.model.recalibration
        for ask in procedure.due_requests(now):
            number = next(self._numbers)
            procedure.sent(ask, number)
            if ask.block is None:
                self.endpoint.command(Command(ask.tube, number, ask.name, ask.arguments), now)
            elif self._uploads is not None:
                outcome: Future[BlockStatus] = Future()
                outcome.add_done_callback(self._uploaded)
                self._uploads.start(ask.block, number, outcome, now)
        if self.recalibration.keep_progress():
            self._publish(["recalibration"])

    def _uploaded(self, outcome: Future[BlockStatus]) -> None:
        if not outcome.cancelled():
            with self._lock:
                self.model.recalibration.on_block_status(outcome.result())

    def _give_up(self, tube: int) -> None:
        if self._uploads is not None:
            self._uploads.give_up(tube)

    def _notice_silence(self, now: float) -> None:
        """Bring rig time forward, also where no depth comes any more, and tell who fell silent or came back."""
        with self._lock:
            if self.endpoint.clock.synchronised:
                self.model.rig_now = self.endpoint.clock.rig_from_local(now)
            stale = {tube for tube in self.model.nodes if self.model.is_stale(tube)}
            changed, self._stale = sorted(stale ^ self._stale), stale
            if changed:
                self._publish([*(f"nodes/{tube}" for tube in changed), "status", "string"])

    def _keep_tally(self) -> None:
        """Store a new order of the string before anything is placed by it."""
        if self.model.tally.tubes != self._kept_tally:
            self._kept_tally = list(self.model.tally.tubes)
            self.store.keep_tally(self._kept_tally)

    def _on_message(self, message: Message, now: float) -> None:
        if isinstance(message, NodeState):
            with self._lock:
                self.model.on_state(message)
                self._keep_tally()
                self._publish([f"nodes/{message.tube}"])
        elif isinstance(message, SurveyMeasurement | Event | StaticRecord):
            with self._lock:
                md = self.model.place(message) if isinstance(message, SurveyMeasurement) else None
                self._keep_tally()
                if self.store.add_message(message, md):
                    self._publish(self._apply_stored(message, md))
            self.endpoint.acknowledge(message.tube, message.sequence, now)
        elif isinstance(message, Reply) and message.sequence in self._ordered:
            self._ordered.pop(message.sequence).set_result(message)
        elif isinstance(message, Reply):
            with self._lock:
                self.model.recalibration.on_reply(message, now)
        elif isinstance(message, BlockStatus) and self._uploads is not None:
            self._uploads.on_status(message)

    def _apply_stored(self, message: Kept, md: float | None) -> list[str]:
        """Take a stored message into the knowledge; returns the paths that changed."""
        if isinstance(message, Event):
            self.model.on_event(message)
            return []
        if isinstance(message, StaticRecord):
            self.model.on_static_record(message)
            return []
        before = list(self.model.alarms.alarms), len(self.model.moved)
        self.model.on_survey(message, md)
        after = self.model.alarms.alarms, len(self.model.moved)
        return ["stations", "trajectory", "uncertainty", "column"] + (["alarms"] if before != after else [])

    def _publish(self, changed: list[str]) -> None:
        if self._queries is not None:
            self._queries.publish(changed)

    def _order(self, query: Query) -> None:
        """An operator's command: sent down at the next occasion, answered with its outcome."""
        name = query.selector_key.rsplit("/", 1)[1]
        if name == COMMAND:
            self._order_recalibration(query)
            return
        try:
            tube, arguments = parse(name, query.parameters)
            if name == "upload_parameters":
                view = status_view(name, self._upload_files(tube, arguments).result(timeout=COMMAND_TIMEOUT))
            else:
                view = reply_view(name, self.order(tube, name, arguments).result(timeout=COMMAND_TIMEOUT))
        except (SelectorError, CalibrationError, ConfigurationError) as error:
            query.reply_error(f"{query.selector_key}: {error}")
        except FutureTimeoutError:
            query.reply_error(
                f"tube {tube} has not answered {name} within {COMMAND_TIMEOUT:.0f} s; it is still being asked"
            )
        except CancelledError:
            query.reply_error(f"tube {tube}: another upload has taken the place of this one")
        else:
            query.reply(keys.COMMAND.format(rig=self.config.rig, name=name), pack(view, "json"))

    def _order_recalibration(self, query: Query) -> None:
        """An operator's step of the calibration in the field, answered at once with how far it has come."""
        try:
            with self._lock:
                if self._uploads is None:
                    raise ConfigurationError(NO_KEY)
                k = self.model
                self.recalibration.order(query.parameters, k.rig_now, k.tally.tubes)
                self._publish(["recalibration"])
                view = FIXED["recalibration"].show(k, {})
        except (SelectorError, CalibrationError, ConfigurationError, StoreError) as error:
            query.reply_error(f"{query.selector_key}: {error}")
        else:
            query.reply(keys.COMMAND.format(rig=self.config.rig, name=COMMAND), pack(view, "json"))

    def _upload_files(self, tube: int, arguments: dict[str, Scalar]) -> Future[BlockStatus]:
        """Upload the calibrations that are named, as the version after the one in use unless a version is named."""
        with self._lock:
            state = self.model.nodes.get(tube)
        version = arguments.get("version")
        if version is None and state is None:
            raise SelectorError(f"tube {tube}: no state of it is known, and so no version; expected version=..")
        number = int(version) if version is not None else (state.parameters_version if state else 0) + 1
        names = str(arguments["gyroscope"]), str(arguments["accelerometer"])
        return self.upload(block_of_files(self.config.calibrations, tube, number, *names))
