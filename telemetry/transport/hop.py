"""One joint's link as a pure state machine: frames in, payloads out, acknowledgement and retransmission.

A frame is ``crc32 | msgpack [version, sender, epoch, count, ack_epoch, ack, ack_mask, entries]``; an entry is
``[number, payload]``, number 0 for what may be lost. ``epoch`` names the sender, its boot and session; on a new one
the other end starts to count from 1 again, and takes numbered payloads only from a sender that knows whom it talks to.
Acknowledgement is cumulative plus a mask of the next 64 numbers and rides on whatever frame leaves next. Nothing that
arrives raises, and every queue is bounded.
"""

from __future__ import annotations

import math
import zlib
from collections import Counter, OrderedDict
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import msgpack

from telemetry.media.port import MAX_FRAME, PortFrame, Priority
from telemetry.transport.nearest import Nearest
from telemetry.unwritten import Content, Unwritten

VERSION = 1
WINDOW = 64
QUEUE_LIMIT = 512
BEST_EFFORT_LIMIT = 320  # a state of every tube that a string can have, and what neighbours say to each other
ENTRY_BYTES = 13  # around a payload, at most
HEADER_BYTES = 64  # around the entries, at most
BUNDLE_LIMIT = MAX_FRAME - 1024  # bytes of payloads that share a frame, with what is around each
FIRST_TIMEOUT = 0.06  # s, one round trip and the wait of a lonely acknowledgement
LAST_TIMEOUT = 2.0  # s
ACK_DELAY = 0.02  # s
SILENCE = 3.5  # s after which the other end is taken for gone
BOOT_SHIFT = 24
SESSION_SHIFT = 8
SESSION_MASK = 0xFFFF
QUALITY_WEIGHT = 1.0 / 32.0
NOT_TOLD = -1  # instead of the epoch of a sender whose header did not come with its payloads, and has not come before
ACKNOWLEDGEMENT = "acknowledgement"  # topic of a frame that holds nothing else


@dataclass(slots=True)
class Outstanding:
    """A numbered payload on its way."""

    payload: bytes
    priority: Priority
    send_at: float
    timeout: float = FIRST_TIMEOUT


class Patient(NamedTuple):
    """A best-effort payload that waits for others to go with, until a time (s)."""

    payload: Content
    priority: Priority
    until: float


class Entry(NamedTuple):
    """A payload that is due; best effort has the number 0 and a topic."""

    number: int
    payload: Content
    priority: Priority
    topic: Hashable | None = None


class Header(NamedTuple):
    """First part of every frame."""

    sender: int
    epoch: int
    number: int
    ack_epoch: int
    ack: int
    ack_mask: int


class LinkFrame(Unwritten):
    """A frame as its header and entries, of which its bytes are made where a medium asks for them."""

    __slots__ = ("entries", "header")

    def __init__(self, header: Header, entries: Sequence[tuple[int, Content]]) -> None:
        self._written = None
        self.header, self.entries = header, entries

    @property
    def most(self) -> int:
        """Bytes that it takes at most."""
        return HEADER_BYTES + sum([ENTRY_BYTES + most_of(payload) for _, payload in self.entries])

    def _write(self) -> bytes:
        return pack_frame(self.header, [(number, bytes(payload)) for number, payload in self.entries])


