"""Seals of one end of one joint: every frame under the key of the two processes, and none twice.

A sealed frame names its sender and its addressee, the random session number of either end, and counts. It is
believed when its tag fits and it names the receiver's present session, which proves that it was made after this end
began; within a session a window of 64 numbers lets each frame in once. Nothing has to be kept over a restart for that.

The process at the other end is not known before: an end that hears none calls, under a key of the whole rig. A call
proves nothing. It is answered with a sealed frame that names the caller's session; the caller's next frame then names
this end's, and both are proven.
"""

from __future__ import annotations

import math
import struct
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass, field

from telemetry.transport.key_ring import KeyRing
from telemetry.transport.seal import TAG_SIZE, WINDOW, ReplayWindow, SealKey

VERSION = 1
HEAD = struct.Struct("<5BQQI")  # version, generation, newest, sender, addressee, own session, other's session, number
OVERHEAD = HEAD.size + TAG_SIZE  # bytes
ANYBODY = 255  # addressee of a call
LAST_NUMBER = 2**32 - 1
CALL_EVERY = 1.0  # s
UNHEARD = 1.5  # s without a frame of the other end, after which this end calls
ANSWER_EVERY = 0.1  # s, so that repeated calls cost little
PROOF_WITHIN = 3.0  # s that an end has to prove a session it claims, until what it sealed counts as repeated
DUPLICATE_WITHIN = 0.5  # s after a frame, in which a second one is the medium's doing
SETTLED = 5.0  # s after which frames for another process are no longer those of a joint that was just closed

Ring = Callable[[], KeyRing]
Lot = Callable[[], int]


@dataclass(slots=True)
class Partner:
    """The other end of the joint in one session, proven."""

    address: int
    session: int
    newest: int  # generation of its keys
    since: float  # s
    heard_at: float  # s
    window: ReplayWindow = field(default_factory=ReplayWindow)
    arrived: dict[int, float] = field(default_factory=dict)  # s, when each of the newest numbers came


@dataclass(slots=True)
class Claim:
    """A session that a sender claims and has not proven; ``frames`` were sealed for it and are of no effect."""

    address: int
    session: int
    newest: int
    at: float  # s
    frames: int = 0


