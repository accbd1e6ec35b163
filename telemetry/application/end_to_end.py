"""What a process and the other end of the string send each other, however many hops lie between.

A tube's mail to the ground station is kept until it is receipted, an order from there until it is answered; both are
sealed from end to end where there are keys. The links only carry it.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from telemetry.application.delivery_rules import is_warning
from telemetry.application.endpoint_state import SavedState, is_needed, pack_state
from telemetry.application.order_answers import Answers
from telemetry.application.outbox import Outbox
from telemetry.application.series import SequenceCounter
from telemetry.media.port import Priority
from telemetry.messages import (
    BASE,
    BlockSegment,
    BlockStatus,
    Command,
    Kept,
    Message,
    Receipt,
    Reply,
    SessionOffer,
)
from telemetry.presentation.content import content_of, content_of_message
from telemetry.presentation.msgpack_codec import Opened, decode_opened, encode_message, open_payload
from telemetry.schema import MessageKind
from telemetry.transport.hop import HopLink
from telemetry.unwritten import Content

if TYPE_CHECKING:
    from telemetry.application.seals import Seals

KEPT_WAIT = 1.15  # s that a message other than a warning waits for a state to go up with


class EndToEndDelivery:
    """Mail of one process: the base writes down the string, every other process up.

    Parameters
    ----------
    address : ``BASE``, ``ENCODER`` or the tube's number
    boot_count : starts so far
    upper, lower : links at the ends that exist
    counters : where what had no effect is counted
    seals : what is said and heard under keys; None: everybody is believed

    Attributes
    ----------
    series : numbers of what is kept
    has_states : whether states go up from here, with which others may go
    """

    def __init__(
        self,
        address: int,
        boot_count: int,
        upper: HopLink | None,
        lower: HopLink | None,
        counters: Counter[str],
        seals: Seals | None,
    ) -> None:
        self._address, self._upper, self._lower = address, upper, lower
        self._counters, self._seals = counters, seals
        # a process that lost its numbers begins another series, so that none is given to a second message
        self.series = SequenceCounter(boot_count if boot_count > 1 and address != BASE else 0)
        self.has_states = False
        self._outbox = Outbox()
        self._orders = Outbox()
        self._answers = Answers()
        self._holding = False

    # a tube's side

    def submit(self, message: Kept, now: float) -> None:
        """Keep a message until the ground station has receipted it, and send it unless messages are held back.

        Messages other than warnings go up with the next states, in their frames.
        """
        payload, needed = encode_message(message), is_needed(message)
        if is_warning(message) or not self.has_states:
            self._outbox.keep_payload(message.sequence, payload, now, needed=needed)
        else:
            self._outbox.keep_waiting(message.sequence, payload, now + KEPT_WAIT, needed=needed)
        self._send_kept(now)

    def submit_again(self, sequence: int, payload: bytes, now: float) -> None:
        """Send once more what was receipted before, because the ground station asks for it."""
        self._outbox.keep_payload(sequence, payload, now)

    def hasten(self, first: int, last: int, now: float) -> set[int]:
        """Send what is kept of these numbers now, because the ground station misses it; returns their numbers."""
        hastened = self._outbox.make_due(now, first, last)
        self._send_kept(now)
        return hastened

    def hold(self) -> None:
        """Hold all kept messages back until ``release``, because the disk must be written first."""
        self._holding = True

    def release(self, now: float) -> None:
        """Send the messages that were held back."""
        if self._holding:
            self._holding = False
            self._send_kept(now)

    def go_with_states(self, now: float) -> None:
        """Send the messages that waited for a state to go with."""
        self.has_states = True
        if self._outbox.release(now):
            self._send_kept(now)

    def reply(self, reply: Reply) -> None:
        """Answer a command and keep the answer: a repeated command is answered, not obeyed again."""
        payload = encode_message(reply)
        self._answers.keep(reply.sequence, payload)
        self._send_up(payload)

    def send_status(self, status: BlockStatus) -> None:
        """Tell the ground station the state of an upload."""
        self._send_up(encode_message(status))

    def open_from_base(self, opened: Opened, payload: Content, now: float) -> Message | None:
        """Return the base's message for the process; None for one not believed, or handled here."""
        message = self._told(opened, payload, now)
        if isinstance(message, Receipt):
            self._settle(message)
            return None
        if isinstance(message, Command) and message.sequence in self._answers:
            self._send_up(self._answers.payload(message.sequence))
            return None
        return message

    # the base's side

    def command(self, command: Command, now: float) -> None:
        """Send an order down the string until its reply comes."""
        self._orders.keep_payload(command.sequence, encode_message(command), now)
        self._send_orders(now)

    def withdraw(self, sequence: int) -> None:
        """Stop sending an order."""
        self._orders.settle(sequence)

    def send_segment(self, segment: BlockSegment) -> None:
        """Send a part of a parameter block down; the upload repeats what is lost with a relay."""
        self._send_down(encode_message(segment), segment.tube, Priority.BLOCK)

    def acknowledge(self, message: Kept) -> None:
        """Send a receipt of this message, by its content, to its tube."""
        receipt = Receipt(message.tube, message.sequence, content_of_message(message))
        self._send_down(encode_message(receipt), receipt.tube, Priority.COMMAND)

    def send_offers(self) -> None:
        """Offer sessions to tubes whose seals the base does not know."""
        if self._seals is not None and self._lower is not None:
            for tube, payload in self._seals.due_offers():
                self._lower.send_best_effort(payload, (MessageKind.SESSION_OFFER, tube), Priority.COMMAND)

    def open_from_tube(self, opened: Opened, payload: Content, now: float) -> Message | None:
        """Return a tube's message for the base; None for one not believed, or an answer to no order."""
        message = self._heard(opened, payload, now)
        if isinstance(message, Reply):
            order = self._orders.payload(message.sequence)
            if order is None or open_payload(order).target != message.tube:
                return None  # answered already, or by a tube that was not asked
            self._orders.settle(message.sequence)
        return message

    # both

    def send_due(self, now: float) -> None:
        """Send what is due, for the first time or again."""
        self._send_kept(now)
        self._send_orders(now)

    @property
    def outbox_size(self) -> int:
        """Surveys and events that the ground station has not receipted yet."""
        return len(self._outbox)

    @property
    def dropped(self) -> int:
        """Number of messages without room in the outbox since the start."""
        return self._outbox.dropped

    def export_state(self, hops: int) -> bytes:
        """Pack what a restart needs: numbers, unreceipted messages, answered commands, hops from the top."""
        return pack_state(self.series.following, self._outbox.contents(), self._answers.contents(), hops, self._address)

    def restore(self, saved: SavedState) -> None:
        """Continue from a saved state."""
        self.series.following = saved.next_sequence
        for sequence, payload, needed in saved.parcels:
            self._outbox.keep_payload(sequence, payload, -math.inf, needed=needed)
        self._answers.restore(saved.answered)

    def _heard(self, opened: Opened, payload: Content, now: float) -> Message | None:
        """Return a tube's message; None where its seal is not believed."""
        seals = self._seals
        if seals is None:
            return decode_opened(opened)
        tube = opened.origin
        heard = seals.hear(bytes(payload), tube, now)
        self.send_offers()
        if not heard.is_believed:
            return None
        if heard.begins_session:
            self._orders.make_due(now)
        message = decode_opened(opened)
        return message if seals.is_of(message, tube) else None

    def _told(self, opened: Opened, payload: Content, now: float) -> Message | None:
        """Return the base's message; None where its seal is not believed, or it was for the seals alone."""
        seals = self._seals
        if seals is None:
            message = decode_opened(opened)
            return None if isinstance(message, SessionOffer) else message
        if not seals.is_told(bytes(payload), now, is_offer=opened.kind is MessageKind.SESSION_OFFER):
            return None
        message = decode_opened(opened)
        if not seals.is_of(message, self._address):
            return None
        if isinstance(message, SessionOffer):
            self._answers.begin_session()
            self._outbox.make_due(now)  # what was sent without a session was not believed
            self._send_kept(now)
            return None
        is_command = isinstance(message, Command) and message.sequence not in self._answers
        return None if is_command and not seals.is_order_new(opened.sequence, self._answers.too_old) else message

    def _settle(self, receipt: Receipt) -> None:
        """Forget a message that the ground station stored; a receipt of other content is stale or forged."""
        payload = self._outbox.payload(receipt.sequence)
        if payload is None:
            return
        if content_of(payload) == receipt.content:
            self._outbox.settle(receipt.sequence)
        else:
            self._counters["foreign_receipts"] += 1

    def _send_kept(self, now: float) -> None:
        if self._upper is not None and not self._holding and self.outbox_size:
            for payload in self._outbox.due_payloads(now):
                self._send_up(payload)

    def _send_orders(self, now: float) -> None:
        if self._lower is not None and len(self._orders):
            for payload in self._orders.due_payloads(now):
                self._send_down(payload, open_payload(payload).target, Priority.COMMAND)

    def _send_up(self, payload: bytes) -> None:
        """Send a payload that must arrive to the base."""
        if self._upper is None:
            self._counters["nowhere_to_go"] += 1
            return
        self._upper.send_reliable(payload if self._seals is None else self._seals.close_up(payload))

    def _send_down(self, payload: bytes, tube: int, priority: Priority) -> None:
        """Send a payload that must arrive to a tube; without a session under keys it waits for its repetition."""
        if self._lower is None:
            self._counters["nowhere_to_go"] += 1
            return
        sealed = payload if self._seals is None else self._seals.close_down(payload, tube)
        if sealed is not None:
            self._lower.send_reliable(sealed, priority)
