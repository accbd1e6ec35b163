"""What operators ordered and what became of it. No I/O.

An order is ``sent`` from the moment it is accepted, ``acknowledged`` when the tube has taken it and its work goes on,
and ends ``done`` or ``failed``.
"""

from __future__ import annotations

import enum
from collections import OrderedDict
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

from telemetry.application.arguments import checked_values
from telemetry.application.commands import CommandSpec
from telemetry.messages import BlockStatus, Event, Reply, StaticRecord, UploadPhase, Value

KEPT = 100  # orders shown; one that has not ended is never dropped
RECORD_EMPTY = "static_record_empty"  # event of a tube


class OrderState(enum.StrEnum):
    """How far an order has come."""

    SENT = "sent"
    ACKNOWLEDGED = "acknowledged"
    DONE = "done"
    FAILED = "failed"


@dataclass(slots=True)
class SentOrder:
    """One order.

    ``tube`` is None for an order to the ground station. ``answered`` means that its sender can have an
    answer: the tube obeyed or refused, or the order ended.
    """

    number: int
    spec: CommandSpec
    tube: int | None
    arguments: dict[str, Any]  # SI
    by: str
    at: float  # s, rig time; NaN before it is known
    utc: str
    state: OrderState = OrderState.SENT
    detail: str = ""
    values: dict[str, Value] = field(default_factory=dict)
    answered: bool = False
    _waiting: list[Callable[[], None]] = field(default_factory=list)

    @property
    def ended(self) -> bool:
        """Whether nothing more will happen."""
        return self.state in (OrderState.DONE, OrderState.FAILED)

    @property
    def done(self) -> bool | None:
        """Whether it was obeyed; None before its answer."""
        return self.state is not OrderState.FAILED if self.answered else None

    def when_answered(self, act: Callable[[], None]) -> None:
        """Call ``act`` once, now or as soon as the order is answered."""
        if self.answered:
            act()
        else:
            self._waiting.append(act)

    def advance(self, state: OrderState, detail: str = "", *, answered: bool = True) -> None:
        """Change the state."""
        self.state, self.detail = state, detail
        if answered and not self.answered:
            self.answered = True
            waiting, self._waiting = self._waiting, []
            for act in waiting:
                act()


class OrderBook:
    """Orders by their number, the oldest first; ``changed`` names those that changed since they were last drained."""

    def __init__(self) -> None:
        self._orders: OrderedDict[int, SentOrder] = OrderedDict()
        self._changed: dict[int, None] = {}

    def __iter__(self) -> Iterator[SentOrder]:
        return iter(self._orders.values())

    def get(self, number: int) -> SentOrder | None:
        """Order of a number, None for one that is not known any more."""
        return self._orders.get(number)

    def add(self, order: SentOrder) -> None:
        """Keep a new order; the oldest that ended makes room."""
        self._orders[order.number] = order
        self._changed[order.number] = None
        if len(self._orders) > KEPT and (oldest := next((o for o in self if o.ended), None)) is not None:
            del self._orders[oldest.number]
            self._changed.pop(oldest.number, None)

    def drain_changed(self) -> list[int]:
        """Numbers of the orders that changed since the last call."""
        changed, self._changed = list(self._changed), {}
        return changed

    def fail(self, number: int | None, detail: str) -> None:
        """End an order without success; unknown and ended ones stay as they are."""
        order = self._orders.get(number) if number is not None else None
        if order is not None and not order.ended:
            self._advance(order, OrderState.FAILED, detail)

    def finish(self, number: int, detail: str = "") -> None:
        """End an order with success."""
        order = self._orders.get(number)
        if order is not None and not order.ended:
            self._advance(order, OrderState.DONE, detail)

    def on_reply(self, reply: Reply) -> None:
        """Handle a tube's answer to a command."""
        order = self._orders.get(reply.sequence)
        if order is None or order.tube != reply.tube or order.state is not OrderState.SENT:
            return
        order.values = checked_values(order.spec, reply.values)
        if not reply.done:
            self._advance(order, OrderState.FAILED, reply.detail)
        else:
            state = OrderState.ACKNOWLEDGED if order.spec.goes_on else OrderState.DONE
            self._advance(order, state, reply.detail)

    def on_block_status(self, status: BlockStatus, *, ended: bool) -> None:
        """Handle a tube's status of an upload; ``ended`` marks the last word."""
        order = self._orders.get(status.sequence)
        if order is None or order.ended or order.tube != status.tube:
            return
        phase = status.phase
        if ended:
            values: dict[str, Value] = {
                "phase": phase.name.lower(),
                "version": status.version,
                "sha256": status.in_use.hex(),
            }
            order.values = checked_values(order.spec, values)
            done = phase is UploadPhase.APPLIED
            self._advance(order, OrderState.DONE if done else OrderState.FAILED, status.detail)
        elif phase is not UploadPhase.UNTRUSTED:
            detail = "waits until the tube stands still" if phase is UploadPhase.WAITING else "under way"
            if (order.state, order.detail) != (OrderState.ACKNOWLEDGED, detail):
                self._advance(order, OrderState.ACKNOWLEDGED, detail, answered=False)

    def on_static_record(self, record: StaticRecord) -> None:
        """Handle the result of an order for a record."""
        order = self._orders.get(record.command)
        if order is not None and order.tube == record.tube:
            self.finish(record.command, "the tube moved" if record.moved else "")

    def on_event(self, event: Event) -> None:
        """Handle the event that the record of a tube, which takes one at a time, is empty."""
        if event.code == RECORD_EMPTY:
            for order in list(self):
                if order.tube == event.tube and order.spec.goes_on and order.state is OrderState.ACKNOWLEDGED:
                    self.fail(order.number, "nothing was recorded")

    def _advance(self, order: SentOrder, state: OrderState, detail: str, *, answered: bool = True) -> None:
        self._changed[order.number] = None
        order.advance(state, detail, answered=answered)