class HopLink:
    """One end of one joint.

    Parameters
    ----------
    address : of this process
    boot_count : its starts so far, so that the other end can tell a restart from a long silence
    nearest : chooses the other end, where frames of several are heard

    Attributes
    ----------
    epoch : boot, session and address of this end
    """

    def __init__(self, address: int, boot_count: int, nearest: Nearest | None = None) -> None:
        self._nearest = nearest
        self.margin = math.inf  # dB, of the newest frame; infinite where no radio brings it
        self._address = address
        self._boot_count = boot_count
        self._session = 0
        self.epoch = epoch_of(boot_count, 0, address)
        self.peer: tuple[int, int] | None = None  # address and boot count of the other end
        self.last_heard = -math.inf
        self.quality = 1.0
        self.bundle_limit = BUNDLE_LIMIT  # bytes; a single payload may be larger
        self.counters: Counter[str] = Counter()
        self._peer_epoch = 0
        self._peer_count = 0
        self._received = 0  # every number up to this one
        self._received_mask = 0  # numbers after it, bit 0 is _received + 1
        self._ack_due = math.inf
        self._frames = 0
        self._next_number = 1
        self._outstanding: OrderedDict[int, Outstanding] = OrderedDict()
        self._queue: OrderedDict[bytes, Priority] = OrderedDict()
        self._best_effort: OrderedDict[Hashable, Entry] = OrderedDict()
        self._patient: dict[Hashable, Patient] = {}
        self._patient_until = math.inf

    def is_up(self, now: float) -> bool:
        """Whether the other end was heard lately."""
        return now - self.last_heard <= SILENCE

    def send_reliable(self, payload: bytes, priority: Priority = Priority.SURVEY) -> None:
        """Queue a payload that must arrive; one that is still queued or on its way is not queued again."""
        if payload in self._queue or any(o.payload == payload for o in self._outstanding.values()):
            return
        if len(self._queue) >= QUEUE_LIMIT:
            self._queue.popitem(last=False)
            self.counters["reliable_dropped"] += 1
        self._queue[payload] = priority

    def send_best_effort(self, payload: Content, topic: Hashable, priority: Priority = Priority.STATE) -> None:
        """Queue a payload that the newest of its ``topic`` replaces."""
        self._best_effort.pop(topic, None)
        if len(self._best_effort) >= BEST_EFFORT_LIMIT:
            self._best_effort.popitem(last=False)
            self.counters["best_effort_dropped"] += 1
        self._best_effort[topic] = Entry(0, payload, priority, topic)

    def send_with_others(self, payload: Content, topic: Hashable, priority: Priority, until: float) -> None:
        """Queue a best effort that goes with the next ``release``, and alone at ``until`` (s)."""
        if (waiting := self._patient.pop(topic, None)) is not None:
            until = min(until, waiting.until)
        self._patient[topic] = Patient(payload, priority, until)
        self._patient_until = min(self._patient_until, until)

    def release(self, now: float = math.inf) -> None:
        """Make the payloads due that wait for others to go with, or that have waited until ``now`` (s)."""
        if not self._patient:
            return
        before, self._patient, self._patient_until = self._patient, {}, math.inf
        for topic, waiting in before.items():
            if waiting.until <= now:
                self.send_best_effort(waiting.payload, topic, waiting.priority)
            else:
                self._patient[topic] = waiting
                self._patient_until = min(self._patient_until, waiting.until)

    def receive(self, frame: Content, now: float, margin: float = math.inf) -> list[Content]:
        """Return the payloads of a frame that were not delivered before; garbage is counted and gives none.

        Of a sender that has not told its epoch what may be lost is taken, and nothing is acknowledged or counted.
        ``margin`` is what the radio heard it with over its threshold, dB.
        """
        parsed = parse_frame(frame)
        if parsed is None:
            self.counters["bad_frames"] += 1
            return []
        (sender, epoch, number, ack_epoch, ack, ack_mask), entries = parsed
        if self._nearest is not None and not self._nearest.is_chosen(sender, now):
            self.counters["overheard"] += 1
            return []
        self.margin = margin
        if epoch == NOT_TOLD:
            self.last_heard = now
            self.counters["frames_received"] += 1
            return [payload for number, payload in entries if number == 0]
        if epoch != self._peer_epoch and self._is_of_before(epoch) and self.is_up(now):
            self.counters["stale_frames"] += 1
            return []
        is_new_session = epoch != self._peer_epoch
        self._on_peer(sender, epoch)
        self._update_quality(number)
        self.last_heard = now
        self.counters["frames_received"] += 1
        if ack_epoch == self.epoch:
            if self._outstanding:
                self._acknowledged(ack, ack_mask)
            if is_new_session and ack + 1 < next(iter(self._outstanding), self._next_number):
                self._restart()  # it met another meanwhile, and lacks what it acknowledged before
        elif not self._is_me(ack_epoch):
            entries = [(0, payload) for number, payload in entries if number == 0]
        return [payload for number, payload in entries if number == 0 or self._is_new(number, now)]

    def take_frames(self, now: float) -> list[PortFrame]:
        """Frames that are due now."""
        frames: list[PortFrame] = []
        if self._patient_until <= now:
            self.release(now)
        if not (self._best_effort or self._queue or self._outstanding or self._ack_due <= now):
            return frames  # the usual case: called after every event
        entries = self._due_entries(now)
        while len(entries) > 1:
            count = bundled_count(entries, self.bundle_limit)
            frames.append(self._build(entries[:count]))
            entries = entries[count:]
        if entries or self._ack_due <= now:
            frames.append(self._build(entries))
        return frames

    def next_wake(self, now: float) -> float:
        """Time (s) at which ``take_frames`` has something to do without further input, infinite if never."""
        wake = self._ack_due if self._ack_due < self._patient_until else self._patient_until
        if self._outstanding and self.is_up(now):
            wake = min(wake, *(one.send_at for one in self._outstanding.values()))
        return wake

    @property
    def waiting(self) -> int:
        """Payloads queued or on their way."""
        return len(self._queue) + len(self._outstanding)

    def _is_me(self, epoch: int) -> bool:
        """Return whether an epoch names this process, not the one before a restart, whose numbers may still come."""
        return epoch >> BOOT_SHIFT == self._boot_count and epoch & 0xFF == self._address

    def _is_of_before(self, epoch: int) -> bool:
        """Whether an epoch is of a session that this peer has ended.

        A port that was blocked hands urgent frames on first, and those of the session before after them. They would
        have its numbers counted anew, and those of the present one never be complete.
        """
        same_process = epoch >> BOOT_SHIFT == self._peer_epoch >> BOOT_SHIFT and epoch & 0xFF == self._peer_epoch & 0xFF
        since = (self._peer_epoch >> SESSION_SHIFT) - (epoch >> SESSION_SHIFT)
        return same_process and 0 < since & SESSION_MASK <= SESSION_MASK >> 1

    def _on_peer(self, sender: int, epoch: int) -> None:
        """Notice another process at the other end (start our numbers anew) or its new session (forget its numbers)."""
        if epoch == self._peer_epoch and self.peer is not None and sender == self.peer[0]:
            return  # the usual case
        peer = (sender, epoch >> BOOT_SHIFT)
        if peer != self.peer:
            if self.peer is not None:
                self._restart()
            self.peer = peer
            self.quality = 1.0
            self._peer_epoch = -1
        if epoch != self._peer_epoch:
            self._peer_epoch = epoch
            self._peer_count = 0
            self._received, self._received_mask = 0, 0

    def _restart(self) -> None:
        self._session += 1
        self.epoch = epoch_of(self._boot_count, self._session, self._address)
        self._next_number = 1
        again = OrderedDict((o.payload, o.priority) for o in self._outstanding.values())
        again.update(self._queue)
        self._queue = again
        self._outstanding.clear()

    def _update_quality(self, count: int) -> None:
        before, missed = self._peer_count, 0
        if before and count != before + 1:
            missed = max(min(count - before - 1, 32), 0)
        self._peer_count = max(before, count)
        self.quality *= (1.0 - QUALITY_WEIGHT) ** (missed + 1)
        self.quality += QUALITY_WEIGHT

    def _acknowledged(self, ack: int, mask: int) -> None:
        for number in list(self._outstanding):
            ahead = number - ack - 1
            if ahead < 0 or (ahead < WINDOW and mask >> ahead & 1):
                del self._outstanding[number]

    def _is_new(self, number: int, now: float) -> bool:
        self._ack_due = min(self._ack_due, now + ACK_DELAY)
        ahead = number - self._received - 1
        if ahead < 0 or ahead >= WINDOW or self._received_mask >> ahead & 1:
            self.counters["repeated"] += 1
            return False
        self._received_mask |= 1 << ahead
        while self._received_mask & 1:
            self._received_mask >>= 1
            self._received += 1
        return True

    def _due_entries(self, now: float) -> list[Entry]:
        entries: list[Entry] = []
        if (self._queue or self._outstanding) and self.is_up(now):
            oldest = next(iter(self._outstanding), self._next_number)
            while self._queue and self._next_number - oldest < WINDOW:
                payload, priority = self._queue.popitem(last=False)
                self._outstanding[self._next_number] = Outstanding(payload, priority, now)
                self._next_number += 1
            for number, outstanding in self._outstanding.items():
                if outstanding.send_at <= now:
                    entries.append(Entry(number, outstanding.payload, outstanding.priority))
                    outstanding.send_at = now + outstanding.timeout
                    outstanding.timeout = min(2.0 * outstanding.timeout, LAST_TIMEOUT)
        if self._best_effort:
            entries += self._best_effort.values()
            self._best_effort.clear()
        return entries

    def _build(self, entries: list[Entry]) -> PortFrame:
        self._frames += 1
        self._ack_due = math.inf
        self.counters["frames_sent"] += 1
        peer_epoch = max(self._peer_epoch, 0)
        header = Header(self._address, self.epoch, self._frames, peer_epoch, self._received, self._received_mask)
        if len(entries) == 1:  # the usual case
            number, payload, priority, topic = entries[0]
            return PortFrame(LinkFrame(header, [(number, payload)]), priority, None if topic is None else (topic,))
        priority = min([entry.priority for entry in entries], default=Priority.COMMAND)
        return PortFrame(LinkFrame(header, [entry[:2] for entry in entries]), priority, common_topic(entries))


