"""What must reach the ground station: kept by the tube, resent end to end, forgotten on its receipt."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass

from telemetry.schema import U53

FIRST_RETRY = 10.0  # s
LAST_RETRY = 60.0  # s
LIMIT = 256  # payloads kept; of more the oldest that may be lost goes


@dataclass(slots=True)
class Parcel:
    """A payload, when to send it again and how long to wait after that."""

    payload: bytes
    send_at: float
    wait: float = FIRST_RETRY
    needed: bool = True  # never dropped for another
    was_sent: bool = False


class Outbox:
    """Payloads by their end-to-end sequence number, in order; ``dropped`` counts those that found no place.

    A survey is dropped only where surveys alone fill it, and then it is the oldest: the newest is where the bit is.
    """

    def __init__(self, limit: int = LIMIT) -> None:
        self._parcels: dict[int, Parcel] = {}
        self._waiting: deque[int] = deque(maxlen=limit)  # numbers of those that wait for others to go with
        self._limit = limit
        self.dropped = 0

    def __len__(self) -> int:
        return len(self._parcels)

    def keep_payload(self, sequence: int, payload: bytes, due: float, *, needed: bool = True) -> None:
        """Keep a payload that is due at ``due`` (s). One that is not ``needed`` goes first when room runs out."""
        self._parcels[sequence] = Parcel(payload, due, needed=needed)
        if len(self._parcels) > self._limit:
            oldest = next((n for n, parcel in self._parcels.items() if not parcel.needed), next(iter(self._parcels)))
            del self._parcels[oldest]
            self.dropped += 1

    def payload(self, sequence: int) -> bytes | None:
        """Payload kept under a number, None where there is none."""
        parcel = self._parcels.get(sequence)
        return None if parcel is None else parcel.payload

    def settle(self, sequence: int) -> bool:
        """Forget a payload that arrived; False when it was not kept."""
        return self._parcels.pop(sequence, None) is not None

    def due_payloads(self, now: float) -> Iterator[bytes]:
        """Payloads to send now; each is due again later, at growing intervals."""
        for parcel in self._parcels.values():
            if parcel.send_at <= now:
                parcel.send_at, parcel.was_sent = now + parcel.wait, True
                parcel.wait = min(2.0 * parcel.wait, LAST_RETRY)
                yield parcel.payload

    def keep_waiting(self, sequence: int, payload: bytes, until: float, *, needed: bool = True) -> None:
        """Keep a payload that goes with the next ``release``, and alone at ``until`` (s)."""
        self.keep_payload(sequence, payload, until, needed=needed)
        self._waiting.append(sequence)

    def release(self, now: float) -> bool:
        """Make the payloads due that wait for others to go with; returns whether there were any."""
        hastened = False
        while self._waiting:
            parcel = self._parcels.get(self._waiting.popleft())
            if parcel is not None and not parcel.was_sent:
                parcel.send_at, hastened = now, True
        return hastened

    def make_due(self, now: float, first: int = 0, last: int = U53) -> set[int]:
        """Make what is kept of these numbers due now, for its receiver can take it; returns the numbers."""
        found = {number for number in self._parcels if first <= number <= last}
        for number in found:
            self._parcels[number].send_at = now
        return found

    def next_due(self) -> float:
        """Time (s) at which something is due, infinite if nothing is kept."""
        return min((parcel.send_at for parcel in self._parcels.values()), default=math.inf)

    def contents(self) -> list[list[int | bytes]]:
        """Sequence numbers and payloads to save."""
        return [[sequence, parcel.payload] for sequence, parcel in self._parcels.items()]
