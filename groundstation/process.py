"""The ground station as a process: link to the string, knowledge, store, keys."""

from __future__ import annotations

import contextlib
import math
import queue
import threading
from collections.abc import Iterator
from concurrent.futures import Future
from concurrent.futures import TimeoutError as FutureTimeoutError

from groundstation.config import GroundConfig
from groundstation.service.core import Knowledge
from groundstation.service.queries import Queries, pack
from groundstation.service.store import Store
from telemetry import keys
from telemetry.application.driven import Driven
from telemetry.application.station import Station
from telemetry.media.zenoh_bus import Query, ZenohBus
from telemetry.messages import BASE, MAX_TUBE, Command, Event, Message, NodeState, Reply, Side, SurveyMeasurement

COMMAND_TIMEOUT = 30.0  # wall s
COMMANDS = ("take_survey",)
BOOT_SHIFT = 20


class GroundProcess(Driven):
    """Everything the ground station does at each event of its link; operators ask at any time, on other threads.

    Parameters
    ----------
    config : validated settings

    Raises
    ------
    StoreError
        When the database cannot be opened.
    """

    def __init__(self, config: GroundConfig) -> None:
        self.config = config
        self.store = Store(config.url)
        self.knowledge = Knowledge(config)
        self.station = Station(BASE, frozenset({Side.LOWER}), boot_count=self.store.boots)
        self._lock = threading.Lock()
        self._queries: Queries | None = None
        self._orders: queue.SimpleQueue[tuple[Command, Future[Reply]]] = queue.SimpleQueue()
        self._ordered: dict[int, Future[Reply]] = {}
        self._next_command = self.store.boots << BOOT_SHIFT
        self._stale: set[int] = set()
        self.knowledge.order.restore(self.store.order())
        self._kept_order = list(self.knowledge.order.tubes)
        for at, md in self.store.depths():
            self.knowledge.depths.restore(at, md)
        for stored in self.store.messages():
            self._learn(stored.message, stored.md)

    @contextlib.contextmanager
    def serving(self, bus: ZenohBus) -> Iterator[None]:
        """Answer operators on ``bus`` while the context lasts."""
        self._queries = Queries(bus, self.knowledge, self._lock)
        bus.queryable(keys.COMMAND.format(rig=self.config.rig, name="*"), self._order)
        try:
            yield
        finally:
            self._queries = None
            self.store.close()

    def on_frame(self, side: Side, frame: bytes, now: float) -> None:
        """A frame arrived from the encoder."""
        for received in self.station.receive(side, frame, now):
            self._take(received.message, now)

    def on_depth(self, rig_time: float, md: float) -> None:
        """The rig measured the depth of the bit; what is no number is not taken."""
        if not (math.isfinite(rig_time) and math.isfinite(md)):
            return
        with self._lock:
            self.knowledge.rig_now = rig_time
            if self.knowledge.depths.add(rig_time, md):
                self.store.add_depth(rig_time, md)
            self._publish(["status", "string"])

    def on_timer(self, now: float) -> None:
        """Let time pass: hello, time requests, repetition, and commands that operators gave."""
        with contextlib.suppress(queue.Empty):
            while True:
                command, outcome = self._orders.get_nowait()
                self._ordered[command.sequence] = outcome
                self.station.command(command, now)
        super().on_timer(now)
        self._notice_silence(now)

    def _notice_silence(self, now: float) -> None:
        """Bring rig time forward, also where no depth comes any more, and tell who fell silent or came back."""
        with self._lock:
            if self.station.clock.synchronised:
                self.knowledge.rig_now = self.station.clock.rig_from_local(now)
            stale = {tube for tube in self.knowledge.nodes if self.knowledge.is_stale(tube)}
            changed, self._stale = sorted(stale ^ self._stale), stale
            if changed:
                self._publish([*(f"nodes/{tube}" for tube in changed), "status", "string"])

    def _keep_order(self) -> None:
        """Store a new order of the string before anything is placed by it."""
        if self.knowledge.order.tubes != self._kept_order:
            self._kept_order = list(self.knowledge.order.tubes)
            self.store.keep_order(self._kept_order)

    def _take(self, message: Message, now: float) -> None:
        if isinstance(message, NodeState):
            with self._lock:
                self.knowledge.take_state(message)
                self._keep_order()
                self._publish([f"nodes/{message.tube}"])
        elif isinstance(message, SurveyMeasurement | Event):
            with self._lock:
                md = self.knowledge.place(message) if isinstance(message, SurveyMeasurement) else None
                self._keep_order()
                if self.store.add(message, md):
                    self._publish(self._learn(message, md))
            self.station.acknowledge(message.tube, message.sequence, now)
        elif isinstance(message, Reply) and message.sequence in self._ordered:
            self._ordered.pop(message.sequence).set_result(message)

    def _learn(self, message: SurveyMeasurement | Event, md: float | None) -> list[str]:
        """Take a stored message into the knowledge; returns the paths that changed."""
        if isinstance(message, Event):
            self.knowledge.take_event(message)
            return []
        before = list(self.knowledge.alarms.alarms), len(self.knowledge.moved)
        self.knowledge.take_survey(message, md)
        after = self.knowledge.alarms.alarms, len(self.knowledge.moved)
        return ["stations", "trajectory", "uncertainty", "column"] + (["alarms"] if before != after else [])

    def _publish(self, changed: list[str]) -> None:
        if self._queries is not None:
            self._queries.publish(changed)

    def _order(self, query: Query) -> None:
        """An operator's command: sent down at the next occasion, answered with its outcome."""
        name = query.selector_key.rsplit("/", 1)[1]
        tube = query.parameters.get("tube", "")
        if name not in COMMANDS or not tube.isdigit() or not 1 <= int(tube) <= MAX_TUBE:
            query.reply_error(f"{query.selector_key}: expected cmd/{'|'.join(COMMANDS)}?tube=N with N of 1..{MAX_TUBE}")
            return
        self._next_command += 1
        outcome: Future[Reply] = Future()
        self._orders.put((Command(int(tube), self._next_command, name), outcome))
        try:
            reply = outcome.result(timeout=COMMAND_TIMEOUT)
        except FutureTimeoutError:
            query.reply_error(
                f"tube {tube} has not answered {name} within {COMMAND_TIMEOUT:.0f} s; it is still being asked"
            )
            return
        view = {"tube": reply.tube, "command": name, "done": reply.done, "detail": reply.detail}
        query.reply(keys.COMMAND.format(rig=self.config.rig, name=name), pack(view, "json"))