def epoch_of(boot_count: int, session: int, address: int) -> int:
    """Name of a sender in its frames."""
    return boot_count << BOOT_SHIFT | (session & SESSION_MASK) << SESSION_SHIFT | address


def pack_frame(header: Sequence[int], entries: Sequence[Sequence[object]]) -> bytes:
    """Bytes of a frame with a ``Header``; an entry is its number and its payload."""
    body: bytes = msgpack.packb([VERSION, *header, entries])
    return zlib.crc32(body).to_bytes(4, "little") + body


def most_of(payload: Content) -> int:
    """Largest size (bytes) of a payload."""
    return payload.most if isinstance(payload, Unwritten) else len(payload)


def parse_frame(frame: Content) -> tuple[Header, Sequence[Any]] | None:
    """Header and entries of a frame; None for anything else."""
    if isinstance(frame, Unwritten):
        return (frame.header, frame.entries) if isinstance(frame, LinkFrame) else None
    if not 5 < len(frame) <= MAX_FRAME:
        return None
    body = frame[4:]
    if zlib.crc32(body) != int.from_bytes(frame[:4], "little"):
        return None
    try:
        version, sender, epoch, number, peer_epoch, ack, mask, entries = msgpack.unpackb(body, max_ext_len=0)
    except (ValueError, TypeError, RecursionError, msgpack.UnpackException):
        return None
    are_integers = type(sender) is type(epoch) is type(number) is type(peer_epoch) is type(ack) is type(mask) is int
    if version != VERSION or not are_integers or not isinstance(entries, list):
        return None
    header = Header(sender, epoch, number, peer_epoch, ack, mask)
    return (header, entries) if min(header) >= 0 and all(map(_is_entry, entries)) else None


def common_topic(entries: Iterable[Entry]) -> Hashable | None:
    """Topic of a frame of these entries: all their topics if all are best effort, None if one is numbered."""
    topics = tuple([entry.topic for entry in entries])
    if not topics:
        return ACKNOWLEDGEMENT
    return None if None in topics else topics


def bundled_count(entries: Iterable[Entry], limit: int) -> int:
    """Number of the first entries that share a frame: ``limit`` bytes of them at most, but at least one."""
    count = total = 0
    for entry in entries:
        total += len(bytes(entry.payload)) + ENTRY_BYTES
        if count > 0 and total > limit:
            break
        count += 1
    return count


def _is_entry(entry: object) -> bool:
    if type(entry) is not list or len(entry) != 2:
        return False
    number, payload = entry
    return type(number) is int and 0 <= number < 2**53 and type(payload) is bytes
