"""Seals end to end: what a tube and the base say to each other, under a key that no tube between them has.

A sealed payload begins with a byte that no payload of ours begins with; a relay hands it on as it is. It names two
random session numbers, the tube's and the base's, and its tag covers both. Neither side believes what does not name
the present pair, so nothing from before a restart of either is believed, and neither has to keep a counter.

The pair comes about so: a tube begins with a number of its own and 0 for the base's. The base answers what names no
pair it knows with an offer, sealed for the tube's number, of a number drawn for this purpose. The tube takes an offer
once: it draws a new number for itself, and what it says next proves to the base that it has the offer.

Within a session what travels has a number of its own: a survey is stored once, a state is newer than the one before,
an order is obeyed once, and one older than the last 64 is refused.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from typing import NamedTuple

from telemetry.transport.key_ring import KeyRing
from telemetry.transport.seal import TAG_SIZE, SealKey

MARK = 0xC1  # never begins a msgpack value
HEAD = struct.Struct("<3BQQ")  # mark, generation, newest, the tube's session, the base's
OVERHEAD = HEAD.size + TAG_SIZE  # bytes
UP, DOWN = b"up", b"down"
OFFER_EVERY = 1.0  # s, to one tube
PROOF_WITHIN = 10.0  # s that a tube has to take an offer, until what it sealed counts as of an old session
LATE_WITHIN = 10.0  # s after a session began, in which what names the one before was under way
OFFERS_KEPT = 8  # to one tube

Ring = Callable[[], KeyRing]
Lot = Callable[[], int]


class Pair(NamedTuple):
    """Session numbers that a sealed payload names; 0 for a base that is not known."""

    tube: int
    base: int


class SealFinding(Enum):
    """Finding of the base on a sealed payload."""

    NOTHING = 0  # it is of no effect
    BELIEVED = 1
    BEGINS = 2  # it is believed, and a session begins with it

    @property
    def is_believed(self) -> bool:
        """Whether the payload takes effect."""
        return self is not SealFinding.NOTHING

    @property
    def begins_session(self) -> bool:
        """Whether the tube has just taken an offer."""
        return self is SealFinding.BEGINS


class Sealed(NamedTuple):
    """A sealed payload whose tag fits."""

    content: bytes
    of_tube: int  # session number of the tube
    of_base: int  # and of the base
    newest: int  # generation of the keys of who sealed it

    @property
    def pair(self) -> Pair:
        """The session numbers."""
        return Pair(self.of_tube, self.of_base)


def content_of_sealed(payload: bytes) -> bytes:
    """Return the content of a payload, sealed or not, without a look at its seal."""
    return payload[OVERHEAD:] if is_sealed(payload) else payload


def is_sealed(payload: bytes) -> bool:
    """Whether a payload has the form of a sealed one."""
    return len(payload) > OVERHEAD and payload[0] == MARK


def close_payload(
    key: SealKey, way: bytes, content: bytes, pair: Pair, generation: int, newest: int, tube: int
) -> bytes:
    """Seal a payload."""
    head = HEAD.pack(MARK, generation, newest, *pair)
    return head + key.tag(way, bytes([tube]), head, content) + content


def open_sealed(ring: KeyRing, purpose: str, way: bytes, payload: bytes, tube: int) -> Sealed | None:
    """Return a sealed payload whose tag fits; None where it does not."""
    if not is_sealed(payload):
        return None
    _, generation, newest, of_tube, of_base = HEAD.unpack_from(payload)
    key = ring.seal_key(generation, purpose, tube if purpose == "end" else 0)
    content = payload[OVERHEAD:]
    tag = payload[HEAD.size : OVERHEAD]
    if key is None or not key.fits(tag, way, tube.to_bytes(), payload[: HEAD.size], content):
        return None
    return Sealed(content, of_tube, of_base, newest)


class SealingEnd:
    """The end of a tube, or of the encoder.

    Parameters
    ----------
    address : of this process
    ring : gives its keys; they may change
    lot : 64 random bits
    """

    def __init__(self, address: int, ring: Ring, lot: Lot) -> None:
        self.counters: Counter[str] = Counter()
        self._address = address
        self._ring = ring
        self._lot = lot
        self._pair = Pair(lot(), 0)
        self._before: Pair | None = None  # the pair in use before the newest offer
        self._began_at = -math.inf
        self._bases_newest: int | None = None

    def close(self, content: bytes) -> bytes:
        """Seal a payload for the base."""
        ring = self._ring()
        generation = ring.oldest if self._bases_newest is None else ring.common(self._bases_newest)
        key = ring.seal_key(generation, "end", self._address)
        if key is None:
            return content  # revoked: no receiver would believe it
        return close_payload(key, UP, content, self._pair, generation, ring.newest, self._address)

    def open(self, payload: bytes, now: float, *, is_offer: bool) -> bool:
        """Return whether a payload from the base that came at ``now`` (s) is believed; an offer begins a session."""
        sealed = open_sealed(self._ring(), "end", DOWN, payload, self._address)
        if sealed is None:
            self.counters["seal_end_wrong_tag" if is_sealed(payload) else "seal_end_unsealed"] += 1
            return False
        pair = sealed.pair
        if pair.tube != self._pair.tube or (pair.base != self._pair.base) != is_offer:
            self._count_old(pair, now)
            return False
        self._bases_newest = sealed.newest
        if is_offer:
            self._before, self._began_at = self._pair, now
            self._pair = Pair(self._lot(), pair.base)
        return True

    def _count_old(self, pair: Pair, now: float) -> None:
        is_late = self._before is not None and pair.tube == self._before.tube and now < self._began_at + LATE_WITHIN
        self.counters["seal_late" if is_late else "seal_end_old_session"] += 1


@dataclass(slots=True)
class Offer:
    """An offer on its way to a tube, and how often the tube spoke without it."""

    pair: Pair
    newest: int  # generation of the tube's keys
    begun_at: float  # s
    sent_at: float  # s
    unproven: int = 1


@dataclass(slots=True)
class EndSession:
    """Session of the base with a tube."""

    pair: Pair
    newest: int  # generation of the tube's keys
    cycles: int = -1  # of its newest state


class BaseEnd:
    """The end of the base: a session with every tube.

    Parameters
    ----------
    ring : gives its keys; they may change
    lot : 64 random bits
    """

    def __init__(self, ring: Ring, lot: Lot) -> None:
        self.counters: Counter[str] = Counter()
        self._ring = ring
        self._lot = lot
        self._sessions: dict[int, EndSession] = {}
        self._offers: dict[int, list[Offer]] = {}  # by tube, the oldest first
        self._due: list[tuple[int, Offer]] = []

    def close(self, content: bytes, tube: int) -> bytes | None:
        """Seal a payload for a tube; None without a session."""
        session = self._sessions.get(tube)
        return None if session is None else self._closed(content, tube, session.pair, session.newest)

    def open(self, payload: bytes, tube: int, now: float) -> SealFinding:
        """Judge a payload of a tube that came at ``now`` (s)."""
        sealed = open_sealed(self._ring(), "end", UP, payload, tube)
        if sealed is None:
            self.counters["seal_end_wrong_tag" if is_sealed(payload) else "seal_end_unsealed"] += 1
            return SealFinding.NOTHING
        session = self._sessions.get(tube)
        if session is not None and session.pair == (sealed.of_tube, sealed.of_base):
            session.newest = sealed.newest
            return SealFinding.BELIEVED
        if self._is_proof(tube, sealed.pair):
            self._sessions[tube] = EndSession(sealed.pair, sealed.newest)
            del self._offers[tube]
            return SealFinding.BEGINS
        self._offer(tube, sealed, now)
        return SealFinding.NOTHING

    def newest_of(self, tube: int) -> int | None:
        """Newest generation of keys that a tube has; None without a session."""
        session = self._sessions.get(tube)
        return None if session is None else session.newest

    def due_offers(self, content_for: Callable[[int], bytes]) -> list[tuple[int, bytes]]:
        """Take the sealed offers that are due, each with its tube; ``content_for(tube)`` gives their content."""
        due, self._due = self._due, []
        closed = [(tube, self._closed(content_for(tube), tube, offer.pair, offer.newest)) for tube, offer in due]
        return [(tube, payload) for tube, payload in closed if payload is not None]

    def is_next_state(self, tube: int, cycles: int) -> bool:
        """Return whether a state of ``cycles`` is newer than all earlier ones of the session with its tube."""
        session = self._sessions.get(tube)
        if session is None or cycles <= session.cycles:
            self.counters["seal_end_repeated"] += 1
            return False
        session.cycles = cycles
        return True

    def count_unproven(self, now: float) -> None:
        """Count what was sealed for sessions that are not proven by ``now`` (s)."""
        for tube, offers in list(self._offers.items()):
            for offer in [offer for offer in offers if now > offer.begun_at + PROOF_WITHIN]:
                self._drop_offer(tube, offer)

    def forget_revoked(self) -> None:
        """End the sessions with tubes whose keys are no longer believed."""
        for tube in self._ring().revoked:
            self._sessions.pop(tube, None)
            self._offers.pop(tube, None)

    def _is_proof(self, tube: int, pair: Pair) -> bool:
        return any(pair.base == o.pair.base and pair.tube != o.pair.tube for o in self._offers.get(tube, []))

    def _offer(self, tube: int, sealed: Sealed, now: float) -> None:
        """Offer a session to a tube that names no known pair, the same one while the tube names the same number."""
        offers = self._offers.setdefault(tube, [])
        offer = next((o for o in offers if o.pair.tube == sealed.pair.tube), None)
        if offer is not None:
            offer.unproven += 1
            if now < offer.sent_at + OFFER_EVERY:
                return
            offer.sent_at = now
        else:
            if len(offers) == OFFERS_KEPT:
                self._drop_offer(tube, offers[0])
            offer = Offer(Pair(sealed.pair.tube, self._lot()), sealed.newest, now, now)
            self._offers.setdefault(tube, []).append(offer)
        self._due.append((tube, offer))

    def _drop_offer(self, tube: int, offer: Offer) -> None:
        self.counters["seal_end_old_session"] += offer.unproven
        self._offers[tube].remove(offer)
        if not self._offers[tube]:
            del self._offers[tube]

    def _closed(self, content: bytes, tube: int, pair: Pair, newest: int) -> bytes | None:
        ring = self._ring()
        generation = ring.common(newest)
        key = ring.seal_key(generation, "end", tube)
        return None if key is None else close_payload(key, DOWN, content, pair, generation, ring.newest, tube)