class JointSeal:
    """One end of one joint.

    Parameters
    ----------
    address : of this process
    ring : gives its keys; they may change
    lot : 64 random bits

    Attributes
    ----------
    counters : frames of no effect, by reason
    """

    def __init__(self, address: int, ring: Ring, lot: Lot) -> None:
        self.counters: Counter[str] = Counter()
        self.partner: Partner | None = None
        self._address = address
        self._ring = ring
        self._lot = lot
        self._session = lot()
        self._number = 0
        self._claim: Claim | None = None
        self._answer_due = self._confirm_due = False
        self._answered_at = self._called_at = -math.inf

    def open(self, frame: bytes, now: float) -> bytes | None:
        """Return the content of a frame that came at ``now`` (s); None where it takes no effect."""
        if len(frame) < OVERHEAD or frame[0] != VERSION:
            self._refuse("unsealed")
            return None
        _, generation, newest, sender, addressee, session, mine, number = HEAD.unpack_from(frame)
        if addressee not in (self._address, ANYBODY):
            self._refuse("wrong_joint" if self._is_settled(now) else "before_joined")
            return None
        key = None if sender == self._address else self._key(generation, sender, addressee)
        if key is None or not key.fits(frame[-TAG_SIZE:], frame[:-TAG_SIZE]):
            self._refuse("wrong_tag")
            return None
        if addressee == ANYBODY or mine != self._session:
            self._on_claim(sender, session, newest, now, is_call=addressee == ANYBODY)
            return None
        return self._deliver(sender, session, newest, number, frame[HEAD.size : -TAG_SIZE], now)

    def close(self, payload: bytes) -> bytes | None:
        """Sealed frame for the other end; None without a proven session."""
        partner = self.partner
        return None if partner is None else self._sealed(partner.address, partner.session, partner.newest, payload)

    def own_frames(self, now: float) -> list[bytes]:
        """Return the call, the answer and the first frame to a new partner that are due at ``now`` (s)."""
        frames: list[bytes | None] = []
        claim = self._claim
        if self._answer_due and claim is not None and now >= self._answered_at + ANSWER_EVERY:
            self._answered_at, self._answer_due = now, False
            frames.append(self._sealed(claim.address, claim.session, claim.newest, b""))
        if self._confirm_due:
            self._confirm_due = False
            frames.append(self.close(b""))
        if claim is not None and now > claim.at + PROOF_WITHIN:
            self._drop_claim()
        unheard = self.partner is None or now > self.partner.heard_at + UNHEARD
        if unheard and now >= self._called_at + CALL_EVERY:
            self._called_at = now
            frames.append(self._call())
        return [frame for frame in frames if frame is not None]

    def next_wake(self) -> float:
        """Time (s) at which an answer is due, infinite if none."""
        return self._answered_at + ANSWER_EVERY if self._answer_due else math.inf

    def forget_revoked(self) -> None:
        """Drop a partner whose key is no longer believed."""
        if self.partner is not None and self.partner.address in self._ring().revoked:
            self.partner = None
        if self._claim is not None and self._claim.address in self._ring().revoked:
            self._claim = None

    def _deliver(self, sender: int, session: int, newest: int, number: int, payload: bytes, now: float) -> bytes | None:
        partner = self.partner
        if partner is None or partner.address != sender or partner.session != session:
            partner = self.partner = Partner(sender, session, newest, now, now)
            self._claim, self._answer_due, self._confirm_due = None, False, True
        if not partner.window.admit(number):
            self._refuse(
                "duplicate" if now <= partner.arrived.get(number, -math.inf) + DUPLICATE_WITHIN else "repeated"
            )
            return None
        partner.newest, partner.heard_at = newest, now
        partner.arrived[number] = now
        if len(partner.arrived) > WINDOW:
            del partner.arrived[next(iter(partner.arrived))]
        return payload or None

    def _on_claim(self, sender: int, session: int, newest: int, now: float, *, is_call: bool) -> None:
        """Handle a sender that does not know this end's session: send it, and see whether the sender can use it."""
        partner, claim = self.partner, self._claim
        if partner is not None and not is_call and (partner.address, partner.session) == (sender, session):
            self._refuse("late" if now < partner.since + SETTLED else "old_session")  # he knows this end's session
            return
        if claim is None or (claim.address, claim.session) != (sender, session):
            self._drop_claim()
            claim = self._claim = Claim(sender, session, newest, now)
        claim.frames += not is_call
        self._answer_due = True

    def _drop_claim(self) -> None:
        if self._claim is not None and self._claim.frames:
            self.counters["seal_old_session"] += self._claim.frames
        self._claim, self._answer_due = None, False

    def _sealed(self, addressee: int, session: int, others_newest: int, payload: bytes) -> bytes | None:
        ring = self._ring()
        generation = ring.common(others_newest)
        key = self._key(generation, self._address, addressee)
        if key is None:
            return None
        if self._number == LAST_NUMBER:
            self._session, self._number = self._lot(), 0
        self._number += 1
        places = (VERSION, generation, ring.newest, self._address, addressee, self._session, session, self._number)
        body = HEAD.pack(*places) + payload
        return body + key.tag(body)

    def _call(self) -> bytes | None:
        """Call under the oldest keys, which the other end has if it has any."""
        return self._sealed(ANYBODY, 0, self._ring().oldest, b"")

    def _key(self, generation: int, sender: int, addressee: int) -> SealKey | None:
        ring = self._ring()
        if sender in ring.revoked:
            return None
        if addressee == ANYBODY:
            return ring.seal_key(generation, "call")
        return ring.seal_key(generation, "joint", addressee if sender == self._address else sender)

    def _is_settled(self, now: float) -> bool:
        return self.partner is not None and self.partner.since + SETTLED < now < self.partner.heard_at + UNHEARD

    def _refuse(self, reason: str) -> None:
        self.counters[f"seal_{reason}"] += 1
