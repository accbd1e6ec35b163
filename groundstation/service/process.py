"""The ground station as a process: link to the string, model, store, and the operator's doors."""

from __future__ import annotations

import math
from collections.abc import Callable

from groundstation.config import GroundConfig
from groundstation.service.model import RigModel
from groundstation.service.operator import BlockUpload, Operator, Outgoing
from groundstation.service.store import Store
from groundstation.service.uploads import Uploads
from telemetry.application.endpoint import Endpoint
from telemetry.messages import (
    BASE,
    BlockStatus,
    Event,
    Kept,
    Message,
    NodeState,
    Reply,
    Side,
    StaticRecord,
    SurveyMeasurement,
)
from telemetry.runtime.process import Process
from telemetry.transport.authentication import read_key

Listener = Callable[[list[str]], None]  # takes the paths below ground/ that changed


class GroundProcess(Process):
    """Everything the ground station does at each event of its link.

    Whoever drives it and whoever comes in by ``operator`` does so on one thread.

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
        self.listeners: list[Listener] = []
        self._stale: set[int] = set()
        self.model.tally.restore(self.store.tally())
        self._kept_tally = list(self.model.tally.tubes)
        for at, md in self.store.depths():
            self.model.depths.restore(at, md)
        self.operator = Operator(config, self.model, self.store, self._uploads)
        self.operator.changed = self._publish
        for stored in self.store.messages():
            self._apply_stored(stored.message, stored.md)

    def on_frame(self, side: Side, frame: bytes, now: float, margin: float = math.inf) -> None:
        """A frame arrived from the encoder."""
        self._send_pending(now)
        for received in self.endpoint.receive(side, frame, now, margin):
            self._on_message(received.message, now)

    def on_depth(self, rig_time: float, md: float) -> None:
        """The rig measured the depth of the bit; non-finite values are ignored."""
        if not (math.isfinite(rig_time) and math.isfinite(md)):
            return
        self.model.rig_now = rig_time
        if self.model.depths.append_reading(rig_time, md):
            self.store.add_depth(rig_time, md)
        self._publish(["status", "string"])

    def on_timer(self, now: float) -> None:
        """Advance to ``now``: orders and uploads, hello, time requests, repetition, silent nodes."""
        self._send_pending(now)
        for outgoing in self.operator.due_requests(now):
            self._send(outgoing, now)
        for segment in self._uploads.due_segments(now) if self._uploads is not None else ():
            self.endpoint.send_segment(segment)
        super().on_timer(now)
        self._notice_silence(now)

    def next_wake(self, now: float) -> float:
        """Local time (s) of the next timer."""
        if self.operator.has_pending:
            return now
        due = self._uploads.next_due() if self._uploads is not None else math.inf
        return min(super().next_wake(now), due)

    def close(self) -> None:
        """Close the database."""
        self.store.close()

    def _send_pending(self, now: float) -> None:
        for outgoing in self.operator.take_pending():
            self._send(outgoing, now)

    def _send(self, outgoing: Outgoing, now: float) -> None:
        if isinstance(outgoing, BlockUpload):
            self.operator.start_upload(outgoing, now)
        else:
            self.endpoint.command(outgoing, now)

    def _notice_silence(self, now: float) -> None:
        """Advance rig time, also where no depth comes any more, and publish who fell silent or came back."""
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
        match message:
            case NodeState():
                self.model.on_state(message)
                self._keep_tally()
                self._publish([f"nodes/{message.tube}"])
            case SurveyMeasurement() | Event() | StaticRecord():
                self._on_kept(message)
                self.endpoint.acknowledge(message.tube, message.sequence, now)
            case Reply():
                self.model.orders.on_reply(message)
                self.model.recalibration.on_reply(message, now)
            case BlockStatus():
                self.operator.on_block_status(message)
        self.operator.publish_orders()

    def _on_kept(self, message: Kept) -> None:
        """Place and store a message before it is acknowledged; one that was stored already changes nothing."""
        md = self.model.place(message) if isinstance(message, SurveyMeasurement) else None
        self._keep_tally()
        if self.store.add_message(message, md):
            self._publish(self._apply_stored(message, md))

    def _apply_stored(self, message: Kept, md: float | None) -> list[str]:
        """Add a stored message to the model; returns the paths that changed."""
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
        for listener in self.listeners:
            listener(changed)
