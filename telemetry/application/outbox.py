"""What must reach the ground station: kept by the tube, resent end to end, forgotten on its receipt."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

FIRST_RETRY = 10.0  # s
LAST_RETRY = 60.0  # s


@dataclass(slots=True)
class Parcel:
    """A payload, when to send it again and how long to wait after that."""

    payload: bytes
    send_at: float
    wait: float = FIRST_RETRY


class Outbox:
    """Payloads by their end-to-end sequence number, in order."""

    def __init__(self) -> None:
        self._parcels: dict[int, Parcel] = {}

    def __len__(self) -> int:
        return len(self._parcels)

    def keep_payload(self, sequence: int, payload: bytes, now: float) -> None:
        """Keep a payload; it is due at once."""
        self._parcels[sequence] = Parcel(payload, now)

    def settle(self, sequence: int) -> bool:
        """Forget a payload that arrived; False when it was not kept."""
        return self._parcels.pop(sequence, None) is not None

    def due_payloads(self, now: float) -> Iterator[bytes]:
        """Payloads to send now; each is due again later, with growing patience."""
        for parcel in self._parcels.values():
            if parcel.send_at <= now:
                parcel.send_at = now + parcel.wait
                parcel.wait = min(2.0 * parcel.wait, LAST_RETRY)
                yield parcel.payload

    def next_due(self) -> float:
        """When something is due, infinite if nothing is kept."""
        return min((parcel.send_at for parcel in self._parcels.values()), default=math.inf)

    def contents(self) -> list[list[int | bytes]]:
        """What to save: sequence numbers and payloads."""
        return [[sequence, parcel.payload] for sequence, parcel in self._parcels.items()]
